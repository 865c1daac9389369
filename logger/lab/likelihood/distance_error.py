"""The distance error of a run, as a Gaussian process, and the errors of its recorder.

Problem: one recorder's distance is right to millimetres after a minute, another integrates a speed that is off by some
centimetres a second, now more and now less. Solution: the distance error is the sum of an offset at the start, a scale
error, and a random walk, drawn as a smooth curve (a spline whose coefficients are a random walk: P. Eilers and B. Marx,
Statistical Science 11, 1996); whatever in the distance is rougher than any car drives is the recorder's as well. The
sizes of the first three maximise the evidence of the runs: the likelihood with the error integrated out (D. J. C.
MacKay, Neural Computation 4, 1992), under a prior around a good recorder's. Where a run states a standard error of its
places, its start and its walk are larger in proportion; where its places are a receiver's, an unknown delay of the
receiver shifts all of the run by one time. So does, where they were found by the road, how late the model was that it
was felt with: by how much the phase of a body's bounce is wrong, and whatever was late in the record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cache, cached_property
from math import comb
from typing import TYPE_CHECKING

import numpy as np

from logger.arrays import Array
from logger.bounds import CONFLICT_SIGMA, UNUSUAL_SIGMA
from logger.lab.likelihood.priors import Tolerance
from logger.runs import RECEIVER_ERROR_LASTS_S, SENSOR, SLOWEST_MPS, Past, Run

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_KNOT_S, _MOST_KNOTS = 1 / 3, 360
"""Knots lie so far apart; a run that would have more has them farther apart. Measured: with half a second, a speed that
is wrong by 0.1 m/s now more and now less leaves a tenth more than the noise. The most, a run of two minutes: a fit's
time grows with the square of their number."""

_HELD = 1e-6  # of its deviation, within which a number is held


@dataclass(frozen=True)
class ErrorSize:
    """Standard deviations of a distance error: of the start [m], of the walk after one second, growing with the root
    of the time [m], and of the scale, as a share."""

    start_m: float = 0.004
    walk_m: float = 0.004
    scale: float = 0.0003

    @property
    def logs(self) -> Array:
        """Natural logarithms of the three sizes (3,)."""
        return np.log(astuple(self))

    @staticmethod
    def of(logs: Array) -> ErrorSize:
        """The sizes with these natural logarithms (3,)."""
        return ErrorSize(*map(float, np.exp(logs)))

    @property
    def is_unusually_large(self) -> bool:
        """Whether start or scale errors are much larger than a good recorder's: a late clock or a wrong speed may be
        the cause."""
        return max(self.start_m / USUAL.start_m, self.scale / USUAL.scale) > UNUSUAL_SIGMA

    @property
    def cost(self) -> float:
        """Minus twice the log of the prior density, without its constant."""
        return float((((self.logs - USUAL.logs) / _LOG_DEVIATIONS) ** 2).sum())


USUAL = ErrorSize()
"""The sizes of a good recorder's distance error."""


def usual_size(run: Run) -> ErrorSize:
    """Sizes of the distance error of a run's recorder: a good one's, or larger where the run states a larger standard
    error of its places. An error that lasts for a time T walks by the root of 2 / T of its deviation in a second (a
    first-order Gauss-Markov process)."""
    off_m = run.facts.place_std_m or 0.0
    return ErrorSize(max(USUAL.start_m, off_m), max(USUAL.walk_m, off_m * float(np.sqrt(2 / RECEIVER_ERROR_LASTS_S))))


# Standard deviations of the logarithms of the three sizes (a judgement). A walk of centimetres is common; a start or a
# scale error ten times as large as usual is a late clock or a wrong wheel radius, which are effects.
_LOG_DEVIATIONS = np.array([0.5, 1.5, 0.5])


