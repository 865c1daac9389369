"""Normal distribution without scipy: its integral, what rounding leaves of it, and its absolute value.

The service must not import scipy (memory), so the error function is computed here, by the Chebyshev fit of Press et
al., Numerical Recipes, 6.2: its relative error is below 1.2e-7 everywhere, also far out in the tail.
"""

from math import pi, sqrt

import numpy as np

from logger.arrays import Array

_CHEBYSHEV = (-1.26551223, 1.00002368, 0.37409196, 0.09678418, -0.18628806, 0.27886807, -1.13520398, 1.48851587,
              -0.82215223, 0.17087277)
_LEAST_SHARE = 1e-200
_LEAST_NARROWING = 1e-6


def density(u: Array) -> Array:
    """Standard normal density."""
    return np.asarray(np.exp(-0.5 * (u * u)) / sqrt(2 * pi))


def _tail(u: Array) -> Array:
    """Probability beyond u >= 0. In place: for long rows most of the time goes into new memory."""
    z = u / sqrt(2)
    t = 0.5 * z
    t += 1.0
    np.divide(1.0, t, out=t)
    series = np.full_like(t, _CHEBYSHEV[-1])
    for coefficient in _CHEBYSHEV[-2::-1]:
        series *= t
        series += coefficient
    z *= z
    series -= z
    np.exp(series, out=series)
    series *= t
    series *= 0.5
    return series


def distribution(u: Array) -> Array:
    """Standard normal distribution function, with a small relative error in the lower tail too."""
    tail = _tail(np.abs(u))
    return np.where(u > 0, 1 - tail, tail)


def probability_between(low: Array, high: Array) -> Array:
    """Standard normal probability between two bounds (any one shape), with a small relative error in both tails."""
    mirrored = low > 0  # differences in the lower tail keep their digits
    return distribution(np.where(mirrored, -low, high)) - distribution(np.where(mirrored, -high, low))


def within(mean: Array, variance: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Mean and variance of a normal variable that is known to lie between two bounds; arrays of one shape.

    The bounds may be infinite. The variance is never more than ``variance`` and never zero.
    """
    deviation = np.sqrt(variance)
    ends = (np.stack([low, high]) - mean) / deviation
    mirrored = ends[0] > 0  # take the tail where the distribution function is small, not near one
    ends = np.where(mirrored, -ends[::-1], ends)
    below_share, above_share = distribution(ends)
    share = above_share - below_share
    far = share < _LEAST_SHARE  # so far out that the variable sits at the near bound
    share = np.where(far, 1.0, share)
    densities = density(ends)
    at_below, at_above = densities
    shift = np.where(far, ends[1], (at_below - at_above) / share)
    moment_below, moment_above = np.where(np.isfinite(ends), ends, 0.0) * densities
    moment = moment_below - moment_above
    narrowed = np.where(far, _LEAST_NARROWING, 1 + moment / share - shift * shift)
    shift = np.where(mirrored, -shift, shift)
    return mean + deviation * shift, variance * np.clip(narrowed, _LEAST_NARROWING, 1.0)


def mean_absolute(mean: Array, deviation: Array) -> Array:
    """Mean of |x| of a normal x (the folded normal distribution)."""
    u = mean / deviation
    return 2 * deviation * density(u) + mean * (2 * distribution(u) - 1)


def variance_of_mean_absolute(mean: Array, deviation: Array, correlation: Array, weight: Array) -> float:
    """Variance of the sum of weight_i |x_i| for jointly normal x in a row.

    mean, deviation, weight    (n,)
    correlation                (n,) of x_i and x_j, by their lag |i - j|

    By the expansion of |x| in Hermite polynomials of its normal part: what is of order k goes with the correlation to
    the power k. Orders 1 and 2 are exact; all that is left goes with the third power, so that no variance is lost.
    """
    u = mean / deviation
    first = deviation * (2 * distribution(u) - 1)
    second = sqrt(2) * deviation * density(u)
    whole = mean**2 + deviation**2 - (sqrt(2) * second + u * first) ** 2  # its mean is as in mean_absolute
    third = np.sqrt(np.maximum(whole - first**2 - second**2, 0.0))
    total, power = 0.0, np.ones(len(correlation))
    for term in (first, second, third):
        power = power * correlation
        weighted = weight * term
        by_lag = np.correlate(weighted, weighted, mode="full")[len(weighted) - 1:]
        by_lag[1:] *= 2  # a lag counts ahead and behind
        total += float(by_lag @ power)
    return max(total, 0.0)
