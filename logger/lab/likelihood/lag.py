"""The lag of the measurement behind the model, window by window along each run.

Problem: a clock that is late, a position that is off and a speed that is off by a factor all leave residuals like those
of missing physics. Solution: in short windows the measurement is correlated with the model at every lag within reach of
the last one, and around the best one the lag is found between samples, to first order (with the gain free). A lag that
is a constant time is a clock's, a constant length a position's, and one that grows along the way a wrong speed's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Indices
from logger.runs import LATE_WITHIN_S, SLOWEST_MPS, Run

WINDOW_S = 2.56
"""Length of a window: 256 samples at 100 Hz, a quick transform, two to four bounces of a body."""
_LEAST_FREEDOM = 5
"""No slope is estimated with fewer degrees of freedom: Student's t at 5 % is above 2.6 there. A judgement."""
RESOLVED_M = 0.1
"""A fifth of the shortest wave that is felt: places that are known better need no search."""


@dataclass(frozen=True, eq=False)
class Lags:
    """Windows (k,) of all runs in which the measurement correlates with the model.

    run               number of the run it is in
    middle            the sample in its middle
    along_m           how far into the run [m]
    lag_s, error_s    how much later than the model the measurement is: the model is ahead where it is above 0
    speed_mps         in the window; NaN on a rig
    """

    run: Indices
    middle: Indices
    along_m: Array
    lag_s: Array
    error_s: Array
    speed_mps: Array

    @property
    def lag_m(self) -> Array:
        """The lags as lengths of road (k,) [m]."""
        return self.lag_s * self.speed_mps


@dataclass(frozen=True)
class Trend:
    """A slope with its standard error and the p-value of no slope; NaN where nothing is known."""

    value: float = float("nan")
    error: float = float("nan")
    p_value: float = float("nan")


def lags(runs: Sequence[Run], predictions: Sequence[Array]) -> Lags:
    """Lags of runs behind a model's predictions (n,), or ((1 + s) n,) of all signals."""
    rows: list[tuple[float, ...]] = []
    for number, (run, prediction) in enumerate(zip(runs, predictions, strict=True)):
        rows += _windows(number, run, run.main(prediction))
    table = np.array(rows).reshape(-1, 6).T
    return Lags(table[0].astype(np.intp), table[1].astype(np.intp), *table[2:])


def offset_by_lag_m(run: Run, prediction: Array) -> Array:
    """Distance error (n,) [m] that the lags behind a prediction (n,) amount to, linear between windows; 0 without
    windows, and on a rig."""
    windows = None if run.timed else lags([run], [prediction])
    if windows is None or not len(windows.run):
        return np.zeros(run.count)
    places_m = np.maximum.accumulate(windows.along_m)
    return np.asarray(np.interp(run.distance_m - run.distance_m[0], places_m, -windows.lag_m))


def offset_by_correlation_m(distance_m: Array, measured_mps2: Array, prediction: Array, road_m: tuple[float, float],
                            reach_m: float) -> float | None:
    """The constant distance error within ``reach_m`` either way at which the measurement correlates most with a
    prediction (n,) [m]; None where the car hardly moved.

    distance_m    as recorded (n,)
    road_m        where the road is known: from, to
    """
    from scipy.signal import correlate

    grid_m = np.arange(distance_m[0], distance_m[-1], RESOLVED_M)
    if len(grid_m) < 2:
        return None
    rising = distance_m + 1e-9 * np.arange(len(distance_m))
    inside = ((grid_m >= road_m[0]) & (grid_m <= road_m[1])).astype(float)
    measured, predicted = (_equalised(np.interp(grid_m, rising, one)) * inside for one in (measured_mps2, prediction))
    reach = min(round(reach_m / RESOLVED_M), len(grid_m) - 1)
    correlation = correlate(predicted, measured, "full", "fft")[len(grid_m) - 1 - reach : len(grid_m) + reach]
    return (int(correlation.argmax()) - reach) * RESOLVED_M


def _equalised(samples: Array) -> Array:
    """Samples along the road (n,) over their r.m.s. of 20 m, some car lengths: one pothole shall not decide."""
    size = round(20.0 / RESOLVED_M)
    loud = np.sqrt(np.convolve(samples**2, np.full(size, 1 / size), "same"))[: len(samples)]
    return samples / np.maximum(loud, 0.3 * np.sqrt(np.mean(samples**2)) + 1e-9)