@dataclass(frozen=True, eq=False)
class RecordError:
    """Errors of the record of one run, by numbers k: those of its distance (coefficients of the spline, the delay
    of its places if they may have one, the scale, the share of its roughness), then two of its recorder (gain, droop),
    gain and lag of each further signal. None of these sensors is quite right, and one that is wrong by a per cent or
    read a millisecond later would else contradict the others wherever it is hundreds of times its noise.

    basis          what each of the distance's numbers adds to the distance (k - 2, n) [m]; sparse: of a spline's, four
                   are not 0 at a sample
    knot_s         time between the knots of the spline
    delay_std_s    standard error of the delay of its places; None: they have none
    scale_std      of the common scale of the car's masses and forces, as a share, where the runs show forces: where the
                   first signal's gain is known better, both do the same, and it is held; 0: it is free
    """

    run: Run
    basis: csr_array
    tolerance: Tolerance
    knot_s: float
    delay_std_s: float | None = None
    scale_std: float = 0.0

    @staticmethod
    def of(run: Run, tolerance: Tolerance) -> RecordError:
        """The record error of a run."""
        from scipy.sparse import csr_array, vstack

        lasts_s = (run.count - 1) / run.rate_hz
        pieces = min(max(1, round(lasts_s / _KNOT_S)), _MOST_KNOTS)
        delay_std_s = run.facts.late_std_s
        late = [run.speed_mps] if delay_std_s else []
        basis = csr_array(vstack([_cubic_b_splines(pieces, run.count), *map(csr_array, (
            one[None] for one in (*late, run.distance_m - run.distance_m[0], -_roughness(run))))]))
        return RecordError(run, basis, tolerance, lasts_s / pieces, delay_std_s)

    @property
    def count(self) -> int:
        """Number of the numbers k."""
        return self.places + len(self._recorder_deviations)

    @cached_property
    def _recorder_deviations(self) -> Array:
        """Standard deviations of the numbers of the recorder and of further signals (2 + 2 s,), and of the zero of a
        part's force. What a part pulls back with at its rest depends on gas, weight and how its sensor was set to zero:
        any force as large as those measured is as likely. Channels that are read in turn lie anywhere within half a
        sample."""
        signals = (self.run.facts.main, *self.run.signals)
        gain, *gains = (self.tolerance.gain_of(one) for one in signals)
        gain = gain if gain >= self.scale_std else _HELD * gain
        zero = [float(np.sqrt(np.mean(self.run.kept_readings_mps2**2))) or 1.0] if self.has_zero else []
        return np.array([gain, self.tolerance.droop, *gains, *[self._lag_deviation_s] * len(gains), *zero])

    @property
    def _lag_deviation_s(self) -> float:
        """Of channels that are read in turn, each anywhere within half a sample: uniform."""
        return float(1 / (self.run.rate_hz * np.sqrt(12)))

    @property
    def has_zero(self) -> bool:
        """Whether the zero of what was measured is the last of k."""
        return self.run.facts.main.measures == "force"

    def gain_deviations(self) -> dict[str, float]:
        """Standard deviations of the signals' gains, by name."""
        first, _, *more = self._recorder_deviations
        names = [self.run.facts.main.name, *(one.name for one in self.run.signals)]
        return dict(zip(names, [first, *more[: len(names) - 1]], strict=True))

    def signal_gains(self, k: Array) -> Array:
        """By what share each further signal reads too much (s,)."""
        return k[self.places + 2 : self.places + 2 + len(self.run.signals)]

    def _signal_lags_s(self, k: Array) -> Array:
        """By how much each further signal is later than the first (s,)."""
        return k[self.places + 2 + len(self.run.signals) :][: len(self.run.signals)]

    @property
    def places(self) -> int:
        """Number of the numbers of the distance, the first of k."""
        return int(self.basis.shape[0])

    @property
    def spline_count(self) -> int:
        """Number of coefficients of the spline, the first of k."""
        return self.places - (2 if self.delay_std_s is None else 3)

    def precision(self, size: ErrorSize) -> Array:
        """Inverse covariance of k (k, k)."""
        found = self._walk_precision / (self._start_and_walk_m(size)[1] ** 2 * self.knot_s)
        np.einsum("ii->i", found)[self.places - 1 :] += 1.0, *self._recorder_deviations**-2
        if self.delay_std_s is not None:
            found[self.spline_count, self.spline_count] += self.delay_std_s**-2
        return found + (self.trend * self.trend_precisions(size)) @ self.trend.T

    @cached_property
    def trend(self) -> Array:
        """Columns (k, t) whose products with k are the start and the scale error."""
        found = np.zeros((self.count, 2))
        found[: self.spline_count, 0] = self.basis[: self.spline_count, [0]].toarray()[:, 0]
        found[self.places - 2, 1] = 1.0
        return found

    def trend_precisions(self, size: ErrorSize) -> Array:
        """Prior precisions of start and scale error (t,)."""
        return np.array([self._start_and_walk_m(size)[0], size.scale]) ** -2

    def _start_and_walk_m(self, size: ErrorSize) -> tuple[float, float]:
        """Start and walk [m] of this run, given those of a good recorder."""
        usual = usual_size(self.run)
        return size.start_m * (usual.start_m / USUAL.start_m), size.walk_m * (usual.walk_m / USUAL.walk_m)

    @property
    def _pace(self) -> Array:
        """What the numbers of the distance move, by time (n,) [m/s]."""
        return np.maximum(self.run.speed_mps, SLOWEST_MPS)

    @cached_property
    def _walk_precision(self) -> Array:
        """Precision (k, k) of a random walk with steps of unit variance."""
        steps = np.diff(np.eye(self.spline_count, self.count), axis=0)
        return steps.T @ steps

    def log_determinant(self, size: ErrorSize) -> float:
        """Logarithm of the determinant of the precision."""
        start_m, walk_m = self._start_and_walk_m(size)
        walk = -(self.spline_count - 1) * np.log(walk_m**2 * self.knot_s)
        others = [start_m, size.scale, *self._recorder_deviations, self.delay_std_s or 1.0]
        return float(walk - 2 * np.log(others).sum())

    def distance_error_m(self, k: Array) -> Array:
        """Distance driven minus distance recorded (n,) [m]."""
        return np.asarray(self.basis.T @ k[: self.places])

    def without_trend(self, k: Array) -> Array:
        """The numbers (k,) without start and scale error: a straight line along the way is subtracted. A delay is
        described by the spline then."""
        moved, way = self.distance_error_m(k), self.run.distance_m - self.run.distance_m[0]
        trend = np.polyval(np.polyfit(way, moved, 1), way) if np.ptp(way) > 0 else moved.mean()
        found = self.coefficients_of(moved - trend)
        roughness = self.places - 1
        found[roughness:] = k[roughness:]
        return found

    def without_distance_error(self, k: Array) -> Array:
        """The numbers (k,) with an exact distance and the same recorder."""
        return np.concatenate([np.zeros(self.places), k[self.places :]])

    def coefficients_of(self, distance_error_m: Array) -> Array:
        """Numbers (k,) of the least-squares spline through a distance error (n,) [m], with an exact recorder."""
        from scipy.sparse.linalg import spsolve

        spline = self.basis[: self.spline_count]
        curve = spsolve((spline @ spline.T).tocsc(), spline @ distance_error_m)
        return np.concatenate([curve, np.zeros(self.count - len(curve))])

    def with_recorder_error(self, prediction: Array, k: Array) -> Array:
        """A prediction (n,), or more signals joined to it, as a recorder with these numbers (k,) records it."""
        main, numbers = self.run.main(prediction), k[self.places : self.places + 2]
        found = main.copy()
        if numbers.any():
            found += numbers @ _recorder_slopes(main, derivative(main, self.run.rate_hz), self.run)
        if self.has_zero:
            found += k[-1] * self._zero_slope
        if len(main) == len(prediction):
            return found
        others = prediction[len(main) :].reshape(-1, len(main))
        if (lags_s := self._signal_lags_s(k)).any():
            others = np.stack([_later(one, lag_s, self.run.rate_hz) for one, lag_s in zip(others, lags_s, strict=True)])
        return np.concatenate([found, (others * (1 + self.signal_gains(k))[:, None]).ravel()])

    @cached_property
    def _zero_slope(self) -> Array:
        """What a zero of 1 adds to the samples (n,)."""
        return self.run.in_band(np.ones(self.run.count))

    def slopes(self, prediction: Array) -> csr_array:
        """Derivatives of a prediction (n,), or of more signals joined to it, by each of k: a sparse array (k, n) [m/s2
        per unit]. The distance moves all signals; the recorder's numbers are those of the sensor, and each gain that of
        its signal."""
        from scipy.sparse import block_array, csr_array

        n, found, count = self.run.count, [], len(self._recorder_deviations)
        for signal, start in enumerate(range(0, len(prediction), n)):
            rise = derivative(prediction[start : start + n], self.run.rate_hz)
            by_place = rise / self._pace
            moved = csr_array((self.basis.data * by_place[self.basis.indices], self.basis.indices, self.basis.indptr),
                              self.basis.shape)
            recorded = np.zeros((count, n))
            if start:
                recorded[1 + signal] = prediction[start : start + n]
                recorded[1 + len(self.run.signals) + signal] = -rise
            else:
                recorded[:2] = _recorder_slopes(prediction[:n], rise, self.run)
                if self.has_zero:
                    recorded[-1] = self._zero_slope
            found.append([[moved], [csr_array(recorded)]])
        return csr_array(block_array([[column[row][0] for column in found] for row in range(2)], format="csr"))


