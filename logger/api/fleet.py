"""Many cars over years: logs into a dataset, and the figures of its roads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.ranges import Range
from logger.api.shown import CommandResult
from logger.errors import BadInput
from logger.fleet.dataset import EXTRA, Dataset, existing

if TYPE_CHECKING:
    from logger.exchange.layer import Layer
    from logger.fleet.drive_rows import Keyed
    from logger.fleet.engine import Engine
    from logger.fleet.road_map import RoadPieces
    from logger.fleet.summary import FleetFigures

BY = ("segment", "section", "cell", "route")
TRIM = Range(0.0, 10_000.0, "m")
CARS = Range(1, 1_000_000, "")
_ROADS = "roads.geojson"
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


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
        from logger.fleet.words import figures_json

        return figures_json(self.found)

    def layer(self) -> Layer:
        """Roads with their places, for the formats of ``convert``."""
        from logger.fleet.layer import roads_layer

        return roads_layer(self.found.roads)


def fleet_ingest(logs: Path | str | Sequence[Path | str], to: Path | str, *, car: str | None = None,
                 car_folders: bool = False, roads: Path | str | None = None, trim_m: float | None = None
                 ) -> Ingested:
    """Add the intact rows of segment logs to a dataset, each once; what is there already is passed over.

    logs           folders at any depth, or files, of segment logs
    to             the dataset, a folder; it is made where there is none
    car            the name of the car; None: that of the vehicle in the logs' description. The dataset keeps a
                   pseudonym, the table beside it (``DATASET.cars.csv``) its name
    car_folders    a car is called as the folder that its logs lie in
    roads          GeoJSON of roads to lay the windows on, at the first ingest; None: cells of the ground, or the roads
                   that the dataset has
    trim_m         how much of each drive's start and end is left out [m], at the first ingest; None: nothing, or what
                   the dataset has

    Raises BadInput for no log, a log without a car's name, a folder that is no dataset, and other roads or another
    ``trim_m`` than the dataset has; OSError for a disk that refuses.

    >>> fleet_ingest(folder / "logs", folder / "fleet", car="blue").added > 0
    True
    """
    from logger.fleet.ingest import ingest_sessions, sessions_of
    from logger.fleet.pseudonyms import keep_names, own_key, pseudonym
    from logger.fleet.words import ingest_json, ingest_words
    from logger.store.log.log_reader import find_logs_in

    _needs_arrow()
    if trim_m is not None:
        TRIM.check("--trim-m", trim_m)
    dataset = Dataset(Path(to))
    places = [Path(logs)] if isinstance(logs, str | Path) else [Path(one) for one in logs]
    named = [(log, log.resolve().parent.name if car_folders else car or _car_of(log))
             for log, _ in find_logs_in(places)]
    with dataset.writing():
        key = own_key(dataset.folder)
        if trim_m is not None and not dataset.is_new and trim_m != dataset.manifest.trim_m:
            raise BadInput(f"--trim-m {trim_m:g}: expected {dataset.manifest.trim_m:g} m, as the dataset was begun "
                           "with")
        keep_names(dataset.folder, {name for _, name in named}, key)
        with _keys(dataset, None if roads is None else Path(roads)) as (keyed, roads_sha256):
            counts = ingest_sessions(
                dataset, sessions_of((log, pseudonym(name, key)) for log, name in named), keyed, roads=roads_sha256,
                trim_m=(trim_m or 0.0) if dataset.is_new else dataset.manifest.trim_m)
    rows = dataset.manifest.rows
    return Ingested(ingest_words(counts, rows, str(dataset.folder)), ingest_json(counts, rows), counts.added, rows)


def fleet_summarise(dataset: Path | str, *, by: str = "segment", since: str | None = None, until: str | None = None,
                    engine: str = "duckdb", min_cars: int = 1, pseudonyms: bool = False) -> FleetSummary:
    """Mean IRI with its standard error, change and comfort of a dataset's roads, and the biases of its cars.

    by          segment (66 ft of one direction), section (0.1 mi), cell (0.8 mi square) or route (a road of the map)
    since       first day, such as 2026-03-01; ``until`` the first day that is left out
    engine      duckdb, spark://HOST:PORT, or ``spark MASTER`` such as ``spark local[2]``
    min_cars    segments that fewer cars have driven are left out
    pseudonyms  cars are called by these, also where the table of their names lies beside the dataset

    Raises BadInput for no dataset, another engine, no pass in that time, and routes without a map.

    >>> summary = fleet_summarise(folder / "fleet", by="section")
    >>> bool((summary.found.roads.iri_m_per_km > 0).all())
    True
    """
    from logger.fleet.words import figures_words

    with _summarised(Path(dataset), by, since, until, engine, min_cars, pseudonyms) as (figures, _, _):
        return FleetSummary(figures_words(figures), {}, figures)


@dataclass(frozen=True, eq=False, repr=False)
class FleetReport(CommandResult):
    """What a report wrote: ``page``, and how many ``tiles``."""

    page: Path
    tiles: int


def fleet_report(dataset: Path | str, out: Path | str, *, since: str | None = None, until: str | None = None,
                 engine: str = "duckdb", min_cars: int = 1, pseudonyms: bool = False) -> FleetReport:
    """Write a folder that opens without a server: ``index.html``, the tiles of its map, ``segments.parquet`` and
    sections of 0.1 mi as ``sections.parquet`` and ``sections.csv``. It is there whole, in place of an older one, or
    not at all.

    out       a folder that is not there, or that a report has made; the rest as for ``fleet_summarise``

    Raises BadInput as ``fleet_summarise``, for a folder with other files, and where too few cars leave no segment.

    >>> fleet_report(folder / "fleet", folder / "map").page.stat().st_size < 200_000
    True
    """
    from logger.fleet.report import INDEX, check_folder, history_of, write_report

    place = Path(out)
    check_folder(place)
    with _summarised(Path(dataset), "segment", since, until, engine, min_cars, pseudonyms) as (
            figures, running, pieces):
        if not len(figures.roads.key):
            raise BadInput(f"{dataset}: expected a segment that {min_cars} cars have driven, found none")
        steps = history_of(running, figures, day_us(since, "--since"), day_us(until, "--until"))
    tiles = write_report(figures, steps, pieces, place)
    page = place / INDEX
    text = f"Report: {page} ({len(figures.roads.key):,} segments, {tiles:,} tiles)"
    return FleetReport(text, {"page": str(page), "tiles": tiles, "segments": len(figures.roads.key)}, page, tiles)


@contextmanager
def _summarised(folder: Path, by: str, since: str | None, until: str | None, engine: str, min_cars: int,
                pseudonyms: bool) -> Iterator[tuple[FleetFigures, Engine, RoadPieces | None]]:
    """Figures, the engine that made them, and the map of the dataset."""
    from logger.fleet.engine import opened
    from logger.fleet.pseudonyms import names_of, shown_car
    from logger.fleet.summary import summarise

    _needs_arrow()
    CARS.check("--min-cars", min_cars)
    if by not in BY:
        raise BadInput(f"--by {by}: expected one of {', '.join(BY)}")
    since_us, until_us = day_us(since, "--since"), day_us(until, "--until")
    dataset = existing(folder)
    if by == "route" and not dataset.manifest.roads:
        raise BadInput("--by route: expected a dataset that was begun with --roads")
    empty = BadInput(f"{folder}: expected at least one pass with an IRI in that time")
    files = dataset.files(since_us, None if until_us is None else until_us - 1)
    if not files:
        raise empty
    pieces, names = _pieces(dataset), {} if pseudonyms else names_of(folder)
    with opened(files, engine) as running:
        figures = summarise(running, by, since_us, until_us, min_cars, pieces,
                            lambda car: names.get(car) or shown_car(car))
        if figures is None:
            raise empty
        yield figures, running, pieces


def day_us(text: str | None, option: str) -> int | None:
    """The start of a day (UTC) [us since 1970]; None for None. BadInput for what is no day."""
    if text is None:
        return None
    try:
        day = date.fromisoformat(text)
    except ValueError:
        raise BadInput(f"{option} {text}: expected a day such as 2026-03-01") from None
    return (datetime(day.year, day.month, day.day, tzinfo=UTC) - _EPOCH) // timedelta(microseconds=1)


def _pieces(dataset: Dataset) -> RoadPieces | None:
    """The pieces of the map that a dataset was made with."""
    from logger.fleet.road_map import pieces_of
    from logger.store.formats.road_lines import read_road_lines

    return pieces_of(read_road_lines(dataset.folder / _ROADS)) if dataset.manifest.roads else None


@contextmanager
def _keys(dataset: Dataset, roads: Path | None) -> Iterator[tuple[Keyed, str]]:
    """How keys are made, and the SHA-256 of the map."""
    from logger.files import read_bounded, replace_bytes
    from logger.fleet.road_cells import cell_keys
    from logger.fleet.road_map import RoadMap, pieces_of
    from logger.store.formats.road_lines import MAX_BYTES, read_road_lines

    if roads is None and not dataset.manifest.roads:
        yield lambda lat_deg, lon_deg, heading_deg, drive: cell_keys(lat_deg, lon_deg, heading_deg), ""
        return
    content = read_bounded(roads or dataset.folder / _ROADS, MAX_BYTES)
    digest = sha256(content).hexdigest()
    if not dataset.is_new and digest != dataset.manifest.roads:
        raise BadInput(f"{roads or dataset.folder / _ROADS}: expected the roads that the dataset was begun with")
    try:
        pieces = pieces_of(read_road_lines(roads or dataset.folder / _ROADS))
    except ValueError as error:
        raise BadInput(f"{roads or dataset.folder / _ROADS}: {error}") from None
    if dataset.is_new:
        replace_bytes(dataset.folder / _ROADS, content)
    yield RoadMap(pieces).keys, digest


def _car_of(log: Path) -> str:
    """The vehicle's name in the description beside a log."""
    from logger.store.log.sidecar import read_sidecar

    try:
        content: Any = read_sidecar(log)
    except (ValueError, OSError):
        content = None
    vehicle = content.get("vehicle") if isinstance(content, dict) else None
    name = vehicle.get("name") if isinstance(vehicle, dict) else None
    if not isinstance(name, str) or not name:
        raise BadInput(f"{log}: expected the car's name in the description beside it, or --car NAME")
    return name


def _needs_arrow() -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise BadInput(f"fleet: {EXTRA.format(error)}") from None
