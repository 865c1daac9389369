"""Fixes of a receiver along a drive through a town, with errors that last as those of receivers do."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivers.readings import Fix
from logger.service.timebase import TimedFix

METRES_PER_DEG = 111_195.0
HELD_BELOW_MPS = 1.2  # static navigation: places are held while the car creeps


def town_drive(seconds: int, seed: int, factor: float = 1.0, usual_mps: float = 14.0,
               outlier_s: int | None = None) -> Iterator[TimedFix]:
    """A fix a second: stretches at about ``usual_mps`` with turns, lights and queues; speed noise of 0.1 m/s.

    Places wander by 4 m over a minute, and by 15 m over 20 s for two minutes of each twenty; in queues they are held.
    ``factor``: of the speed that the receiver says; ``outlier_s``: its place is 300 m off in this second.
    """
    rng = np.random.default_rng(seed)
    wanted_mps = _wanted_mps(seconds, usual_mps, rng)
    speed_mps, course = 0.0, 0.0
    north_m = east_m = 0.0
    wander, reflected = rng.normal(0, 4, 2), np.zeros(2)
    held: tuple[float, float] | None = None
    turning = 0
    for second in range(seconds):
        speed_mps += float(np.clip(wanted_mps[second] - speed_mps, -2.5, 1.8))
        turns = turning == 0 and rng.random() < 1 / 60
        turning = int(rng.choice([-1, 1])) * 6 if turns else turning - int(np.sign(turning))
        course += np.sign(turning) * np.pi / 12
        north_m += speed_mps * np.cos(course)
        east_m += speed_mps * np.sin(course)
        wander = wander * (1 - 1 / 60) + rng.normal(0, 4 * (2 / 60) ** 0.5, 2)
        among_houses = second % 1200 < 120
        reflected = reflected * (1 - 1 / 20) + rng.normal(0, 15 * (2 / 20) ** 0.5, 2) * among_houses
        place = (north_m + wander[0] + reflected[0], east_m + wander[1] + reflected[1])
        if second == outlier_s:
            place = (place[0] + 300.0, place[1])
        held = (held or place) if speed_mps < HELD_BELOW_MPS else None
        said_mps = max(0.0, factor * (speed_mps + rng.normal(0, 0.1)))
        yield _fix(second, held or place, said_mps)


def _wanted_mps(seconds: int, usual_mps: float, rng: np.random.Generator) -> np.ndarray:
    wanted: list[float] = []
    while len(wanted) < seconds:
        wanted += [float(usual_mps * rng.uniform(0.6, 1.3))] * int(rng.integers(20, 150))
        wanted += [0.0] * int(rng.integers(5, 60)) if rng.random() < 0.4 else []
        if rng.random() < 0.15:  # a queue: creeping
            for _ in range(int(rng.integers(3, 12))):
                wanted += [float(rng.uniform(0.3, 1.0))] * int(rng.integers(10, 60))
                wanted += [float(rng.uniform(0, 3))] * int(rng.integers(3, 15))
    return np.array(wanted[:seconds])


def _fix(second: int, place_m: tuple[float, float], speed_mps: float) -> TimedFix:
    t_us = 1_000_000 * second
    lat_deg = round(46 + place_m[0] / METRES_PER_DEG, 6)
    lon_deg = round(6 + place_m[1] / METRES_PER_DEG / np.cos(np.radians(46)), 6)
    return TimedFix(t_us, Fix(t_us, True, None, None, lat_deg, lon_deg, speed_mps, None, None, None, None))
