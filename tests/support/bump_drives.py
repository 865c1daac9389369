"""Drives over a speed bump and over roads, made by the time-stepping simulation, which the fits know nothing of."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.identification.prediction import Record
from logger.roads.bumps import speed_bump
from logger.roads.iso8608 import gd_n0_from_iri, generate
from logger.roads.track import Track
from logger.vehicle.models import structure_of
from logger.vehicle.simulate import drive
from logger.vehicle.structure import body_point
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

RATE_HZ = 100
BUMP_MPS = 16.1 / 3.6
SPACING_M = 0.05
_LEAD_S = 3


def recorded(vehicle: Vehicle, track: Track, distance_m: Array, noise_mps2: float, seed: int) -> Array:
    """What the sensor records at 100 Hz; the car has come to the start as fast as it goes there."""
    structure = structure_of(vehicle)
    lead = np.arange(-_LEAD_S * RATE_HZ, 0)
    way = np.concatenate([distance_m[0] + (distance_m[1] - distance_m[0]) * lead, distance_m])
    output = body_point(structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m)
    clean = drive(structure, [output], track, np.arange(len(way)) / RATE_HZ, way)[len(lead):, 0]
    return np.asarray(clean + noise_mps2 * np.random.default_rng(seed).standard_normal(len(clean)))


def bump_record(
    vehicle: Vehicle, seconds: float = 6.0, noise_mps2: float = 0.05, seed: int = 0, iri_outside: float = 0.0,
    height_m: float = 0.15, speed_mps: float = BUMP_MPS, start_m: float = 2.0,
) -> Record:
    """A drive over a bump 2.60 m wide, which is all the record's track has; a road of ``iri_outside`` lay under it."""
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    distance_m = speed_mps * time_s
    place = np.arange(-20.0, distance_m[-1] + 20, SPACING_M)
    bump = speed_bump(place, start_m, height_m, 2.6)
    road = bump
    if iri_outside:
        length_m = SPACING_M * (len(place) + 1)
        road = bump + generate(gd_n0_from_iri(iri_outside), length_m, SPACING_M, seed)[: len(place)]
    measured = recorded(vehicle, Track(SPACING_M, road, place[0]), distance_m, noise_mps2, seed)
    speed = np.full(len(time_s), speed_mps)
    return Record(time_s, measured, distance_m, speed, Track(SPACING_M, bump, place[0]), skip_s=0.0)


def road_record(
    vehicle: Vehicle, seconds: float, speed_mps: float, seed: int, gd_n0_cm3: float = 64.0, noise_mps2: float = 0.05,
    swing_mps: float = 1.0,
) -> Record:
    """A drive over a rough road whose profile is known, at a speed that swings."""
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    distance_m = speed_mps * time_s + swing_mps * 2 * (1 - np.cos(time_s / 2))
    track = Track(SPACING_M, generate(gd_n0_cm3, distance_m[-1] + 20, SPACING_M, seed))
    measured = recorded(vehicle, track, distance_m, noise_mps2, seed)
    return Record(time_s, measured, distance_m, np.gradient(distance_m, time_s), track)
