"""By how much the model runs ahead of the measurement, along each run.

Problem: a clock that is late, a position that is off and a speed that is off by a factor all leave residuals like those
of missing physics. Solution: in short windows the measurement is laid beside the model at every shift within reach of
the last one, and around the best one the shift is found between samples, to first order (with the gain free). A shift
that is one time is a clock's, one that is one length is a position's, one that grows along the way is a wrong speed's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.runs import Run

Array = npt.NDArray[np.float64]

WINDOW_S = 2.56
_LEAST_WINDOWS = 5
_LEAST_READ = 0.9
"""Of a window, lest what stands where nothing was read decides; a tenth moves a lag by less than its error."""
_GRID_M = 0.1  # a fifth of the shortest wave that is felt
_LOUD_M = 20.0  # places are compared by their loudness over so much road
SLOWEST_MPS = 0.5
"""A car that is slower stands: a length over its speed says nothing."""


@dataclass(frozen=True, eq=False)
class Lags:
    """Windows (k,) of all runs in which the model and the measurement are alike.

    run           which run it is in
    middle        the sample in its middle
    along_m       how far into the run [m]
    lag_s, error_s    how much later than the model the measurement is: the model is ahead where it is above 0
    speed_mps     in the window; NaN on a rig
    """

    run: npt.NDArray[np.intp]
    middle: npt.NDArray[np.intp]
    along_m: Array
    lag_s: Array
    error_s: Array
    speed_mps: Array

    @property
    def lag_m(self) -> Array:
        """The same as lengths of road."""
        return self.lag_s * self.speed_mps


@dataclass(frozen=True)
class Trend:
    """A number with its standard error and how probable one so large would be by chance; NaN where nothing is known."""

    value: float = float("nan")
    error: float = float("nan")
    p_value: float = float("nan")


def lags(runs: Sequence[Run], predictions: Sequence[Array]) -> Lags:
    """The windows of runs beside a model's predictions (n,), or ((1 + s) n,) of all signals."""
    rows: list[tuple[float, ...]] = []
    for number, (run, prediction) in enumerate(zip(runs, predictions, strict=True)):
        rows += _windows(number, run, run.main(prediction))
    table = np.array(rows).reshape(-1, 6).T
    return Lags(table[0].astype(np.intp), table[1].astype(np.intp), *table[2:])


def followed_m(run: Run, prediction: Array) -> Array:
    """By how much the car seems to have been farther than a model of it (n,) [m], straight between windows in which
    both are alike; nothing where there are none, and on a rig."""
    windows = lags([run], [prediction])
    if run.timed or not len(windows.run):
        return np.zeros(run.count)
    places_m = np.maximum.accumulate(windows.along_m)
    return np.asarray(np.interp(run.distance_m - run.distance_m[0], places_m, -windows.lag_m))


def shift_m(distance_m: Array, measured_mps2: Array, prediction: Array, road_m: tuple[float, float],
            reach_m: float) -> float | None:
    """By how much the car was farther than these distances (n,) all the way, up to ``reach_m`` either way, if it was on
    this road, known from ``road_m`` on and up to there; None where it hardly moved [m]."""
    from scipy.signal import correlate

    grid_m = np.arange(distance_m[0], distance_m[-1], _GRID_M)
    if len(grid_m) < 2:
        return None
    rising = distance_m + 1e-9 * np.arange(len(distance_m))
    inside = ((grid_m >= road_m[0]) & (grid_m <= road_m[1])).astype(float)
    measured, predicted = (_evened(np.interp(grid_m, rising, one)) * inside for one in (measured_mps2, prediction))
    reach = min(round(reach_m / _GRID_M), len(grid_m) - 1)
    alike = correlate(predicted, measured, "full", "fft")[len(grid_m) - 1 - reach : len(grid_m) + reach]
    return (int(alike.argmax()) - reach) * _GRID_M


def _evened(samples: Array) -> Array:
    """Of places (n,), each as loud as the others: one pothole shall not decide."""
    size = round(_LOUD_M / _GRID_M)
    loud = np.sqrt(np.convolve(samples**2, np.full(size, 1 / size), "same"))[: len(samples)]
    return samples / np.maximum(loud, 0.3 * np.sqrt(np.mean(samples**2)) + 1e-9)


