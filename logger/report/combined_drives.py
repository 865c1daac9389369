"""Repeated drives of logs, combined: means of cells of the road, what changed, and places to visit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from logger.chart_data import Array
from logger.records import WindowRecord
from logger.report.placed_rows import column, iri_errors, placed, trace_of
from logger.report.summary import counts
from logger.roads.repeated_drives import (
    Changes,
    Means,
    Passes,
    PlaceToVisit,
    Scatter,
    Trends,
    changes,
    means,
    passes_of,
    places_to_visit,
    scatter_of,
    trends,
    way_and_cell,
)
from logger.roads.road_matching import lay
from logger.roads.road_network import RoadNetwork, directions, east_and_north, on_sphere
from logger.roads.window_errors import WindowErrors
from logger.store.log.log_reader import split_drives
from logger.units import US_PER_S


@dataclass(frozen=True, eq=False)
class CombinedDrives:
    """What the drives of some logs say together, in cells (k,) by way and measure.

    drives, windows       how many there are, and ``placed`` windows of a known place
    length_m              of a cell
    above_m_per_km        from which IRI a place is rough
    passes, scatter       of the IRI, drive by drive
    iri                   means [m/km]
    a_w_mps2, a_w_std_mps2    mean of the passes, NaN: not known
    speed_mps             mean of the passes, NaN: not known
    lat_deg, lon_deg      where the middle of the passes lay
    heading_deg           in which direction they went, clockwise from north
    change                between two periods, where a date between them was given
    trend                 where passes are a month apart at least
    visits                the most urgent first
    """

    drives: int
    windows: int
    placed: int
    length_m: float
    above_m_per_km: float
    passes: Passes
    scatter: Scatter
    iri: Means
    a_w_mps2: Array
    a_w_std_mps2: Array
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array
    heading_deg: Array
    change: Changes | None
    trend: Trends
    visits: tuple[PlaceToVisit, ...]


def combined_drives(records: Sequence[WindowRecord], length_m: float, above_m_per_km: float,
                split_s: float | None = None) -> CombinedDrives:
    """Combine the drives of rows by place and direction.

    length_m          of a cell
    above_m_per_km    from which IRI a place is rough
    split_s           an instant between two periods to compare [s since 1970]
    """
    drives = [[one for one in drive if placed(one)] for drive in split_drives(records)]
    drives = [drive for drive in drives if len(drive) > 1]
    rows = [one for drive in drives for one in drive]
    number = np.repeat(np.arange(len(drives)), [len(drive) for drive in drives])
    found = lay(RoadNetwork(), [trace_of(drive) for drive in drives])
    way, middle_m = (np.concatenate([getattr(one, name) for one in found] or [np.zeros(0)])
                     for name in ("way", "along_m"))
    half_m = column(rows, lambda one: (one.distance_end_m or 0.0) - (one.distance_start_m or 0.0)) / 2

    def cells(values: Array, errors: WindowErrors) -> Passes:
        return passes_of(way.astype(np.intp), middle_m - half_m, middle_m + half_m, number, time_s, values, errors,
                         length_m)

    time_s = column(rows, lambda one: None if one.utc_us is None else one.utc_us / US_PER_S)
    iri = column(rows, lambda one: one.iri_m_per_km if counts(one) else None)
    errors = iri_errors(rows)
    passes = cells(iri, errors)
    scatter = scatter_of(passes)
    mean = means(passes, scatter)
    felt = cells(column(rows, lambda one: one.a_w_mps2 if counts(one) else None),
                 WindowErrors.undivided(column(rows, lambda one: one.a_w_std_mps2 or 0.0)))
    comfort = means(felt, scatter_of(felt))
    a_w, a_w_std = (_at(mean.key, comfort.key, values) for values in (comfort.iri_m_per_km, comfort.iri_std_m_per_km))
    driven = cells(column(rows, lambda one: one.speed_mps), WindowErrors.undivided(np.zeros(len(rows))))
    speed = means(driven, scatter_of(driven))
    place = _places(rows, drives, np.where(np.isfinite(iri) & np.isfinite(errors.std), 0.0, np.nan), cells, mean)
    visits = places_to_visit(mean, a_w, a_w_std, length_m, above_m_per_km)
    return CombinedDrives(len(drives), len(records), len(rows), length_m, above_m_per_km, passes, scatter, mean, a_w,
                          a_w_std, _at(mean.key, speed.key, speed.iri_m_per_km), *place,
                          None if split_s is None else changes(passes, scatter, split_s), trends(passes, scatter),
                          visits)


def _at(key: np.ndarray, among: np.ndarray, values: Array) -> Array:
    """Values of keys, NaN for a key that is not there."""
    where = np.searchsorted(among, key)
    where[where == len(among)] = 0
    found = np.full(len(key), np.nan)
    here = among[where] == key if len(among) else np.zeros(len(key), bool)
    found[here] = values[where[here]]
    return found


def _places(rows: Sequence[WindowRecord], drives: Sequence[Sequence[WindowRecord]], usable: Array,
            cells: Callable[[Array, WindowErrors], Passes], mean: Means) -> tuple[Array, Array, Array]:
    """Latitudes, longitudes and headings of cells, as means of points of the sphere and of directions."""
    traces = [trace_of(drive) for drive in drives]
    points = [on_sphere(one.lat_deg, one.lon_deg) for one in traces]
    heads = [np.nan_to_num(directions(point, one.distance_m)) for point, one in zip(points, traces, strict=True)]
    exact = WindowErrors.undivided(usable)
    _, cell = np.unique(cells(usable, exact).key, return_inverse=True)

    def mean_of(parts: Sequence[Array]) -> Array:
        columns = np.concatenate([*parts, np.zeros((0, 3))])
        return np.column_stack([
            np.bincount(cell, cells(columns[:, axis] + usable, exact).iri_m_per_km, len(mean.key))
            / np.maximum(np.bincount(cell, minlength=len(mean.key)), 1) for axis in range(3)])

    point, head = mean_of(points), mean_of(heads)
    east, north = east_and_north(point)
    heading = np.degrees(np.arctan2(np.einsum("ij,ij->i", head, east), np.einsum("ij,ij->i", head, north))) % 360.0
    return (np.degrees(np.arctan2(point[:, 2], np.hypot(point[:, 0], point[:, 1]))),
            np.degrees(np.arctan2(point[:, 1], point[:, 0])), heading)


def chains(found: CombinedDrives) -> list[np.ndarray]:
    """Numbers of cells that follow each other on one way."""
    if not len(found.iri.key):
        return []
    way, cell = way_and_cell(found.iri.key)
    breaks = np.flatnonzero((np.diff(way) != 0) | (np.diff(cell) != 1)) + 1
    return np.split(np.arange(len(way)), breaks)
