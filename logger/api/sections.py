"""Logs in sections of road of one length, as road agencies file them: figures, words and JSON, and a layer for maps.

On a layer a section is a line, of the windows whose middles lie in it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from logger.api.log_questions import SectionsQuestion, length_of
from logger.api.shown import CommandResult
from logger.arrays import Indices
from logger.chart_data import Array, Chart, Curves, Line
from logger.comfort.iso2631 import comfort_word
from logger.errors import BadInput, as_bad_input
from logger.exchange import layer
from logger.left_out import left_out_json, left_out_lines
from logger.printable import counted
from logger.question import function
from logger.records import WindowRecord
from logger.report.blocks import Block, Blocks, Lines, Section, Table, area_blocks
from logger.report.placed import column, iri_errors, of_sections, placed, trace_of
from logger.report.quantities import UNITS, DisplayUnits, area_values, fixed, known
from logger.report.summary import counts, expected_square
from logger.roads.iri import Area, areas
from logger.roads.iso8608 import iri_class
from logger.roads.road_matching import ALONG, RoadNetwork, measures, on_route, route_network
from logger.roads.sections import FEDERAL_WORDS, RoadSections, SectionWindows, even_edges, federal_condition
from logger.roads.sections import sections as in_sections
from logger.store.formats.road_lines import read_route
from logger.store.log.log_reader import LoggedFile, find_logs_in, iso_utc, read_found, split_drives
from logger.units import FOOT_M, MILE_M


@dataclass(frozen=True, eq=False, repr=False)
class Sections(CommandResult):
    """The k sections of all drives of some logs, in the order driven; NaN: not known.

    length_m                      of a section; the last one of a drive is cut short [m]
    drive                         (k,) number of the drive, in the order read, from 0
    start_m, end_m                (k,) along the drive, or measures of the route [m]
    known_m                       (k,) how much of each has an IRI [m]
    iri_m_per_km, iri_std_m_per_km    (k,) mean over that, and its standard error
    a_w_mps2                      (k,) weighted r.m.s. acceleration (ISO 2631-1)
    speed_mps                     (k,) mean
    condition                     (k,) good, fair or poor (23 CFR 490.313); empty: not known
    """

    length_m: float
    drive: Indices
    start_m: Array
    end_m: Array
    known_m: Array
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    a_w_mps2: Array
    speed_mps: Array
    condition: npt.NDArray[np.str_]
    _drives: "tuple[DriveSections, ...]"
    _units: DisplayUnits

    title: ClassVar[str] = "Sections"

    def charts(self) -> Sequence[Chart]:
        """The IRI of the sections along each drive."""
        found: list[Chart] = []
        (way, way_m), (label, scale) = self._units.way, self._units.iri
        for one in self._drives:
            known = np.isfinite(one.figures.iri_m_per_km)
            if known.any():
                middle_m = (one.figures.edges_m[:-1] + one.ends_m)[known] / 2
                found.append(Curves(_title(one), f"distance [{way}]", f"IRI [{label}]", (
                    Line("IRI", middle_m / way_m, one.figures.iri_m_per_km[known] / scale,
                         one.figures.iri_std_m_per_km[known] / scale),)))
        return found

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the rows in the format of the file's ending."""
        layer.write_layer(self.layer(), path)

    def layer(self) -> layer.Layer:
        """Rows with places, for the formats of ``convert``; ``t_utc`` is when the first window of each began."""
        return layer.Layer("sections", FIELDS, tuple(feature for one in self._drives for feature in _features(one)))


