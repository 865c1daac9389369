"""Repeated drives of logs, combined by place and direction: means of cells of the road, what changed, places to visit.

Figures, words and JSON, layers for other programs (cells as lines, places as points), and the page.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from logger.api.log_questions import PassesQuestion, day_us, length_of
from logger.api.shown import CommandResult
from logger.arrays import Indices
from logger.bounds import FALSE_SHARE
from logger.chart_data import Array, Chart, Curves, Line
from logger.comfort.iso2631 import comfort_word
from logger.errors import BadInput
from logger.exchange.layer import Feature, Layer, attributes, cut, half_way, iri_title, write_layer
from logger.left_out import left_out_json, left_out_lines
from logger.printable import counted
from logger.question import function
from logger.records import WindowRecord
from logger.report.blocks import Block, Blocks, Hint, Lines, Linked, Section, Table, elements
from logger.report.document import Html, hint, map_links, section
from logger.report.page import number_button, page
from logger.report.placed import column, iri_errors, of_passes, placed, trace_of
from logger.report.quantities import known
from logger.report.summary import comfort_words, counts
from logger.roads import repeated_drives
from logger.roads.iso8608 import iri_class
from logger.roads.road_matching import RoadNetwork, directions, east_and_north, lay, on_sphere
from logger.roads.sections import FAIR_TO_IN_PER_MI, WindowErrors
from logger.store.log.log_reader import LoggedFile, find_logs_in, iso_utc, read_found, split_drives, utc
from logger.units import INCH_PER_MILE_M_PER_KM, US_PER_S


@dataclass(frozen=True, eq=False, repr=False)
class RepeatedDrives(CommandResult):
    """Pieces of road (k,), one for each place and direction, with the mean of all drives over it; NaN: not known.

    drives                            (k,) how many passed each
    iri_m_per_km, iri_std_m_per_km    (k,) mean weighted by the passes' errors, and its standard error, with what is
                                      common to a drive
    a_w_mps2                          (k,) weighted r.m.s. acceleration, mean of the passes (ISO 2631-1)
    lat_deg, lon_deg, heading_deg     (k,) where, and in which direction, clockwise from north
    """

    drives: Indices
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    a_w_mps2: Array
    lat_deg: Array
    lon_deg: Array
    heading_deg: Array
    _found: "CombinedDrives"

    title: ClassVar[str] = "Passes"

    def charts(self) -> Sequence[Chart]:
        """The IRI of the way that most cells lie on."""
        longest = max(chains(self._found), key=len, default=None)
        if longest is None:
            return []
        at_m: Array = self._found.length_m * (np.arange(len(longest), dtype=np.float64) + 0.5)
        return [Curves("Mean IRI of all drives on the longest road, ± standard error", "distance [m]", "IRI [m/km]", (
            Line("IRI", at_m, self.iri_m_per_km[longest], self.iri_std_m_per_km[longest]),))]

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the cells, or the places to visit, in the format of the file's ending."""
        write_layer(self.visits() if option == "--visit" else self.layer(), path)

    def layer(self) -> Layer:
        """Cells as lines, for the formats of ``convert``."""
        return Layer("passes", attributes(*_CELL), tuple(_cells(self._found)))

    def visits(self) -> Layer:
        """Places to visit as points, the most urgent first, for the formats of ``convert``; waypoints in GPX."""
        return Layer("visits", attributes(*_VISIT), tuple(_layer_visits(self._found)), points=True)

    def as_page(self, of: str) -> Html:
        """Map, curves and tables as one page."""
        return passes_page(self._found)


