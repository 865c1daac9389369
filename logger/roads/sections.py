"""Roads in sections of one length: their IRI with its error, and the words for how rough they are.

Problem: the IRI of a section is the mean of its windows', but their errors are not independent: added as if they were,
sections of 0.1 mi were out by 1.6 to 3.8 times their standard errors. Solution: each error is the sum of four parts,
and each part has its own rule.

own       what the readings leave open of the slope; its memory is a metre or two, so variances add
level     how rough the road is there is not known better; the error fades along the way as exp(-d / 30 m). Measured
          over simulated drives of 4.2 km (10 to 70 mph, 2 and 4 g, noise 0.147 m/s2) on roads that change in steps,
          slowly, not at all, and that have holes: of 8, 15, 30, 45, 60, 120 and 1000 m the likeliest is 30 m; at 2 g
          its log likelihood is 9 above that of 15 m and 22 above that of 45 m
common    numbers of the vehicle and of the sensor are wrong; all windows of a car share it
place     a window lies some way on: what one gains at its end its neighbour loses, so a row of windows is off as much
          as its two ends are

A window cut by a limit counts with the mean of all of it, and so with the error of all of it. The road of a part may be
rougher than the rest. The excess of a mean over small stretches is that of a random walk tied at both ends; how far it
walks shows in the differences of neighbouring windows. No part differs more than a point does: the magnitude of a
normal deviate has a variance of pi / 2 - 1 times its squared mean. The variance of a part is half the harmonic mean of
both limits: its root is within a tenth of that of roads of ISO 8608, for 0.05 to 4 m of windows of 7.6 m.

Words for an IRI: which roads have it (Table 2.3 of Blum 2015) and how they ride (Table 2.4; ASTM E1926).

Table 2.3 gives ranges that overlap on purpose: an old pavement may be as smooth as a new one. So a value has every
kind of road whose range holds it, and none below or above all of them. Table 2.4 writes its descriptions along a
scale from 0 to 12 m/km; here each one holds from the mark it stands at (the first from 0) to that of the next.

The IRI of a section is the mean of the rectified slope over it (ASTM E1926), so it is the mean of its windows' IRI by
length; a window across a limit counts in both sections by its parts.
"""

from dataclasses import dataclass
from math import log, pi

import numpy as np

from logger.arrays import ROUNDING, Array, Indices, Rows
from logger.units import INCH_PER_MILE_M_PER_KM

ALONG_M = 30.0
_ERROR_ROUNDING = 0.0005 * (1 + 3**0.5)  # of a whole and three parts with three decimals


@dataclass(frozen=True, eq=False)
class WindowErrors(Rows):
    """Standard errors of windows (n,) [m/km], whole and by their parts; NaN: not known.

    Logs of older programs have the whole alone. Then all of it counts as that of the level: this is what was measured
    to make sections right. So it does where parts are negative, or larger together than the whole.
    """

    std: Array
    level_std: Array
    common_std: Array
    place_std: Array

    @classmethod
    def undivided(cls, std: Array) -> "WindowErrors":
        """Of which the whole alone is known."""
        nothing = np.full(len(std), np.nan)
        return cls(std, nothing, nothing, nothing)

    @property
    def own_variance(self) -> Array:
        """What the windows do not share [(m/km)2]."""
        level_std, common_std, place_std = self.parts()
        return np.maximum(self.std**2 - level_std**2 - common_std**2 - place_std**2, 0.0)

    def parts(self) -> tuple[Array, Array, Array]:
        """Level, common and place, where they are possible; else all as level."""
        parts = np.stack([self.level_std, self.common_std, self.place_std])
        with np.errstate(over="ignore"):
            possible = (parts >= 0).all(axis=0) & (np.sqrt((parts**2).sum(axis=0)) <= self.std + _ERROR_ROUNDING)
        return (np.where(possible, self.level_std, self.std), np.where(possible, self.common_std, 0.0),
                np.where(possible, self.place_std, 0.0))


