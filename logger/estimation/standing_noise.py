"""The noise of a coarse sensor that stands still: how often which step was read.

Problem. A parked sensor reads one level, which lies anywhere within a step. If noise takes the reading over an edge now
and then, how often it does tells level and noise together; if it never does, only that the noise is small beside the
distance to the edge, which nobody knows. Solution. The probability of the counts of each step, for every noise and
every place of the level on a grid; the mean over the places is the likelihood of the noise, and with what was believed
before it gives a mean and a standard error of its logarithm. A reading that never toggles so gives an upper bound.

Readings that go together (a chip that renews its data more slowly than it is read, a filter) count for fewer: as many
as have the same scatter of the mean (Geyer, Statistical Science 7, 1992). What else shakes a car that stands, an idling
engine above all, counts as noise.
"""

from __future__ import annotations

from math import log, sqrt

import numpy as np
import numpy.typing as npt

from logger.estimation.noise_belief import NoiseBelief
from logger.estimation.normal_distribution import distribution

Array = npt.NDArray[np.float64]

_PLACES = 64
_NOISES = 240
_LEAST_STEPS, _MOST_STEPS = 0.01, 4.0  # noises on the grid
_BEYOND_STEPS = 12
_LONGEST_MEMORY = 50
_LEAST_READINGS = 100
_MODEL_LOG_STD = 0.04
_LEAST_SHARE = 1e-300


def standing_noise(before: NoiseBelief, reading_mps2: Array, step_mps2: float) -> NoiseBelief:
    """What is believed of the noise after a sensor stood still.

    before          what was believed; what is not told stays as it was
    reading_mps2    (n,) consecutive readings on steps, over so short a time that the level does not drift: some seconds
    step_mps2       of the readings [m/s2], above 0
    """
    if len(reading_mps2) < _LEAST_READINGS:
        return before
    codes = np.round((reading_mps2 - np.median(reading_mps2)) / step_mps2).astype(int)
    if np.abs(codes).max() > _BEYOND_STEPS:
        return before  # it did not stand still
    log_noise = np.linspace(log(_LEAST_STEPS * step_mps2), log(_MOST_STEPS * step_mps2), _NOISES)
    likelihood = _log_likelihood(codes, np.exp(log_noise) / step_mps2)
    belief = likelihood - 0.5 * ((log_noise - before.log_mean) / before.log_std) ** 2
    weight = np.exp(belief - belief.max())
    weight /= weight.sum()
    mean = float(weight @ log_noise)
    variance = float(weight @ (log_noise - mean) ** 2) + _MODEL_LOG_STD**2
    return NoiseBelief(mean, min(sqrt(variance), before.log_std))


def _log_likelihood(codes: npt.NDArray[np.int64], noise_steps: Array) -> Array:
    """Log likelihood (s,) of noises (s,), in steps, the mean over where the level lies within its step or the next."""
    values, counts = np.unique(codes, return_counts=True)
    level = (np.arange(2 * _PLACES) + 0.5) / _PLACES - 1.0  # the median may have been taken over the edge
    total = np.zeros((len(noise_steps), len(level)))
    for value, count in zip(values.tolist(), counts.tolist(), strict=True):
        below = (value - 0.5 - level) / noise_steps[:, None]
        above = (value + 0.5 - level) / noise_steps[:, None]
        mirrored = below > 0  # differences in the lower tail keep their digits
        share = distribution(np.where(mirrored, -below, above)) - distribution(np.where(mirrored, -above, below))
        total += count * np.log(np.maximum(share, _LEAST_SHARE))
    total *= independent_share(codes.astype(np.float64))
    highest = total.max()
    mean: Array = np.log(np.exp(total - highest).mean(axis=1) + _LEAST_SHARE) + highest
    return mean


def independent_share(values: Array) -> float:
    """Share of values (n,) in a row that count as independent: one over the sum of their correlations, up to the first
    pair of lags whose sum is not above 0. Values that are all the same show none."""
    off = values - values.mean()
    power = float(off @ off)
    if power == 0.0:
        return 1.0
    total = 1.0
    for lag in range(1, min(_LONGEST_MEMORY, len(values) - 1), 2):
        pair = float(off[lag:] @ off[:-lag] + off[lag + 1:] @ off[: -lag - 1]) / power
        if pair <= 0:
            break
        total += 2 * pair
    return 1 / total
