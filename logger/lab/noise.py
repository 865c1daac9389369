"""The noise of the sensors, which is not given, from what a model leaves; and the error that it alone makes.

Problem: an error means little without the error below which no model comes. Solution: at the highest frequencies a car
moves no sensor, so that what is there is the sensor's own noise, unless that went through the recorder's filter as
well: then the quietest of the bands that pass tells of it. From there every band that is no louder tells more, the
quietest first. No noise is taken for less than what two right simulations of a car differ by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.fitting import Problem, State
from logger.lab.stretches import Stretches

Array = npt.NDArray[np.float64]

# A band is louder than the noise from so many deviations of the difference on; than the quietest of twenty alone, which
# is two deviations of its own below the others by chance, from so many.
_LOUDER, _LOUDER_THAN_QUIETEST = 2.5, (2.5 + 2.0) / np.sqrt(2)
# Noise that is quieter than this share of the quietest band where the filter begins went through the filter.
_FILTERED = 0.6
# Where no fit was made, bands that hold so large a share and are equally loud are flat noise if next to nothing of it
# is left behind the filter: what a car leaves falls towards the highest of them, and the sensor's own noise is
# still there. Below so many hertz all bands are full of what the road does.
_FLAT, _DEAF, _MOVED_HZ = 0.22, 0.01, 30.0
UNEXPLAINED = 0.10
"""What stays above the noise is unexplained from this share of it on."""


@dataclass(frozen=True, eq=False)
class Noise:
    """The noise of the sensors: its deviation, and how certain that is [m/s2]."""

    deviation_mps2: float
    standard_error_mps2: float


def noise_of(problem: Problem, state: State) -> Noise:
    """The sensor's noise under what a state leaves."""
    return sensor_noise(problem.stretches, problem.residuals(state), problem.least_mps2)


def sensor_noise(stretches: Sequence[Stretches], left_mps2: Sequence[Array], least_mps2: float,
                 fitted: bool = True) -> Noise:
    """The sensor's noise under what is left (n,), per run; no less than ``least_mps2``.

    fitted    a fit left it, so that where little is left it is noise; else bands have to be as loud as each other to be
              taken for noise that was filtered, and none but the highest frequencies tell of noise that was not
    """
    quiet = [one.quiet(left) for one, left in zip(stretches, left_mps2, strict=True)]
    freedom = sum(n for _, n in quiet)
    power = sum(level * n for level, n in quiet) / freedom
    highest = power, freedom
    cells = [one.cells(left, None) for one, left in zip(stretches, left_mps2, strict=True)]
    bands = range(min(len(one.power) for one in cells))
    freedoms = [sum(float(one.freedom[band]) for one in cells) for band in bands]
    levels = [sum(float(one.freedom[band] * one.power[band]) for one in cells) / freedoms[band] for band in bands]
    by_level = sorted(zip(levels, freedoms, strict=True))
    louder = _LOUDER
    if power < _FILTERED * by_level[0][0]:
        (power, freedom), *by_level = by_level
        louder = _LOUDER_THAN_QUIETEST
    for level, n in by_level:
        if level > power * (1 + louder * np.sqrt(2 / n + 2 / freedom)):
            break
        power, freedom, louder = (power * freedom + level * n) / (freedom + n), freedom + n, _LOUDER
    flat = freedom > _FLAT * sum(freedoms) and all(one.edges_hz[-1] > _MOVED_HZ for one in stretches)
    if not fitted and not (flat and highest[0] < _DEAF * power):
        power, freedom = highest
    power = max(power, least_mps2**2)
    return Noise(float(np.sqrt(power)), float(np.sqrt(power / (2 * freedom))))


def left_to_explain(problem: Problem, state: State) -> float:
    """By how much minus twice the log-likelihood of all stretches would fall if what is left were just not enough to be
    unexplained; at least 0. Bands that are quiet make up for those that are not."""
    power = ((1 + UNEXPLAINED) * noise_of(problem, state).deviation_mps2) ** 2
    return max(0.0, sum(float(cells.freedom @ np.log(cells.power / power)) for cells in problem.cells(state, None)))


def floor_error(problem: Problem, noise: Noise) -> float:
    """rms(noise) / rms(measured) over all samples that count."""
    return noise.deviation_mps2 / problem.size_mps2
