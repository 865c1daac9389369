"""Many cars over years: logs into a dataset, and the figures of its roads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.log_questions import IngestQuestion, ReportQuestion, SummariseQuestion, day_us
from logger.api.shown import CommandResult
from logger.errors import BadInput, as_bad_input
from logger.files import MAP_BYTES, note, read_bounded, replace_bytes
from logger.fleet.dataset import EXTRA, Dataset, Engine, existing, opened
from logger.fleet.road_map import RoadMap, RoadPieces, cell_keys, pieces_of
from logger.question import function

if TYPE_CHECKING:
    from logger.exchange.layer import Layer
    from logger.fleet.ingest import Keyed
    from logger.fleet.summary import FleetFigures

_ROADS = "roads.geojson"


@dataclass(frozen=True, eq=False, repr=False)
class Ingested(CommandResult):
    """What an ingest added: ``added`` rows, ``rows`` in the dataset now; the rest by ``as_json``."""

    added: int
    rows: int


@dataclass(frozen=True, eq=False, repr=False)
class FleetSummary(CommandResult):
    """Figures of a fleet's roads and cars; ``found`` has them as arrays."""

    found: FleetFigures

    def as_json(self) -> dict[str, Any]:
        """The object that the command prints with ``--json``; made now, as it may be long."""
        from logger.fleet.page import figures_json

        return figures_json(self.found)

    def write(self, path: Path, option: str = "--out") -> None:
        """Write all rows in the format of the file's ending."""
        from logger.exchange.layer import write_layer

        write_layer(self.layer(), path)

    def layer(self) -> Layer:
        """Roads with their places, for the formats of ``convert``."""
        from logger.fleet.page import roads_layer

        return roads_layer(self.found.roads)


@function(IngestQuestion)
def fleet_ingest(question: IngestQuestion) -> Ingested:
    from logger.fleet.ingest import ingest_sessions, keep_names, own_key, pseudonym, sessions_of
    from logger.fleet.page import ingest_json, ingest_words
    from logger.store.log.log_reader import find_logs_in

    _needs_arrow()
    dataset, trim_m, roads = Dataset(Path(question.to)), question.trim_m, question.roads
    named = [(log, _folder_of_car(log, question.places) if question.car_folders else question.car or _car_of(log))
             for log, _ in find_logs_in(question.places)]
    with dataset.writing():
        key = own_key(dataset.folder)
        if trim_m is not None and not dataset.is_new and trim_m != dataset.manifest.trim_m:
            raise question.wrong("trim_m", f" {trim_m:g}: expected {dataset.manifest.trim_m:g} m, as at the dataset's "
                                           "first ingest")
        keep_names(dataset.folder, {name for _, name in named}, key)
        with _keys(dataset, None if roads is None else Path(roads)) as (keyed, roads_sha256):
            counts = ingest_sessions(
                dataset, sessions_of((log, pseudonym(name, key)) for log, name in named), keyed, roads=roads_sha256,
                trim_m=(trim_m or 0.0) if dataset.is_new else dataset.manifest.trim_m)
    note(Path(question.to))
    rows = dataset.manifest.rows
    return Ingested(ingest_words(counts, rows, str(dataset.folder)), ingest_json(counts, rows), counts.added, rows)


@function(SummariseQuestion)
def fleet_summarise(question: SummariseQuestion) -> FleetSummary:
    from logger.fleet.page import figures_words

    with _summarised(question, question.by) as (figures, _, _):
        return FleetSummary(figures_words(figures), {}, figures)


@dataclass(frozen=True, eq=False, repr=False)
class FleetReport(CommandResult):
    """What a report wrote: ``page``, and how many ``tiles``."""

    page: Path
    tiles: int


