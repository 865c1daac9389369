"""Effects off the list that no family of learned laws was designed on: what real cars and sensors have beyond them.

The names in ``akin`` mean what they do for ``outsiders``: which effects of the list come nearest. The examination's
kind "outsider" does not draw these, so that its cases stay what they were.
"""

from __future__ import annotations

import numpy as np

from .cars import Car
from .effects import Path, between, one
from .outsiders import Outsider, damping_of, fields_of


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _rebound_stop(rng: np.random.Generator, car: Car) -> Path:
    return one("clearance_m", 0.08, 0.004, stiffness_n_per_m=_log_uniform(rng, 4e4, 3e5),
               damping_n_s_per_m=rng.uniform(0.2, 1.0) * damping_of(car))


def _inerter(rng: np.random.Generator, car: Car) -> Path:
    return one("inertance_kg", 0.3, 60.0, stiffness_n_per_m=_log_uniform(rng, 1.5e5, 5e5),
               damping_n_s_per_m=rng.uniform(100, 400))


def _hydraulic_mount(rng: np.random.Generator, car: Car) -> Path:
    omega = 2 * np.pi * rng.uniform(5.0, 12.0)
    stiffness = between(100.0, 2 * car.front.suspension_stiffness_n_per_m)

    def at(u: float) -> dict[str, float]:
        inertance = stiffness(u) / omega**2
        # Half of the damping of its resonance grows with the flow: at 0.1 m/s that is a ratio of 0.3.
        return {"stiffness_n_per_m": stiffness(u), "inertance_kg": inertance,
                "damping_n_s_per_m": 0.2 * inertance * omega, "square_n_s2_per_m2": 7 * inertance * omega}
    return at


def _absorber(rng: np.random.Generator, car: Car) -> Path:
    return one("mass_kg", 0.1, 0.6 * car.front.unsprung_mass_kg, frequency_hz=rng.uniform(7.0, 18.0),
               damping_ratio=rng.uniform(0.03, 0.15))


def _flat_spot(rng: np.random.Generator, car: Car) -> Path:
    return one("depth_m", 2e-5, 0.015, length_m=rng.uniform(0.12, 0.3), tire_radius_m=rng.uniform(0.28, 0.35))


def _driveline(rng: np.random.Generator, car: Car) -> Path:
    # A propeller shaft turns 3 to 4.5 times as fast as the wheels.
    return one("rms_mps2", 0.01, 2.0, cycles_per_m=rng.uniform(3.0, 4.5) / (2 * np.pi * 0.31))


def _warming(rng: np.random.Generator, car: Car) -> Path:
    sign, size, lasts_s = 1.0 if rng.random() < 0.5 else -1.0, between(0.02, 4.0), rng.uniform(5.0, 25.0)
    return lambda u: {"offset_mps2": sign * size(u), "time_s": lasts_s}


def _sky(rng: np.random.Generator, car: Car) -> Path:
    return one("sky_n_s_per_m", 0.02 * damping_of(car), 4 * damping_of(car),
               most_n_s_per_m=rng.uniform(1.0, 4.0) * damping_of(car))


NEWCOMERS: dict[str, Outsider] = {newcomer.name: newcomer for newcomer in (
    Outsider("gas_spring", lambda rng, car: one("height_m", 4.0, 0.1), fields_of(gas_height_m="height_m"), rough=1,
             akin=("progressive_spring",)),
    Outsider("place_damper", lambda rng, car: one("share_per_m2", 3.0, 2e4),
             fields_of(damping_by_place_per_m2="share_per_m2"), rough=1),
    Outsider("stribeck_friction",
             lambda rng, car: one("breakaway_n", 3.0, 600.0, falls_at_mps=_log_uniform(rng, 0.01, 0.1)),
             fields_of(stribeck_n="breakaway_n", stribeck_mps="falls_at_mps"), akin=("dry_friction",)),
    Outsider("rebound_stop", _rebound_stop,
             fields_of(droop_m="clearance_m", droop_stop="stiffness_n_per_m", droop_damper="damping_n_s_per_m"),
             rough=1, akin=("bump_stop", "progressive_spring")),
    Outsider("inerter", _inerter, fields_of(inertance_kg="inertance_kg", inerter_spring="stiffness_n_per_m",
                                         inerter_damper="damping_n_s_per_m")),
    Outsider("hydraulic_mount", _hydraulic_mount,
             fields_of(inerter_spring="stiffness_n_per_m", inertance_kg="inertance_kg",
                    inerter_damper="damping_n_s_per_m", inerter_square="square_n_s2_per_m2")),
    Outsider("wheel_absorber", _absorber,
             fields_of(absorber_kg="mass_kg", absorber_hz="frequency_hz", absorber_zeta="damping_ratio")),
    Outsider("tire_warming", lambda rng, car: one("share", 0.005, 0.8, time_s=rng.uniform(10, 30)),
             fields_of(warm="share", warm_s="time_s")),
    Outsider("damper_heating", lambda rng, car: one("per_joule", 1e-7, 3e-3, time_s=rng.uniform(8, 30)),
             fields_of(heat_per_j="per_joule", heat_s="time_s")),
    Outsider("flat_spot", _flat_spot, fields_of(flat_m="depth_m", flat_length_m="length_m",
                                             tire_radius_m="tire_radius_m")),
    Outsider("driveline_order", _driveline, fields_of(driveline_mps2="rms_mps2", driveline_per_m="cycles_per_m")),
    Outsider("warming_sensor", _warming, lambda scene, p: scene.with_sensor(
        offset_mps2=p["offset_mps2"], offset_s=p["time_s"])),
    Outsider("soft_saturation", lambda rng, car: one("limit_mps2", 60.0, 0.7),
             lambda scene, p: scene.with_sensor(soft_mps2=p["limit_mps2"])),
    Outsider("rattling_sensor", lambda rng, car: one("held_mps2", 12.0, 0.3),
             lambda scene, p: scene.with_sensor(held_mps2=p["held_mps2"])),
    Outsider("skyhook_damper", _sky, fields_of(sky="sky_n_s_per_m", sky_most="most_n_s_per_m"),
             akin=("damper_asymmetry",)),
    Outsider("adaptive_damper", lambda rng, car: one("share", 0.01, 0.9, at_mps=rng.uniform(10.0, 20.0)),
             fields_of(firmer="share", firmer_at_mps="at_mps")),
)}
