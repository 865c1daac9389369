"""Statistics of residuals: of blocks of them, which count as independent where samples are correlated, and of the
strongest ordinate of a periodogram."""

from collections.abc import Sequence

import numpy as np

from logger.arrays import Array, Bools
from logger.lab.residuals.breakdown import INDEPENDENT_S, ModelResiduals

NEIGHBOURS = 15
"""An ordinate is compared with so many on either side, or more: the mean of thirty, of which a Hann taper leaves 15
independent, is known to a quarter."""


def block_means(residuals: ModelResiduals, signals: Sequence[Array], blocks: int = 1) -> Array:
    """Means of signals [(n,), ...] over so many blocks at a time, all runs one after the other (b,); an incomplete
    block at an end is left out."""
    size = max(2, round(blocks * INDEPENDENT_S * residuals.rate_hz))
    return np.concatenate([one[: len(one) // size * size].reshape(-1, size).mean(axis=1) for one in signals])


def mean_of_blocks(signals: Sequence[Array], residuals: ModelResiduals) -> tuple[float, float, float]:
    """Mean of signals [(n,), ...], its standard error from the standard deviation of pairs of blocks, and Student's
    p-value of a mean of 0; NaN for too few blocks."""
    from scipy.special import stdtr

    means = block_means(residuals, signals, blocks=2)
    if len(means) < 4:
        return float(np.concatenate(signals).mean()), np.nan, np.nan
    mean, error = float(means.mean()), float(means.std(ddof=1) / np.sqrt(len(means)))
    return mean, error, float(2 * stdtr(len(means) - 1, -abs(mean) / error)) if error > 0 else np.nan


def rank_correlation(one: Array, other: Array, *, fewest: int = 8) -> tuple[float, float]:
    """Spearman's rank correlation of (n,) with (n,) and its two-sided p-value; NaN for less than the ``fewest``, which
    are three or more, or where nothing varies."""
    from scipy.special import stdtr

    if len(one) < fewest or not (np.ptp(one) > 0 and np.ptp(other) > 0):
        return np.nan, np.nan
    places = [np.unique(each, return_inverse=True, return_counts=True) for each in (one, other)]
    ranks = [(np.cumsum(counts) - 0.5 * counts)[place] for _, place, counts in places]  # of equals their mean
    found, freedom = float(np.clip(np.corrcoef(ranks)[0, 1], -1.0, 1.0)), len(one) - 2
    return found, float(2 * stdtr(freedom, -abs(found) * np.sqrt(freedom / max(1 - found**2, 1e-300))))


def band_pass(signal: Array, low_hz: float, high_hz: float, rate_hz: float) -> Array:
    """A signal (n,) without the frequencies outside of a band."""
    f_hz = np.fft.rfftfreq(len(signal), 1 / rate_hz)
    return np.fft.irfft(np.where((f_hz >= low_hz) & (f_hz < high_hz), np.fft.rfft(signal), 0.0), len(signal))


def periodogram(samples: Array) -> Array:
    """Power of evenly spaced samples (n,) at each frequency of their transform (n // 2 + 1,), tapered (Hann)."""
    return np.asarray(np.abs(np.fft.rfft(samples * np.hanning(len(samples)))) ** 2)


def strongest_line(power: Array, among: Bools | None = None, reach: int = 0) -> tuple[int, float] | None:
    """The strongest line of a periodogram: its number, and a bound on the probability of one so strong by chance (above
    1 for weak ones): the ratio of its power to the mean of its neighbours is F(2, 2 m) in noise, Bonferroni over all.

    power    (f,) of any unit
    among    which frequencies are tested, of those with enough neighbours (f,); None: all
    reach    neighbours on either side (``NEIGHBOURS`` at least), without the nearest three

    None where no frequency that is tested has power around it.
    """
    reach = max(NEIGHBOURS, reach)
    if len(power) <= 2 * reach:  # no frequency has so many neighbours
        return None
    around = np.ones(2 * reach + 1)
    around[reach - 3 : reach + 4] = 0.0
    level = np.convolve(power, around / around.sum(), mode="same")
    number = np.arange(len(power))
    whole = (number >= reach) & (number < len(power) - reach) & (level > 0)
    tested = np.flatnonzero(whole if among is None else whole & among)
    if not len(tested):
        return None
    ratio = power[tested] / level[tested]
    # A Hann taper correlates neighbours: independent ones are fewer by 1 + 2 (2/3)^2 + 2 (1/6)^2.
    independent = around.sum() / 1.94
    return int(tested[ratio.argmax()]), len(tested) * float((1 + ratio.max() / independent) ** -independent)
