"""How well estimates of IRI agree with a reference, window by window, and how two lines of windows are laid together.

Problem: one figure hides what another shows. R2 depends on how much the roads differ, a bias is mended by one factor,
standard errors may be wrong where the values are right. Solution: all of them, side by side, of the same windows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Agreement:
    """Figures of n windows.

    r2            1 - mean(error^2) / var(reference), of the IRI itself; a constant bias counts
    r2_log        the same of the IRI's logarithm
    mae_m_per_km  mean of the absolute error [m/km]
    bias          mean error over mean reference
    within_one    share of windows within one standard error, 0.68 where those are right; NaN: there are none
    within_two    within two, 0.95
    """

    windows: int
    r2: float
    r2_log: float
    mae_m_per_km: float
    bias: float
    within_one: float
    within_two: float


def agreement(iri_m_per_km: Array, iri_std_m_per_km: Array | None, reference_m_per_km: Array) -> Agreement | None:
    """Of arrays (n,), where both are known and above 0; None for fewer than two such windows, or a reference that is
    the same everywhere."""
    known = (iri_m_per_km > 0) & (reference_m_per_km > 0)  # False for NaN
    mine, theirs = iri_m_per_km[known], reference_m_per_km[known]
    if len(mine) < 2 or np.ptp(theirs) == 0:
        return None
    error = mine - theirs
    within = (np.nan, np.nan)
    if iri_std_m_per_km is not None:
        away = np.abs(error) / iri_std_m_per_km[known]
        within = (float(np.mean(away <= 1)), float(np.mean(away <= 2)))
    return Agreement(len(mine), _r2(error, theirs), _r2(np.log(mine / theirs), np.log(theirs)),
                     float(np.mean(np.abs(error))), float(error.mean() / theirs.mean()), *within)


def _r2(error: Array, truth: Array) -> float:
    return float(1 - np.mean(error**2) / np.var(truth))


def factor_to(iri_m_per_km: Array, reference_m_per_km: Array) -> float:
    """What estimates (n,) are to be multiplied by: the geometric mean of reference over estimate; NaN: none is
    known."""
    known = (iri_m_per_km > 0) & (reference_m_per_km > 0)
    if not known.any():
        return float("nan")
    return float(np.exp(np.mean(np.log(reference_m_per_km[known] / iri_m_per_km[known]))))


def mean_between(edges_m: Array, values: Array, begin_m: Array, end_m: Array) -> Array:
    """Mean (n,) of values (k,), constant between edges (k + 1,) that grow, from places (n,) to places (n,); NaN beyond
    the edges, where a value is NaN, and where the end is not behind the beginning."""
    known = np.isfinite(values)
    length_m = np.diff(edges_m)
    sums = np.concatenate([[0.0], np.cumsum(np.where(known, values, 0.0) * length_m)])
    holes_m = np.concatenate([[0.0], np.cumsum(np.where(known, 0.0, length_m))])
    ends = (begin_m, end_m)
    total, missing_m = (np.subtract(*(np.interp(at, edges_m, one) for at in reversed(ends))) for one in (sums, holes_m))
    way_m = end_m - begin_m
    whole = (begin_m >= edges_m[0]) & (end_m <= edges_m[-1]) & (way_m > 0) & (missing_m <= 1e-9 * length_m.max())
    return np.where(whole, total / np.where(whole, way_m, 1.0), np.nan)


def best_shift_m(edges_m: Array, values: Array, begin_m: Array, end_m: Array, mine: Array, most_m: float) -> float:
    """By how much places (n,) are to be moved along, at most so far either way, in steps of 1 m, so that the logarithms
    of what is ``mine`` (n,) there and of ``mean_between`` correlate best; 0 where too little is known."""
    best_m, best = 0.0, -np.inf
    for shift_m in np.arange(-np.floor(most_m), np.floor(most_m) + 1):
        theirs = mean_between(edges_m, values, begin_m + shift_m, end_m + shift_m)
        known = (mine > 0) & (theirs > 0)
        if np.count_nonzero(known) < max(3, len(mine) // 2):
            continue
        a, b = np.log(mine[known]), np.log(theirs[known])
        if np.ptp(a) > 0 and np.ptp(b) > 0 and (found := float(np.corrcoef(a, b)[0, 1])) > best + 1e-12:
            best_m, best = float(shift_m), found
    return best_m