@function(ReportQuestion)
def fleet_report(question: ReportQuestion) -> FleetReport:
    from logger.fleet.page import INDEX, check_folder, history_of, write_report

    place = Path(question.out)
    check_folder(place)
    with _summarised(question, "segment") as (figures, running, pieces):
        if not len(figures.roads.key):
            raise BadInput(f"{question.dataset}: expected a segment that {question.public or 1} cars have driven, "
                           "found none")
        steps = history_of(running, figures, day_us(question.since), day_us(question.until))
    tiles = write_report(figures, steps, pieces, place)
    page = place / INDEX
    text = f"Report: {page} ({len(figures.roads.key):,} segments, {tiles:,} tiles)"
    return FleetReport(text, {"page": str(page), "tiles": tiles, "segments": len(figures.roads.key)}, page, tiles)


@contextmanager
def _summarised(question: SummariseQuestion | ReportQuestion, by: str
                ) -> Iterator[tuple[FleetFigures, Engine, RoadPieces | None]]:
    """Figures, the engine that made them, and the map of the dataset."""
    from logger.fleet.ingest import names_of, shown_car
    from logger.fleet.summary import summarise

    _needs_arrow()
    folder = Path(question.dataset)
    since_us, until_us = day_us(question.since), day_us(question.until)
    dataset = existing(folder)
    if by == "route" and not dataset.manifest.roads:
        raise question.wrong("by", " route: expected a dataset made with `roads`")
    empty = BadInput(f"{folder}: expected at least one pass with an IRI in that time")
    files = dataset.files(since_us, None if until_us is None else until_us - 1)
    if not files:
        raise empty
    pieces, names = _pieces(dataset), {} if question.public else names_of(folder)
    with opened(files, question.engine) as running:
        figures = summarise(running, by, since_us, until_us, question.public or 1, pieces,
                            lambda car: names.get(car) or shown_car(car))
        if figures is None:
            raise empty
        yield figures, running, pieces


def _pieces(dataset: Dataset) -> RoadPieces | None:
    """The pieces of the map that a dataset was made with."""
    from logger.store.formats.road_lines import read_road_lines

    return pieces_of(read_road_lines(dataset.folder / _ROADS)) if dataset.manifest.roads else None


@contextmanager
def _keys(dataset: Dataset, roads: Path | None) -> Iterator[tuple[Keyed, str]]:
    """How keys are made, and the SHA-256 of the map."""
    from logger.store.formats.road_lines import read_road_lines

    if roads is None and not dataset.manifest.roads:
        yield lambda lat_deg, lon_deg, heading_deg, drive: cell_keys(lat_deg, lon_deg, heading_deg), ""
        return
    content = read_bounded(roads or dataset.folder / _ROADS, MAP_BYTES)
    digest = sha256(content).hexdigest()
    if not dataset.is_new and digest != dataset.manifest.roads:
        raise BadInput(f"{roads or dataset.folder / _ROADS}: expected the roads of the first ingest")
    with as_bad_input(roads or dataset.folder / _ROADS):
        pieces = pieces_of(read_road_lines(roads or dataset.folder / _ROADS))
    if dataset.is_new:
        replace_bytes(dataset.folder / _ROADS, content)
    yield RoadMap(pieces).keys, digest


def _folder_of_car(log: Path, places: list[Path]) -> str:
    """The name of the folder in a place that holds a car's logs, or its sticks; a place without one is itself a
    car's."""
    from logger.store.export.manifest import FOLDER

    place = next(place for place in places if log.is_relative_to(place))
    inside = log.relative_to(place).parts[:-1]
    return inside[0] if inside and inside[0] != FOLDER else (place if place.is_dir() else place.parent).resolve().name


def _car_of(log: Path) -> str:
    """The vehicle's name in the description beside a log."""
    from logger.store.log.sidecar import read_sidecar
    from logger.vehicle.vehicle import GENERIC

    try:
        content: Any = read_sidecar(log)
    except (ValueError, OSError):
        content = None
    vehicle = content.get("vehicle") if isinstance(content, dict) else None
    name = vehicle.get("name") if isinstance(vehicle, dict) else None
    if not isinstance(name, str) or not name:
        raise BadInput(f"{log}: expected the car's name in the sidecar beside it, or --car NAME")
    if name == GENERIC:
        raise BadInput(f"{log}: expected the car's name, found {GENERIC}, no car in particular: --car NAME")
    return name


def _needs_arrow() -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise BadInput(f"fleet: {EXTRA.format(error)}") from None
