"""How much of an effect is left to be seen once the car's own numbers and the distance may give way.

Problem: some effects hide. A few kilograms of payload are what the tolerance of the sprung mass is for, and a delay of
a millisecond is a start a centimetre farther on; nobody can be asked to name them.

Solution: with the true car at hand, what the effect changes in the clean record is fitted, to first order, by what the
car's numbers and each run's distance do, each as far off as it is drawn to be. What remains over the noise says
whether anyone could see it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..simulator.cars import STEP_S, Car, Physics
from ..simulator.recorder import RATE_HZ, Sensor
from ..simulator.scene import Scene, measured
from .random_case import LENGTHS_OFF, NUMBERS_OFF, SKIPPED_S, Case, without

Array = NDArray[np.float64]

UNSEEN = np.sqrt(1.01**2 - 1)
"""A remainder below this, in units of the noise, raises the error by less than 1 %."""

_STEP = 0.01
# Deviations of what is drawn evenly up to these shares.
_NUMBER, _LENGTH = NUMBERS_OFF / np.sqrt(3), np.sqrt(np.mean(np.square(LENGTHS_OFF)) / 3)
_START_M, _SCALE = 0.02, 0.001


def deviations(case: Case, start_m: float) -> list[float]:
    """Of each hidden effect: by how many standard deviations of the noise it stands out in all that was recorded, over
    what the car's numbers and distances can do whose starts may be so far off."""
    count = sum(max(0, len(one.t_s) - int(SKIPPED_S * RATE_HZ)) for one in case.recordings)
    return [one * float(np.sqrt(count)) for one in remainders(case, start_m)]


def remainders(case: Case, start_m: float = _START_M) -> list[float]:
    """Of each hidden effect: r.m.s. of what neither the car's numbers nor the distance can do, over the noise; starts
    may be so far off."""
    full = _joined(measured(case.scene, 2 * STEP_S))
    bare = replace(case.scene, physics=Physics(), sensor=Sensor(), speed_scale=1.0, profile_blur_m=0.0)
    return [_remainder(case, full, without(bare, case.hidden, which), start_m) for which in range(len(case.hidden))]


def _remainder(case: Case, full: Array, rest: Scene, start_m: float) -> float:
    bare = measured(rest, 2 * STEP_S)
    change = full - _joined(bare)
    columns, deviations = [], []
    for car, deviation in _neighbours(rest.car):
        columns.append((_joined(measured(replace(rest, car=car), 2 * STEP_S)) - _joined(bare)) / _STEP)
        deviations.append(deviation)
    for number, (drive, one) in enumerate(zip(rest.drives, bare, strict=True)):
        per_metre = np.gradient(one, 1 / RATE_HZ) / drive.speed_at_mps(drive.times_s)
        way = drive.speed_mps * drive.times_s
        for column, deviation in ((per_metre, start_m), (per_metre * way, _SCALE)):
            columns.append(_joined(tuple(column if i == number else np.zeros_like(b) for i, b in enumerate(bare))))
            deviations.append(deviation)
    # Columns in units of their deviations over the noise: the prior is then a row of ones.
    scaled = np.array(columns) * np.array(deviations)[:, None] / case.noise_rms_mps2
    change = change / case.noise_rms_mps2
    moves = np.linalg.solve(scaled @ scaled.T + np.eye(len(scaled)), scaled @ change)
    return float(np.sqrt(np.mean((change - moves @ scaled) ** 2)))


def _neighbours(car: Car) -> Iterator[tuple[Car, float]]:
    """The car with each of its numbers off by the step, and how far off such a number may be."""
    def more(value: float) -> float:
        return value * (1 + _STEP)

    yield replace(car, sprung_mass_kg=more(car.sprung_mass_kg)), _NUMBER
    yield replace(car, contact_patch_m=more(car.contact_patch_m)), _LENGTH
    if car.rear:
        yield replace(car, pitch_inertia_kg_m2=more(car.pitch_inertia_kg_m2)), _NUMBER
    for place in ("front", "rear"):
        axle = getattr(car, place)
        for name, value in vars(axle).items() if axle else ():
            if value:
                moved = replace(axle, **{name: more(value)})
                yield replace(car, **{place: moved}), _LENGTH if name == "cg_distance_m" else _NUMBER


def _joined(runs: tuple[Array, ...]) -> Array:
    return np.concatenate([run[int(SKIPPED_S * RATE_HZ):] for run in runs])
