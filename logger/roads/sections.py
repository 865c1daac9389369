"""Roads in sections of one length, and the words for how rough they are.

Words for an IRI: which roads have it (Table 2.3 of Blum 2015) and how they ride (Table 2.4; ASTM E1926).

Table 2.3 gives ranges that overlap on purpose: an old pavement may be as smooth as a new one. So a value has every
kind of road whose range holds it, and none below or above all of them. Table 2.4 writes its descriptions along a
scale from 0 to 12 m/km; here each one holds from the mark it stands at (the first from 0) to that of the next.

Means of windows over sections of road that are as long as an agency files them.

The IRI of a section is the mean of the rectified slope over it (ASTM E1926), so it is the mean of its windows' IRI by
length; a window across a limit counts in both sections by its parts. Its standard error is that of ``window_errors``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.roads.window_errors import WindowErrors, errors_of_means
from logger.units import INCH_PER_MILE_M_PER_KM

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


Array = npt.NDArray[np.float64]

_ROUNDING = 1e-9  # of a measure, in windows


@dataclass(frozen=True, eq=False)
class Windows:
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

    def of(self, rows: npt.NDArray[np.intp]) -> Windows:
        """Some of them."""
        return Windows(self.start_m[rows], self.end_m[rows], self.duration_s[rows], self.iri_m_per_km[rows],
                       self.iri_errors.of(rows), self.mean_square[rows])


@dataclass(frozen=True, eq=False)
class Sections:
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


def sections(windows: Windows, edges_m: Array) -> Sections:
    """The windows in sections between growing limits (k + 1,) [m]; what lies outside is left out."""
    count = len(edges_m) - 1
    piece_m, window, section = _pieces(windows, edges_m)
    share = piece_m / (windows.end_m - windows.start_m)[window]

    def total(weight: Array) -> Array:
        return np.asarray(np.bincount(section, weight, count), dtype=np.float64)

    iri = windows.iri_m_per_km[window]
    known = np.isfinite(iri)
    known_m = total(np.where(known, piece_m, 0.0))
    errors = errors_of_means(
        windows.iri_errors, windows.iri_m_per_km, (windows.start_m + windows.end_m) / 2,
        windows.end_m - windows.start_m, window[known], piece_m[known], section[known], count)
    time_s, square = (share * windows.duration_s[window]), windows.mean_square[window]
    felt_s = total(np.where(np.isfinite(square), time_s, 0.0))
    driven_m = total(piece_m)
    worst, worst_at_m = _worst(windows, window, section, count)
    return Sections(
        edges_m, driven_m, known_m, _ratio(total(np.nan_to_num(iri * piece_m)), known_m),
        errors, np.sqrt(_ratio(total(np.nan_to_num(square * time_s)), felt_s)), _ratio(driven_m, total(time_s)),
        worst, worst_at_m)


def _pieces(windows: Windows, edges_m: Array) -> tuple[Array, npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Parts of windows inside one section each: lengths [m], windows, sections."""
    cuts = np.unique(np.concatenate([windows.start_m, windows.end_m, edges_m]))
    middle_m = (cuts[1:] + cuts[:-1]) / 2
    window = np.searchsorted(windows.start_m, middle_m, side="right") - 1
    section = np.searchsorted(edges_m, middle_m, side="right") - 1
    piece_m = np.diff(cuts)
    inside = (window >= 0) & (middle_m < windows.end_m[window]) & (section >= 0) & (section < len(edges_m) - 1)
    inside &= piece_m > _ROUNDING * (windows.end_m - windows.start_m)[window]
    return piece_m[inside], window[inside], section[inside]


def _worst(windows: Windows, window: npt.NDArray[np.intp], section: npt.NDArray[np.intp], count: int
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
