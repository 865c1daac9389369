"""Comfort values with their standard errors, and the part of a sensor's noise in them."""

from __future__ import annotations

from dataclasses import dataclass
from math import erf, exp, factorial, hypot, lgamma, nan, pi, sqrt

import numpy as np

from logger.arrays import Array


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

    Problem. A reading is the ride, noise and rounding. The r.m.s. of readings counts all three as ride; the r.m.s. of
    the most probable ride is too low, because what the readings leave open is missing in it.

    Solution. The weighted acceleration is known as a Gaussian process: a mean m and a covariance C of what is left
    open. The sums that the figures are made of, of its square and its fourth power, have means and variances in closed
    form, because a power of m + s z is a short sum of Hermite polynomials of z (Isserlis, Biometrika 12, 1918, for
    moments; Mehler's formula for covariances). A figure is a root of such a sum, which is taken to be gamma
    distributed.

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
    most_shape = 1e8  # beyond, a gamma distribution is a point, and its moments only rounding
    if mean <= 0.0:
        return Uncertain(0.0, variance ** (0.5 / degree))
    root = mean ** (1 / degree)
    if variance <= mean**2 / most_shape:
        return Uncertain(root, root / degree * sqrt(variance) / mean)
    shape = mean**2 / variance

    def moment(power: float) -> float:
        return exp(lgamma(shape + power) - lgamma(shape)) * (mean / shape) ** power

    first = moment(1 / degree)
    return Uncertain(first, sqrt(max(moment(2 / degree) - first**2, 0.0)))


BLURRED_FROM_STEPS = 0.5
"""R.m.s. of noise, or of readings less that of rounding, in steps, from which on the variance of rounding is
step^2 / 12 wherever in a step gravity lies. Readings that toggle between two steps for next to nothing show 0.41:
sqrt(1/4 - 1/12). The mean of what is read still follows the acceleration by at most exp(-2 pi^2 0.5^2) / pi = 0.2 % of
a step (B. Widrow and I. Kollar, Quantization Noise, 2008); with noise of a third of a step by 3.5 %, and in the lab, on
a smooth road, standard errors are half as large again (``tests.benchmarks.rounded_lab``)."""

# Expected largest of a white noise's moving means over 1 s in a window, in their own deviations, by its length [s]:
# simulated, 100 samples a second (tests/comfort/test_noise_floor.py).
_LARGEST_OF_MOVING = ((0.0, 0.3, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 120.0),
                      (0.0, 0.53, 1.04, 1.46, 1.95, 2.28, 2.76, 3.06, 3.29))


@dataclass(frozen=True)
class RawFigures:
    """Of the readings in a window: samples, r.m.s. before the weighting, and a_w, MTVV [m/s2] and VDV [m/s^1.75]."""

    count: int
    accel_rms_mps2: float
    a_w_mps2: float
    mtvv_mps2: float
    vdv_mps175: float


class NoiseFloor:
    """For readings ``rate_hz`` a second whose weighting has the gain (n,) at frequencies evenly from 0 to half of that.

    Problem. Noise and rounding shake nobody, and are counted. Solution. White noise of a variance s^2 has after the
    weighting the power K = s^2 times the mean of |W|^2 over frequency. It is independent of the ride, so in expectation

        sum w^2 = sum x^2 + n K,    sum w^4 = sum x^4 + 6 K sum x^2 + 3 n K^2

    (moments of a normal distribution), whatever the ride is: no model of car or road is needed. How far a window's sums
    scatter about that follows from the correlation of the weighted noise. Rounding is such noise where noise and ride
    blur the steps (Widrow and Kollar, Quantization Noise, 2008); where they do not, nothing is known but a bound.

    MTVV is the largest of many running means, and the noise falls otherwise in each. Of the power d by which the
    largest lies above the mean of the window, noise alone would make c s: s is the scatter of one running mean, c the
    largest of a white noise's in a window so long. Independent scatters add by their squares: the ride's own is
    sqrt(d^2 - (c s)^2).

    step_mps2    that readings are rounded to; 0: none
    reads        so many such readings are thinned out to one of the ``rate_hz``
    """

    def __init__(self, gain: Array, rate_hz: float, step_mps2: float, reads: int = 1) -> None:
        self._step_mps2 = step_mps2
        self._reads = reads
        self._rate_hz = rate_hz
        covariance = np.fft.irfft(gain**2)
        self._power = float(covariance[0])
        self._largest_gain = float(gain.max())
        self._spread = float(((covariance / self._power) ** 2).sum())

    def most_hidden_mps2(self, noise_mps2: float) -> float:
        """The weighted r.m.s. of a ride that can hide between two steps: more would, with the noise, have blurred
        them."""
        blurring = (BLURRED_FROM_STEPS * self._step_mps2)**2
        return self._largest_gain * sqrt(max(blurring - noise_mps2**2, 0.0))

    def without(self, raw: RawFigures, noise_mps2: float, log_std: float) -> RideFigures:
        """The figures of the ride alone; none where neither noise nor ride blurs the steps.

        noise_mps2    of a reading, before rounding; ``log_std`` is its standard error, a share of it
        """
        rounding = self._step_mps2**2 / 12
        ride = raw.accel_rms_mps2**2 - rounding / self._reads
        if max(noise_mps2**2, ride) < (BLURRED_FROM_STEPS * self._step_mps2)**2:
            return NO_FIGURES
        power = self._power * (noise_mps2**2 + rounding) / self._reads
        shared = 2 * log_std * self._power * noise_mps2**2 / self._reads
        running = round(self._rate_hz)  # MTVV is over 1 s
        squares = self._squares(raw.count, raw.a_w_mps2, power, shared)
        mtvv_mps2 = self._less_chance(raw, power, max(squares.mean, 0.0) / raw.count, running)
        fourth = raw.vdv_mps175**4 * self._rate_hz - 6 * power * squares.mean - 3 * raw.count * power**2
        fourth = max(fourth, max(squares.mean, 0.0)**2 / raw.count)  # Jensen's inequality
        scatter = sqrt(self._fourth_variance(raw.count, max(squares.mean, 0.0) / raw.count, power))
        fourths = PowerSum(fourth, 0.0, hypot(scatter, 6 * squares.mean * shared))
        return RideSums(raw.count, squares, fourths, self._squares(running, mtvv_mps2, power, shared), running
                        ).figures(1 / self._rate_hz)

    def _alike(self, count: int) -> float:
        """Sum over pairs of samples of their squared correlation: their number times how far it reaches."""
        return count * min(self._spread, count)

    def _less_chance(self, raw: RawFigures, power: float, ride: float, running: int) -> float:
        """MTVV [m/s2], noise in it, less what chance makes of the largest; ``ride`` is its mean square, ``running`` the
        samples of a running mean."""
        above = raw.mtvv_mps2**2 - raw.a_w_mps2**2
        if above <= 0:
            return raw.mtvv_mps2
        largest = float(np.interp(raw.count / running, *_LARGEST_OF_MOVING))
        chance = largest * sqrt(self._power_variance(running, ride, power)) / running
        return sqrt(raw.a_w_mps2**2 + sqrt(max(above**2 - chance**2, 0.0)))

    def _power_variance(self, count: int, ride: float, power: float) -> float:
        """Of the sum of squares, by the noise. The ride is taken to be correlated as weighted noise is."""
        return self._alike(count) * (4 * ride * power + 2 * power**2)

    def _squares(self, count: int, rms_mps2: float, power: float, shared: float) -> PowerSum:
        """Sum of the ride's squares."""
        mean = count * (rms_mps2**2 - power)
        ride = max(mean / count, 0.0)
        return PowerSum(mean, 0.0, hypot(sqrt(self._power_variance(count, ride, power)), count * shared))

    def _fourth_variance(self, count: int, ride: float, power: float) -> float:
        """Of the sum of fourth powers once the expected is taken off: the sum over k of E (4! / (4 - k)! x^(4 - k))^2
        K^k / k!, as in ``uncertain_ride.power_sums``, the ride x taken as Gaussian of the mean square ``ride``."""
        return self._alike(count) * (240 * ride**3 * power + 216 * ride**2 * power**2 + 96 * ride * power**3
                                     + 24 * power**4)
