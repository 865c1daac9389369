"""Drives over a speed bump and over roads of any car, by the studies' simulation, which the fits know nothing of."""

from __future__ import annotations

import numpy as np

from logger.profiles.track import Track
from logger.roads.iso8608 import generate
from logger.runs import Run
from logger.studies.drives import BUMP_MPS, RATE_HZ, SPACING_M, Conditions, bump, record_of, recorded
from logger.vehicle.vehicle import Vehicle


def bump_record(
    vehicle: Vehicle, seconds: float = 6.0, noise_mps2: float = 0.05, seed: int = 0, iri_outside: float = 0.0,
    height_m: float = 0.15, speed_mps: float = BUMP_MPS, start_m: float = 2.0,
) -> Run:
    """A drive over a bump 2.60 m wide, which is all the record's track has; a road of ``iri_outside`` lay under it."""
    conditions = Conditions(noise_mps2, iri_m_per_km=iri_outside, seed=seed)
    return record_of(bump(start_m, height_m), speed_mps, seconds, conditions, vehicle)


def road_record(
    vehicle: Vehicle, seconds: float, speed_mps: float, seed: int, gd_n0_cm3: float = 64.0, noise_mps2: float = 0.05,
    swing_mps: float = 1.0,
) -> Run:
    """A drive over a rough road whose profile is known, at a speed that swings."""
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    distance_m = speed_mps * time_s + swing_mps * 2 * (1 - np.cos(time_s / 2))
    track = Track(SPACING_M, generate(gd_n0_cm3, distance_m[-1] + 20, SPACING_M, seed))
    measured = recorded(vehicle, track, distance_m, noise_mps2, seed)
    return Run("run", RATE_HZ, measured, distance_m, np.gradient(distance_m, time_s), track)
