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
    of what is ``mine`` (n,) there and of ``mean_between`` correlate best; 0 where too little is known.

    The values should be of pieces much shorter than the places are long: a mean over parts of two long ones is smoother
    than either, and would correlate better for that alone.
    """
    best_m, best = 0.0, -np.inf
    for shift_m in np.arange(-np.floor(most_m), np.floor(most_m) + 1):
        found = _correlation(mine, mean_between(edges_m, values, begin_m + shift_m, end_m + shift_m))
        if found > best + 1e-12:
            best_m, best = float(shift_m), found
    return best_m


def matching_cells(begin_m: Array, mine: Array, other_m: Array, theirs: Array, most: int) -> tuple[Array, int]:
    """For cells that begin at places (n,) and hold what is ``mine`` (n,), the nearest of those that begin at
    ``other_m`` (k,), growing, with ``theirs`` (k,): values (n,), NaN where none is within half a cell; and by how many
    whole cells, at most so many either way, they had to be moved along so that the logarithms correlate best.

    Whole ones, and no means of two: those would be smoother than what was measured.
    """
    after = np.clip(np.searchsorted(other_m, begin_m), 1, len(other_m) - 1)
    nearest = after - (begin_m - other_m[after - 1] < other_m[after] - begin_m)
    half_m = float(np.median(np.diff(begin_m))) / 2
    near = np.abs(other_m[nearest] - begin_m) <= half_m * (1 + 1e-9)
    best, best_cells, best_values = -np.inf, 0, np.full(len(begin_m), np.nan)
    for cells in sorted(range(-most, most + 1), key=abs):
        moved = nearest + cells
        inside = near & (moved >= 0) & (moved < len(theirs))
        values = np.where(inside, theirs[np.clip(moved, 0, len(theirs) - 1)], np.nan)
        if (found := _correlation(mine, values)) > best + 1e-12 or not np.isfinite(best_values).any():
            best, best_cells, best_values = found, cells, values
    return best_values, best_cells


def _correlation(mine: Array, theirs: Array) -> float:
    """Of the logarithms; minus infinity where fewer than half are known."""
    known = (mine > 0) & (theirs > 0)
    if np.count_nonzero(known) < max(3, len(mine) // 2):
        return -np.inf
    a, b = np.log(mine[known]), np.log(theirs[known])
    return float(np.corrcoef(a, b)[0, 1]) if np.ptp(a) > 0 and np.ptp(b) > 0 else -np.inf
