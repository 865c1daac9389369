"""Evidence of readings for the noise that they had: coarse ones by their bounds, others by what no road explains.

Each coarse reading says that acceleration plus noise lay between two bounds. What all other readings say of the
acceleration is a Gaussian of mean m and variance v (expectation propagation, ``quantisation``), so the reading had the
probability

    Z = Phi((high - m) / sqrt(V)) - Phi((low - m) / sqrt(V)),  V = v + noise^2

Where the propagation has settled, the slope of its log evidence in a parameter of the likelihood is the sum of the
slopes of log Z with m and v held (Rasmussen and Williams, Gaussian Processes for Machine Learning, 3.6 and 5.5.2): at
the noise that the propagation was made with, the sum of log Z has the right slope, and it says what becomes of it far
from there, where a slope alone would mislead. The next stretches are solved again with the new noise.

A parked car needs no road: its readings are one level, anywhere within a step, and noise; what else shakes it, an
engine or people who get in, is in them too. So they are evidence against larger noises only.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.estimation.normal_distribution import probability_between

Array = npt.NDArray[np.float64]

_LEVELS_PER_STEP = 64  # of the integral over a parked car's level: finer than _MOST_PARKED toggling readings show it
_MOST_PARKED = 1000
"""A stand counts as so many readings at most, ten seconds: in longer ones the level drifts and what shakes the car is
not independent from reading to reading, and their evidence would fall by more than a belief can follow."""
_LEAST_SHARE = 1e-30  # so that its logarithm is finite
_LEAST_PROBABILITY = 1e-6
"""Beyond 4.75 deviations: what is farther out is a hole that the solution has not found yet. Not nearer: where readings
toggle about one edge, the few on a third step, 3 to 4 deviations out where the noise is a third to a quarter of one,
are all that tells how much noise there is; were they no less probable with less noise, it would come out too small."""


def interval_evidence(expected: Array, others: Array, low: Array, high: Array, log_noise: Array) -> Array:
    """Log evidence (g,) of coarse readings for noises (g,), given as logarithms of m/s2.

    expected, others    (n,) mean [m/s2] and variance [(m/s2)2] of each acceleration by all other readings
    low, high           (n,) bounds of each reading [m/s2]
    """
    deviation = np.sqrt(others + np.exp(2 * log_noise)[:, None])
    share = probability_between((low - expected) / deviation, (high - expected) / deviation)
    evidence: Array = np.log(np.maximum(share, _LEAST_PROBABILITY)).sum(axis=1)
    return evidence


def parked_evidence(steps: Array, counts: Array, log_noise: Array) -> Array:
    """Log evidence (g,) of a parked car's readings for noises (g,), given as logarithms of steps: at most that of
    smaller noises, which something else that shook the car may have joined.

    steps, counts    (k,) numbers of neighbouring steps, and how many readings were on each; a long stand is scaled down

    The level may have lain anywhere: Z = integral over the level of the product of each reading's probability.
    """
    levels = np.arange(steps.min() - 0.5, steps.max() + 0.5, 1 / _LEVELS_PER_STEP) + 0.5 / _LEVELS_PER_STEP
    noise, from_level = np.exp(log_noise)[:, None, None], steps - levels[:, None]
    share = probability_between((from_level - 0.5) / noise, (from_level + 0.5) / noise)
    weights = counts * min(1.0, _MOST_PARKED / counts.sum())
    by_level = np.log(np.maximum(share, _LEAST_SHARE)) @ weights
    most = by_level.max(axis=1)
    evidence = most + np.log(np.exp(by_level - most[:, None]).mean(axis=1))
    at_most: Array = np.maximum.accumulate(evidence[::-1])[::-1]
    return at_most


def residual_evidence(slope: float, free: float, at: float, log_noise: Array) -> Array:
    """Log evidence (g,) of residuals for noises (g,), given as logarithms of m/s2: that of ``free`` readings whose mean
    square makes it rise by ``slope`` at the log noise ``at`` (the scaled chi-squared distribution)."""
    off = log_noise - at
    evidence: Array = -free * off - 0.5 * (free + slope) * np.exp(-2 * off)
    return evidence
