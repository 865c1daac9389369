"""Several drives over the same places: what they say together, how far they agree, which place to visit.

The model of a value y of pass i over cell k of the road: y_ik = mu_k (1 + d_i + e_ik) + s_ik. s is the estimate's own
error, whose standard error follows from those in the log (``WindowErrors``). d is common to a drive: calibration, tire
pressure, load, temperature. e is of the pass alone: its lane, and the metres by which it was laid wrong. The last two
are not known beforehand; their variances are estimated from all cells that were passed more than once (moments of the
random-effects model; DerSimonian & Laird, "Meta-analysis in clinical trials", Controlled Clinical Trials 7, 1986), and
stand in each standard error. The variance of d does not fall with the passes of one drive over a place, nor with the
length of a stretch: it falls with the number of drives. Of s, what is common to all windows of a car and its sensor
does not fall with anything; the difference of two periods does not have it. So it is with the part of s that drives
over one place have alike.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from logger.arrays import Array, Bools, Indices, Rows, Whole
from logger.roads.sections import WindowErrors, errors_of_means

_CELLS = 1 << 20
_BITS = 24


def place_key(way: Indices, along_m: Array, length_m: float) -> Whole:
    """One whole number for the cell of a way that a place lies in (n,): cells of a length from the measure 0 on. -1
    where the way or the measure is not known."""
    known = (way >= 0) & np.isfinite(along_m)
    cell = np.floor(np.where(known, along_m, 0.0) / length_m).astype(np.int64)
    return np.where(known, (np.asarray(way, np.int64) << _BITS) | (cell + _CELLS), -1)


def way_and_cell(key: Whole) -> tuple[Indices, Indices]:
    """Ways and numbers of cells along them (n,), which may be negative."""
    return (key >> _BITS).astype(np.intp), (key & ((1 << _BITS) - 1)).astype(np.intp) - _CELLS


@dataclass(frozen=True, eq=False)
class Passes(Rows):
    """Passes of drives over cells (p,), sorted by cell: one row for each drive and cell.

    key           of the cell
    drive         number of the drive
    time_s        when, seconds since 1970; NaN: not known
    iri_m_per_km  mean over the windows of the drive in the cell, by length, and ``iri_errors`` of that
    known_m       how much of the road that is: twice the cell where the drive came twice [m]
    """

    key: Whole
    drive: Indices
    time_s: Array
    iri_m_per_km: Array
    iri_errors: WindowErrors
    known_m: Array

    @property
    def own_variance(self) -> Array:
        """Of each, without what is common to all [(m/km)2]."""
        return self.iri_errors.std**2 - self.iri_errors.parts()[1] ** 2


def passes_of(way: Indices, start_m: Array, end_m: Array, drive: Indices, time_s: Array, iri: Array,
              errors: WindowErrors, length_m: float) -> Passes:
    """Windows (n,) from and to measures of ways, in cells of a length; a window across a limit counts in each cell by
    its part. NaN in ``iri`` or its error, and negative ways, are left out."""
    rounding = 1e-9  # of a measure, in cells
    known = (way >= 0) & np.isfinite(iri) & np.isfinite(errors.std) & (end_m > start_m)
    first = np.floor(np.where(known, start_m, 0.0) / length_m + rounding).astype(np.int64)
    count = np.where(known, np.ceil(np.where(known, end_m, 0.0) / length_m - rounding).astype(np.int64) - first, 0)
    window = np.repeat(np.arange(len(way)), count)
    cell = first[window] + np.arange(len(window)) - np.repeat(np.cumsum(count) - count, count)
    piece_m = np.minimum(end_m[window], (cell + 1) * length_m) - np.maximum(start_m[window], cell * length_m)
    window, cell, piece_m = (one[piece_m > 0] for one in (window, cell, piece_m))
    key = place_key(way[window], (cell + 0.5) * length_m, length_m)
    order = np.lexsort((drive[window], key))
    window, key, piece_m = window[order], key[order], piece_m[order]
    begin = np.diff(key, prepend=-2).astype(bool) | np.diff(drive[window], prepend=-1).astype(bool)
    begins = np.flatnonzero(begin)

    def total(values: Array) -> Array:
        return np.asarray(np.add.reduceat(values, begins), dtype=np.float64)

    known_m = total(piece_m)
    return Passes(key[begins], drive[window][begins], total(time_s[window] * piece_m) / known_m,
                  total(iri[window] * piece_m) / known_m,
                  errors_of_means(errors, iri, (start_m + end_m) / 2, end_m - start_m, window, piece_m,
                                  np.cumsum(begin) - 1, len(begins)), known_m)


@dataclass(frozen=True)
class Scatter:
    """What scatters between passes beyond their own standard errors, each a share of the IRI; NaN: no cell was passed
    twice, so it is not known.

    drive    standard deviation of what is common to a drive
    passes   of what is of each pass alone
    alike    share of the variance of their own errors that drives over one place have alike
    """

    drive: float
    passes: float
    alike: float = 0.0


def scatter_of(passes: Passes) -> Scatter:
    """Both variances out of all cells that several drives passed, by their moments; never negative. Passes that differ
    less than their own errors have a part of these alike: what no drive resolves is the same road each time."""
    key, cell = np.unique(passes.key, return_inverse=True)
    count = np.bincount(cell, minlength=len(key))
    several = count[cell] > 1
    if not several.any():
        return Scatter(float("nan"), float("nan"))
    mean = np.bincount(cell, passes.iri_m_per_km) / np.maximum(count, 1)
    several &= mean[cell] > 0
    ratio = passes.iri_m_per_km[several] / mean[cell][several] - 1.0
    own = passes.own_variance[several] / mean[cell][several]**2
    # Residuals against a mean of c passes have (c - 1) / c of the variance.
    share = 1.0 - 1.0 / count[cell][several]
    expected = float(np.sum(share * own))
    alike = max(1.0 - float(np.sum(ratio**2)) / expected, 0.0) if expected > 0 else 0.0
    all_of_it = max(float(np.sum(ratio**2 - share * own) / np.sum(share)), 0.0)
    drive = passes.drive[several]
    number = np.bincount(drive)
    sums = np.bincount(drive, ratio)
    within = np.bincount(drive, share * (own + all_of_it))
    use = number > 1
    # The sum over m cells of one drive: m^2 share^2 of the drive's own, and the sum of the rest.
    level = sums[use]**2 - within[use]
    weight = np.bincount(drive, share)[use]**2 - np.bincount(drive, share)[use]
    common = max(float(level.sum() / weight.sum()), 0.0) if len(weight) and weight.sum() > 0 else 0.0
    common = min(common, all_of_it)
    return Scatter(float(np.sqrt(common)), float(np.sqrt(all_of_it - common)), alike)


@dataclass(frozen=True, eq=False)
class Means:
    """Cells (k,) by growing key.

    drives              how many passed each
    iri_m_per_km        mean, weighted by the variances of the passes, with its standard error
    common_std_m_per_km    what of that its drives have alike
    first_s, last_s     of the passes [s since 1970]; NaN: not known
    """

    key: Whole
    drives: Indices
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    common_std_m_per_km: Array
    first_s: Array
    last_s: Array


def variances(passes: Passes, scatter: Scatter) -> Array:
    """Of each pass (p,): its own, and what the scatter adds at its cell [(m/km)2]; without what is common to all."""
    _, cell = np.unique(passes.key, return_inverse=True)
    level = (np.bincount(cell, passes.iri_m_per_km) / np.maximum(np.bincount(cell), 1))[cell]
    return np.asarray(passes.own_variance
                      + (np.nan_to_num(scatter.drive)**2 + np.nan_to_num(scatter.passes)**2) * level**2)


def _weighted(passes: Passes, scatter: Scatter) -> tuple[Whole, Indices, Array, Array]:
    """Keys of the cells (k,), the cell and the weight of each pass (p,), and the sums of the weights (k,)."""
    key, cell = np.unique(passes.key, return_inverse=True)
    weight = 1.0 / np.maximum(variances(passes, scatter), 1e-12)
    return key, cell, weight, np.asarray(np.bincount(cell, weight, len(key)), dtype=np.float64)


def means(passes: Passes, scatter: Scatter) -> Means:
    """The mean of the passes over each cell."""
    key, cell, weight, total = _weighted(passes, scatter)
    first, last = np.full(len(key), np.inf), np.full(len(key), -np.inf)
    np.fmin.at(first, cell, passes.time_s)
    np.fmax.at(last, cell, passes.time_s)
    own = np.sqrt(np.maximum(passes.own_variance, 0.0))
    common, mean_own, square = (np.bincount(cell, one, len(key)) / total for one in (
        weight * passes.iri_errors.parts()[1], weight * own, (weight * own) ** 2 / total[cell]))
    common = np.sqrt(common**2 + scatter.alike * np.maximum(mean_own**2 - square, 0.0))
    return Means(key, np.bincount(cell, minlength=len(key)).astype(np.intp),
                 np.bincount(cell, weight * passes.iri_m_per_km, len(key)) / total, np.sqrt(1.0 / total + common**2),
                 common, np.where(np.isfinite(first), first, np.nan), np.where(np.isfinite(last), last, np.nan))


@dataclass(frozen=True, eq=False)
class Changes:
    """What changed in cells (k,), by growing key.

    drives                     in either period, anywhere
    before, after              drives in either period
    change_m_per_km            mean after less mean before, with its standard error
    p_value                    of a change so large either way where there is none (normal distribution)
    false_share                share of false finds among all cells whose value is not above this one's (Benjamini &
                               Hochberg, J. R. Stat. Soc. B 57, 1995): 0.05 here means that of the cells listed up to
                               this one 5 % did not change
    mean_m_per_km              mean change of these cells, with its standard error; NaN where there is none
    """

    key: Whole
    drives: tuple[int, ...]
    before: Indices
    after: Indices
    change_m_per_km: Array
    change_std_m_per_km: Array
    p_value: Array
    false_share: Array
    mean_m_per_km: float
    mean_std_m_per_km: float


def changes(passes: Passes, scatter: Scatter, split_s: float, length_m: float) -> Changes:
    """The difference of two periods, before an instant and from it on, in the cells of a length that were passed in
    both."""
    early = passes.time_s < split_s
    late = passes.time_s >= split_s
    one, other = means(passes.of(early), scatter), means(passes.of(late), scatter)
    key, here, there = np.intersect1d(one.key, other.key, return_indices=True)
    change = other.iri_m_per_km[there] - one.iri_m_per_km[here]
    variance = sum(mean.iri_std_m_per_km[rows] ** 2 - mean.common_std_m_per_km[rows] ** 2
                   for mean, rows in ((one, here), (other, there)))
    std = np.sqrt(variance)
    p_value = two_sided(change / std)
    mean = _mean_change(passes.of((early | late) & np.isin(passes.key, key)), scatter, split_s, length_m)
    drives = tuple(len(np.unique(passes.drive[which])) for which in (early, late))
    return Changes(key, drives, one.drives[here], other.drives[there], change, std, p_value, false_discovery(p_value),
                   *mean)


def _mean_change(passes: Passes, scatter: Scatter, split_s: float, length_m: float) -> tuple[float, float]:
    """The mean over cells that were passed in both periods, with its standard error: what is common to a drive does not
    fall with its cells; what is common to all is in it as far as it differs. Drives that have errors alike differ by
    less, which is not counted here, as it is not in one cell."""
    if not len(passes.key):
        return float("nan"), float("nan")
    period = (passes.time_s >= split_s).astype(np.intp)
    found = _group_means(passes, replace(scatter, alike=0.0), length_m, period)
    change, common = (float(np.diff(one)[0]) for one in (found.mean, found.common))
    return change, float(np.sqrt(found.variance.sum() + common**2))


@dataclass(frozen=True, eq=False)
class Trends:
    """How fast cells (k,) change, those with passes at two times at least.

    per_year_m_per_km     slope of a weighted straight line, with its standard error
    p_value, false_share  as of ``Changes``
    """

    key: Whole
    drives: Indices
    per_year_m_per_km: Array
    per_year_std_m_per_km: Array
    p_value: Array
    false_share: Array


def trends(passes: Passes, scatter: Scatter) -> Trends:
    """A straight line through the passes over each cell."""
    year_s = 365.25 * 86_400.0
    dated = passes.of(np.isfinite(passes.time_s))
    key, cell, weight, total = _weighted(dated, scatter)
    year = dated.time_s / year_s
    aside = year - (np.bincount(cell, weight * year, len(key)) / total)[cell]
    spread = np.bincount(cell, weight * aside**2, len(key))
    days = spread / np.maximum(total, 1e-300) > (1.0 / 365.25)**2
    slope = np.bincount(cell, weight * aside * dated.iri_m_per_km, len(key))[days] / spread[days]
    std = 1.0 / np.sqrt(spread[days])
    p_value = two_sided(slope / std)
    drives = np.bincount(cell, minlength=len(key)).astype(np.intp)
    return Trends(key[days], drives[days], slope, std, p_value, false_discovery(p_value))


def false_discovery(p_value: Array) -> Array:
    """Share of false finds (m,) among all tests whose p value is not above each one's (Benjamini & Hochberg 1995)."""
    order = np.argsort(p_value)
    share = p_value[order] * len(p_value) / np.arange(1, len(p_value) + 1)
    found = np.empty_like(p_value)
    found[order] = np.minimum(np.minimum.accumulate(share[::-1])[::-1], 1.0)
    return found