@function(PassesQuestion)
def passes(question: PassesQuestion) -> RepeatedDrives:
    since, until, places = question.since, question.until, question.places
    first_us, end_us, split_us = map(day_us, (since, until, question.split))
    above_m_per_km = question.above_m_per_km or FAIR_TO_IN_PER_MI * INCH_PER_MILE_M_PER_KM
    files = read_found(find_logs_in(places))
    records = [one for file in files for one in file.records]
    if since is not None or until is not None:
        records = [one for one in records if one.utc_us is not None and (first_us is None or first_us <= one.utc_us)
                   and (end_us is None or one.utc_us < end_us)]
    if not records:
        raise BadInput(f"{', '.join(map(str, places))}: expected a log with at least one intact row"
                       + (" of these days" if since or until else ""))
    found = combined_drives(records, length_of(question.length), above_m_per_km,
                            None if split_us is None else split_us / US_PER_S)
    left = of_passes(files, records, found.placed)
    return RepeatedDrives(
        Blocks([*blocks(found), Lines(left_out_lines(left))]), as_json(found) | left_out_json(left),
        found.iri.drives, found.iri.iri_m_per_km, found.iri.iri_std_m_per_km,
        found.a_w_mps2, found.lat_deg, found.lon_deg, found.heading_deg, found)


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
    passes: repeated_drives.Passes
    scatter: repeated_drives.Scatter
    iri: repeated_drives.Means
    a_w_mps2: Array
    a_w_std_mps2: Array
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array
    heading_deg: Array
    change: repeated_drives.Changes | None
    trend: repeated_drives.Trends
    visits: tuple[repeated_drives.PlaceToVisit, ...]


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

    def cells(values: Array, errors: WindowErrors) -> repeated_drives.Passes:
        return repeated_drives.passes_of(way.astype(np.intp), middle_m - half_m, middle_m + half_m, number, time_s,
                                         values, errors, length_m)

    time_s = column(rows, lambda one: None if one.utc_us is None else one.utc_us / US_PER_S)
    iri = column(rows, lambda one: one.iri_m_per_km if counts(one) else None)
    errors = iri_errors(rows)
    passes = cells(iri, errors)
    scatter = repeated_drives.scatter_of(passes)
    mean = repeated_drives.means(passes, scatter)
    felt = cells(column(rows, lambda one: one.a_w_mps2 if counts(one) else None),
                 WindowErrors.undivided(column(rows, lambda one: one.a_w_std_mps2 or 0.0)))
    comfort = repeated_drives.means(felt, repeated_drives.scatter_of(felt))
    a_w, a_w_std = (_at(mean.key, comfort.key, values) for values in (comfort.iri_m_per_km, comfort.iri_std_m_per_km))
    driven = cells(column(rows, lambda one: one.speed_mps), WindowErrors.undivided(np.zeros(len(rows))))
    speed = repeated_drives.means(driven, repeated_drives.scatter_of(driven))
    place = _places(drives, np.where(np.isfinite(iri) & np.isfinite(errors.std), 0.0, np.nan), cells, mean)
    visits = repeated_drives.places_to_visit(mean, a_w, a_w_std, length_m, above_m_per_km)
    return CombinedDrives(len(drives), len(records), len(rows), length_m, above_m_per_km, passes, scatter, mean, a_w,
                          a_w_std, _at(mean.key, speed.key, speed.iri_m_per_km), *place,
                          None if split_s is None else repeated_drives.changes(passes, scatter, split_s, length_m),
                          repeated_drives.trends(passes, scatter), visits)


def _at(key: np.ndarray, among: np.ndarray, values: Array) -> Array:
    """Values of keys, NaN for a key that is not there."""
    where = np.searchsorted(among, key)
    where[where == len(among)] = 0
    found = np.full(len(key), np.nan)
    here = among[where] == key if len(among) else np.zeros(len(key), bool)
    found[here] = values[where[here]]
    return found


def _places(drives: Sequence[Sequence[WindowRecord]], usable: Array,
            cells: Callable[[Array, WindowErrors], repeated_drives.Passes], mean: repeated_drives.Means
            ) -> tuple[Array, Array, Array]:
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
    way, cell = repeated_drives.way_and_cell(found.iri.key)
    breaks = np.flatnonzero((np.diff(way) != 0) | (np.diff(cell) != 1)) + 1
    return np.split(np.arange(len(way)), breaks)


MOST_PLACES = 20
"""Rows of a table of places at a terminal, which is looked through, not read."""


def blocks(found: CombinedDrives, marked: Sequence[int] = ()) -> Iterator[Block]:
    """For a person; ``marked``: rows of a page that its numbers show."""
    if not len(found.iri.key):
        yield "No row has a position and an IRI with its standard error, so drives cannot be combined."
        return
    if found.change is not None:
        yield from _change_blocks(found, found.change)
    yield Lines(list(_summary(found)))
    yield hint("Below, each piece of road appears once, with the mean of all drives over it: its time is that of the "
               "last drive, its speed their mean.")
    if not found.visits:
        yield Section("Work list", ["No place is above a limit with enough confidence."])
        return
    yield Section("Work list", [
        Table(_VISIT_HEADS, [
            (_number(number, marked), one.kind, _place(found, one.worst), *_visit_cells(found, one))
            for number, one in enumerate(found.visits, start=1)], (0, 1, 2, 3, 7), MOST_PLACES,
            ": --visit FILE writes all of them"), Hint(f"Rough: above {found.above_m_per_km:.2f} m/km."),
        hint("A place has its number in all tables, on the map and in the curves.")])


