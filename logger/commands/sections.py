"""Logs in sections of one length, as road agencies file them: mean IRI with its standard error, condition, comfort.

  ridelog sections /media/RIDELOG --length 0.1mi --units us
  ridelog sections drive-logs/ --length 100m --out sections.geojson
  ridelog sections drive-logs/ --length 100m --route route.geojson

Sections count from the beginning of each drive; the last one is cut short. A section's IRI is the mean of its windows
by length, over as much of it as has an IRI, which is said beside it. Its standard error is that of independent windows.
It does not hold what all windows of a car share, such as a vehicle file that is wrong.

With --route they count by the measures of a line, for each pass over it and in either direction. The line may say
begin_km and end_km; points with a number km are its kilometre posts.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.api.outputs import check_outs
from logger.api.sections import SYSTEMS
from logger.commands.numbers import add_limit
from logger.commands.pictures import parted, write_pictures
from logger.commands.table_files import table_endings
from logger.errors import EXIT_DONE
from logger.files import together

_USUAL = "100m"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog sections``."""
    parser.add_argument("logs", metavar="LOGS", type=Path, nargs="+",
                        help="folder of segment logs, exported stick, or log file")
    parser.add_argument("--length", default=_USUAL, metavar="LENGTH",
                        help=f"of a section with its unit, such as 0.1mi (23 CFR 490), 100ft, 1km (default: {_USUAL})")
    parser.add_argument("--route", metavar="LINE.geojson", type=Path,
                        help="count by the measures of this line, along and against it")
    add_limit(parser, "--localized", metavar="IRI",
              help="list where the IRI over 25 ft, which slides along, is above this, in m/km, or as 160in/mi (AASHTO "
                   "R 54)")
    parser.add_argument("--units", choices=SYSTEMS, default=SYSTEMS[0], help="of what is printed (default: si)")
    parser.add_argument("--out", metavar="FILE", type=Path, action="append", default=[],
                        help=f"write the sections as {table_endings()} (in SI units), or a page or picture of them "
                             "(.html .png .svg .pdf); may repeat")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog sections``."""
    from logger.api.sections import sections
    from logger.exchange.format import format_of, write_layer
    from logger.store.log.log_reader import find_logs_in

    pictures, tables = parted(args.out)
    for table in tables:
        format_of(table)
    if args.out:
        check_outs([("--out", path) for path in args.out], read=[log for log, _ in find_logs_in(args.logs)])
    found = sections(args.logs, args.length, args.units, args.route, args.localized)
    with together():
        for table in tables:
            write_layer(found.layer(), table)
        write_pictures(pictures, "Sections", ", ".join(map(str, args.logs)), found.text, found.charts)
    print(json.dumps(found.as_json(), allow_nan=False) if args.json else found.text)
    return EXIT_DONE
