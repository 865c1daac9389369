"""Mean and change of each road from sums over its passes, with their errors.

Few passes show little of their own scatter. Their variance is drawn towards that of all roads by as much as the roads'
variances agree (G. K. Smyth, Linear models and empirical Bayes methods, 2004, sections 3 and 6.2: a scaled inverse
chi-square prior whose two numbers follow from mean and variance of the logarithms). Changes are significant where the
share of false ones among them stays below a limit (Y. Benjamini and Y. Hochberg, 1995).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Sums:
    """Of the passes over each of n roads: number; sums of times [years], IRI [m/km] and products; and what the cars'
    gains add to the variance of the sum, over the square of the IRI."""

    passes: Array
    years: Array
    years_square: Array
    iri: Array
    iri_years: Array
    iri_square: Array
    bias_square: Array


@dataclass(frozen=True, eq=False)
class RoadFigures:
    """Of n roads; NaN: not known.

    iri_m_per_km, iri_std_m_per_km            mean of the passes, and its standard error with that of the cars' biases
    trend_m_per_km_per_year, trend_std_...    change, from three passes on
    p_value                                   of no change, two-sided
    """

    iri_m_per_km: Array
    iri_std_m_per_km: Array
    trend_m_per_km_per_year: Array
    trend_std_m_per_km_per_year: Array
    p_value: Array


def road_figures(sums: Sums, pass_std: float) -> RoadFigures:
    """Figures of n roads. ``pass_std``: relative standard deviation of a pass, for where no road shows it; NaN: drives
    are too few to show how far they scatter, so no error and no change is known."""
    from scipy.stats import t

    count = sums.passes
    mean = sums.iri / count
    if not np.isfinite(pass_std):
        return RoadFigures(mean, *(np.full(len(mean), np.nan) for _ in range(4)))
    spread_years = np.maximum(sums.years_square - sums.years**2 / count, 0.0)
    product = sums.iri_years - sums.iri * sums.years / count
    has_trend = (count >= 3) & (spread_years > 1e-9 * count)
    trend = np.divide(product, spread_years, out=np.zeros(len(mean)), where=has_trend)
    rest = np.maximum(sums.iri_square - sums.iri**2 / count - trend * product, 0.0)
    freedom = count - 1 - has_trend
    variance = np.divide(rest, freedom * mean**2, out=np.zeros(len(mean)), where=freedom > 0)
    prior_freedom, prior = _prior(variance, freedom, pass_std**2)
    if np.isinf(prior_freedom):
        moderated = np.full(len(mean), prior)
    else:
        moderated = (prior_freedom * prior + freedom * variance) / (prior_freedom + freedom)
    iri_std = mean * np.sqrt(moderated / count + sums.bias_square / count**2)
    trend_std = np.sqrt(np.divide(moderated * mean**2, spread_years, out=np.full(len(mean), np.nan), where=has_trend))
    trend = np.where(has_trend, trend, np.nan)
    p_value = 2.0 * t.sf(np.abs(trend) / trend_std, np.minimum(prior_freedom + freedom, 1e9))
    return RoadFigures(mean, iri_std, trend, trend_std, p_value)


def significant(p_value: Array, false_share: float) -> Bools:
    """Which of n tests are significant, with a share of false ones among them of at most so much; NaN is none."""
    known = np.flatnonzero(np.isfinite(p_value))
    order = known[np.argsort(p_value[known], kind="stable")]
    passed = np.flatnonzero(p_value[order] <= false_share * np.arange(1, len(order) + 1) / max(len(order), 1))
    out = np.zeros(len(p_value), dtype=np.bool_)
    if len(passed):
        out[order[: passed[-1] + 1]] = True
    return out


def _prior(variance: Array, freedom: Array, otherwise: float) -> tuple[float, float]:
    """Degrees of freedom and value of the prior variance (Smyth 2004, section 6.2)."""
    from scipy.special import digamma, polygamma

    known = (freedom > 0) & (variance > 0)
    if known.sum() < 3:
        return np.inf, otherwise
    half = freedom[known] / 2
    level = np.log(variance[known]) - digamma(half) + np.log(half)
    excess = level.var(ddof=1) - float(polygamma(1, half).mean())
    if excess <= 0:
        return np.inf, float(np.exp(level.mean()))
    prior_half = _inverse_trigamma(excess)
    return 2 * prior_half, float(np.exp(level.mean() + digamma(prior_half) - np.log(prior_half)))


def _inverse_trigamma(value: float) -> float:
    """Where trigamma has a value above 0, by Newton's method for 1 / trigamma, which is convex (Smyth 2004,
    appendix)."""
    from scipy.special import polygamma

    if value > 1e7:
        return float(value**-0.5)
    if value < 1e-6:
        return 1.0 / value
    at = 0.5 + 1.0 / value
    for _ in range(50):
        trigamma = float(polygamma(1, at))
        step = trigamma * (1.0 - trigamma / value) / float(polygamma(2, at))
        at += step
        if -step / at < 1e-8:
            break
    return at
