"""The twenty effects of the list, read from their descriptions, each with a road from barely there to strong.

Problem: a case needs an effect of a wanted strength, within what is physically sensible, on a car drawn at random.

Solution: an effect draws its secondary parameters (a frequency, a sign, a knee's slope) once and leaves one path u in
[0, 1] from its weakest to its strongest sensible form. ``cases.py`` searches that path. ``apply`` is its physics.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from .cars import Car
from .scene import Scene

Parameters = Mapping[str, float]
Path = Callable[[float], dict[str, float]]


@dataclass(frozen=True)
class Effect:
    """``path(rng, car)`` draws a path to the parameters; ``stage(scene, u)`` sets what both sides of a comparison
    share (a rougher road, tracks farther apart); ``rough`` says that it needs amplitude; ``grip`` names what it acts
    on, as two effects on the same thing may not be distinguishable by anyone."""

    name: str
    path: Callable[[np.random.Generator, Car], Path]
    apply: Callable[[Scene, Parameters], Scene]
    stage: Callable[[Scene, float], Scene] = lambda scene, u: scene
    models: tuple[str, ...] = ("quarter_car", "half_car")
    rough: int = 0


def between(weak: float, strong: float) -> Callable[[float], float]:
    """A geometric path."""
    return lambda u: float(weak * (strong / weak) ** u)


def one(name: str, weak: float, strong: float, **others: float) -> Path:
    """A path of one parameter, the others fixed."""
    value = between(weak, strong)
    return lambda u: {name: value(u), **others}


def _physics(**names: str) -> Callable[[Scene, Parameters], Scene]:
    """Physics fields from parameters."""
    return lambda scene, p: scene.with_physics(**{field: p[name] for field, name in names.items()})


def _sensor(**names: str) -> Callable[[Scene, Parameters], Scene]:
    return lambda scene, p: scene.with_sensor(**{field: p[name] for field, name in names.items()})


def _sign(rng: np.random.Generator, positive: float = 0.5) -> float:
    return 1.0 if rng.random() < positive else -1.0


def _asymmetry(rng: np.random.Generator, car: Car) -> Path:
    sign, size = _sign(rng, 0.75), between(0.02, np.log(5.0))
    return lambda u: {"rebound_to_bump_ratio": float(np.exp(sign * size(u)))}


def _blow_off(rng: np.random.Generator, car: Car) -> Path:
    return one("knee_velocity_m_per_s", 1.2, 0.02, slope_ratio=rng.uniform(0.15, 0.6))


def _friction(rng: np.random.Generator, car: Car) -> Path:
    law = float(rng.random() < 0.5)
    return one("friction_force_n", 2.0, 400.0, _regularised=law)


def _rub(scene: Scene, p: Parameters) -> Scene:
    force = p["friction_force_n"]
    return scene.with_physics(friction_front_n=force, friction_rear_n=force,
                              friction_law="tanh" if p["_regularised"] else "stick")


def _stop(rng: np.random.Generator, car: Car) -> Path:
    return one("clearance_m", 0.08, 0.005, stop_stiffness_n_per_m=float(np.exp(rng.uniform(*np.log([5e4, 4e5])))))


def _tracks(rng: np.random.Generator, car: Car) -> Path:
    track = rng.uniform(1.35, 1.65)
    inertia = 2 * car.sprung_mass_kg * (track * rng.uniform(0.38, 0.5)) ** 2
    return lambda u: {"track_width_m": track, "roll_inertia_kg_m2": inertia}


def _seat(rng: np.random.Generator, car: Car) -> Path:
    return one("mass_kg", 2.0, min(160.0, 0.3 * car.sprung_mass_kg),
               frequency_hz=rng.uniform(2.5, 6.0), damping_ratio=rng.uniform(0.12, 0.4))


def _console(rng: np.random.Generator, car: Car) -> Path:
    return one("frequency_hz", 70.0, 14.0, damping_ratio=rng.uniform(0.03, 0.2))


def _lowpass(rng: np.random.Generator, car: Car) -> Path:
    order = int(rng.integers(1, 3))
    cutoff = between(400.0 if order == 1 else 300.0, 3.0 if order == 1 else 5.0)
    return lambda u: {"cutoff_hz": cutoff(u), "order": order}


def _gain(rng: np.random.Generator, car: Car) -> Path:
    sign, size = _sign(rng), between(0.003, 0.35)
    return lambda u: {"gain": 1 + sign * size(u)}


def _bending(rng: np.random.Generator, car: Car) -> Path:
    sign, size = _sign(rng), between(0.005, 2.0)
    fixed = {"frequency_hz": rng.uniform(14.0, 34.0), "damping_ratio": rng.uniform(0.015, 0.08)}
    return lambda u: {**fixed, "participation": sign * size(u)}


def _enveloping(rng: np.random.Generator, car: Car) -> Path:
    longer = rng.random() < 0.6
    size = between(0.005, 0.35) if longer else between(0.005, car.contact_patch_m - 0.02)
    return lambda u: {"contact_patch_m": car.contact_patch_m + (size(u) if longer else -size(u))}


def _speedometer(rng: np.random.Generator, car: Car) -> Path:
    sign, size = _sign(rng, 0.6), between(3e-3, 0.04)
    return lambda u: {"scale": 1 + sign * size(u)}


def _signed(name: str, weak: float, strong: Callable[[Car], float], positive: float = 0.5):
    def path(rng: np.random.Generator, car: Car) -> Path:
        sign, size = _sign(rng, positive), between(weak, strong(car))
        return lambda u: {name: sign * size(u)}
    return path


_HALF = ("half_car",)
EFFECTS: dict[str, Effect] = {effect.name: effect for effect in (
    Effect("tire_damping", lambda rng, car: one("tire_damping_n_s_per_m", 3.0, 700.0),
           _physics(tire_damping="tire_damping_n_s_per_m")),
    Effect("damper_asymmetry", _asymmetry, _physics(rebound_to_bump="rebound_to_bump_ratio")),
    Effect("damper_blow_off", _blow_off, _physics(knee_mps="knee_velocity_m_per_s", slope_ratio="slope_ratio"),
           rough=1),
    Effect("dry_friction", _friction, _rub),
    Effect("progressive_spring",
           lambda rng, car: one("cubic_stiffness_n_per_m3", car.front.suspension_stiffness_n_per_m,
                                1000 * car.front.suspension_stiffness_n_per_m),
           _physics(cubic="cubic_stiffness_n_per_m3"), rough=1),
    Effect("bump_stop", _stop, _physics(clearance_m="clearance_m", stop="stop_stiffness_n_per_m"), rough=1),
    Effect("wheel_lift", lambda rng, car: lambda u: {},
           lambda scene, p: scene.with_physics(wheel_lift=True),
           stage=lambda scene, u: replace(scene, road_scale=between(0.7, 3.0)(u)), rough=2),
    Effect("top_mount_compliance", lambda rng, car: one("mount_stiffness_n_per_m", 3e6, 2.5e4),
           _physics(mount="mount_stiffness_n_per_m")),
    Effect("sensor_offset", _signed("offset_m", 0.01, lambda car: 0.9 * car.front.cg_distance_m),
           _physics(sensor_ahead_m="offset_m"), models=_HALF),
    Effect("sensor_mount_resonance", _console, _sensor(mount_hz="frequency_hz", mount_zeta="damping_ratio")),
    Effect("sensor_bandwidth", _lowpass, _sensor(cutoff_hz="cutoff_hz", order="order")),
    Effect("sensor_gain", _gain, _sensor(gain="gain")),
    Effect("occupant", _seat,
           _physics(seat_mass_kg="mass_kg", seat_hz="frequency_hz", seat_zeta="damping_ratio")),
    Effect("payload", lambda rng, car: one("mass_kg", 4.0, 0.35 * car.sprung_mass_kg), _physics(payload_kg="mass_kg")),
    Effect("cg_shift", _signed("shift_m", 0.005, lambda car: 0.3 * car.front.cg_distance_m),
           _physics(cg_shift_m="shift_m"), models=_HALF),
    Effect("body_bending", _bending,
           _physics(bend_hz="frequency_hz", bend_zeta="damping_ratio", bend_gain="participation")),
    Effect("tire_enveloping", _enveloping, _physics(patch_m="contact_patch_m")),
    Effect("speed_scale", _speedometer, lambda scene, p: replace(scene, speed_scale=p["scale"])),
    Effect("time_offset", lambda rng, car: one("delay_s", 0.005, 0.15), _sensor(delay_s="delay_s")),
    Effect("roll", _tracks, _physics(track_m="track_width_m", roll_inertia_kg_m2="roll_inertia_kg_m2"),
           stage=lambda scene, u: replace(scene, tracks_apart=between(0.01, 1.0)(u)), models=_HALF),
)}

# Pairs whose description leaves open what they mean together, or that are one physical thing said twice.
NEVER_TOGETHER = ({"sensor_offset", "cg_shift"},)
