"""Evidence of coarse readings: would another noise have made them more probable?

Each reading says that acceleration plus noise lay between two bounds. What all other readings say of the acceleration
is a Gaussian of mean m and variance v (expectation propagation, ``quantisation``), so the reading had the probability

    Z = Phi((high - m) / sqrt(V)) - Phi((low - m) / sqrt(V)),  V = v + noise^2

Where the propagation has settled, the slope of its log evidence in a parameter of the likelihood is the sum of the
slopes of log Z with m and v held (Rasmussen and Williams, Gaussian Processes for Machine Learning, 3.6 and
5.5.2). Z solves the heat equation, dZ/dV = 1/2 d2Z/dm2, so the slope of log Z in V is half of
(E(x - m)^2 - V) / V^2 with x the truncated Gaussian. The information is the expected square of that slope, over all
steps on which the reading could have been.
"""

from __future__ import annotations

from math import ceil, log

import numpy as np
import numpy.typing as npt

from logger.estimation.noise_belief import NoiseScore
from logger.estimation.normal_distribution import density, distribution, within

Array = npt.NDArray[np.float64]

_FARTHEST = 3.0  # deviations: what is farther out is a hole that the solution has not found yet
_REACH = 5.0
_LEAST_SHARE = 1e-12


def interval_score(expected: Array, others: Array, low: Array, high: Array, noise_rms_mps2: float) -> NoiseScore:
    """Score of readings for the logarithm of their noise, at this noise.

    expected, others    (n,) mean [m/s2] and variance [(m/s2)2] of each acceleration by all other readings
    low, high           (n,) bounds of each reading, finite, the same width apart [m/s2]
    """
    at = log(noise_rms_mps2)
    if not len(expected):
        return NoiseScore(at, 0.0, 0.0)
    noise = noise_rms_mps2**2
    variance = others + noise
    mean, left = within(expected, variance, low, high)
    square = np.minimum((mean - expected) ** 2, _FARTHEST**2 * variance)
    slope = (square + left - variance) / (2 * variance**2)
    per_log = 2 * noise
    information = _information(expected, variance, low, high)
    return NoiseScore(at, per_log * float(slope.sum()), per_log**2 * float(information.sum()))


def _information(expected: Array, variance: Array, low: Array, high: Array) -> Array:
    """Expected square (n,) of the slope of log Z in V."""
    deviation = np.sqrt(variance)
    step = high - low
    steps_off = np.round((expected - 0.5 * (low + high)) / step)
    reach = ceil(_REACH * float((deviation / step).max())) + 1
    total = np.zeros(len(expected))
    for number in range(-reach, reach + 1):
        below = (low + (steps_off + number) * step - expected) / deviation
        above = below + step / deviation
        mirrored = below > 0
        share = (distribution(np.where(mirrored, -below, above)) - distribution(np.where(mirrored, -above, below)))
        slope = 0.5 * (below * density(below) - above * density(above)) / variance
        total += slope**2 / np.maximum(share, _LEAST_SHARE)
    return total