def errors_of_means(errors: WindowErrors, iri: Array, at_m: Array, length_m: Array, window: Indices, piece_m: Array,
                    group: Indices, count: int) -> WindowErrors:
    """Standard errors of means by length (count,), whole and by their parts.

    errors, iri, at_m, length_m    of windows (n,): IRI [m/km], middles and lengths [m]
    window, piece_m, group         of pieces (p,): the window that each is cut from, how long it is [m], and the mean
                                   that it counts in; those of one mean stand together, in the order driven, and are of
                                   different windows
    """
    point_share, faded = pi / 2 - 1, 1e-3
    of_windows, whole_m = errors.of(window), length_m[window]
    level_std, common_std, place_std = of_windows.parts()
    level_std = level_std * piece_m

    def total(values: Array, of: Indices = group) -> Array:
        return np.asarray(np.bincount(of, values, count), dtype=np.float64)

    walk, point = _scatter_share(iri) * np.maximum(whole_m - piece_m, 0.0), point_share * piece_m
    excess = np.divide(walk * point, walk + point, out=np.zeros(len(group)), where=walk + point > 0)
    own = total(piece_m**2 * of_windows.own_variance + piece_m * excess * np.nan_to_num(iri[window]) ** 2)
    level = total(level_std**2)
    for lag in range(1, len(group)):
        apart_m = np.abs(at_m[window[lag:]] - at_m[window[:-lag]])
        near = (group[lag:] == group[:-lag]) & (apart_m < -ALONG_M * log(faded))
        if not near.any():
            break
        pairs = 2 * level_std[lag:] * level_std[:-lag] * np.exp(-apart_m / ALONG_M)
        level += total(pairs[near], group[lag:][near])
    middle_m = at_m[window]
    apart = np.abs(np.diff(middle_m)) > 0.75 * (whole_m[1:] + whole_m[:-1])
    ends = (np.diff(group) != 0) | apart
    first, last = np.append(True, ends)[:len(group)], np.append(ends, True)[:len(group)]
    share = np.divide(piece_m, whole_m, out=np.ones(len(group)), where=whole_m > 0)
    moved = (place_std * whole_m) ** 2 / 2
    place = total(moved * share**2 * (first.astype(np.float64) + last))
    place += total(np.where(ends, 0.0, np.diff(share) ** 2 * (moved[1:] + moved[:-1]) / 2), group[1:])
    common, known_m = total(common_std * piece_m), total(piece_m)
    return WindowErrors(*(np.divide(one, known_m, out=np.full(count, np.nan), where=known_m > 0) for one in (
        np.sqrt(own + level + common**2 + place), np.sqrt(level), common, np.sqrt(place))))


def _scatter_share(iri: Array) -> float:
    """Variance of windows (n,) about the road (half the mean square step), as a share of the mean square."""
    steps, known = np.diff(iri), iri[np.isfinite(iri)]
    steps = steps[np.isfinite(steps)]
    return float(np.mean(steps**2) / 2 / np.mean(known**2)) if len(steps) and known.any() else 0.0


# Lowest and highest IRI [m/km] and the kind of road.
ROAD_RANGES = (
    (0.25, 1.75, "airport runways and superhighways"),
    (1.50, 3.25, "new pavements"),
    (2.25, 5.75, "older pavements"),
    (3.25, 10.00, "maintained unpaved roads"),
    (4.00, 10.75, "damaged pavements"),
    (8.00, 20.00, "rough unpaved roads"),
)

# From which IRI [m/km], and how a paved road of it rides.
RIDES = (
    (0.0, "comfortable above 120 km/h; no potholes or corrugations to notice"),
    (4.0, "comfortable up to 100-120 km/h; movements felt at 80 km/h, some dips, patches or shallow potholes"),
    (6.0, "comfortable up to 70-90 km/h; strong movements and swaying, frequent dips or patches, some potholes"),
    (8.0, "comfortable up to 50-60 km/h; frequent sharp movements, deep dips and frequent potholes"),
    (10.0, "too rough for 50 km/h; many deep dips and potholes, surface breaking up"),
)

# Where good ends and how far fair reaches: 23 CFR 490.313 (b)(1), of the Interstate and National Highway System.
GOOD_BELOW_IN_PER_MI, FAIR_TO_IN_PER_MI = 95.0, 170.0
FEDERAL_WORDS = ("good", "fair", "poor")


def federal_condition(iri_m_per_km: float) -> str:
    """Good, fair or poor by the IRI of a section of 0.1 mi (23 CFR 490.313: below 95 in/mi, up to 170, above)."""
    in_per_mi = iri_m_per_km / INCH_PER_MILE_M_PER_KM
    if in_per_mi < GOOD_BELOW_IN_PER_MI:
        return "good"
    return "fair" if in_per_mi <= FAIR_TO_IN_PER_MI else "poor"


def road_kinds(iri_m_per_km: float) -> tuple[str, ...]:
    """The kinds of road that usually have this IRI [m/km], smoothest first; none outside every range."""
    return tuple(kind for lowest, highest, kind in ROAD_RANGES if lowest <= iri_m_per_km <= highest)


def ride_words(iri_m_per_km: float) -> str:
    """How a paved road of this IRI [m/km] rides. ValueError for a negative value or NaN."""
    if not iri_m_per_km >= 0:
        raise ValueError(f"an IRI is 0 or more, not {iri_m_per_km}")
    return next(words for lowest, words in reversed(RIDES) if iri_m_per_km >= lowest)


