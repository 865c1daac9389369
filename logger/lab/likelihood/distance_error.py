"""The error of a run's distance, as a Gaussian process, and of its recorder.

Problem: one recorder's distance is right to millimetres after a minute, another integrates a speed that is off by some
centimetres a second, now more and now less. Solution: the error begins with a start, grows with a factor, and walks at
random in between, as a smooth curve (a spline whose coefficients are a random walk: P. Eilers and B. Marx, Statistical
Science 11, 1996); what of the distance is rougher than any car drives is the recorder's as well. How large each of the
first three is, the evidence of the runs says: the likelihood with the error integrated out (D. J. C. MacKay, Neural
Computation 4, 1992), under a prior around what a good recorder does. A run that says how far off its places may be
begins, and walks, as many times farther off; and where places are those of a receiver, what this is late by moves all
of a run by a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cache, cached_property
from math import comb
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.lag import SLOWEST_MPS
from logger.lab.likelihood.priors import Tolerance
from logger.runs import Run

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Array = npt.NDArray[np.float64]

_KNOT_S, _MOST_KNOTS = 1 / 3, 360
"""Knots lie so far apart; a run that would have more has them farther apart. Measured: with half a second, a speed that
is wrong by 0.1 m/s now more and now less leaves a tenth more than the noise."""
_UNUSUAL = 3.0  # standard deviations
_RECEIVER_LASTS_S = 60.0
"""A receiver's places are wrong in the same way for about so long (``extraction.registration``)."""


@dataclass(frozen=True)
class ErrorSize:
    """Standard deviations of a distance error: where a run begins [m], of the walk after one second, growing with the
    root of the time [m], and of the factor, as a share."""

    start_m: float = 0.004
    walk_m: float = 0.004
    scale: float = 0.0003

    @property
    def logs(self) -> Array:
        """(3,) natural logarithms."""
        return np.log(astuple(self))

    @staticmethod
    def of(logs: Array) -> ErrorSize:
        """The reverse."""
        return ErrorSize(*map(float, np.exp(logs)))

    @property
    def is_unusual(self) -> bool:
        """Whether starts or factors are much farther off than a good recorder's: a late clock or a wrong speed may be
        the cause."""
        return max(self.start_m / USUAL.start_m, self.scale / USUAL.scale) > _UNUSUAL

    @property
    def cost(self) -> float:
        """Minus twice the log of the prior density, without its constant."""
        return float((((self.logs - USUAL.logs) / _LOG_DEVIATIONS) ** 2).sum())


USUAL = ErrorSize()
"""Of a good recorder."""


def usual_of(run: Run) -> ErrorSize:
    """Of a run's recorder: a good one's, or more if the run says that its places are off by more. What is wrong by the
    same for a time T walks by the root of 2 / T of its deviation in a second (a first-order Gauss-Markov process)."""
    off_m = run.facts.place_std_m or 0.0
    return ErrorSize(max(USUAL.start_m, off_m), max(USUAL.walk_m, off_m * float(np.sqrt(2 / _RECEIVER_LASTS_S))))


# Priors of the logarithms of the three sizes. A walk of centimetres is common; a start or a factor that is ten times
# as far off as usual is a late clock or a wrong wheel radius, which are effects.
_LOG_DEVIATIONS = np.array([0.5, 1.5, 0.5])


