"""Statistics of residuals that are correlated from sample to sample: blocks of them count as independent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.lab.residuals.breakdown import ModelResiduals, block_means

Array = npt.NDArray[np.float64]

_UNKNOWN = float("nan")
_LEAST_BLOCKS, _LEAST_FREEDOM = 4, 6


def mean_of_blocks(signals: Sequence[Array], residuals: ModelResiduals, seconds: float) -> tuple[float, float, float]:
    """Mean, its standard error from the spread of blocks, and Student's p-value against 0; NaN where nothing is known.
    """
    from scipy.stats import ttest_1samp

    means = block_means(residuals, signals, seconds)
    if len(means) < _LEAST_BLOCKS:
        return float(means.mean()), _UNKNOWN, _UNKNOWN
    error = float(means.std(ddof=1) / np.sqrt(len(means)))
    return float(means.mean()), error, float(ttest_1samp(means, 0.0).pvalue) if error > 0 else _UNKNOWN


def rank_correlation(one: Array, other: Array) -> tuple[float, float]:
    """Spearman's rank correlation and its p-value; NaN where nothing is known."""
    from scipy.stats import spearmanr

    if len(one) - 2 < _LEAST_FREEDOM or not (np.ptp(one) > 0 and np.ptp(other) > 0):
        return _UNKNOWN, _UNKNOWN
    found = spearmanr(one, other)
    return float(found.statistic), float(found.pvalue)


def autocorrelations(signals: Sequence[Array], lags: int) -> Array:
    """At 1 ... lags samples (lags,)."""
    power = sum(float(one @ one) for one in signals) or 1.0
    return np.array([sum(float(one[lag:] @ one[:-lag]) for one in signals) for lag in range(1, lags + 1)]) / power


def band_pass(signal: Array, low_hz: float, high_hz: float, rate_hz: float) -> Array:
    """A signal (n,) without what is outside of a band."""
    f_hz = np.fft.rfftfreq(len(signal), 1 / rate_hz)
    return np.fft.irfft(np.where((f_hz >= low_hz) & (f_hz < high_hz), np.fft.rfft(signal), 0.0), len(signal))


def rms(signals: Sequence[Array]) -> float:
    """Over all samples of some signals."""
    return float(np.sqrt(sum(float(one @ one) for one in signals) / sum(map(len, signals))))