class RigRecordError(RecordError):
    """Errors of the record of a run on a rig: numbers k of its clock and lag, its recorder and signals. What moves a
    rig and what the rig does may be recorded by two clocks, one of which runs a little faster, and lie up to half a
    sample apart in the middle; of a signal alone an effect does what the lag does, which is not there. There is no
    distance error: one that was fitted nevertheless would absorb physics. Methods as of ``RecordError``."""

    @staticmethod
    def of(run: Run, tolerance: Tolerance, scale_std: float = 0.0) -> RigRecordError:
        """The record error of a run; ``scale_std`` as of ``RecordError``."""
        from scipy.sparse import csr_array

        from_middle_s = (np.arange(run.count) - 0.5 * (run.count - 1)) / run.rate_hz
        late = [np.ones(run.count)] * bool(run.signals)
        return RigRecordError(run, csr_array(np.stack([from_middle_s, *late])), tolerance, 1.0, None, scale_std)

    @property
    def spline_count(self) -> int:
        return 0

    @property
    def trend(self) -> Array:
        return np.empty((self.count, 0))

    @property
    def deviations(self) -> Array:
        """Standard deviations of k. What nothing drives has no second clock."""
        clock = np.array([self.tolerance.clock, self._lag_deviation_s])[: self.places]
        return np.concatenate([clock * (_HELD if self.run.past is Past.FREE else 1.0), self._recorder_deviations])

    @property
    def _pace(self) -> Array:
        return np.ones(self.run.count)

    def precision(self, size: ErrorSize) -> Array:
        return np.diag(self.deviations**-2)

    def trend_precisions(self, size: ErrorSize) -> Array:
        return np.empty(0)

    def log_determinant(self, size: ErrorSize) -> float:
        return -2 * float(np.log(self.deviations).sum())

    def distance_error_m(self, k: Array) -> Array:
        return np.zeros(self.run.count)

    @cached_property
    def _clock(self) -> Array:
        """By how much each sample is early, of a clock and a lag of 1 (2, n) or (1, n)."""
        return np.asarray(self.basis.toarray())  # asked for with each prediction

    def with_recorder_error(self, prediction: Array, k: Array) -> Array:
        """As of ``RecordError``."""
        if k[: self.places].any():
            late_s = -(k[: self.places] @ self._clock)
            prediction = np.concatenate([_later(one, late_s, self.run.rate_hz)
                                         for one in prediction.reshape(-1, self.run.count)])
        return super().with_recorder_error(prediction, k)

    @property
    def instruments(self) -> list[tuple[object, ...]]:
        """Of which instrument each of k is: runs of one instrument have one clock and gain. The zero of a part's force
        is each run's own."""
        names = [*["clock", "lag"][: self.places], "gain", "droop",
                 *(f"{what} of {one.name}" for what in ("gain", "lag") for one in self.run.signals)]
        facts = self.run.facts
        return [*((name, facts.step_mps2, facts.range_mps2) for name in names),
                *[("zero", self.run.name)] * self.has_zero]

    def without_trend(self, k: Array) -> Array:
        return k

    def coefficients_of(self, distance_error_m: Array) -> Array:
        return np.zeros(self.count)


