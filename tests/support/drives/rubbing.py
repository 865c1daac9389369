"""Drives of cars whose suspensions rub, by Newton's laws integrated by SciPy, which fits know nothing of."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from logger.profiles.track import Track
from logger.roads.iso8608 import generate
from logger.runs import Run
from logger.studies.drives import RATE_HZ, rav4
from logger.vehicle.simulate import recorder_taps

from .newton_car import judge, road_under

Array = npt.NDArray[np.float64]

CAR, FRICTION_N, GROWN_AT_MPS = rav4(), 120.0, 0.02
_STEPS, _LEAD_S, _SPACING_M = 10, 2.0, 0.1


def rubbing_run(seed: int, seconds: float = 10.0, noise_mps2: float = 0.05, road_seed: int = 0,
                speed_mps: float = 12.0) -> Run:
    """The car of Table 4.2 with dry friction on a smooth road whose profile is known."""
    track, distance_m, clean = _clean(seconds, road_seed, speed_mps)
    noise = noise_mps2 * np.random.default_rng(seed).standard_normal(len(clean))
    return Run("rubbing", RATE_HZ, clean + noise, distance_m, np.full(len(clean), speed_mps), track)


@cache
def _clean(seconds: float, road_seed: int, speed_mps: float) -> tuple[Track, Array, Array]:
    """Road, distances and what the sensor records without noise; the car has come to the start at its speed."""
    distance_m = speed_mps * np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    track = Track(_SPACING_M, generate(32.0, distance_m[-1] + 20, _SPACING_M, road_seed))
    road = road_under(track.start_m, track.spacing_m, track.elevation_m, CAR.contact_patch_m)
    level_m = float(road(np.zeros(1))[0])
    time_s = np.arange(round(-_LEAD_S * RATE_HZ * _STEPS), len(distance_m) * _STEPS + RATE_HZ) / (RATE_HZ * _STEPS)
    told = judge(CAR, [lambda place: road(place) - level_m], lambda t: speed_mps * t, time_s, 1e-7, 6e-3, FRICTION_N,
                 GROWN_AT_MPS)
    filtered = np.convolve(told.body_mps2, recorder_taps(_STEPS), mode="same")
    first = round(_LEAD_S * RATE_HZ * _STEPS)
    return track, distance_m, filtered[first :: _STEPS][: len(distance_m)]
