"""Which families of a learned law are right for which hidden effect off the list.

A family is right where its meaning is the effect's: the law need not have the effect's own equation, but it must say
what kind of thing is there. Two are right where both are said of the same thing in the field.
"""

from __future__ import annotations

from dataclasses import dataclass

BY_TRAVEL, BY_RATE, BY_BOTH, BY_TIRE = "force by travel", "force by rate", "damping by travel", "force by the tire"
FRICTION, RUBBER, PLAY, HEAT = "friction", "spring with memory", "play", "fading by heat"
MASS, ON_BODY, CORRECTION, REPEATS = "mass on a spring", "mass on the body", "body to record", "repeats"
DRIFT, CHANGE = "sensor drift", "number that changes"
PROFILE, INERTIA = "profile that lacks waves", "inertia in the suspension"
STOP = "stop"
SKY, BY_SPEED = "force by the body's speed", "number that changes with the speed"

REMOVED_DRIFT = "drift that is removed"
"""No family: a sensor's drift is no law of the car, it is removed and said."""

NAMES: dict[str, frozenset[str]] = {
    BY_TRAVEL: frozenset({"force_by_travel"}),
    STOP: frozenset({"extension_stop"}),
    BY_RATE: frozenset({"force_by_rate"}),
    BY_BOTH: frozenset({"damping_by_travel"}),
    BY_TIRE: frozenset({"tire_force"}),
    FRICTION: frozenset({"hysteresis", "mount_as_a_whole", "sliding_behind_spring"}),
    RUBBER: frozenset({"maxwell_element", "mount_as_a_whole"}),
    PLAY: frozenset({"damper_backlash", "damper_as_a_whole"}),
    HEAT: frozenset({"damper_heat"}),
    MASS: frozenset({"hung_mass"}),
    ON_BODY: frozenset({"occupant"}),
    CORRECTION: frozenset({"record_factor", "clipping", "loose_sensor"}),
    REPEATS: frozenset({"hum", "wheel_turns", "flat_spot"}),
    DRIFT: frozenset({REMOVED_DRIFT}),
    INERTIA: frozenset({"inertia_behind_spring"}),
    PROFILE: frozenset({"smoothed_profile"}),
    SKY: frozenset({"skyhook"}),
    BY_SPEED: frozenset({"changing_with_speed"}),
    CHANGE: frozenset({"changing_gain", "changing_with_time"}),
}
"""What ``ridelog learn`` calls the families of each meaning, or the effect of the list that it names in their place."""

@dataclass(frozen=True)
class Right:
    """Meanings that are right for an effect, and why."""

    meanings: tuple[str, ...]
    because: str


RIGHT: dict[str, Right] = {
    "quadratic_damping": Right((BY_RATE,), "a force by the suspension's rate"),
    "bushing_hysteresis": Right((FRICTION,), "Bouc-Wen: the force depends on where the motion turned"),
    "hardening_tire": Right((BY_TIRE,), "a force by the tire's deflection"),
    "damper_backlash": Right((PLAY,), "play in series with a damper: where its ends stand is a state"),
    "wheel_imbalance": Right((REPEATS,), "once a turn of the wheel"),
    "engine_vibration": Right((REPEATS,), "a line in time"),
    "damper_fading": Right((CHANGE, HEAT), "the damping changes with time, as if it warmed"),
    "rubber_spring": Right((RUBBER,), "a Maxwell branch"),
    "trailer": Right((ON_BODY,), "a mass on a spring behind the rear axle"),
    "clipping": Right((CORRECTION,), "of the sensor's reading alone"),
    "gain_drift": Right((CHANGE, DRIFT), "the gain is a number that was taken for fixed, and it is the sensor's"),
    "blurred_profile": Right((PROFILE,), "the profile lacks short waves; the record itself is as it should be"),
    "gas_spring": Right((BY_TRAVEL,), "a force by travel, stiffer in compression"),
    "place_damper": Right((BY_BOTH,), "a force by travel and rate together"),
    "stribeck_friction": Right((FRICTION, BY_RATE), "a force by rate that falls; friction"),
    "rebound_stop": Right((STOP, BY_TRAVEL), "a force by travel and rate, in extension"),
    "inerter": Right((INERTIA, MASS, RUBBER), "inertia behind a spring: a resonance, or a spring that gives way"),
    "hydraulic_mount": Right((INERTIA, MASS, RUBBER), "a column of fluid behind a spring, as an inerter"),
    "wheel_absorber": Right((MASS,), "a mass on a spring at each wheel"),
    "tire_warming": Right((CHANGE,), "the tires' stiffness changes with time"),
    "damper_heating": Right((HEAT, CHANGE), "the damping falls with the heat that it made"),
    "flat_spot": Right((REPEATS,), "once a turn of the wheel, with its multiples"),
    "driveline_order": Right((REPEATS,), "so many times a turn of the wheel"),
    "warming_sensor": Right((DRIFT,), "an offset that decays"),
    "soft_saturation": Right((CORRECTION,), "of the sensor's reading alone"),
    "rattling_sensor": Right((CORRECTION,), "between the body and the record"),
    "skyhook_damper": Right((SKY,), "a force by the body's speed against the ground"),
    "adaptive_damper": Right((BY_SPEED,), "the damping goes with the driving speed"),
}

PHASES_OF_THEIR_OWN = frozenset({"wheel_imbalance", "engine_vibration", "flat_spot", "driveline_order"})
"""Effects that begin each drive somewhere else: no law can say where a run begins that it has not seen."""


def named(kind: str, family: str | None) -> bool:
    """Whether a family, or a known effect in its place, is right for a hidden effect. KeyError: not an effect off the
    list."""
    return any(family in NAMES[meaning] for meaning in RIGHT[kind].meanings)
