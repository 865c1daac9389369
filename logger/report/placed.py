"""Rows of logs that have a place, as arrays; which of several drives lie on one place of the road, and what they say
together; and what of logs stands in no figure, and why."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Indices
from logger.chart_data import Array
from logger.left_out import LeftOut, counting
from logger.question import WINDOW
from logger.records import WindowRecord
from logger.report.summary import counts
from logger.roads.repeated_drives import means, passes_of, place_key, scatter_of
from logger.roads.road_matching import RoadNetwork, Trace, lay
from logger.roads.sections import WindowErrors
from logger.store.log.log_reader import LoggedFile
from logger.units import US_PER_S, WINDOW_M

_NOT_PLACED = frozenset(("gps_lost", "gps_late"))


def placed(one: WindowRecord) -> bool:
    """Whether a row has a place that the receiver gave, and a length that a window may have."""
    return (one.lat_deg is not None and one.lon_deg is not None and one.distance_start_m is not None
            and one.distance_end_m is not None and 0 < one.distance_end_m - one.distance_start_m <= WINDOW.high
            and _NOT_PLACED.isdisjoint(one.flags))


def trace_of(drive: Sequence[WindowRecord]) -> Trace:
    """Rows of a drive as they are laid on roads."""
    return Trace(column(drive, lambda one: one.lat_deg), column(drive, lambda one: one.lon_deg),
                 column(drive, lambda one: ((one.distance_start_m or 0.0) + (one.distance_end_m or 0.0)) / 2),
                 column(drive, lambda one: one.t_us / US_PER_S))


def column(rows: Sequence[WindowRecord], of: Callable[[WindowRecord], float | None]) -> Array:
    """Of each row one number, NaN for None."""
    return np.array([np.nan if (value := of(one)) is None else value for one in rows], dtype=np.float64)


def iri_errors(rows: Sequence[WindowRecord]) -> WindowErrors:
    """Standard errors of their IRI."""
    return WindowErrors(
        column(rows, lambda one: one.iri_std_m_per_km), column(rows, lambda one: one.iri_level_std_m_per_km),
        column(rows, lambda one: one.iri_common_std_m_per_km), column(rows, lambda one: one.iri_place_std_m_per_km))


_VERIFY = "('ridelog verify' lists them)"


def damaged(lines: int) -> LeftOut:
    """Lines of logs that cannot be read."""
    return LeftOut(lines, "damaged line", _VERIFY)


def of_files(files: Sequence[LoggedFile]) -> tuple[LeftOut, ...]:
    """What of logs cannot be read."""
    return counting([damaged(sum(one.damaged_lines for one in files))])


def of_passes(files: Sequence[LoggedFile], rows: Sequence[WindowRecord], figures_of: int) -> tuple[LeftOut, ...]:
    """Of rows by place: of the days that count are ``rows``, and on the ground of several in a drive are
    ``figures_of``."""
    every = sum(len(one.records) for one in files)
    known = sum(placed(one) and not _has_iri(one) for one in rows)
    return counting((*of_files(files), LeftOut(every - len(rows), "row", "of other days, or without a date"),
                     LeftOut(len(rows) - figures_of, "row", "without a position"),
                     LeftOut(known, "row", "without a usable IRI")))


def of_sections(files: Sequence[LoggedFile], used: Collection[WindowRecord], on_route: bool) -> tuple[LeftOut, ...]:
    """Of rows by their way, or by a route."""
    every = sum(len(one.records) for one in files)
    why = "off the route, or without a position" if on_route else "without a distance"
    return counting((*of_files(files), LeftOut(every - len(used), "row", why),
                     LeftOut(sum(not _has_iri(one) for one in used), "row", "without a usable IRI")))


def _has_iri(one: WindowRecord) -> bool:
    return one.iri_m_per_km is not None and counts(one)


MOST_ROWS = 30_000  # More take longer to lay over each other than a page should take to make: at 0.6 ms a row, 18 s


@dataclass(frozen=True, eq=False)
class PlacesPassed:
    """Places (p,) that more than one drive passed with an IRI.

    place           of rows (n,) the number of their place; NaN: no other drive came by
    drives          (p,) how many came by
    iri_m_per_km    (p,) their mean, with its standard error (``iri_std_m_per_km``)
    """

    place: Array
    drives: Indices
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
                       column(rows, lambda one: one.iri_m_per_km if counts(one) else None), iri_errors(rows), WINDOW_M)
    mean = means(passes, scatter_of(passes))
    key = place_key(way, middle_m, WINDOW_M)
    several = mean.drives > 1
    keys = mean.key[several]
    at = np.searchsorted(keys, key)
    known = np.append(keys, -1)[at] == key
    known &= key >= 0
    return PlacesPassed(np.where(known, at, np.nan), mean.drives[several], mean.iri_m_per_km[several],
                        mean.iri_std_m_per_km[several])
