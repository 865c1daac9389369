"""Repeated drives combined by place and direction: the mean of all passes with its standard error, what changed, and
places that somebody should go and see.

  ridelog passes /media/RIDELOG --out means.html --visit places.gpx
  ridelog passes spring/ autumn/ --split 2026-07-01 --out changes.geojson

Each drive is matched to those before it as a whole: by its places, its direction, and the receiver's error, which
changes over minutes. Streets some 15 m apart or more are distinguished, lanes of one direction are not. The standard
error of a mean includes the errors that all windows of one drive share (the car, its tires, its load), estimated from
how drives differ. It cannot include what all drives share, such as a wrong vehicle file.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.api.outputs import check_outs
from logger.api.passes import ROUGH_M_PER_KM, USUAL
from logger.commands.numbers import add_limit
from logger.commands.pictures import PAGE, parted, write_pictures
from logger.commands.table_files import table_endings
from logger.errors import EXIT_DONE


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog passes``."""
    parser.add_argument("logs", metavar="LOGS", type=Path, nargs="+",
                        help="folder of segment logs, exported stick, or log file")
    parser.add_argument("--length", default=USUAL, metavar="LENGTH",
                        help=f"of a cell of road with its unit, such as 25ft, 50m, 0.1mi (default: {USUAL})")
    parser.add_argument("--since", metavar="DAY", help="rows from this day on (UTC), such as 2026-04-30")
    parser.add_argument("--until", metavar="DAY", help="rows before this day (UTC)")
    parser.add_argument("--split", metavar="DAY",
                        help="what changed between the drives before this day and those from it on")
    add_limit(parser, "--above", metavar="IRI", default=ROUGH_M_PER_KM,
              help=f"from which IRI [m/km, or as 160in/mi] a place is to be visited (default: {ROUGH_M_PER_KM:.2f}, "
                   "poor by 23 CFR 490.313)")
    parser.add_argument("--out", metavar="FILE", type=Path, action="append", default=[],
                        help=f"write the means as {table_endings()}, or a page with map and curves (.html) or picture "
                             "(.png .svg .pdf); may repeat")
    parser.add_argument("--visit", metavar="FILE", type=Path,
                        help="write the places to visit: waypoints (.gpx), or one of --out's other endings")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog passes``."""
    from logger.api.passes import passes
    from logger.exchange.format import format_of, write_layer
    from logger.files import together, write_text
    from logger.store.log.log_reader import find_logs_in

    pictures, tables = parted(args.out)
    for path in (*tables, *([args.visit] if args.visit else [])):
        format_of(path)
    logs = [log for log, _ in find_logs_in(args.logs)]
    check_outs([*(("--out", path) for path in args.out), ("--visit", args.visit)], read=logs)
    found = passes(args.logs, args.length, args.since, args.until, args.split, args.above)
    with together():
        for table in tables:
            write_layer(found.layer(), table)
        if args.visit is not None:
            write_layer(found.visits(), args.visit)
        for page in (path for path in pictures if path.suffix.lower() == PAGE):
            write_text(page, found.page())
        write_pictures([path for path in pictures if path.suffix.lower() != PAGE], "Passes",
                       ", ".join(map(str, args.logs)), found.text, found.charts)
    print(json.dumps(found.as_json(), allow_nan=False) if args.json else found.text)
    return EXIT_DONE