def record_error(run: Run, tolerance: Tolerance, scale_std: float = 0.0) -> RecordError:
    """The record error of a run, on a road or on a rig; ``scale_std`` as of ``RecordError``."""
    return RigRecordError.of(run, tolerance, scale_std) if run.timed else RecordError.of(run, tolerance)


def zero_of(errors: Sequence[RecordError], record: Sequence[Array]) -> tuple[float, list[Array]]:
    """The zero of the force [N] that runs of a part on its bench have, in the mean, by numbers (k,) per run, and the
    numbers of records that have it and no other error; 0 and exact records of others."""
    found = [float(k[-1]) if one.has_zero else 0.0 for one, k in zip(errors, record, strict=True)]
    zero, exact = float(np.mean(found)), [np.zeros(one.count) for one in errors]
    for k in exact:
        k[-1] = zero
    return zero, exact


def unusual_distance_error_m(errors: Sequence[RecordError], record: Sequence[Array]) -> float:
    """The largest distance error (numbers (k,) per run) if it is larger than a good recorder's, or than the run states;
    else 0 [m]."""
    found = 0.0
    for one, k in zip(errors, record, strict=True):
        run, usual = one.run, usual_size(one.run)
        usual_m = np.sqrt(usual.start_m**2 + usual.walk_m**2 * run.count / run.rate_hz
                          + (usual.scale * np.ptp(run.distance_m)) ** 2
                          + ((one.delay_std_s or 0.0) * run.speed_mps.max()) ** 2)
        off_m = float(np.abs(one.distance_error_m(k)).max())
        found = max(found, off_m if off_m > UNUSUAL_SIGMA * usual_m else 0.0)
    return found