@dataclass(frozen=True, eq=False)
class SectionWindows(Rows):
    """Windows of one way (n,), in order, none over another; NaN: not known, or to stand in no mean.

    start_m, end_m           [m]
    duration_s               [s]
    iri_m_per_km             and ``iri_errors`` of it
    mean_square              of the weighted acceleration [(m/s2)2]
    """

    start_m: Array
    end_m: Array
    duration_s: Array
    iri_m_per_km: Array
    iri_errors: WindowErrors
    mean_square: Array


@dataclass(frozen=True, eq=False)
class RoadSections:
    """Sections (k,) between limits (k + 1,) on the same way; NaN: not known.

    edges_m          limits [m]
    driven_m         how much of each windows cover, and ``known_m`` those with an IRI [m]
    iri_m_per_km     mean over that, and ``iri_errors`` of it
    a_w_mps2         weighted r.m.s. acceleration over the time for which it is known [m/s2]
    speed_mps        mean [m/s]
    worst_m_per_km   largest IRI of a window in it, and ``worst_at_m`` where the middle of that lies [m]
    """

    edges_m: Array
    driven_m: Array
    known_m: Array
    iri_m_per_km: Array
    iri_errors: WindowErrors
    a_w_mps2: Array
    speed_mps: Array
    worst_m_per_km: Array
    worst_at_m: Array

    @property
    def iri_std_m_per_km(self) -> Array:
        """(k,) Standard error of the IRI."""
        return self.iri_errors.std


def even_edges(end_m: float, length_m: float) -> Array:
    """Limits from 0 to beyond the end, a length apart; the last section may be longer than what was driven."""
    return np.asarray(length_m * np.arange(int(np.ceil(end_m / length_m - 1e-9)) + 1), dtype=np.float64)


def sections(windows: SectionWindows, edges_m: Array) -> RoadSections:
    """The windows in sections between growing limits (k + 1,) [m]; what lies outside is left out."""
    count = len(edges_m) - 1
    piece_m, window, section = _pieces(windows, edges_m)
    share = piece_m / (windows.end_m - windows.start_m)[window]

    def total(weight: Array) -> Array:
        return np.asarray(np.bincount(section, weight, count), dtype=np.float64)

    iri = windows.iri_m_per_km[window]
    known = np.isfinite(iri)
    known_m = total(np.where(known, piece_m, 0.0))
    errors = errors_of_means(windows.iri_errors, windows.iri_m_per_km, (windows.start_m + windows.end_m) / 2,
                             windows.end_m - windows.start_m, window[known], piece_m[known], section[known], count)
    time_s, square = (share * windows.duration_s[window]), windows.mean_square[window]
    felt_s = total(np.where(np.isfinite(square), time_s, 0.0))
    driven_m = total(piece_m)
    worst, worst_at_m = _worst(windows, window, section, count)
    return RoadSections(edges_m, driven_m, known_m, _ratio(total(np.nan_to_num(iri * piece_m)), known_m), errors,
                        np.sqrt(_ratio(total(np.nan_to_num(square * time_s)), felt_s)), _ratio(driven_m, total(time_s)),
                        worst, worst_at_m)


def _pieces(windows: SectionWindows, edges_m: Array) -> tuple[Array, Indices, Indices]:
    """Parts of windows inside one section each: lengths [m], windows, sections."""
    cuts = np.unique(np.concatenate([windows.start_m, windows.end_m, edges_m]))
    middle_m = (cuts[1:] + cuts[:-1]) / 2
    window = np.searchsorted(windows.start_m, middle_m, side="right") - 1
    section = np.searchsorted(edges_m, middle_m, side="right") - 1
    piece_m = np.diff(cuts)
    inside = (window >= 0) & (middle_m < windows.end_m[window]) & (section >= 0) & (section < len(edges_m) - 1)
    inside &= piece_m > ROUNDING * (windows.end_m - windows.start_m)[window]
    return piece_m[inside], window[inside], section[inside]


def _worst(windows: SectionWindows, window: Indices, section: Indices, count: int
           ) -> tuple[Array, Array]:
    iri = np.nan_to_num(windows.iri_m_per_km[window], nan=-np.inf)
    order = np.lexsort((iri, section))
    last = np.searchsorted(section[order], np.arange(count), side="right") - 1
    there = (last >= 0) & (section[order][last] == np.arange(count)) if len(order) else np.zeros(count, bool)
    found, at_m = np.full(count, np.nan), np.full(count, np.nan)
    best = order[last[there]] if len(order) else np.zeros(0, np.intp)
    known = np.isfinite(iri[best])
    places = np.flatnonzero(there)[known]
    found[places] = iri[best][known]
    at_m[places] = ((windows.start_m + windows.end_m) / 2)[window[best]][known]
    return found, at_m


def _ratio(total: Array, over: Array) -> Array:
    return np.divide(total, over, out=np.full(len(over), np.nan), where=over > 0)