def drift(windows: Lags) -> Trend:
    """By how much the model gets ahead per length of road [m/m], each run beginning where it will."""
    runs = np.unique(windows.run)
    freedom = len(windows.run) - len(runs) - 1
    if freedom < _LEAST_WINDOWS:
        return Trend()
    lag_m, along_m = (_centred(one, windows.run) for one in (windows.lag_m, windows.along_m))
    return _slope(lag_m, along_m, freedom)


def constant(windows: Lags, apart: float = 1.3) -> tuple[Trend, Trend, bool | None]:
    """By how much the model is ahead all the way [s], [m], and whether it is rather the one time (True) or the one
    length (False); None: the speeds, slow and fast ones, do not differ by the factor ``apart``, and do not tell."""
    freedom = len(windows.run) - 1
    if freedom < _LEAST_WINDOWS:
        return Trend(), Trend(), None
    ones = np.ones_like(windows.lag_s)
    time = _slope(windows.lag_s, ones, freedom)
    length = _slope(windows.lag_s, 1 / windows.speed_mps, freedom)
    slow, fast = np.quantile(windows.speed_mps, (0.1, 0.9))
    left_time = float(np.sum((windows.lag_s - time.value) ** 2))
    left_length = float(np.sum((windows.lag_s - length.value / windows.speed_mps) ** 2))
    return time, length, left_time < left_length if fast > apart * slow else None


def _windows(number: int, run: Run, prediction: Array, reach_s: float = 0.3,
             least_correlation: float = 0.5) -> list[tuple[float, ...]]:
    size, reach = round(WINDOW_S * run.rate_hz), round(reach_s * run.rate_hz)
    rate_of_change = np.gradient(prediction, 1 / run.rate_hz)
    read = run.read
    found: list[tuple[float, ...]] = []
    about = step = 0
    for start in range(run.first, run.count - size + 1, size):
        measured = run.measured_mps2[start : start + size]
        low = max(0, start - about - step - reach)
        high = min(run.count - size, start - about - step + reach)
        if high < low or np.mean(read[start : start + size]) < _LEAST_READ:
            continue
        shifted = np.lib.stride_tricks.sliding_window_view(prediction[low : high + size], size)
        scale = np.sqrt((shifted**2).sum(axis=1) * (measured @ measured))
        alike = np.divide(shifted @ measured, scale, out=np.zeros(len(shifted)), where=scale > 0)
        best = low + int(alike.argmax())
        if alike[best - low] < least_correlation:
            continue
        part = slice(best, best + size)
        columns = np.stack([prediction[part], -rate_of_change[part]], axis=1)
        (gain, late), *_ = np.linalg.lstsq(columns, measured, rcond=None)
        left = measured - columns @ (gain, late)
        precision = np.linalg.pinv(columns.T @ columns)[1, 1]
        error_s = float(np.sqrt(left @ left / size * precision) / abs(gain)) if gain else np.inf
        lag = start - best
        step, about = (lag - about, lag) if found else (0, lag)
        middle = start + size // 2
        found.append((number, middle, run.distance_m[middle] - run.distance_m[0],
                      lag / run.rate_hz + (late / gain if gain else 0.0), error_s,
                      np.nan if run.timed else max(float(run.speed_mps[start : start + size].mean()), SLOWEST_MPS)))
    return found


def _centred(values: Array, groups: npt.NDArray[np.intp]) -> Array:
    sums, counts = np.bincount(groups, values), np.bincount(groups)
    return np.asarray(values - (sums / np.maximum(counts, 1))[groups])


def _slope(values: Array, against: Array, freedom: int) -> Trend:
    """Values = slope * against, with Student's test of it."""
    from scipy.stats import t

    size = float(against @ against)
    if not size > 0:
        return Trend()
    slope = float(values @ against) / size
    left = values - slope * against
    error = float(np.sqrt(left @ left / freedom / size))
    return Trend(slope, error, float(2 * t.sf(abs(slope) / error, freedom)) if error > 0 else float("nan"))
