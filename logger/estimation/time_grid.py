"""Time grid of the estimator: readings at even instants, cut and joined.

Coarse readings may be taken several times per sample of the grid. What a car does is slow enough to be known between
the samples from them, so each reading is one of the acceleration at its own instant: ``between`` gives that.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from logger.arrays import Array, Bools, Complex, Rows
from logger.dsp.resample import GRID_RATE_HZ

RATE_HZ = float(GRID_RATE_HZ)
SLOWEST_MPS = 1.0
"""Slower than this receivers hold their speed at zero, and have no sign for a car that backs up: such a fix counts only
where those before and after it say as well that the car stands."""


@dataclass(frozen=True)
class RoadSamples(Rows):
    """Arrays as ``RoadEstimator.push`` takes them: the first three (n, k) for k readings per sample, the first of them
    at the sample and the others at even steps up to the next; ``distance_m`` (n,)."""

    reading_mps2: Array
    usable: Bools
    at_end: Array
    distance_m: Array

    @property
    def read(self) -> Bools:
        """(n,) samples with a reading."""
        return np.asarray(self.usable.any(axis=1))

    @classmethod
    def unread(cls, count: int, until_m: float, step_m: float, reads: int) -> RoadSamples:
        """None of the ``reads`` per sample came while the car came up to ``until_m``, ``step_m`` further with each
        sample."""
        distance_m = until_m - step_m * np.arange(count, 0, -1.0)
        shape = (count, reads)
        return cls(np.zeros(shape), np.zeros(shape, dtype=np.bool_), np.zeros(shape), distance_m)

    def speed_mps(self, begin_m: float, end_m: float) -> float | None:
        """Mean speed between two places while the car moved; None when it is too slow for an estimate."""
        low, high = np.searchsorted(self.distance_m, [begin_m, end_m])
        steps_m = np.diff(self.distance_m[max(low - 1, 0):high + 1])
        moving = steps_m > SLOWEST_MPS / RATE_HZ
        return float(steps_m[moving].mean()) * RATE_HZ if moving.sum() > 0.5 * len(steps_m) else None


def between(row: Array, reads: int) -> Array:
    """A row (n,) of even samples, without anything at half their rate, at ``reads`` instants per sample (n reads,)."""
    return row if reads == 1 else at_readings(np.fft.rfft(row), len(row), reads)


def at_readings(waves: Complex, count: int, reads: int) -> Array:
    """The same from its rfft."""
    return np.fft.irfft(waves, count * reads) * reads


@lru_cache(maxsize=8)
def frequencies_hz(count: int, rate_hz: float) -> Array:
    """Those of the rfft of ``count`` samples (count // 2 + 1,) [Hz]; kept, for there are few counts."""
    return np.asarray(np.fft.rfftfreq(count, 1 / rate_hz), dtype=np.float64)


@lru_cache(maxsize=32)
def neighbours(count: int, reach: float) -> Array:
    """The rfft of how much each neighbour of a point counts, on a closed grid of so many: exp(-(lag / reach)^2 / 2);
    the last are kept."""
    lag = np.minimum(np.arange(count), count - np.arange(count))
    return np.asarray(np.fft.rfft(np.exp(-0.5 * (lag / reach) ** 2)).real)
