"""Logs as files for other programs.

Suggestions of OpenStreetMap's ``smoothness`` per way, as a layer to be reviewed by a person.
"""

from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

from logger.api.log_questions import ConvertQuestion
from logger.api.shown import CommandResult, check_out
from logger.errors import BadInput
from logger.exchange.layer import Feature, Layer, attributes, cut, format_of, windows_layer, write_layer
from logger.left_out import counting, left_out_json, left_out_lines
from logger.printable import counted
from logger.question import function
from logger.records import WindowRecord
from logger.report.placed import column, damaged, iri_errors, placed, trace_of
from logger.report.summary import counts
from logger.roads.iso8608 import iri_class
from logger.roads.repeated_drives import LEAST_COVERED, passes_of, scatter_of, suggestion, way_means
from logger.roads.road_matching import Array, RoadNetwork, match, on_sphere
from logger.roads.sections import WindowErrors
from logger.store.formats.road_lines import MapWay, read_map_ways
from logger.store.log.log_reader import LoggedFile, find_logs_in, read_found, split_drives


@dataclass(frozen=True, eq=False, repr=False)
class Conversion(CommandResult):
    """The file that ``convert`` wrote.

    path             the file
    format           its ending
    rows             windows in it, or ways
    placed           those of them with a place on the ground
    damaged_lines    lines of the logs that were left out
    """

    path: Path
    format: str
    rows: int
    placed: int
    damaged_lines: int


@function(ConvertQuestion)
def convert(question: ConvertQuestion) -> Conversion:
    path, smoothness = Path(question.to), question.smoothness
    form, found = format_of(path), find_logs_in(question.places)
    check_out(path, (), [*([] if smoothness is None else [Path(smoothness)]), *(log for log, _ in found)], "--to")
    files = read_found(found)
    if not any(one.records for one in files):
        raise BadInput(f"{question.named()}: expected a log with at least one intact row")
    layer = windows_layer(files) if smoothness is None else _ways(files, smoothness)
    write_layer(layer, path)
    rows, placed, of = len(layer.features), layer.placed, "window" if smoothness is None else "way"
    damaged_lines = sum(one.damaged_lines for one in files)
    left_out = counting([damaged(damaged_lines)])
    words = f"{path}: {counted(rows, of)}" + f", {rows - placed} of them without a position" * (placed < rows)
    made = {"file": str(path), "format": form.name, "rows" if smoothness is None else "ways": rows, "placed": placed,
            "damaged_lines": damaged_lines, **left_out_json(left_out)}
    return Conversion("\n".join([words, *left_out_lines(left_out)]), made, path, form.name, rows, placed, damaged_lines)


def _ways(files: Sequence[LoggedFile], roads: Path | str) -> Layer:
    layer = smoothness_layer([one for file in files for one in file.records], read_map_ways(roads))
    if not layer.features:
        raise BadInput(f"{roads}: expected ways along which these logs have an IRI, found none")
    return layer


_CELL_M = 25.0
_TAGS = ("name", "highway", "surface")
_FIELDS = attributes("osm_way", *_TAGS, "smoothness_tagged", "smoothness_suggested", "confidence", "iri_m_per_km",
                     "iri_std_m_per_km", "covered_m", "length_m", "drives")


def smoothness_layer(records: Sequence[WindowRecord], ways: Sequence[MapWay]) -> Layer:
    """Each way that a row with an IRI lies on, with what is tagged and what the drives suggest. The suggestion is empty
    where less than half of the way is known."""
    return Layer("smoothness", _FIELDS, tuple(_features(records, ways)))


def _features(records: Sequence[WindowRecord], ways: Sequence[MapWay]) -> Iterator[Feature]:
    network = RoadNetwork()
    usable: list[MapWay] = []
    lengths: list[float] = []
    for way in ways:
        try:
            network.add_line(way.lat_deg, way.lon_deg)
        except ValueError:  # without length
            continue
        network.add_line(way.lat_deg[::-1], way.lon_deg[::-1])
        usable.append(way)
        corners = on_sphere(way.lat_deg, way.lon_deg)
        lengths.append(float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()))
    if not usable:
        return
    parts: list[tuple[Array, ...]] = []
    for number, drive in enumerate(split_drives(records)):
        rows = [one for one in drive if placed(one)]
        if len(rows) < 2:
            continue
        found, _ = match(network, trace_of(rows))
        on = found.way >= 0
        number_on, against = np.divmod(np.maximum(found.way, 0), 2)
        length_m = np.array(lengths)[number_on]
        at_m = np.where(against == 1, length_m - found.along_m, found.along_m)
        half_m = column(rows, lambda one: (one.distance_end_m or 0.0) - (one.distance_start_m or 0.0)) / 2
        start_m, end_m = np.maximum(at_m - half_m, 0.0), np.minimum(at_m + half_m, length_m)
        parts.append((np.where(on, number_on, -1.0), start_m, end_m, np.full(len(rows), float(number)),
                      column(rows, lambda one: one.iri_m_per_km if counts(one) else None),
                      *astuple(iri_errors(rows))))
    if not parts:
        return
    on_way, start_m, end_m, driven, iri, *errors = (np.concatenate(one) for one in zip(*parts, strict=True))
    passes = passes_of(on_way.astype(np.intp), start_m, end_m, driven.astype(np.intp), np.zeros(len(on_way)), iri,
                       WindowErrors(*errors), _CELL_M)
    mean = way_means(passes, scatter_of(passes), _CELL_M)
    for index, number in enumerate(mean.way.tolist()):
        yield _feature(usable[number], lengths[number], float(mean.covered_m[index]), int(mean.drives[index]),
                       float(mean.iri_m_per_km[index]), float(mean.iri_std_m_per_km[index]))


def _feature(way: MapWay, length_m: float, covered_m: float, drives: int, iri: float, std: float) -> Feature:
    known = covered_m >= LEAST_COVERED * length_m
    word, confidence = suggestion(iri, std) if known else (None, None)
    if drives < 2:  # what one drive has of its car, its load and its tires is not known
        confidence = None
    places = tuple(zip(way.lon_deg.tolist(), way.lat_deg.tolist(), strict=True))
    title = f"way {way.osm_id}: smoothness={word}" if word else f"way {way.osm_id}: too little of it is known"
    return Feature(f"way {way.osm_id}", title, (
        way.osm_id, *(way.tags.get(name) for name in _TAGS), way.tags.get("smoothness"), word, confidence, iri, std,
        covered_m, length_m, drives), cut(places), places[len(places) // 2], None, False, iri_class(iri))
