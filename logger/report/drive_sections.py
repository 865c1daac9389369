"""Drives of logs in sections of one length, and their places as a layer for other programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from logger.chart_data import Array
from logger.records import WindowRecord
from logger.report.placed_rows import column, iri_errors, placed, trace_of
from logger.report.summary import counts, expected_square
from logger.roads.iri import Area, areas
from logger.roads.road_matching import ALONG, on_route
from logger.roads.road_network import RoadNetwork
from logger.roads.sections import Sections, Windows, even_edges, federal_condition, sections
from logger.store.log.log_reader import LoggedFile, split_drives

_GAP_M = 1000.0  # between neighbours on a route: beyond it they are two passes
_REACH = 1.2  # of a window against its length: measures are places, and scatter by less


@dataclass(frozen=True, eq=False)
class DriveSections:
    """The sections of one drive.

    log, number    the file, and which drive of it, from 1
    records        its rows with a distance
    middle_m       (n,) of their middles, counted as the sections are [m]
    figures        of the k sections, and ``whole`` of all of them as one
    condition      by the federal limits; empty: not known
    ends_m         (k,) of the sections, the last one where the drive ends [m]
    direction      ``along`` a route or ``against`` it; empty: sections count from the beginning of the drive
    """

    log: str
    number: int
    records: tuple[WindowRecord, ...]
    middle_m: Array
    figures: Sections
    whole: Sections
    condition: tuple[str, ...]
    ends_m: Array
    direction: str = ""


def drive_sections(files: Sequence[LoggedFile], length_m: float) -> Iterator[DriveSections]:
    """Drives of logs, those that have a distance, in sections."""
    for file in files:
        for number, drive in enumerate(split_drives(file.records), start=1):
            records = tuple(one for one in drive
                            if one.distance_start_m is not None and one.distance_end_m is not None
                            and one.distance_end_m > one.distance_start_m)
            if records:
                yield _of_drive(file.name, number, records, length_m)


def route_sections(files: Sequence[LoggedFile], route: RoadNetwork, first_m: float, length_m: float
                   ) -> Iterator[DriveSections]:
    """Each pass of a drive over a route in sections of the route's measures, from ``first_m`` on."""
    for file in files:
        for number, drive in enumerate(split_drives(file.records), start=1):
            records = [one for one in drive if placed(one)]
            if not records:
                continue
            found = on_route(route, trace_of(records))
            breaks = np.flatnonzero((np.diff(found.direction) != 0)
                                    | ~(np.abs(np.diff(found.measure_m)) < _GAP_M)) + 1
            for part in np.split(np.arange(len(records)), breaks):
                if found.direction[part[0]]:
                    yield from _of_pass(file.name, number, [records[row] for row in part], found.measure_m[part],
                                        int(found.direction[part[0]]), first_m, length_m)


def _of_pass(log: str, number: int, records: Sequence[WindowRecord], measure_m: Array, direction: int, first_m: float,
             length_m: float) -> Iterator[DriveSections]:
    order = np.argsort(measure_m, kind="stable")
    measure_m, records = measure_m[order], tuple(records[row] for row in order.tolist())
    windows = windows_of(records)
    half_m = (windows.end_m - windows.start_m) / 2
    # Neighbours share a limit, so that no road counts twice; a hole stays one.
    limits_m = (measure_m[1:] + measure_m[:-1]) / 2
    start_m = np.concatenate([measure_m[:1] - half_m[:1], np.maximum(limits_m, (measure_m - _REACH * half_m)[1:])])
    end_m = np.concatenate([np.minimum(limits_m, (measure_m + _REACH * half_m)[:-1]), measure_m[-1:] + half_m[-1:]])
    start_m = np.maximum(start_m, first_m)
    windows = replace(windows, start_m=start_m, end_m=end_m)
    kept = end_m > start_m
    if not kept.any():
        return
    windows = windows.of(np.flatnonzero(kept))
    first = int(np.floor((windows.start_m[0] - first_m) / length_m))
    edges_m = first_m + length_m * first + even_edges(
        float(windows.end_m[-1] - first_m - length_m * first), length_m)
    found = sections(windows, edges_m)
    condition = tuple(federal_condition(value) if isfinite(value) else "" for value in found.iri_m_per_km.tolist())
    counted_records = tuple(one for one, here in zip(records, kept.tolist(), strict=True) if here)
    yield DriveSections(log, number, counted_records, measure_m[kept], found, sections(windows, edges_m[[0, -1]]),
                        condition, np.minimum(edges_m[1:], windows.end_m[-1]),
                        "along" if direction == ALONG else "against")


def windows_of(records: Sequence[WindowRecord]) -> Windows:
    """Rows with a distance as arrays, from the first one's beginning on."""
    origin_m = records[0].distance_start_m or 0.0
    return Windows(
        column(records, lambda one: one.distance_start_m) - origin_m,
        column(records, lambda one: one.distance_end_m) - origin_m, column(records, lambda one: one.duration_s),
        column(records, lambda one: one.iri_m_per_km if counts(one) else None), iri_errors(records),
        column(records, lambda one: expected_square(one) if counts(one) else None))


def localized(drive: DriveSections, limit_m_per_km: float) -> list[Area]:
    """Areas of localized roughness of a drive, by its own distance or the route's measures. A row that does not count
    has no value; windows of other lengths than 25 ft slide by their own."""
    windows = windows_of(drive.records)
    beyond_m = _REACH * float(np.median(windows.end_m - windows.start_m))
    return areas(drive.middle_m, windows.iri_m_per_km, limit_m_per_km, windows.iri_errors.std, beyond_m)


def _of_drive(log: str, number: int, records: tuple[WindowRecord, ...], length_m: float) -> DriveSections:
    windows = windows_of(records)
    edges_m = even_edges(float(windows.end_m[-1]), length_m)
    found = sections(windows, edges_m)
    condition = tuple(federal_condition(value) if isfinite(value) else "" for value in found.iri_m_per_km.tolist())
    return DriveSections(log, number, records, (windows.start_m + windows.end_m) / 2, found,
                         sections(windows, edges_m[[0, -1]]), condition, np.minimum(edges_m[1:], windows.end_m[-1]))