@dataclass(frozen=True, eq=False)
class RecordError:
    """How the record of one run may be off, by numbers k: those of its distance (coefficients of the curve, what its
    receiver is late by if its places are a receiver's, the factor, the share of its roughness), then two of its
    recorder (gain, droop).

    basis     (k - 2, n) of the distance [m]
    knot_s    between the knots of the curve
    late_s    deviation of what the receiver is late by; None: places are not a receiver's
    """

    run: Run
    basis: Array
    tolerance: Tolerance
    knot_s: float
    late_s: float | None = None

    @staticmethod
    def of(run: Run, tolerance: Tolerance) -> RecordError:
        """That of a run."""
        lasts_s = (run.count - 1) / run.rate_hz
        pieces = min(max(1, round(lasts_s / _KNOT_S)), _MOST_KNOTS)
        late_s = run.facts.delay_std_s or None if run.facts.places_by == "receiver" else None
        late = [run.speed_mps] if late_s else []
        basis = np.vstack([_curves(pieces, run.count), *late, run.distance_m - run.distance_m[0], -_roughness(run)])
        return RecordError(run, basis, tolerance, lasts_s / pieces, late_s)

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return len(self.basis) + 2

    @property
    def coefficients(self) -> int:
        """How many of them, the first ones, are of the curve."""
        return len(self.basis) - (2 if self.late_s is None else 3)

    def precision(self, size: ErrorSize) -> Array:
        """Inverse covariance of k (k, k)."""
        found = self._walk_precision / (self._own(size)[1] ** 2 * self.knot_s)
        np.einsum("ii->i", found)[-3:] += 1.0, self.tolerance.gain**-2, self.tolerance.droop**-2
        if self.late_s is not None:
            found[self.coefficients, self.coefficients] += self.late_s**-2
        return found + (self.trend * self.trend_precisions(size)) @ self.trend.T

    @cached_property
    def trend(self) -> Array:
        """Start and factor are products of k with these columns (k, t)."""
        found = np.zeros((self.count, 2))
        found[: self.coefficients, 0], found[-4, 1] = self.basis[: self.coefficients, 0], 1.0
        return found

    def trend_precisions(self, size: ErrorSize) -> Array:
        """Of start and factor (t,)."""
        return np.array([self._own(size)[0], size.scale]) ** -2

    def _own(self, size: ErrorSize) -> tuple[float, float]:
        """Start and walk [m] of this run, if those of a good recorder were of a size."""
        usual = usual_of(self.run)
        return size.start_m * (usual.start_m / USUAL.start_m), size.walk_m * (usual.walk_m / USUAL.walk_m)

    @cached_property
    def _walk_precision(self) -> Array:
        """The precision (k, k) of the walk, if each of its steps had a deviation of one."""
        steps = np.diff(np.eye(self.coefficients, self.count), axis=0)
        return steps.T @ steps

    def log_determinant(self, size: ErrorSize) -> float:
        """Of the precision."""
        start_m, walk_m = self._own(size)
        walk = -(self.coefficients - 1) * np.log(walk_m**2 * self.knot_s)
        others = [start_m, size.scale, self.tolerance.gain, self.tolerance.droop, self.late_s or 1.0]
        return float(walk - 2 * np.log(others).sum())

    def moved_m(self, k: Array) -> Array:
        """By how much the car was farther than its distance signal said (n,)."""
        return np.asarray(self._sparse_basis @ k[: len(self.basis)])

    @cached_property
    def _sparse_basis(self) -> csr_array:
        """The same (n, k - 2), of which four in a row are of the curve."""
        from scipy.sparse import csr_array

        return csr_array(self.basis.T)

    def without_trend(self, k: Array) -> Array:
        """The same error (k,) with its start and its factor taken out, as a straight line along the way; what its
        receiver is late by is of the curve then."""
        moved, way = self.moved_m(k), self.run.distance_m - self.run.distance_m[0]
        trend = np.polyval(np.polyfit(way, moved, 1), way) if np.ptp(way) > 0 else moved.mean()
        found = self.through(moved - trend)
        roughness = len(self.basis) - 1
        found[roughness:] = k[roughness:]
        return found

    def in_place(self, k: Array) -> Array:
        """The same recorder (k,) where the distance is as it was recorded."""
        return np.concatenate([np.zeros(len(self.basis)), k[len(self.basis):]])

    def through(self, moved_m: Array) -> Array:
        """The numbers (k,) of the curve that comes nearest to a distance farther by this (n,) [m], its recorder as it
        is."""
        curve, *_ = np.linalg.lstsq(self.basis[: self.coefficients].T, moved_m, rcond=None)
        return np.concatenate([curve, np.zeros(self.count - len(curve))])

    def recorded(self, prediction: Array, k: Array) -> Array:
        """A prediction (n,), or more signals joined to it, as such a recorder has it."""
        main = self.run.main(prediction)
        rise = rate_of_change(main, self.run.rate_hz)
        found = np.asarray(main + k[len(self.basis) :] @ _by_recorder(main, rise, self.run))
        return np.concatenate([found, prediction[len(main) :]]) if len(main) < len(prediction) else found

    def slopes(self, prediction: Array) -> Array:
        """What each of k does to a prediction (n,), or more signals joined to it: (k, n) [m/s2 per unit]. They are all
        where the car was; the recorder's numbers are those of the sensor."""
        n, places = self.run.count, len(self.basis)
        found = np.empty((self.count, len(prediction)))
        for start in range(0, len(prediction), n):
            rise = rate_of_change(prediction[start : start + n], self.run.rate_hz)
            by_place = rise / np.maximum(self.run.speed_mps, SLOWEST_MPS)
            np.multiply(self.basis, by_place, out=found[:places, start : start + n])
            found[places:, start : start + n] = 0.0 if start else _by_recorder(prediction[:n], rise, self.run)
        return found