def lag_drift(windows: Lags) -> Trend:
    """Growth of the lag per length of road [m/m], with a free offset of each run."""
    runs = np.unique(windows.run)
    freedom = len(windows.run) - len(runs) - 1
    if freedom < _LEAST_FREEDOM:
        return Trend()
    lag_m, along_m = (_centred(one, windows.run) for one in (windows.lag_m, windows.along_m))
    return _slope(lag_m, along_m, freedom)


def constant_lag(windows: Lags) -> tuple[Trend, Trend, bool | None]:
    """The lag as one time [s] and as one length [m], and whether the time fits better (True) or the length (False);
    None: slow and fast speeds differ by less than a third, and cannot distinguish them (a judgement)."""
    freedom = len(windows.run) - 1
    if freedom < _LEAST_FREEDOM:
        return Trend(), Trend(), None
    ones = np.ones_like(windows.lag_s)
    time = _slope(windows.lag_s, ones, freedom)
    length = _slope(windows.lag_s, 1 / windows.speed_mps, freedom)
    slow, fast = np.quantile(windows.speed_mps, (0.1, 0.9))
    squares_time = float(np.sum((windows.lag_s - time.value) ** 2))
    squares_length = float(np.sum((windows.lag_s - length.value / windows.speed_mps) ** 2))
    return time, length, squares_time < squares_length if fast > 4 / 3 * slow else None


def _windows(number: int, run: Run, prediction: Array) -> list[tuple[float, ...]]:
    size, reach = round(WINDOW_S * run.rate_hz), round(LATE_WITHIN_S * run.rate_hz)
    derivative = np.gradient(prediction, 1 / run.rate_hz)
    read = run.read
    found: list[tuple[float, ...]] = []
    about = step = 0
    for start in range(run.first, run.count - size + 1, size):
        measured = run.measured_mps2[start : start + size]
        low = max(0, start - about - step - reach)
        high = min(run.count - size, start - about - step + reach)
        if high < low or np.mean(read[start : start + size]) < 0.9:
            continue  # lest the filling of the rest decides; that of a tenth moves a lag by less than its error
        shifted = np.lib.stride_tricks.sliding_window_view(prediction[low : high + size], size)
        scale = np.sqrt((shifted**2).sum(axis=1) * (measured @ measured))
        correlation = np.divide(shifted @ measured, scale, out=np.zeros(len(shifted)), where=scale > 0)
        best = low + int(correlation.argmax())
        if correlation[best - low] < 0.5:  # the model explains less than a quarter of the window
            continue
        part = slice(best, best + size)
        columns = np.stack([prediction[part], -derivative[part]], axis=1)
        (gain, late), *_ = np.linalg.lstsq(columns, measured, rcond=None)
        residual = measured - columns @ (gain, late)
        precision = np.linalg.pinv(columns.T @ columns)[1, 1]
        error_s = float(np.sqrt(residual @ residual / size * precision) / abs(gain)) if gain else np.inf
        lag = start - best
        step, about = (lag - about, lag) if found else (0, lag)
        middle = start + size // 2
        found.append((number, middle, run.distance_m[middle] - run.distance_m[0],
                      lag / run.rate_hz + (late / gain if gain else 0.0), error_s,
                      np.nan if run.timed else max(float(run.speed_mps[start : start + size].mean()), SLOWEST_MPS)))
    return found


def _centred(values: Array, groups: Indices) -> Array:
    sums, counts = np.bincount(groups, values), np.bincount(groups)
    return np.asarray(values - (sums / np.maximum(counts, 1))[groups])


def _slope(values: Array, against: Array, freedom: int) -> Trend:
    """Slope of values over another variable through 0, with Student's test."""
    from scipy.special import stdtr

    size = float(against @ against)
    if not size > 0:
        return Trend()
    slope = float(values @ against) / size
    residual = values - slope * against
    error = float(np.sqrt(residual @ residual / freedom / size))
    return Trend(slope, error, float(2 * stdtr(freedom, -abs(slope) / error)) if error > 0 else float("nan"))
