"""Which rows of several drives lie on one place of the road, and what they say together: for the page of logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.chart_data import Array
from logger.records import WindowRecord
from logger.report.placed_rows import column, iri_errors, placed, trace_of
from logger.report.summary import counts
from logger.roads.repeated_drives import means, passes_of, place_key, scatter_of
from logger.roads.road_matching import lay
from logger.roads.road_network import Ints, RoadNetwork
from logger.units import WINDOW_M

MOST_ROWS = 30_000
"""More take longer to lay over each other than a page should take to make: at 0.6 ms a row, 18 s."""


@dataclass(frozen=True, eq=False)
class PlacesPassed:
    """Places (p,) that more than one drive passed with an IRI.

    place           of rows (n,) the number of their place; NaN: no other drive came by
    drives          (p,) how many came by
    iri_m_per_km    (p,) their mean, with its standard error (``iri_std_m_per_km``)
    """

    place: Array
    drives: Ints
    iri_m_per_km: Array
    iri_std_m_per_km: Array


def places_passed(drives: Sequence[Sequence[WindowRecord]]) -> PlacesPassed | None:
    """Lay drives over each other, in places of 25 ft. None where there is one drive, or too many rows."""
    rows = [one for drive in drives for one in drive]
    if len(drives) < 2 or len(rows) > MOST_ROWS:
        return None
    number = np.repeat(np.arange(len(drives)), [len(drive) for drive in drives])
    on = np.array([placed(one) for one in rows], dtype=bool)
    way, middle_m = np.full(len(rows), -1, np.intp), np.full(len(rows), np.nan)
    chosen = [np.flatnonzero(on & (number == one)) for one in range(len(drives))]
    chosen = [one for one in chosen if len(one) > 1]
    found = lay(RoadNetwork(), [trace_of([rows[row] for row in one]) for one in chosen])
    for index, matched in zip(chosen, found, strict=True):
        way[index], middle_m[index] = matched.way, matched.along_m
    half_m = column(rows, lambda one: (one.distance_end_m or 0.0) - (one.distance_start_m or 0.0)) / 2
    passes = passes_of(way, middle_m - half_m, middle_m + half_m, number, np.zeros(len(rows)),
                       column(rows, lambda one: one.iri_m_per_km if counts(one) else None),
                       iri_errors(rows), WINDOW_M)
    mean = means(passes, scatter_of(passes))
    key = place_key(way, middle_m, WINDOW_M)
    several = mean.drives > 1
    keys = mean.key[several]
    at = np.searchsorted(keys, key)
    known = np.append(keys, -1)[at] == key
    known &= key >= 0
    return PlacesPassed(np.where(known, at, np.nan), mean.drives[several], mean.iri_m_per_km[several],
                        mean.iri_std_m_per_km[several])