def unusual_m(errors: Sequence[RecordError], record: Sequence[Array]) -> float:
    """By how much a distance is off at most (numbers (k,) per run), if that is more than a good recorder's is, or than
    the run says; else 0 [m]."""
    found = 0.0
    for one, k in zip(errors, record, strict=True):
        run, usual = one.run, usual_of(one.run)
        usual_m = np.sqrt(usual.start_m**2 + usual.walk_m**2 * run.count / run.rate_hz
                          + (usual.scale * np.ptp(run.distance_m)) ** 2
                          + ((one.late_s or 0.0) * run.speed_mps.max()) ** 2)
        off_m = float(np.abs(one.moved_m(k)).max())
        found = max(found, off_m if off_m > _UNUSUAL * usual_m else 0.0)
    return found


def _curves(pieces: int, count: int) -> Array:
    """Cubic B-splines with a knot after each of so many pieces, at ``count`` places from end to end (pieces + 3, n)."""
    place = np.linspace(0, pieces, count)
    first = np.minimum(place.astype(np.intp), pieces - 1)
    u = place - first
    found = np.zeros((pieces + 3, count))
    for later, weight in enumerate((
            (1 - u) ** 3, (3 * u - 6) * u**2 + 4, ((3 - 3 * u) * u + 3) * u + 1, u**3)):
        found[first + later, np.arange(count)] = weight / 6
    return found


def _roughness(run: Run, smooth_s: float = 1.0) -> Array:
    """What of a run's distance (n,) no car drives [m]: within so short a time its speed changes by no more than a cubic
    curve does (A. Savitzky and M. Golay, Analytical Chemistry 36, 1964). The curve at an end serves up to there."""
    half = min(round(smooth_s * run.rate_hz), run.count - 1) // 2
    if half < 2:
        return np.zeros(run.count)
    powers = np.vander(np.linspace(-1, 1, 2 * half + 1), 4)
    smooth = powers @ np.linalg.pinv(powers)
    way = run.distance_m - run.distance_m[0]
    inside = np.convolve(way, smooth[half], "valid")
    return np.asarray(way - np.concatenate([smooth[:half] @ way[: 2 * half + 1], inside,
                                            smooth[half + 1 :] @ way[-2 * half - 1 :]]))


def _by_recorder(prediction: Array, rise: Array, run: Run) -> Array:
    """What the recorder's numbers do to a prediction (n,) that changes at these rates (n,): (2, n)."""
    return np.stack([prediction, rate_of_change(rise, run.rate_hz) / (2 * np.pi * run.rate_hz) ** 2])


def rate_of_change(samples: Array, rate_hz: float) -> Array:
    """The derivative of evenly spaced samples (n,), right to 0.03 % up to a third of their rate: central differences of
    order 48 (B. Fornberg, Mathematics of Computation 51, 1988). The difference of two neighbours would be half of it at
    30 Hz."""
    taps = _difference_taps(24)
    half = len(taps)
    past_ends = np.pad(samples, half, mode="reflect", reflect_type="odd")
    return np.asarray(np.convolve(past_ends, [*taps[::-1], 0.0, *-taps], mode="valid") * rate_hz)


@cache
def _difference_taps(half: int) -> Array:
    """Of central differences of order 2 half: (half,), the nearest sample first."""
    return np.array([(-1.0) ** (k + 1) * comb(2 * half, half - k) / (k * comb(2 * half, half))
                     for k in range(1, half + 1)])