def _summary(found: CombinedDrives) -> Iterator[str]:
    drives, cells = found.iri.drives, len(found.iri.key)
    several = int((drives > 1).sum())
    mean, std = (float(np.mean(one)) for one in (found.iri.iri_m_per_km, found.iri.iri_std_m_per_km))
    yield (f"Mean IRI {mean:.2f} m/km over {counted(cells, 'piece')} of road ({found.length_m:g} m, one direction); "
           f"standard error of one piece {std:.2f} m/km")
    yield (f"From {counted(found.drives, 'drive')}; {found.placed:,} of {counted(found.windows, 'window')} "
           "have a position")
    yield (f"More than one drive passed {several / cells:.0%} of the pieces; drives per piece: median "
           f"{np.median(drives):g}, largest {drives.max()}")
    if isfinite(found.scatter.drive):
        yield (f"Whole drives differ by {found.scatter.drive:.1%} of the IRI and single passes by "
               f"{found.scatter.passes:.1%}, beyond the errors of their windows; the standard errors include both")
        if found.scatter.alike > 0:
            yield (f"{found.scatter.alike:.0%} of the error variance is common to all drives; more drives do not "
                   "reduce it")
    else:
        yield ("No two drives passed the same piece, so the standard errors do not include how whole drives differ "
               "(tires, load, temperature)")


_VISIT_HEADS = ("Place", "What", "Worst piece at", "Towards", "Length [m]", "IRI [m/km]", "a_w [m/s²]",
                "Perception", "Confidence", "Drives")
_CHANGE_HEADS = ("Place", "Change", "Coordinates", "Towards", "Change of the IRI [m/km]", "p-value", "Drives before",
                 "after")


def _place(found: CombinedDrives, cell: int) -> Linked:
    lat_deg, lon_deg = float(found.lat_deg[cell]), float(found.lon_deg[cell])
    words = f"{lat_deg:.6f}, {lon_deg:.6f}"
    return Linked(words, map_links(lat_deg, lon_deg, words))


def _number(number: int, marked: Sequence[int]) -> str:
    """Of a place to visit, the first of which a page shows where they are pointed at."""
    return Linked(str(number), number_button(marked[number - 1], number)) if number <= len(marked) else str(number)


def _visit_cells(found: CombinedDrives, one: repeated_drives.PlaceToVisit) -> tuple[str, ...]:
    """A place to visit as words, from its direction on."""
    values = visit_values(found, one)
    a_w = values["a_w_mps2"]
    return (compass(values["heading_deg"]), f"{one.length_m:.0f}",
            f"{values['iri_m_per_km']:.2f} ± {values['iri_std_m_per_km']:.2f}", "" if a_w is None else f"{a_w:.2f}",
            "" if a_w is None else comfort_words(values["comfort"]), f"{one.confidence:.0%}", str(one.drives))


def _change_blocks(found: CombinedDrives, change: repeated_drives.Changes) -> Iterator[Block]:
    """What changed between two periods: how much of the road, and the largest changes."""
    if not len(change.key):
        before, after = change.drives
        yield (f"No change can be measured: no piece of road was passed in both periods (drives before the date: "
               f"{before}, from then on: {after}, without a date: {found.drives - before - after}).")
        return
    words = [changed(change, one) for one in range(len(change.key))]
    worse, better = words.count("worse"), words.count("better")
    yield Lines([f"Between the two periods the IRI of {counted(len(change.key), 'piece')} of {found.length_m:g} m "
                 f"changed by {change.mean_m_per_km:+.3f} ± {change.mean_std_m_per_km:.3f} m/km on average",
                 f"{worse} of them got worse, {better} better (at most {FALSE_SHARE:.0%} of these by chance; Benjamini "
                 "& Hochberg)"])
    cells = np.searchsorted(found.iri.key, change.key).tolist()
    yield Table(_CHANGE_HEADS, [
        (next((str(number) for number, visit in enumerate(found.visits, start=1) if cells[one] in visit.cells), ""),
         words[one], _place(found, cells[one]), compass(float(found.heading_deg[cells[one]])),
         f"{change.change_m_per_km[one]:+.2f} ± {change.change_std_m_per_km[one]:.2f}", f"{change.p_value[one]:.1g}",
         str(change.before[one]), str(change.after[one])) for one in largest_changes(change)], (0, 1, 2, 3))
    yield Hint("Place: its number in the work list, which combines both periods.")