def two_sided(z: Array) -> Array:
    """Probability of a normal deviate (n,) as far from 0 either way."""
    from scipy.special import ndtr

    return np.asarray(2.0 * ndtr(-np.abs(z)), dtype=np.float64)


BUMP, STRETCH, COMFORT = "single bump", "rough stretch", "comfort only"


@dataclass(frozen=True)
class PlaceToVisit:
    """A place of cells from one to before another of the means.

    kind                single bump, rough stretch or comfort only
    cells               numbers of its cells, in the order driven
    worst               number of the worst of them
    length_m            of all
    confidence          that its worst cell lies above the limit
    drives              that passed its worst cell
    """

    kind: str
    cells: tuple[int, ...]
    worst: int
    length_m: float
    confidence: float
    drives: int


def places_to_visit(mean: Means, a_w_mps2: Array, a_w_std_mps2: Array, length_m: float, above_m_per_km: float
                    ) -> tuple[PlaceToVisit, ...]:
    """The places of means over cells of a length (k,), those first that are furthest above their limit.

    Table 6.5 of Blum 2015 lists such places of a drive by the comfort there and the reason found. Here a place is a row
    of neighbouring cells of the road, of any length, of which each is as rough, or rides as badly, with so much
    confidence.

    a_w_mps2, a_w_std_mps2    of the cells; NaN: not known
    above_m_per_km            from which IRI a cell is rough
    """
    least_confidence = 0.8  # That a cell's true value lies above the limit: in four of five cases at least.
    uncomfortable_mps2 = 0.5  # From here on ISO 2631-1 (annex C.2.3) calls a ride fairly uncomfortable.
    bump_m = 30.0  # One obstacle shakes a car for some car's lengths: what is rough no further is one.
    rough = _confidence(mean.iri_m_per_km, mean.iri_std_m_per_km, above_m_per_km)
    felt = _confidence(a_w_mps2, a_w_std_mps2, uncomfortable_mps2)
    is_rough = rough >= least_confidence
    rows = _rows(mean, is_rough) + _rows(mean, (felt >= least_confidence) & ~is_rough)
    found = []
    for row in rows:
        comfort = not is_rough[row[0]]
        excess = a_w_mps2[row] / uncomfortable_mps2 if comfort else mean.iri_m_per_km[row] / above_m_per_km
        worst = int(row[np.argmax(excess)])
        reach_m = len(row) * length_m
        kind = COMFORT if comfort else BUMP if reach_m <= max(bump_m, length_m) else STRETCH
        place = PlaceToVisit(kind, tuple(row.tolist()), worst, reach_m, float((felt if comfort else rough)[worst]),
                      int(mean.drives[worst]))
        found.append((-float(excess.max()), worst, place))
    return tuple(place for _, _, place in sorted(found, key=lambda one: one[:2]))