def signals_off(errors: Sequence[RecordError], record: Sequence[Array]) -> dict[str, float]:
    """By what share signals read more than all else says that is known, numbers (k,) per run, by name: those whose gain
    is in conflict with its prior, but for the sensor's acceleration, whose gain is an effect."""
    found: dict[str, list[float]] = {}
    known: dict[str, float] = {}
    for one, k in zip(errors, record, strict=True):
        signals = (one.run.facts.main, *one.run.signals)
        for signal, gain in zip(signals, [k[one.places], *one.signal_gains(k)], strict=True):
            if signal.name != SENSOR:
                found.setdefault(signal.name, []).append(float(gain))
        known |= one.gain_deviations()
    shares = {name: float(np.mean(gains)) for name, gains in found.items()}
    return {name: share for name, share in shares.items() if abs(share) > CONFLICT_SIGMA * known[name]}


def _cubic_b_splines(pieces: int, count: int) -> csr_array:
    """Cubic B-splines with a knot after each of so many pieces, at ``count`` places from end to end (pieces + 3, n)."""
    from scipy.interpolate import BSpline
    from scipy.sparse import csr_array

    return csr_array(BSpline.design_matrix(np.linspace(0, pieces, count), np.arange(-3.0, pieces + 4), 3).T)


def _roughness(run: Run) -> Array:
    """The part of a run's distance (n,) that is rougher than a car drives [m]: what a moving cubic fit over three knots
    leaves (A. Savitzky and M. Golay, Analytical Chemistry 36, 1964). The fit at an end serves up to there."""
    half = min(round(3 * _KNOT_S * run.rate_hz), run.count - 1) // 2
    if half < 2:
        return np.zeros(run.count)
    way = run.distance_m - run.distance_m[0]
    cubic = np.vander(np.linspace(-1, 1, 2 * half + 1), 4)
    fits = cubic @ np.linalg.pinv(cubic)  # at each sample of a window
    ends = fits[:half] @ way[: 2 * half + 1], fits[half + 1 :] @ way[-2 * half - 1 :]
    return np.asarray(way - np.concatenate([ends[0], np.convolve(way, fits[half], "valid"), ends[1]]))


def _recorder_slopes(prediction: Array, rise: Array, run: Run) -> Array:
    """Derivatives (2, n) by the recorder's numbers of a prediction (n,) that changes at these rates (n,)."""
    return np.stack([prediction, derivative(rise, run.rate_hz) / (2 * np.pi * run.rate_hz) ** 2])


def _later(samples: Array, late_s: float | Array, rate_hz: float) -> Array:
    """Samples (n,) that come later by a small part of their waves: two terms of Taylor's series."""
    rise = derivative(samples, rate_hz)
    return np.asarray(samples - late_s * rise + 0.5 * late_s**2 * derivative(rise, rate_hz))


def derivative(samples: Array, rate_hz: float) -> Array:
    """Derivative of evenly spaced samples (n,), within 0.03 % up to a third of their rate: central differences of order
    48 (B. Fornberg, Mathematics of Computation 51, 1988). The difference of two neighbours would give half of it at
    30 Hz."""
    taps = _difference_taps(24)
    half = len(taps) // 2
    if len(samples) > half:
        past_ends = np.concatenate([2 * samples[0] - samples[half:0:-1], samples,
                                    2 * samples[-1] - samples[-2 : -half - 2 : -1]])
    else:
        past_ends = np.pad(samples, half, mode="reflect", reflect_type="odd")  # again and again
    return np.asarray(np.convolve(past_ends, taps, mode="valid") * rate_hz)


@cache
def _difference_taps(half: int) -> Array:
    """Taps (2 half + 1,) of central differences of order 2 half, the latest sample first."""
    later = [(-1.0) ** (k + 1) * comb(2 * half, half - k) / (k * comb(2 * half, half)) for k in range(1, half + 1)]
    return np.array([*later[::-1], 0.0, *(-one for one in later)])
