"""Comfort figures of a weighted acceleration that is not known exactly, each with its standard error.

Problem. A reading is the ride, noise and rounding. The r.m.s. of readings counts all three as ride; the r.m.s. of the
most probable ride is too low, because what the readings leave open is missing in it.

Solution. The weighted acceleration is known as a Gaussian process: a mean m and a covariance C of what is left open.
The sums that the figures are made of, of its square and its fourth power, have means and variances in closed form,
because a power of m + s z is a short sum of Hermite polynomials of z (Isserlis, Biometrika 12, 1918, for moments;
Mehler's formula for covariances). A figure is a root of such a sum, which is taken to be gamma distributed.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import erf, exp, factorial, hypot, lgamma, nan, pi, sqrt

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_MOST_SHAPE = 1e8  # beyond, a gamma distribution is a point, and its moments only rounding


@dataclass(frozen=True)
class Uncertain:
    """A value with its standard error, both nan where nothing is known."""

    value: float
    std: float


UNKNOWN = Uncertain(nan, nan)


@dataclass(frozen=True)
class RideFigures:
    """a_w [m/s2], MTVV [m/s2] and VDV [m/s^1.75] of the ride alone."""

    a_w: Uncertain
    mtvv: Uncertain
    vdv: Uncertain


NO_FIGURES = RideFigures(UNKNOWN, UNKNOWN, UNKNOWN)


@dataclass(frozen=True)
class PowerSum:
    """Sum of a power of the weighted acceleration over samples.

    mean, variance    of what it can be, once the readings are known
    shared            standard error of the mean itself, from what stretches share: the level of road or noise
    """

    mean: float
    variance: float
    shared: float = 0.0

    def plus(self, other: PowerSum) -> PowerSum:
        """With the sum over other samples; what is shared goes the same way in both."""
        return PowerSum(self.mean + other.mean, self.variance + other.variance, self.shared + other.shared)

    def root(self, divisor: float, degree: int) -> Uncertain:
        """(sum / divisor) ** (1 / degree): mean and standard deviation. An error of the mean does not make a root
        smaller on average, as scatter does."""
        if self.mean <= 0.0:
            return gamma_root(0.0, hypot(sqrt(self.variance), self.shared) ** 2 / divisor**2, degree)
        own = gamma_root(self.mean / divisor, self.variance / divisor**2, degree)
        # To first order, and near 0 no more than an error of its own size comes to.
        moved = min(own.value * self.shared / (degree * self.mean), (self.shared / divisor) ** (1 / degree))
        return Uncertain(own.value, hypot(own.std, moved))


@dataclass(frozen=True)
class RideSums:
    """What the figures are made of, for consecutive stretches.

    count      samples
    squares    sum of the squares over them; ``fourths`` of the fourth powers
    running    the largest of the sums of squares over ``running_count`` samples that end in the stretch
    """

    count: int
    squares: PowerSum
    fourths: PowerSum
    running: PowerSum
    running_count: int

    def plus(self, later: RideSums) -> RideSums:
        """Both stretches as one."""
        running = larger(self.running, later.running, 0.0)
        return RideSums(self.count + later.count, self.squares.plus(later.squares), self.fourths.plus(later.fourths),
                        running, self.running_count)

    def figures(self, step_s: float) -> RideFigures:
        """ISO 2631-1 clauses 6.1 and 6.3, samples ``step_s`` apart [s]."""
        if not self.count:
            return NO_FIGURES
        return RideFigures(self.squares.root(self.count, 2), self.running.root(self.running_count, 2),
                           self.fourths.root(1 / step_s, 4))


def larger(one: PowerSum, other: PowerSum, correlation: float) -> PowerSum:
    """The larger of two sums that go together by a correlation, taken as Gaussian: expected to be more than the larger
    expectation. (Clark, Operations Research 9, 1961.)"""
    high, low = (one, other) if one.mean >= other.mean else (other, one)
    apart = sqrt(max(one.variance + other.variance - 2 * correlation * sqrt(one.variance * other.variance), 0.0))
    if apart == 0.0:
        return high
    ahead = (high.mean - low.mean) / apart
    share = 0.5 * (1 + erf(ahead / sqrt(2)))
    density = exp(-0.5 * ahead**2) / sqrt(2 * pi)
    mean = high.mean * share + low.mean * (1 - share) + apart * density
    second = ((high.mean**2 + high.variance) * share + (low.mean**2 + low.variance) * (1 - share)
              + (high.mean + low.mean) * apart * density)
    return PowerSum(mean, max(second - mean**2, 0.0), share * high.shared + (1 - share) * low.shared)


def square_sum(mean: Array, std: Array, correlation: Array) -> PowerSum:
    """Sum of the squares of a Gaussian path.

    mean           (n,) of it; ``std`` (n,) its standard deviation, [m/s2]
    correlation    (l,) of its errors, by lag; 0 beyond
    """
    return PowerSum(expected_squares(mean, std), _variance((2 * mean * std, 2 * std * std), correlation))


def fourth_power_sum(mean: Array, std: Array, correlation: Array) -> PowerSum:
    """Sum of its fourth powers, likewise."""
    square, variance, mixed = mean * mean, std * std, mean * std
    derivatives = ((4 * square + 12 * variance) * mixed, 12 * (square + variance) * variance, 24 * mixed * variance,
                   24 * variance * variance)
    return PowerSum(expected_fourth_powers(mean, std), _variance(derivatives, correlation))


def expected_squares(mean: Array, std: Array) -> float:
    """Expected sum of the squares."""
    return float((mean * mean + std * std).sum())


def expected_fourth_powers(mean: Array, std: Array) -> float:
    """Expected sum of the fourth powers."""
    square, variance = mean * mean, std * std
    return float((square * (square + 6 * variance) + 3 * variance * variance).sum())


def _variance(derivatives: tuple[Array, ...], correlation: Array) -> float:
    """Variance of the sum of f(m + s z) over a path, by E f', E f'', ... times s, s^2, ...: the covariance at two
    places is the sum over k of the product of both E f^(k) with correlation^k / k! (Mehler)."""
    correlation = correlation[:len(derivatives[0])]
    total, kernel = 0.0, np.ones(len(correlation))
    for order, row in enumerate(derivatives, start=1):
        lags = np.correlate(row, row, "full")[len(row) - 1:][:len(correlation)]
        kernel = kernel * correlation
        total += float(2 * (lags @ kernel) - lags[0] * kernel[0]) / factorial(order)
    return max(total, 0.0)


def gamma_root(mean: float, variance: float, degree: int) -> Uncertain:
    """Mean and standard deviation of x^(1/degree), x gamma distributed. (Johnson, Kotz and Balakrishnan, Continuous
    Univariate Distributions 1, 17.)"""
    if mean <= 0.0:
        return Uncertain(0.0, variance ** (0.5 / degree))
    root = mean ** (1 / degree)
    if variance <= mean**2 / _MOST_SHAPE:
        return Uncertain(root, root / degree * sqrt(variance) / mean)
    shape = mean**2 / variance

    def moment(power: float) -> float:
        return exp(lgamma(shape + power) - lgamma(shape)) * (mean / shape) ** power

    first = moment(1 / degree)
    return Uncertain(first, sqrt(max(moment(2 / degree) - first**2, 0.0)))