def _confidence(value: Array, std: Array, limit: float) -> Array:
    """That the true value lies above a limit (k,); 0 where nothing is known."""
    from scipy.special import ndtr

    known = np.isfinite(value) & np.isfinite(std)
    z = (np.where(known, value, 0.0) - limit) / np.where(known, np.maximum(std, 1e-9), 1.0)
    return np.where(known, ndtr(z), 0.0)


def _rows(mean: Means, which: Bools) -> list[Indices]:
    """Cells that are chosen, in rows of neighbours on one way."""
    chosen = np.flatnonzero(which)
    if not len(chosen):
        return []
    way, cell = way_and_cell(mean.key[chosen])
    return np.split(chosen, np.flatnonzero((np.diff(way) != 0) | (np.diff(cell) != 1)) + 1)


WORDS = ("excellent", "good", "intermediate", "bad")
MARKS_M_PER_KM = (2.0, 4.0, 6.0, 8.0)
LIMITS_M_PER_KM = tuple((one + other) / 2 for one, other in pairwise(MARKS_M_PER_KM))
LEAST_COVERED = 0.5  # Share of a way that has to be known: with less, most of the way may be otherwise


@dataclass(frozen=True, eq=False)
class WayMeans:
    """Ways (w,) that drives passed.

    way             numbers of the ways
    covered_m       how much of each has an IRI [m]
    drives          how many drives gave it one
    iri_m_per_km    mean over what is covered, each piece of road counting by its length, with its standard error
    """

    way: Indices
    covered_m: Array
    drives: Indices
    iri_m_per_km: Array
    iri_std_m_per_km: Array


