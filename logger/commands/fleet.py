"""Many cars over years: logs into a dataset, the figures of its roads and cars, and a map of them.

  ridelog fleet ingest /media/RIDELOG --to county --car "van 7"
  ridelog fleet summarise county --by section --since 2026-01-01 --out sections.parquet
  ridelog fleet report county --out map/

docs/fleet.md describes all of it, from the stick in a depot to the map.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.api.fleet import BY, CARS, TRIM
from logger.api.outputs import check_out
from logger.commands.numbers import add_number
from logger.commands.table_files import table_endings
from logger.errors import EXIT_DONE
from logger.files import note


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the verbs."""
    verbs = parser.add_subparsers(dest="fleet_verb", required=True, metavar="ingest|summarise|report")
    take = verbs.add_parser("ingest", help="add logs to a dataset", allow_abbrev=False, description=(
        "Add the intact rows of logs to a dataset of Parquet files. What is there already is passed over; an ingest "
        "that was cut off goes on where it was when it is started again."))
    take.add_argument("logs", metavar="LOGS", type=Path, nargs="+",
                      help="folder of segment logs, exported stick, or log file")
    take.add_argument("--to", metavar="DATASET", type=Path, required=True, help="folder of the dataset; made if needed")
    whose = take.add_mutually_exclusive_group()
    whose.add_argument("--car", metavar="NAME", help="the car's name (default: the vehicle's name in the "
                                                    "description beside each log; give one where cars share it)")
    whose.add_argument("--car-folders", action="store_true",
                       help="each car has a folder of logs, which is called as it is")
    take.add_argument("--roads", metavar="FILE.geojson", type=Path,
                      help="roads to lay the windows on, at the first ingest (default: cells of the ground of 66 ft)")
    add_number(take, "--trim-m", *TRIM, metavar="M",
               help="leave out so much of each drive's start and end, from the first ingest on [m] (default: 0)")
    tell = verbs.add_parser("summarise", help="figures of roads and cars", allow_abbrev=False, description=(
        "Mean IRI with its standard error, change and comfort by road; which car reads how much too high, from the "
        "roads that cars share."))
    _common(tell)
    tell.add_argument("--by", choices=BY, default=BY[0],
                      help="segment (66 ft, one direction), section (0.1 mi), cell (0.8 mi), route (default: segment)")
    tell.add_argument("--out", metavar="FILE", type=Path,
                      help=f"write all rows as {table_endings()}")
    draw = verbs.add_parser("report", help="a map in a folder", allow_abbrev=False, description=(
        "Write a folder that opens without a server: a page with a map and lists, tiles of the map, and the segments "
        "and sections of 0.1 mi as GeoParquet and CSV."))
    _common(draw)
    draw.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder to write")
    for one in (take, tell, draw):
        one.add_argument("--json", action="store_true", help="print one JSON object")


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dataset", metavar="DATASET", type=Path, help="folder that 'fleet ingest' has made")
    parser.add_argument("--since", metavar="DAY", help="first day, such as 2026-03-01 (UTC)")
    parser.add_argument("--until", metavar="DAY", help="first day that is left out")
    parser.add_argument("--engine", default="duckdb", metavar="ENGINE",
                        help="duckdb, spark://HOST:PORT, or 'spark MASTER' such as 'spark local[2]' (default: duckdb)")
    parser.add_argument("--pseudonyms", action="store_true",
                        help="call cars by pseudonyms, for others to read; DATASET.cars.csv tells you which is which")
    add_number(parser, "--min-cars", *CARS, kind=int, default=1, metavar="N",
               help="leave out segments that fewer cars have driven (default: 1)")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog fleet``."""
    return {"ingest": _ingest, "summarise": _summarise, "report": _report}[args.fleet_verb](args)


def _ingest(args: argparse.Namespace) -> int:
    from logger.api.fleet import fleet_ingest

    done = fleet_ingest(args.logs, args.to, car=args.car, car_folders=args.car_folders, roads=args.roads,
                        trim_m=args.trim_m)
    note(args.to)
    print(json.dumps(done.as_json()) if args.json else done.text)
    return EXIT_DONE


def _summarise(args: argparse.Namespace) -> int:
    from logger.api.fleet import fleet_summarise
    from logger.exchange.format import format_of, write_layer

    if args.out is not None:
        format_of(args.out)
        check_out(args.out, ())
    found = fleet_summarise(args.dataset, by=args.by, since=args.since, until=args.until, engine=args.engine,
                            min_cars=args.min_cars, pseudonyms=args.pseudonyms)
    if args.out is not None:
        write_layer(found.layer(), args.out)
    print(json.dumps(found.as_json(), allow_nan=False) if args.json else found.text)
    return EXIT_DONE


def _report(args: argparse.Namespace) -> int:
    from logger.api.fleet import fleet_report

    done = fleet_report(args.dataset, args.out, since=args.since, until=args.until, engine=args.engine,
                        min_cars=args.min_cars, pseudonyms=args.pseudonyms)
    print(json.dumps(done.as_json()) if args.json else done.text)
    return EXIT_DONE
