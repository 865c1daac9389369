"""Effects that are not on the list: what the lab must call unexplained.

Each says which effects of the list come nearest to it (``akin``): a lab that names one of those is less wrong than one
that names another, and where the data cannot separate the two, not wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .cars import Car
from .effects import Effect, Parameters, Path, between, one
from .scene import Scene


@dataclass(frozen=True)
class Outsider(Effect):
    """An effect off the list."""

    akin: tuple[str, ...] = ()


def damping_of(car: Car) -> float:
    return car.front.suspension_damping_n_s_per_m


def _axle_friction(rng: np.random.Generator, car: Car) -> Path:
    return one("friction_force_n", 5.0, 500.0, rear=float(rng.random() < 0.5))


def _rub_one(scene: Scene, p: Parameters) -> Scene:
    name = "friction_rear_n" if p["rear"] else "friction_front_n"
    return scene.with_physics(**{name: p["friction_force_n"]})


def _bushing(rng: np.random.Generator, car: Car) -> Path:
    return one("stiffness_n_per_m", 200.0, 3 * car.front.suspension_stiffness_n_per_m,
               yield_m=float(np.exp(rng.uniform(*np.log([0.001, 0.006])))))


def _engine(rng: np.random.Generator, car: Car) -> Path:
    return one("rms_mps2", 0.01, 3.0, frequency_hz=rng.uniform(15, 36), wander_s=rng.uniform(0.1, 1.5),
               phase=rng.uniform(0, 6.28))


def _out_of_balance(rng: np.random.Generator, car: Car) -> Path:
    # A heavy spot of 10 to 400 g on a rim of 0.2 m: m r omega^2 / k.
    heaviest = 0.4 * 0.2 / car.front.tire_stiffness_n_per_m
    return one("imbalance_m_s2", heaviest / 200, heaviest, tire_radius_m=rng.uniform(0.28, 0.35))


def fields_of(**names: str) -> Callable[[Scene, Parameters], Scene]:
    return lambda scene, p: scene.with_physics(**{field: p[name] for field, name in names.items()})


def _drift(rng: np.random.Generator, car: Car) -> Path:
    sign, size = (1.0 if rng.random() < 0.5 else -1.0), between(0.01, 0.7)
    return lambda u: {"gain_change_per_min": sign * size(u)}


OUTSIDERS: dict[str, Outsider] = {outsider.name: outsider for outsider in (
    Outsider("quadratic_damping",
             lambda rng, car: one("square_n_s2_per_m2", 0.02 * damping_of(car), 8 * damping_of(car)),
             fields_of(damper_square="square_n_s2_per_m2"), rough=1, akin=("damper_blow_off",)),
    Outsider("bushing_hysteresis", _bushing, fields_of(bushing="stiffness_n_per_m", bushing_yield_m="yield_m"),
             akin=("dry_friction",)),
    Outsider("hardening_tire",
             lambda rng, car: one("cubic_n_per_m3", 20 * car.front.tire_stiffness_n_per_m,
                                  4e4 * car.front.tire_stiffness_n_per_m),
             fields_of(tire_cubic="cubic_n_per_m3"), rough=1, akin=("bump_stop", "progressive_spring")),
    Outsider("one_axle_friction", _axle_friction, _rub_one, akin=("dry_friction",), models=("half_car",)),
    Outsider("damper_backlash",
             lambda rng, car: one("gap_m", 1e-5, 0.006, stiffness_n_per_m=3e6),
             fields_of(mount_gap_m="gap_m", mount="stiffness_n_per_m"), akin=("top_mount_compliance",)),
    Outsider("wheel_imbalance", _out_of_balance, fields_of(unround_m="imbalance_m_s2", tire_radius_m="tire_radius_m")),
    Outsider("engine_vibration", _engine, lambda scene, p: scene.with_sensor(
        engine_mps2=p["rms_mps2"], engine_hz=p["frequency_hz"], engine_wander=p["wander_s"], engine_phase=p["phase"])),
    Outsider("damper_fading", lambda rng, car: one("lost_share", 0.01, 0.7, time_s=rng.uniform(10, 30)),
             fields_of(fade="lost_share", fade_s="time_s")),
    Outsider("rubber_spring",
             lambda rng, car: one("stiffness_n_per_m", 300.0, 3 * car.front.suspension_stiffness_n_per_m,
                                  time_s=float(np.exp(rng.uniform(*np.log([0.03, 0.3]))))),
             fields_of(rubber="stiffness_n_per_m", rubber_s="time_s"), akin=("top_mount_compliance",)),
    Outsider("trailer",
             lambda rng, car: one("mass_kg", 5.0, 0.35 * car.sprung_mass_kg, frequency_hz=rng.uniform(1.5, 5.0),
                                  damping_ratio=rng.uniform(0.05, 0.3), behind_axle_m=rng.uniform(0.5, 1.1)),
             fields_of(tow_mass_kg="mass_kg", tow_hz="frequency_hz", tow_zeta="damping_ratio",
                    tow_behind_axle_m="behind_axle_m"), akin=("occupant",), models=("half_car",)),
    Outsider("clipping", lambda rng, car: one("limit_mps2", 15.0, 0.4),
             lambda scene, p: scene.with_sensor(clip_mps2=p["limit_mps2"])),
    Outsider("gain_drift", _drift, lambda scene, p: scene.with_sensor(drift=p["gain_change_per_min"]),
             akin=("sensor_gain",)),
    Outsider("blurred_profile", lambda rng, car: one("blur_m", 0.05, 3.0),
             lambda scene, p: replace(scene, profile_blur_m=p["blur_m"]), akin=("tire_enveloping",)),
)}