def way_means(passes: Passes, scatter: Scatter, cell_m: float) -> WayMeans:
    """Means over ways of passes over their cells.

    A cell is the mean of its passes, weighted by their variances; a way is the mean of its cells by length. What is
    common to a drive (``scatter``) does not fall with the cells that it passed.
    """
    if not len(passes.key):
        none = np.zeros(0, np.intp)
        return WayMeans(none, np.zeros(0), none, np.zeros(0), np.zeros(0))
    way, of = np.unique(way_and_cell(passes.key)[0], return_inverse=True)
    found = _group_means(passes, scatter, cell_m, of)
    return WayMeans(way, found.covered_m, found.drives, found.mean,
                    np.sqrt(found.variance + found.alike**2 + found.common**2))


@dataclass(frozen=True, eq=False)
class _GroupMeans:
    """Means over groups of passes (g,) [m/km].

    variance         of what each drive has alone
    alike, common    standard errors of what drives over one place, and all windows, have alike
    """

    covered_m: Array
    drives: Indices
    mean: Array
    variance: Array
    alike: Array
    common: Array


def _group_means(passes: Passes, scatter: Scatter, cell_m: float, of: Indices) -> _GroupMeans:
    """The means over the cells of each group, ``of`` the passes (p,): a cell as in ``way_means``, but in all groups by
    the length that each of them covers, as else how cells differ would be taken for a difference of the groups."""
    cells, cell = np.unique(np.stack([of, passes.key]), axis=1, return_inverse=True)
    cell = cell.ravel()
    weight = 1.0 / np.maximum(variances(passes, scatter), 1e-12)
    own_m = np.zeros(cell.max() + 1)
    np.maximum.at(own_m, cell, np.minimum(passes.known_m, cell_m))
    _, place = np.unique(cells[1], return_inverse=True)
    shared_m = np.full(place.max() + 1, np.inf)
    np.minimum.at(shared_m, place, own_m)
    length_m = shared_m[place]
    covered_m = np.zeros(of.max() + 1)
    np.add.at(covered_m, of[np.unique(cell, return_index=True)[1]], length_m)
    share = weight / np.bincount(cell, weight)[cell] * length_m[cell] / covered_m[of]
    mean: Array = np.asarray(np.bincount(of, share * passes.iri_m_per_km), dtype=np.float64)
    pair, which = np.unique(np.stack([of, passes.drive]), axis=1, return_inverse=True)
    which = which.ravel()
    by_drive = np.bincount(which, share)
    order = np.lexsort((passes.key, which))
    at_m = cell_m * passes.key.astype(np.float64)  # ways are far apart
    of_drives = errors_of_means(passes.iri_errors, passes.iri_m_per_km, at_m, share, order, share[order], which[order],
                                len(by_drive))
    of_drive = np.sqrt(of_drives.std**2 - of_drives.common_std**2) * by_drive
    variance: Array = (1 - scatter.alike) * np.asarray(np.bincount(pair[0], of_drive**2), dtype=np.float64)
    variance += np.bincount(of, share**2 * (variances(passes, Scatter(0.0, scatter.passes)) - passes.own_variance))
    variance += np.bincount(pair[0], by_drive**2) * (np.nan_to_num(scatter.drive) * mean)**2
    return _GroupMeans(covered_m, np.bincount(pair[0]).astype(np.intp), mean, variance,
                       np.sqrt(scatter.alike) * np.asarray(np.bincount(pair[0], of_drive), dtype=np.float64),
                       np.asarray(np.bincount(pair[0], of_drives.common_std * by_drive), dtype=np.float64))