def changed(change: repeated_drives.Changes, one: int) -> str:
    """``worse`` or ``better``; nothing where no change is sure."""
    if not change.false_share[one] <= FALSE_SHARE:
        return ""
    return "worse" if change.change_m_per_km[one] > 0 else "better"


def largest_changes(change: repeated_drives.Changes) -> list[int]:
    """The largest of those that are sure, worse or better."""
    sure = np.flatnonzero(change.false_share <= FALSE_SHARE)
    order = sure[np.argsort(-np.abs(change.change_m_per_km[sure]), kind="stable")]
    return list(map(int, order[:MOST_PLACES]))


def compass(heading_deg: float) -> str:
    """A heading clockwise from north in one of eight words."""
    return ("N", "NE", "E", "SE", "S", "SW", "W", "NW")[round(heading_deg / 45.0) % 8]


# --- for programs ---


def as_json(found: CombinedDrives) -> dict[str, Any]:
    """The figures; null where nothing is known."""
    return {"drives": found.drives, "windows": found.windows, "placed": found.placed, "length_m": found.length_m,
            "scatter_drive": known(found.scatter.drive), "scatter_pass": known(found.scatter.passes),
            "errors_alike": found.scatter.alike,
            "mean_change_m_per_km": known(None if found.change is None else found.change.mean_m_per_km),
            "mean_change_std_m_per_km": known(None if found.change is None else found.change.mean_std_m_per_km),
            "cells": [cell_values(found, index) for index in range(len(found.iri.key))],
            "visits": [visit_values(found, one) for one in found.visits]}


def cell_values(found: CombinedDrives, index: int) -> dict[str, Any]:
    """A cell by the names of its columns."""
    key = found.iri.key[index]
    change, trend = found.change, found.trend
    values = {
        "cell": int(key), "drives": int(found.iri.drives[index]), "iri_m_per_km": float(found.iri.iri_m_per_km[index]),
        "iri_std_m_per_km": float(found.iri.iri_std_m_per_km[index]), "a_w_mps2": known(found.a_w_mps2[index]),
        "lat_deg": float(found.lat_deg[index]), "lon_deg": float(found.lon_deg[index]),
        "heading_deg": float(found.heading_deg[index]), "first_utc": _utc(found.iri.first_s[index]),
        "last_utc": _utc(found.iri.last_s[index])}
    row = np.searchsorted(trend.key, key)
    there = row < len(trend.key) and trend.key[row] == key
    for name, by_cell in (("trend_m_per_km_year", trend.per_year_m_per_km),
                         ("trend_std_m_per_km_year", trend.per_year_std_m_per_km), ("trend_p_value", trend.p_value)):
        values[name] = float(by_cell[row]) if there else None
    row = 0 if change is None else int(np.searchsorted(change.key, key))
    there = change is not None and row < len(change.key) and change.key[row] == key
    for name in ("change_m_per_km", "change_std_m_per_km", "p_value", "false_share"):
        values[name if name.startswith("change") else f"change_{name}"] = (
            float(getattr(change, name)[row]) if there else None)
    values["changed"] = changed(change, row) or None if change is not None and there else None
    return values


def visit_values(found: CombinedDrives, one: repeated_drives.PlaceToVisit) -> dict[str, Any]:
    """A place to visit by the names of its columns: where its worst cell is, and the figures of that."""
    values = cell_values(found, one.worst)
    a_w = values["a_w_mps2"]
    return {"what": one.kind, "length_m": one.length_m, "confidence": one.confidence,
            "comfort": None if a_w is None else comfort_word(a_w),
            **{name: values[name] for name in ("drives", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2", "lat_deg",
                                               "lon_deg", "heading_deg", "first_utc", "last_utc")}}


