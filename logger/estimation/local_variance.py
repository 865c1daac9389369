"""Local variance of a road that is not equally rough everywhere, learnt on the way.

Problem. One level for a block of 20 s makes too much of a smooth stretch behind a rough patch, and too little of a
pothole on a smooth road. Solution. The white innovations v of the road have, at each point, a variance d of their own
about 1. From the estimate of v, d is the local mean of v^2 over the local share of it that the readings resolve (MacKay
1992), with the weight of some more points that say 1: where the readings show little, d stays at 1. How many: a road
whose d scatters by a variance s is worth 2 / s of them, and s is learnt from block to block, so that a Gaussian road
keeps d near 1. Where readings are uneven, so is what they resolve. d is followed by place, from block to block.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_REACH_M = 1.5
_COMMON = 4.0  # points, before the scatter is known, and never fewer
_MOST_COMMON = 100.0  # d keeps within 14 %, which costs nothing
_FORGOTTEN = 0.1  # of what was heard of the scatter: a block of 20 s begins 2 s behind the one before
_LEAST_OF_MEAN = 0.1  # a place that shows less says nothing of the scatter
_TAKEN_OVER = 0.6  # of a new estimate, so that it does not overshoot
_SMALLEST_LOG, _LARGEST_LOG = -3.0, 7.0
_LEAST_SCATTER, _LARGEST_SCATTER = 1e-3, 1.0
_CLASSES = 8
_LOG_TABLE = np.linspace(_SMALLEST_LOG, _LARGEST_LOG, 21)


@dataclass(frozen=True)
class RelativeVariance:
    """variance    (n,) d at points of the distance grid
    log_error      (n,) variance of the error of log d
    """

    variance: Array
    log_error: Array


class LocalRoughness:
    """Relative variance by number of the point on an endless grid of ``spacing_m``; 1 where nothing is known."""

    def __init__(self, spacing_m: float) -> None:
        self._reach = _REACH_M / spacing_m
        self._first = 0
        self._known = RelativeVariance(np.empty(0), np.empty(0))
        self._common = _COMMON
        self._scattered, self._heard = 0.0, 0.0  # sum of weight x scatter, and of the weights

    def at(self, first: int, count: int) -> RelativeVariance:
        """What is known of points ``first`` ... ``first + count - 1``."""
        variance, log_error = np.ones(count), np.zeros(count)
        ahead = first - self._first
        here = slice(max(-ahead, 0), max(min(len(self._known.variance) - ahead, count), 0))
        there = slice(max(ahead, 0), max(min(len(self._known.variance), ahead + count), 0))
        variance[here] = self._known.variance[there]
        log_error[here] = self._known.log_error[there]
        return RelativeVariance(variance, log_error)

    def learn(
        self, first: int, innovations: Array, before: Array, gain: Array, seen: Array, taken: Array | float = 1.0,
        learns: bool = False,
    ) -> None:
        """Take what a solved block says.

        innovations    (n,) v at its points; n is even
        before         (n,) the d that it was solved with
        gain           (n // 2 + 1,) information over prior of each wave where d is 1
        seen           (n,) 1 where the road was read, else 0
        taken          (n,) degrees of freedom that it takes there over their mean; 1 where readings are even
        learns         the scatter of d as well: once per block, when its readings have settled
        """
        log_before = np.log(before)
        resolved = np.interp(log_before, _LOG_TABLE, self._resolved_by_point(gain, len(before))) * taken
        power, weight, near = self._smoothed(np.stack([innovations**2, resolved, np.ones(len(before))]) * seen)
        if learns and seen.any():
            self._learn_scatter(power, weight, gain, seen > 0)
        fresh = (self._common + power) / (self._common + weight)
        log_new = _TAKEN_OVER * np.log(fresh) + (1 - _TAKEN_OVER) * log_before
        log_new = np.where(near > 0, np.clip(log_new, _SMALLEST_LOG, _LARGEST_LOG), 0.0)
        self._first = first
        self._known = RelativeVariance(np.exp(log_new), self._log_error(log_new, weight, seen > 0))

    def _learn_scatter(self, power: Array, weight: Array, gain: Array, inside: npt.NDArray[np.bool_]) -> None:
        """By how much the local means of a block scatter more than chance makes them: their variance less that of a
        weighted sum of squares of what has the correlation that the resolved shares give it (Isserlis)."""
        count = len(power)
        neighbours = _neighbours(count, self._reach).real
        correlation = np.fft.irfft(gain / (1 + gain), count)
        if correlation[0] <= 0 or not power.any():
            return
        chance = 2 * float(np.fft.irfft(neighbours**2, count) @ correlation**2) / (correlation[0] * neighbours[0]) ** 2
        mean = float(weight[inside].mean())
        relative = power[inside] / np.maximum(weight[inside], _LEAST_OF_MEAN * mean)
        found = float(np.var(relative) / np.mean(relative) ** 2) - chance
        usual = 2 / _COMMON
        self._scattered += mean * min(max(found, -usual), usual) - _FORGOTTEN * self._scattered
        self._heard += mean - _FORGOTTEN * self._heard
        scatter = (self._scattered + _COMMON * usual) / (self._heard + _COMMON)
        self._common = 2 / max(scatter, 2 / _MOST_COMMON)

    def _resolved_by_point(self, gain: Array, count: int) -> Array:
        """Share of a point's innovation that the readings resolve, for each d of the table: the mean over all waves."""
        strength = np.exp(_LOG_TABLE)[:, None] * gain
        strength /= 1 + strength
        share: Array = strength.sum(axis=1) * 2 / count
        return share

    def _log_error(self, log_variance: Array, weight: Array, seen: npt.NDArray[np.bool_]) -> Array:
        """A road whose d scatters by s is known to 1 / (1 / s + weight / 2); s that is not learnt is seen shrunk by
        the common points."""
        if not seen.any():
            return np.zeros(len(weight))
        shrunk = float(np.mean(weight[seen] / (weight[seen] + _COMMON)))
        scatter = 2 / self._common if self._heard else float(np.var(log_variance[seen])) / max(shrunk, 0.1) ** 2
        error: Array = 1 / (1 / np.clip(scatter, _LEAST_SCATTER, _LARGEST_SCATTER) + 0.5 * weight)
        return error

    def _smoothed(self, rows: Array) -> Array:
        """Sums (r, n) over the neighbours, weighted with a Gaussian of ``_REACH_M``, periodic as the grid is."""
        count = rows.shape[1]
        return np.maximum(np.fft.irfft(np.fft.rfft(rows) * _neighbours(count, self._reach), count), 0.0)


@lru_cache(maxsize=32)
def _neighbours(count: int, reach: float) -> npt.NDArray[np.complex128]:
    """The rfft of how much each neighbour of a point counts, on a grid of so many; kept, for there are few counts."""
    lag = np.minimum(np.arange(count), count - np.arange(count))
    return np.asarray(np.fft.rfft(np.exp(-0.5 * (lag / reach) ** 2)))



def mean_resolved(gain: Array, variance: Array) -> Array:
    """Share of each wave that the readings resolve, mean over points of relative variance d (n,)."""
    if not len(variance):
        return gain / (1 + gain)
    logs = np.log(variance)
    lowest, width = logs.min(), (logs.max() - logs.min()) / _CLASSES
    classes = np.minimum((logs - lowest) / width, _CLASSES - 1).astype(np.int64) if width else np.zeros(len(logs), int)
    counts, sums = np.bincount(classes), np.bincount(classes, logs)
    counts, sums = counts[counts > 0], sums[counts > 0]
    strength = np.exp(sums / counts)[:, None] * gain
    mean: Array = (counts / counts.sum()) @ (strength / (1 + strength))
    return mean