def suggestion(iri_m_per_km: float, iri_std_m_per_km: float) -> tuple[str, float]:
    """The word for a mean IRI, and how likely the true one asks for the same word, by a normal distribution.

    Problem: the key is defined by which vehicles a way is fit for, not by a number. Solution: both sides have a scale
    in the speed at which a car is driven there. OpenStreetMap (wiki, ``Key:smoothness``, and the rules of thumb behind
    it): a car's speed is not affected on ``excellent`` and ``good`` ways, somewhat reduced (to 50 to 90 %) on
    ``intermediate`` ones, to less than half on ``bad`` ones. World Bank Technical Paper 46 (Sayers, Gillespie &
    Paterson 1986; also in ASTM E1926, appendix X2) describes paved roads at marks of the IRI: about 2 m/km is
    comfortable above 120 km/h, 4 up to 100 to 120 km/h, 6 up to 70 to 90 km/h, 8 up to 50 to 60 km/h. A way is given
    the word of the nearest mark.

    ``very_bad`` and worse ask for more clearance than a car has: that an IRI cannot show, so nothing worse than ``bad``
    is suggested.
    """
    from scipy.special import ndtr

    number = int(np.searchsorted(LIMITS_M_PER_KM, iri_m_per_km, side="right"))
    edges = np.array([-np.inf, *LIMITS_M_PER_KM, np.inf])[number: number + 2]
    low, high = ndtr((edges - iri_m_per_km) / max(iri_std_m_per_km, 1e-9))
    return WORDS[number], float(high - low)


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
    the same everywhere.

    Problem: one figure hides what another shows. R2 depends on how much the roads differ, a bias is mended by one
    factor, standard errors may be wrong where the values are right. Solution: all of them, side by side, of the same
    windows.
    """
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
    """Factor for estimates (n,): the geometric mean of reference over estimate; NaN: none is known."""
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
