"""Statistics of residuals that are correlated from sample to sample: blocks of them count as independent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from logger.arrays import Array
from logger.lab.residuals.breakdown import INDEPENDENT_S, ModelResiduals


def block_means(residuals: ModelResiduals, signals: Sequence[Array], blocks: int = 1) -> Array:
    """Means of signals [(n,), ...] over so many blocks at a time, all runs one after the other (b,); an incomplete
    block at an end is left out."""
    size = max(2, round(blocks * INDEPENDENT_S * residuals.rate_hz))
    return np.concatenate([one[: len(one) // size * size].reshape(-1, size).mean(axis=1) for one in signals])


def mean_of_blocks(signals: Sequence[Array], residuals: ModelResiduals) -> tuple[float, float, float]:
    """Mean of signals [(n,), ...], its standard error from the standard deviation of pairs of blocks, and Student's
    p-value of a mean of 0; NaN for too few blocks."""
    from scipy.stats import ttest_1samp

    means = block_means(residuals, signals, blocks=2)
    if len(means) < 4:
        return float(np.concatenate(signals).mean()), np.nan, np.nan
    error = float(means.std(ddof=1) / np.sqrt(len(means)))
    return float(means.mean()), error, float(ttest_1samp(means, 0.0).pvalue) if error > 0 else np.nan


def rank_correlation(one: Array, other: Array) -> tuple[float, float]:
    """Spearman's rank correlation of (n,) with (n,) and its p-value; NaN for fewer than eight or where nothing varies.
    """
    from scipy.stats import spearmanr

    if len(one) < 8 or not (np.ptp(one) > 0 and np.ptp(other) > 0):
        return np.nan, np.nan
    found = spearmanr(one, other)
    return float(found.statistic), float(found.pvalue)


def band_pass(signal: Array, low_hz: float, high_hz: float, rate_hz: float) -> Array:
    """A signal (n,) without the frequencies outside of a band."""
    f_hz = np.fft.rfftfreq(len(signal), 1 / rate_hz)
    return np.fft.irfft(np.where((f_hz >= low_hz) & (f_hz < high_hz), np.fft.rfft(signal), 0.0), len(signal))


def rms(signals: Sequence[Array]) -> float:
    """Root-mean-square of all samples of signals [(n,), ...]."""
    return float(np.sqrt(sum(float(one @ one) for one in signals) / sum(map(len, signals))))
