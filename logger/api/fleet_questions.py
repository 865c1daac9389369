"""What ``ridelog fleet`` is asked: ingest, summarise and report."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from logger.api.log_questions import FORMATS, LogsQuestion, check_day
from logger.api.question import Argument, Option, Out, Question, Verb
from logger.api.ranges import Range

BY = ("segment", "section", "cell", "route")


@dataclass(frozen=True)
class IngestQuestion(LogsQuestion):
    """Add the intact rows of logs to a dataset of Parquet files. What is there already is passed over; an ingest that
    was cut off goes on where it was when it is started again. The dataset keeps a pseudonym of each car, the table
    beside it (``DATASET.cars.csv``) its name.

    In Python: raises BadInput for no log, a log without a car's name, a folder that is no dataset, and other roads or
    another ``trim_m`` than the dataset has; OSError for a disk that refuses.

    >>> fleet_ingest(folder / "logs", folder / "fleet", car="blue").added > 0
    True
    """

    to: Annotated[Path | str, Option("folder of the dataset; made if needed", metavar="DATASET", read=Path)]
    _: KW_ONLY
    car: Annotated[str | None, Option(
        "the car's name (default: the vehicle's name in the description beside each log; give one where cars share "
        "it)", metavar="NAME")] = None
    car_folders: Annotated[bool, Option("each car has a folder of logs, which is called as it is")] = False
    roads: Annotated[Path | str | None, Option(
        "roads to lay the windows on, at the first ingest (default: cells of the ground of 66 ft)",
        metavar="FILE.geojson", read=Path)] = None
    trim_m: Annotated[float | None, Option(
        "leave out so much of each drive's start and end, from the first ingest on [m] (default: 0)",
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
    min_cars: Annotated[int, Option(
        "leave out segments that fewer cars have driven", Range(1, 1_000_000), "N")] = 1
    pseudonyms: Annotated[bool, Option(
        "call cars by pseudonyms, for others to read; DATASET.cars.csv tells you which is which")] = False


Dataset = Annotated[Path | str, Argument("folder that 'fleet ingest' has made", metavar="DATASET", read=Path)]


@dataclass(frozen=True)
class SummariseQuestion(FleetQuestion):
    """Mean IRI with its standard error, change and comfort by road; which car reads how much too high, from the roads
    that cars share.

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
    segments and sections of 0.1 mi as GeoParquet and CSV. It is there whole, in place of an older one, or not at all.

    In Python: raises BadInput as ``fleet_summarise``, for a folder with other files, and where too few cars leave no
    segment.

    >>> fleet_report(folder / "fleet", folder / "map").page.stat().st_size < 200_000
    True
    """

    dataset: Dataset
    out: Annotated[Path | str, Option("folder to write", metavar="DIR", read=Path)]


INGEST = Verb(IngestQuestion, "logger.api.fleet:ingested")
SUMMARISE = Verb(SummariseQuestion, "logger.api.fleet:summarised", (Out(
    f"write all rows as {' '.join(FORMATS)}", metavar="FILE", others=FORMATS, many=False, is_drawn=False),))
REPORT = Verb(ReportQuestion, "logger.api.fleet:reported")