@function(SectionsQuestion)
def sections(question: SectionsQuestion) -> Sections:
    length_m, route, places = length_of(question.length), question.route, question.places
    units = question.units or ("us" if str(question.length).endswith(("mi", "ft")) else "si")
    localized_m_per_km = question.localized_m_per_km
    files = read_found(find_logs_in(places))
    if not any(one.records for one in files):
        raise BadInput(f"{', '.join(map(str, places))}: expected a log with at least one intact row")
    drives = tuple(drive_sections(files, length_m) if route is None else _on_route(files, route, length_m))
    left = of_sections(files, [row for one in drives for row in one.records], route is not None)
    figures = [one.figures for one in drives]
    known_m, iri, std, a_w, speed_mps = (_joined([getattr(one, name) for one in figures]) for name in (
        "known_m", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2", "speed_mps"))
    return Sections(
        Blocks([*blocks(drives, length_m, units, localized_m_per_km), Lines(left_out_lines(left))]),
        as_json(drives, length_m, localized_m_per_km) | left_out_json(left), length_m,
        np.repeat(np.arange(len(drives)), [len(one.condition) for one in drives]),
        _joined([one.edges_m[:-1] for one in figures]), _joined([one.ends_m for one in drives]), known_m, iri, std, a_w,
        speed_mps, np.array([word for one in drives for word in one.condition], dtype=np.str_), drives,
        UNITS[units])


def _on_route(files: Sequence[LoggedFile], path: Path | str, length_m: float) -> "Iterator[DriveSections]":
    route = read_route(path)
    with as_bad_input(path):
        measure_m = measures(route.lat_deg, route.lon_deg, route.begin_m, route.end_m,
                             np.column_stack([route.post_lat_deg, route.post_lon_deg]), route.post_m)
        network = route_network(route.lat_deg, route.lon_deg, measure_m)
    return route_sections(files, network, float(measure_m[0]), length_m)


def _joined(arrays: Sequence[Array]) -> Array:
    return np.concatenate(arrays) if arrays else np.zeros(0)


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
    figures: RoadSections
    whole: RoadSections
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
            breaks = np.flatnonzero((np.diff(found.direction) != 0) | ~(np.abs(np.diff(found.measure_m)) < _GAP_M)) + 1
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
    edges_m = first_m + length_m * first + even_edges(float(windows.end_m[-1] - first_m - length_m * first), length_m)
    found = in_sections(windows, edges_m)
    counted_records = tuple(one for one, here in zip(records, kept.tolist(), strict=True) if here)
    yield DriveSections(log, number, counted_records, measure_m[kept], found, in_sections(windows, edges_m[[0, -1]]),
                        _conditions(found), np.minimum(edges_m[1:], windows.end_m[-1]),
                        "along" if direction == ALONG else "against")


def windows_of(records: Sequence[WindowRecord]) -> SectionWindows:
    """Rows with a distance as arrays, from the first one's beginning on."""
    origin_m = records[0].distance_start_m or 0.0
    return SectionWindows(
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


def _conditions(found: RoadSections) -> tuple[str, ...]:
    return tuple(federal_condition(value) if isfinite(value) else "" for value in found.iri_m_per_km.tolist())


def _of_drive(log: str, number: int, records: tuple[WindowRecord, ...], length_m: float) -> DriveSections:
    windows = windows_of(records)
    edges_m = even_edges(float(windows.end_m[-1]), length_m)
    found = in_sections(windows, edges_m)
    return DriveSections(log, number, records, (windows.start_m + windows.end_m) / 2, found,
                         in_sections(windows, edges_m[[0, -1]]), _conditions(found),
                         np.minimum(edges_m[1:], windows.end_m[-1]))


def blocks(drives: Sequence[DriveSections], length_m: float, system: str, localized_m_per_km: float | None = None
           ) -> Iterator[Block]:
    """For a person; with a limit the areas of localized roughness under each drive."""
    if not drives:
        yield "No row has a distance or lies on the route, so there are no sections."
        return
    units = UNITS[system]
    yield Lines(list(_summary(drives, length_m, units)))
    heads = (f"from {units.length[0]}", f"to {units.length[0]}", "known", f"IRI {units.iri[0]}", "std. error",
             "condition", "a_w m/s2", units.speed[0])
    for one in drives:
        yield Section(_title(one), [Table(heads, list(_rows(one, units)), (5,))])
        if localized_m_per_km is not None:
            yield from area_blocks(localized(one, localized_m_per_km), localized_m_per_km, units)
    yield Lines(["Condition: good below 95 in/mi (1.50 m/km), poor above 170 (2.68), 23 CFR 490.313.",
                 "One sensor in the middle of the car: the IRI is that of a half car on both wheelpaths (HRI)."])


def _title(one: DriveSections) -> str:
    return f"{one.log}, drive {one.number}" + (f", {one.direction} the route" if one.direction else "")


def _summary(drives: Sequence[DriveSections], length_m: float, units: DisplayUnits) -> Iterator[str]:
    count = sum(len(one.condition) for one in drives)
    known_m = np.concatenate([one.figures.known_m for one in drives])
    driven_m = sum(float(one.figures.driven_m.sum()) for one in drives)
    name, unit_m = units.way
    extent = (f"{counted(len(drives), 'drive')}, {driven_m / unit_m:.2f} {name} in {counted(count, 'section')} of "
              f"{_length_words(length_m)}")
    total_m = float(known_m.sum())
    if total_m <= 0:
        yield from ("No section has an IRI.", extent)
        return
    mean, error = _mean([one.whole for one in drives if one.whole.known_m[0] > 0])
    label, scale = units.iri
    sure = f"{error / scale:.{units.iri_decimals + 1}f}" if isfinite(error) else "not known"
    yield (f"Mean IRI {mean / scale:.{units.iri_decimals}f} {label}, standard error {sure}, over "
           f"{total_m / unit_m:.2f} {name}")
    words = [word for one in drives for word in one.condition]
    shares = {word: float(known_m[[here == word for here in words]].sum()) / total_m for word in FEDERAL_WORDS}
    yield "Of that: " + ", ".join(f"{word} {share:.0%}" for word, share in shares.items())
    yield extent


def _mean(wholes: Sequence[RoadSections]) -> tuple[float, float]:
    """Mean IRI of drives by length, and its standard error [m/km]: the numbers of the car are wrong in all alike."""
    known_m, iri, std, common = np.array([
        (one.known_m[0], one.iri_m_per_km[0], one.iri_errors.std[0], one.iri_errors.common_std[0]) for one in wholes]).T
    weight = known_m / known_m.sum()
    variance = weight**2 @ (std**2 - common**2) + (weight @ common) ** 2
    return float(weight @ iri), float(np.sqrt(variance))


def _rows(one: DriveSections, units: DisplayUnits) -> Iterator[tuple[str, ...]]:
    figures = one.figures
    columns = (figures.edges_m[:-1], one.ends_m, figures.known_m, figures.iri_m_per_km, figures.iri_std_m_per_km,
               figures.a_w_mps2, figures.speed_mps)
    for word, (start_m, end_m, known_m, iri, std, a_w, speed) in zip(
            one.condition, zip(*(each.tolist() for each in columns), strict=True), strict=True):
        (_, unit_m), (_, iri_scale), (_, speed_scale) = units.length, units.iri, units.speed
        yield (f"{start_m / unit_m:.{units.length_decimals}f}", f"{end_m / unit_m:.{units.length_decimals}f}",
               f"{known_m / (end_m - start_m):.0%}", fixed(iri / iri_scale, units.iri_decimals, "-"),
               fixed(std / iri_scale, units.iri_decimals + 1, "-"), word, fixed(a_w, 2, "-"),
               fixed(speed / speed_scale, 0, "-"))


def _length_words(length_m: float) -> str:
    for name, unit_m in (("mi", MILE_M), ("km", 1000.0), ("ft", FOOT_M)):
        units = length_m / unit_m
        if abs(units - round(units, 1)) < 1e-6 * units and (name != "km" or units >= 1):
            return f"{units:g} {name}" if name != "ft" or length_m % 1 else f"{length_m:g} m"
    return f"{length_m:g} m"


# --- for programs ---


def as_json(drives: Sequence[DriveSections], length_m: float, localized_m_per_km: float | None = None
            ) -> dict[str, Any]:
    """Drives with their sections, and areas of localized roughness above a limit; null where nothing is known."""
    return {"length_m": length_m, "drives": [
        {"log": one.log, "drive": one.number, "direction": one.direction or None,
         "sections": list(section_values(one)),
         **({} if localized_m_per_km is None else {
             "localized": [area_values(area) for area in localized(one, localized_m_per_km)]})} for one in drives]}


def section_values(one: DriveSections) -> Iterator[dict[str, Any]]:
    """The sections of a drive by the names of their columns; None where nothing is known."""
    figures = one.figures
    for index, word in enumerate(one.condition):
        numbers = {name: known(getattr(figures, name)[index]) for name in _NUMBERS[3:]}
        a_w = numbers["a_w_mps2"]
        yield {"distance_start_m": float(figures.edges_m[index]), "distance_end_m": float(one.ends_m[index]),
               "known_m": float(figures.known_m[index]), **numbers, "condition": word or None,
               "comfort": None if a_w is None else comfort_word(a_w)}


_NUMBERS = ("distance_start_m", "distance_end_m", "known_m", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2",
            "speed_mps", "worst_m_per_km", "worst_at_m")
_WORDS = ("condition", "comfort")
FIELDS = layer.attributes("log", "drive", "t_utc", "direction", *_NUMBERS, *_WORDS)


def _features(drive: DriveSections) -> Iterator[layer.Feature]:
    lines = layer.geometries(drive.records)
    section = np.searchsorted(drive.figures.edges_m, drive.middle_m, side="right") - 1
    for index, values in enumerate(section_values(drive)):
        inside = np.flatnonzero(section == index).tolist()
        geometry = layer.chained([lines[row][0] for row in inside])
        began = iso_utc(drive.records[inside[0]].utc_us) if inside else None
        places = [place for line in geometry for place in line]
        yield layer.Feature(
            layer.group_name(drive.log, drive.number), layer.iri_title(values["iri_m_per_km"]),
            (drive.log, drive.number, began, drive.direction or None,
             *(values[name] for name in _NUMBERS + _WORDS)), geometry,
            places[len(places) // 2] if places else None, began,
            bool(inside) and index > 0 and lines[inside[0]][1],
            "" if values["iri_m_per_km"] is None else iri_class(values["iri_m_per_km"]))
