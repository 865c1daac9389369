"""Write logs as a file for other programs, by its ending: maps such as .geojson, tracks such as .gpx, tables such as
.csv.

Each row of a log becomes a line on the map, from half-way to the row before to half-way to the next; a row without
neighbours is a point, and one without a position has no place on it. Values keep their names and units; what is not
known is empty.

  ridelog convert /media/RIDELOG --to drive.geojson
  ridelog convert /media/RIDELOG --smoothness ways.geojson --to review.geojson

With --smoothness each row is a way of OpenStreetMap that was driven: the value of its key smoothness that the IRI
suggests, how sure that is, and what is tagged. It is for a person to look through; nothing is sent anywhere.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.commands.table_files import table_endings
from logger.errors import EXIT_DONE
from logger.left_out import left_out_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog convert``."""
    parser.add_argument("logs", metavar="LOGS", type=Path, nargs="+",
                        help="folder of segment logs, exported stick, or log file")
    parser.add_argument("--to", metavar="FILE", type=Path, required=True,
                        help=f"file to write; its ending says what: {table_endings()}")
    parser.add_argument("--smoothness", metavar="WAYS.geojson", type=Path,
                        help="suggest OpenStreetMap's smoothness for the ways of this extract (with @id and highway)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog convert``."""
    from logger.api.conversion import convert

    done = convert(args.logs, args.to, args.smoothness)
    rows = "rows" if args.smoothness is None else "ways"
    print(json.dumps({"file": str(done.path), "format": done.format, rows: done.rows, "placed": done.placed,
                      "damaged_lines": done.damaged_lines, **left_out_json(done.left_out)}) if args.json else done)
    return EXIT_DONE
