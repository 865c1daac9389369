"""Local variance of a road that is not equally rough everywhere, learnt on the way.

Problem. One level for a block of 20 s makes too much of a smooth stretch behind a rough patch, and too little of a
pothole on a smooth road. Solution. The white innovations v of the road have, at each point, a variance d of their own
about 1. From the estimate of v, d is the local mean of v^2 over the local share of it that the readings resolve (MacKay
1992), with the weight of ``_COMMON`` more points that say 1: where the readings show little, d stays at 1, and a
Gaussian road keeps it near 1. It is followed by place, from block to block.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_REACH_M = 1.5
_COMMON = 4.0
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

    def at(self, first: int, count: int) -> RelativeVariance:
        """What is known of points ``first`` ... ``first + count - 1``."""
        variance, log_error = np.ones(count), np.zeros(count)
        number = np.arange(count) + first - self._first
        known = (number >= 0) & (number < len(self._known.variance))
        variance[known] = self._known.variance[number[known]]
        log_error[known] = self._known.log_error[number[known]]
        return RelativeVariance(variance, log_error)

    def learn(self, first: int, innovations: Array, before: Array, gain: Array, seen: Array) -> None:
        """Take what a solved block says.

        innovations    (n,) v at its points; n is even
        before         (n,) the d that it was solved with
        gain           (n // 2 + 1,) information over prior of each wave where d is 1
        seen           (n,) 1 where the road was read, else 0
        """
        log_before = np.log(before)
        resolved = np.interp(log_before, _LOG_TABLE, self._resolved_by_point(gain, len(before)))
        power, weight, near = self._smoothed(np.stack([innovations**2, resolved, np.ones(len(before))]) * seen)
        fresh = (_COMMON + power) / (_COMMON + weight)
        log_new = _TAKEN_OVER * np.log(fresh) + (1 - _TAKEN_OVER) * log_before
        log_new = np.where(near > 0, np.clip(log_new, _SMALLEST_LOG, _LARGEST_LOG), 0.0)
        self._first = first
        self._known = RelativeVariance(np.exp(log_new), self._log_error(log_new, weight, seen > 0))

    def _resolved_by_point(self, gain: Array, count: int) -> Array:
        """Share of a point's innovation that the readings resolve, for each d of the table: the mean over all waves."""
        strength = np.exp(_LOG_TABLE)[:, None] * gain
        strength /= 1 + strength
        share: Array = strength.sum(axis=1) * 2 / count
        return share

    def _log_error(self, log_variance: Array, weight: Array, seen: npt.NDArray[np.bool_]) -> Array:
        """A road whose d scatters by s is known to 1 / (1 / s + weight / 2); s is seen shrunk by the common points."""
        if not seen.any():
            return np.zeros(len(weight))
        shrunk = float(np.mean(weight[seen] / (weight[seen] + _COMMON)))
        scatter = float(np.var(log_variance[seen])) / max(shrunk, 0.1) ** 2
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
