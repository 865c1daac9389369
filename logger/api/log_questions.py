"""Questions about segment logs: sections, passes, convert, and the three of ``ridelog fleet``."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from datetime import date, timedelta
from pathlib import Path
from re import fullmatch
from typing import Annotated

from drivers.catalogue import names
from logger.api.shared_fields import Localized, limit_of
from logger.question import LIMIT, Argument, Option, Out, Question, Range, Verb, Verbs
from logger.units import LENGTH_UNITS_M, WINDOW_M

MOST_M = 100_000.0
SYSTEMS = ("si", "us")
FORMATS = tuple(f".{name}" for name in names("logger.exchange.formats", "FORMAT"))


def length_of(length: str | float) -> float:
    """A length in metres, or with its unit, such as 100m, 0.1mi, 500ft, 1km [m]. ValueError for anything else."""
    text = length if isinstance(length, str) else f"{length:f}m"
    found = fullmatch(r"([0-9.]+)\s*(m|km|mi|ft)", text.strip())
    try:
        length_m = float(found[1]) * LENGTH_UNITS_M[found[2]] if found else 0.0
    except ValueError:
        length_m = 0.0
    if not WINDOW_M <= length_m <= MOST_M:
        raise ValueError(f"expected a length with its unit, such as 100m, 0.1mi or 500ft, from {WINDOW_M:g} m to "
                         f"{MOST_M / 1000:g} km")
    return length_m


def day_us(day: str | None) -> int | None:
    """The start of a day (2026-04-30), month (2026-04) or year (2026) in UTC [us since 1970]; None for None. ValueError
    for anything else."""
    if day is None:
        return None
    first = date.fromisoformat(day + {4: "-01-01", 7: "-01"}.get(len(day), ""))
    return (first - date(1970, 1, 1)) // timedelta(microseconds=1)


def check_day(day: str) -> None:
    """ValueError for what is no day, month or year."""
    try:
        day_us(day)
    except ValueError:
        raise ValueError("expected a date such as 2026-04-30, a month (2026-04) or a year (2026)") from None


Logs = Annotated[Path | str | Sequence[Path | str], Argument(
    "folder of segment logs at any depth, exported stick, or log file; open ones too", metavar="LOGS", read=Path,
    many=list)]


@dataclass(frozen=True)
class LogsQuestion(Question):
    """One about segment ``logs``."""

    logs: Logs

    @property
    def places(self) -> list[Path]:
        """Where the logs are."""
        return [Path(self.logs)] if isinstance(self.logs, str | Path) else [Path(one) for one in self.logs]

    def files_read(self) -> Sequence[Path]:
        from logger.store.log.log_reader import find_logs_in

        return [log for log, _ in find_logs_in(self.places)]


@dataclass(frozen=True)
class SectionsQuestion(LogsQuestion):
    """Divide logs into sections, as road agencies report them: mean IRI with its standard error, condition, comfort.

      ridelog sections /media/RIDELOG --length 0.1mi
      ridelog sections drive-logs/ --length 100m --out sections.geojson
      ridelog sections drive-logs/ --length 100m --route route.geojson

    Sections count from the beginning of each drive; the last one is cut short. A section's IRI is the mean of its
    windows, weighted by length; beside it stands how much of the section has an IRI. Its standard error includes the
    errors that its windows share. Means leave out rows flagged unsettled.

    With --route, sections follow the kilometres of a line, for each pass over it in either direction. The line may have
    begin_km and end_km; points with a number km are its kilometre posts.

    In Python: raises BadInput for no log, none with an intact row, and a file that is no route.

    >>> found = sections(folder / "logs", "0.1mi")
    >>> bool((found.known_m <= found.length_m + 1e-6).all())
    True
    """

    length: Annotated[str | float, Option(
        "length of a section with its unit, such as 0.1mi (23 CFR 490), 100ft, 1km (default: 100m)", metavar="LENGTH",
        read=str, check=length_of)] = 100.0
    units: Annotated[str | None, Option(
        "units of the printed values (default: us where the length is in miles or feet, else si)",
            choices=SYSTEMS)] = None
    route: Annotated[Path | str | None, Option(
        "measure sections along this line, for both directions", metavar="LINE.geojson", read=Path)] = None
    localized_m_per_km: Localized = None


@dataclass(frozen=True)
class PassesQuestion(LogsQuestion):
    """Combine repeated drives by place and direction: the mean of all passes with its standard error, what changed,
    and a work list of places to look at.

      ridelog passes /media/RIDELOG --out means.html --visit places.gpx
      ridelog passes spring/ autumn/ --split 2026-07-01 --out changes.geojson

    Each drive is matched to those before it as a whole: by its places, its direction, and the receiver's error, which
    changes over minutes. Streets some 15 m apart or more are distinguished, lanes of one direction are not. The
    standard error of a mean includes the errors that all windows of one drive share (the car, its tires, its load),
    estimated from how drives differ. An error that all drives share, such as a wrong vehicle file, does not show in
    these differences; the standard errors of the vehicle file and of the learned noise account for it.

    In Python: raises BadInput for no log, and none with an intact row that counts.

    >>> found = passes(folder / "logs")
    >>> bool((found.drives >= 1).all())
    True
    """

    length: Annotated[str | float, Option(
        "length of a piece of road with its unit, such as 25ft, 50m, 0.1mi (default: 25m)", metavar="LENGTH", read=str,
        check=length_of)] = 25.0
    since: Annotated[str | None, Option(
        "rows from this day on (UTC), such as 2026-04-30; those without a date are then left out", metavar="DAY",
        check=check_day)] = None
    until: Annotated[str | None, Option("rows before this day (UTC)", metavar="DAY", check=check_day)] = None
    split: Annotated[str | None, Option(
        "what changed between the drives before this day (or month 2026-04, or year 2026) and those from it on",
        metavar="DAY", check=check_day)] = None
    above_m_per_km: Annotated[float | None, Option(
        "the IRI [m/km, or at a terminal as 160in/mi] from which a place goes on the work list (default: 2.68, poor by "
        "23 CFR 490.313)", LIMIT, "IRI", read=limit_of)] = None


@dataclass(frozen=True)
class ConvertQuestion(LogsQuestion):
    """Write logs for other programs, in the format of the file's extension: maps such as .geojson, tracks such as .gpx,
    tables such as .csv.

    Each row of a log becomes a line on the map, from half-way to the row before to half-way to the next; a row without
    neighbours is a point, and one without a position has no place on it. Values keep their names and units; what is not
    known is empty. GeoPackage and Parquet need pip install 'ridelog[maps]'. The file is written whole, or not at all.

      ridelog convert /media/RIDELOG --to drive.geojson
      ridelog convert /media/RIDELOG --smoothness ways.geojson --to review.geojson

    With --smoothness each row is a way of OpenStreetMap that was driven: the value of its key smoothness that the IRI
    suggests, how sure that is, and the present tag. Review the file before you use it; nothing is uploaded.

    In Python: raises BadInput for another ending, a missing extra, no log or none with an intact row, a file without
    ways, and where none of them was driven.

    >>> convert(folder / "logs", folder / "drive.geojson").rows > 0
    True
    """

    to: Annotated[Path | str, Option(f"file to write; its extension chooses the format: {' '.join(FORMATS)}",
        metavar="FILE",
                                     read=Path)]
    smoothness: Annotated[Path | str | None, Option(
        "suggest OpenStreetMap's smoothness for the ways of this extract (with @id and highway)",
        metavar="WAYS.geojson", read=Path)] = None


_TABLES = f"{' '.join(FORMATS)} (in SI units)"
SECTIONS = Verb(SectionsQuestion, "logger.api.sections:sections", (Out(
    f"write the sections as {_TABLES}, or a page or picture of them (.html .png .svg .pdf); may repeat",
    metavar="FILE", others=FORMATS),))
PASSES = Verb(PassesQuestion, "logger.api.passes:passes", (
    Out(f"write the means as {_TABLES}, or a page with map and curves (.html) or picture (.png .svg .pdf); may repeat",
        metavar="FILE", others=FORMATS),
    Out("write the work list: waypoints (.gpx), or one of the formats of --out", "--visit", "FILE", FORMATS,
        many=False, is_drawn=False)))
CONVERT = Verb(ConvertQuestion, "logger.api.conversion:convert")


BY = ("segment", "section", "cell", "route")


@dataclass(frozen=True)
class IngestQuestion(LogsQuestion):
    """Add the intact rows of logs to a dataset of Parquet files. It skips rows that are there already; an ingest that
    was interrupted continues when you start it again. The dataset keeps a pseudonym of each car, the table beside it
    (DATASET.cars.csv) its name.

      ridelog fleet ingest depot/ --to county --car-folders
      ridelog fleet ingest /media/RIDELOG --to trimmed --car "van 7" --trim-m 200

    In Python: raises BadInput for no log, a log without a car's name, a folder that is no dataset, and other roads or
    another ``trim_m`` than the dataset has; OSError for a disk that refuses.

    >>> fleet_ingest(folder / "logs", folder / "fleet", car="blue").added > 0
    True
    """

    to: Annotated[Path | str, Option("folder of the dataset; made if needed", metavar="DATASET", read=Path)]
    _: KW_ONLY
    car: Annotated[str | None, Option(
        "the car's name (default: the vehicle's name in the sidecar of each log; give one where cars share it)",
        metavar="NAME")] = None
    car_folders: Annotated[bool, Option(
        "each folder in LOGS holds the logs or sticks of one car, and is named after it")] = False
    roads: Annotated[Path | str | None, Option(
        "map of the roads to which windows are assigned, at the first ingest (default: squares of 66 ft on the "
        "ground)",
        metavar="FILE.geojson", read=Path)] = None
    trim_m: Annotated[float | None, Option(
        "leave out this length at each drive's start and end [m]; the first ingest sets it (default: 0)",
        Range(0.0, 10_000.0, "m"), "M", flag="--trim-m")] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.car is not None and self.car_folders:
            raise self.wrong("car", ": expected no `car_folders` with it")


@dataclass(frozen=True, kw_only=True)
class FleetQuestion(Question):
    """What is asked of a dataset."""

    since: Annotated[str | None, Option("first day, such as 2026-03-01 (UTC)", metavar="DAY", check=check_day)] = None
    until: Annotated[str | None, Option("first day that is left out", metavar="DAY", check=check_day)] = None
    engine: Annotated[str, Option(
        "duckdb, spark://HOST:PORT, or 'spark MASTER' such as 'spark local[2]'", metavar="ENGINE")] = "duckdb"
    public: Annotated[int | None, Option(
        "for others to read: call cars by pseudonyms (DATASET.cars.csv tells you which is which), and leave out "
        "segments that fewer than N cars have driven", Range(1, 1_000_000), "N")] = None


Dataset = Annotated[Path | str, Argument("folder that 'fleet ingest' has made", metavar="DATASET", read=Path)]


@dataclass(frozen=True)
class SummariseQuestion(FleetQuestion):
    """Summarise roads and cars: mean IRI with standard error, change and comfort by road; the bias of each car, from
    the roads that cars share.

      ridelog fleet summarise county --by section --out sections.csv
      ridelog fleet summarise county --since 2026-01-01 --public 3

    In Python: raises BadInput for no dataset, another engine, no pass in that time, and routes without a map.

    >>> summary = fleet_summarise(folder / "fleet", by="section")
    >>> bool((summary.found.roads.iri_m_per_km > 0).all())
    True
    """

    dataset: Dataset
    _: KW_ONLY
    by: Annotated[str, Option(
        "segment (66 ft, one direction), section (0.1 mi), cell (0.8 mi square), route (a road of the map)",
        choices=BY)] = BY[0]


@dataclass(frozen=True)
class ReportQuestion(FleetQuestion):
    """Write a folder that opens without a server: a page with a map and lists (index.html), tiles of the map, and the
    segments and sections of 0.1 mi as GeoParquet and CSV. It replaces an older report as a whole, or not at all.

      ridelog fleet report county --out map/
      ridelog fleet report county --out map/ --public 3

    In Python: raises BadInput as ``fleet_summarise``, for a folder with other files, and where too few cars leave no
    segment.

    >>> fleet_report(folder / "fleet", folder / "map").page.stat().st_size < 200_000
    True
    """

    dataset: Dataset
    out: Annotated[Path | str, Option("folder to write", metavar="DIR", read=Path)]


INGEST = Verb(IngestQuestion, "logger.api.fleet:fleet_ingest")
SUMMARISE = Verb(SummariseQuestion, "logger.api.fleet:fleet_summarise", (Out(
    f"write all rows as {' '.join(FORMATS)}", metavar="FILE", others=FORMATS, many=False, is_drawn=False),))
REPORT = Verb(ReportQuestion, "logger.api.fleet:fleet_report")
FLEET = Verbs('''Combine many cars over years: logs into a dataset, figures of its roads and cars, and a map of them.

  ridelog fleet ingest /media/RIDELOG --to county --car "van 7"
  ridelog fleet summarise county --by section --since 2026-01-01 --out sections.parquet
  ridelog fleet report county --out map/

docs/fleet.md describes all of it, from the stick in a depot to the map.
''', {"ingest": (INGEST, "add logs to a dataset"), "summarise": (SUMMARISE, "figures of roads and cars"),
      "report": (REPORT, "a map in a folder")})
