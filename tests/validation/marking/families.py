"""Which families of a learned law are right for which hidden effect off the list.

A family is right where its meaning is the effect's: the law need not have the effect's own equation, but it must say
what kind of thing is there. Two are right where both are said of the same thing in the field.
"""

from __future__ import annotations

from dataclasses import dataclass

BY_TRAVEL, BY_TIRE, MEMORY, MASS = "force by travel and rate", "force by tire deflection", "memory", "mass on a spring"
CORRECTION, REPEATS, DRIFT, CHANGE = "body to record", "repeats", "sensor drift", "number that changes"

NAMES: dict[str, frozenset[str]] = {
    BY_TRAVEL: frozenset({"suspension_force"}),
    BY_TIRE: frozenset({"tire_force"}),
    MEMORY: frozenset({"memory"}),
    MASS: frozenset({"mass_on_spring"}),
    CORRECTION: frozenset({"sensor_correction"}),
    REPEATS: frozenset({"periodic"}),
    DRIFT: frozenset({"drift"}),
    CHANGE: frozenset({"changing_number"}),
}
"""What ``ridelog learn`` calls a family of each meaning."""


@dataclass(frozen=True)
class Right:
    """Meanings that are right for an effect, and why."""

    meanings: tuple[str, ...]
    because: str


RIGHT: dict[str, Right] = {
    "quadratic_damping": Right((BY_TRAVEL,), "a force by the suspension's rate"),
    "bushing_hysteresis": Right((MEMORY,), "Bouc-Wen: the force depends on where the motion turned"),
    "hardening_tire": Right((BY_TIRE,), "a force by the tire's deflection"),
    "one_axle_friction": Right((BY_TRAVEL, MEMORY), "friction is a force by the sign of the rate; before it slips, by "
                                                    "where it stuck"),
    "damper_backlash": Right((MEMORY,), "play in series with a damper: where its ends stand is a state"),
    "wheel_imbalance": Right((REPEATS,), "once a turn of the wheel"),
    "engine_vibration": Right((REPEATS,), "a line in time"),
    "damper_fading": Right((CHANGE, MEMORY), "the damping changes with time, as if it warmed"),
    "rubber_spring": Right((MEMORY,), "a Maxwell branch"),
    "trailer": Right((MASS,), "a mass on a spring behind the rear axle"),
    "clipping": Right((CORRECTION,), "of the sensor's reading alone"),
    "gain_drift": Right((CHANGE, DRIFT), "the gain is a number that was taken for fixed, and it is the sensor's"),
    "blurred_profile": Right((CORRECTION,), "what was compared lacks short waves, as if it were filtered"),
    "gas_spring": Right((BY_TRAVEL,), "a force by travel, stiffer in compression"),
    "place_damper": Right((BY_TRAVEL,), "a force by travel and rate together"),
    "stribeck_friction": Right((BY_TRAVEL, MEMORY), "a force by rate that falls; friction, as one axle's"),
    "rebound_stop": Right((BY_TRAVEL,), "a force by travel and rate, in extension"),
    "inerter": Right((MASS, MEMORY), "inertia behind a spring: two states, and a resonance"),
    "hydraulic_mount": Right((MASS, MEMORY), "a column of fluid behind a spring: two states, and a resonance"),
    "wheel_absorber": Right((MASS,), "a mass on a spring at each wheel"),
    "tire_warming": Right((CHANGE,), "the tires' stiffness changes with time"),
    "damper_heating": Right((CHANGE, MEMORY), "the damping falls with the heat that it made"),
    "flat_spot": Right((REPEATS,), "once a turn of the wheel, with its multiples"),
    "driveline_order": Right((REPEATS,), "so many times a turn of the wheel"),
    "warming_sensor": Right((DRIFT,), "an offset that decays"),
    "soft_saturation": Right((CORRECTION,), "of the sensor's reading alone"),
    "rattling_sensor": Right((CORRECTION,), "between the body and the record"),
}

PHASES_OF_THEIR_OWN = frozenset({"wheel_imbalance", "engine_vibration", "flat_spot", "driveline_order"})
"""Effects that begin each drive somewhere else: no law can say where a run begins that it has not seen."""


def named(kind: str, family: str | None) -> bool:
    """Whether a family is right for a hidden effect. KeyError: not an effect off the list."""
    return any(family in NAMES[meaning] for meaning in RIGHT[kind].meanings)
