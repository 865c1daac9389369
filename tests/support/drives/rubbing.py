"""Drives of a car whose suspensions rub, by the simulator of the validation, which fits know nothing of."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from logger.profiles.track import Track
from logger.roads.iso8608 import generate
from logger.runs import Run
from logger.studies.drives import rav4
from logger.vehicle.vehicle import Axle as AxleOfFile

from ...validation.simulator.cars import Axle, Car, Physics
from ...validation.simulator.recorder import RATE_HZ
from ...validation.simulator.roads import Road
from ...validation.simulator.scene import Drive, Scene, clean_acceleration

Array = npt.NDArray[np.float64]

FRICTION_N = 120.0
_GD_N0_CM3, _SPACING_M, _START_M = 32.0, 0.1, 3.0


def rubbing_run(seed: int, seconds: float = 15.0, noise_mps2: float = 0.05, road_seed: int = 0,
                speed_mps: float = 12.0) -> Run:
    """The car of Table 4.2 with Coulomb friction, from rest on a road between classes A and B whose profile is
    known; ``seed`` is the noise's."""
    track, distance_m, clean = _clean(seconds, road_seed, speed_mps)
    noise = noise_mps2 * np.random.default_rng(seed).standard_normal(len(clean))
    return Run("rubbing", RATE_HZ, clean + noise, distance_m, np.full(len(clean), speed_mps), track)


@cache
def _clean(seconds: float, road_seed: int, speed_mps: float) -> tuple[Track, Array, Array]:
    """Road, distances [m] and what the sensor records without noise [m/s2]."""
    given = rav4()
    assert given.rear is not None
    car = Car("half_car", given.sprung_mass_kg, given.pitch_inertia_kg_m2 or 0.0, _axle(given.front), _axle(given.rear),
              given.contact_patch_m)
    elevation_m = np.round(generate(_GD_N0_CM3, seconds * speed_mps + 20, _SPACING_M, road_seed), 6)
    road = Road(_SPACING_M, elevation_m, elevation_m, "A", 2.0)
    drive = Drive(road, seconds, speed_mps, _START_M)
    scene = Scene(car, (drive,), Physics(friction_front_n=FRICTION_N, friction_rear_n=FRICTION_N))
    return Track(_SPACING_M, elevation_m), drive.distance_m(drive.times_s), clean_acceleration(scene, drive)


def _axle(one: AxleOfFile) -> Axle:
    return Axle(one.cg_distance_m, one.unsprung_mass_kg, one.suspension_stiffness_n_per_m,
                one.suspension_damping_n_s_per_m, one.tire_stiffness_n_per_m)