def _utc(time_s: float) -> str | None:
    return iso_utc(round(time_s * US_PER_S)) if isfinite(time_s) else None


_CELL = ("cell", "drives", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2", "lat_deg", "lon_deg", "heading_deg",
         "first_utc", "last_utc", "trend_m_per_km_year", "trend_std_m_per_km_year", "trend_p_value", "change_m_per_km",
         "change_std_m_per_km", "change_p_value", "change_false_share", "changed")
_VISIT = ("what", "length_m", "confidence", "comfort", "drives", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2",
          "lat_deg", "lon_deg", "heading_deg", "first_utc", "last_utc")


def _cells(found: CombinedDrives) -> Iterator[Feature]:
    """The cells way by way: each a line half-way to its neighbours."""
    ways, _ = repeated_drives.way_and_cell(found.iri.key)
    for chain in chains(found):
        places = [(float(found.lon_deg[cell]), float(found.lat_deg[cell])) for cell in chain]
        ends = [half_way(one, other) for one, other in pairwise(places)]
        for index, cell in enumerate(chain.tolist()):
            values = cell_values(found, cell)
            geometry = cut((*ends[max(index - 1, 0):index], places[index], *ends[index:index + 1]))
            yield Feature(f"way {ways[cell] + 1}", iri_title(values["iri_m_per_km"]),
                          tuple(values[name] for name in _CELL), geometry, places[index], values["last_utc"], index > 0,
                          iri_class(values["iri_m_per_km"]))


def _layer_visits(found: CombinedDrives) -> Iterator[Feature]:
    """The places to visit, the most urgent first."""
    for number, one in enumerate(found.visits, start=1):
        values = visit_values(found, one)
        place = (values["lon_deg"], values["lat_deg"])
        title = (f"{number} {one.kind}, {one.length_m:.0f} m towards {compass(values['heading_deg'])}, "
                 f"{iri_title(values['iri_m_per_km'])}")
        yield Feature("work list", title, tuple(values[name] for name in _VISIT), ((place,),), place,
                      values["last_utc"], False, iri_class(values["iri_m_per_km"]))


_GAP_M = 1.0


def passes_page(found: CombinedDrives) -> Html:
    """The page. Ways follow each other as if they had been driven in one go, with a gap between."""
    title = f"Road roughness, mean of {counted(found.drives, 'drive')}", _days(found)
    order = [cell for chain in chains(found) for cell in chain.tolist()]
    rows = [order.index(one.worst) for one in found.visits[:MOST_PLACES]]
    return page([LoggedFile("means of drives", tuple(_rows(found)), 0, {})], title=title, marked=rows or None, first=(
        section("Repeated drives combined", elements(blocks(found, rows))),))


def _days(found: CombinedDrives) -> str:
    if not np.isfinite(found.iri.first_s).any():
        return "dates not known"
    first, last = (utc(round(one * US_PER_S)) for one in (np.nanmin(found.iri.first_s), np.nanmax(found.iri.last_s)))
    return f"{first:%Y-%m-%d}" if first.date() == last.date() else f"{first:%Y-%m-%d} to {last:%Y-%m-%d}"


def _rows(found: CombinedDrives) -> Iterator[WindowRecord]:
    """Cells as rows of a log, for the views that show those."""
    length_m, at_m, segment = found.length_m, 0.0, 0
    for chain in chains(found):
        for cell in chain.tolist():
            segment += 1
            a_w = found.a_w_mps2[cell]
            known = bool(np.isfinite(a_w))
            last_s = found.iri.last_s[cell]
            iri, speed_mps = float(found.iri.iri_m_per_km[cell]), float(found.speed_mps[cell])
            drives = speed_mps > 0
            yield WindowRecord(
                segment, 1, segment * US_PER_S, round(last_s * US_PER_S) if np.isfinite(last_s) else None,
                length_m / speed_mps if drives else 0.0, at_m, at_m + length_m, float(found.lat_deg[cell]),
                float(found.lon_deg[cell]), speed_mps if drives else None, iri,
                float(found.iri.iri_std_m_per_km[cell]), None, float(a_w) if known else None, None, None, None,
                comfort_word(float(a_w)) if known else "", iri_class(iri), None, 0, 0, (),
                float(found.a_w_std_mps2[cell]) if known else None)
            at_m += length_m
        at_m += _GAP_M
