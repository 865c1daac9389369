"""Make one web page of segment logs: an interactive map, curves and tables. It opens without a network.

  ridelog report ridelog-demo --out drive.html
  ridelog report /media/RIDELOG --out all.html --base roads.geojson
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Sequence
from pathlib import Path

from logger.errors import EXIT_DONE, BadInput
from logger.files import write_file
from logger.left_out import left_out_json, left_out_lines
from logger.printable import counted
from logger.report.charts import ENDINGS
from logger.report.maps import MapLine
from logger.report.page import notices, page
from logger.report.placed import of_files
from logger.report.summary import summarise, summary_json
from logger.store.formats.road_lines import read_road_lines
from logger.store.log.log_reader import LoggedFile, find_logs_in, read_found

STREETS = "https://tile.openstreetmap.org/{z}/{x}/{y}.png"
"""Where pictures of streets come from when they are asked for: OpenStreetMap's standard tiles."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog report``."""
    parser.add_argument("logs", metavar="LOGS", type=Path, nargs="+",
                        help="log files, folders of them, exported sticks; a log that is there twice counts once")
    parser.add_argument("--out", metavar="FILE.html", type=Path, required=True, help="page to write")
    parser.add_argument("--base", metavar="ROADS.geojson", type=Path,
                        help="roads to draw beneath the drives, such as an extract of OpenStreetMap, kept in the page")
    parser.add_argument("--tiles", metavar="ADDRESS", nargs="?", const=STREETS, default="",
                        help="draw pictures of streets beneath the drives: the page then asks a server for them "
                             "(with {z}, {x} and {y} in the address; by default OpenStreetMap's)")
    parser.add_argument("--json", action="store_true", help="also print the summary, as one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog report``."""
    _check_tiles(args.tiles)
    if args.out.suffix.lower() in ENDINGS:
        raise BadInput(f"--out {args.out}: expected the name of a web page, such as {args.out.stem}.html")
    base = [] if args.base is None else [MapLine("", *line) for line in read_road_lines(args.base)]
    files = write_report(find_logs_in(args.logs), args.out, base=base,
                         base_name="" if args.base is None else args.base.name, tiles_from=args.tiles)
    records = [record for file in files for record in file.records]
    if args.json:
        print(json.dumps({"report": str(args.out), "files": [file.name for file in files],
                          "summary": summary_json(summarise(records)), "notices": notices(files),
                          **left_out_json(of_files(files))}))
    else:
        print(f"Report: {args.out} ({counted(len(records), 'window')} from {counted(len(files), 'file')})",
              *notices(files), *left_out_lines(of_files(files)), sep="\n")
    return EXIT_DONE


def _check_tiles(address: str) -> None:
    whole = re.fullmatch(r"https?://[\w.-]+(:\d+)?/\S*", address, re.ASCII)
    if address and not (whole and all(key in address for key in ("{z}", "{x}", "{y}"))):
        raise BadInput(f"--tiles: expected an address such as {STREETS}, found {address!r}")


def write_report(logs: Sequence[tuple[Path, Path | None]], out: Path, *, base: Sequence[MapLine] = (),
                 base_name: str = "",
                 tiles_from: str = "") -> list[LoggedFile]:
    """Write the page of log files, whole or not at all; give what was read, each named from the folder beside it on.

    What a service has finished since is read as what it has become, what it has removed to make room is left out.
    Raises BadInput when no log has an intact row, or the page cannot be written.
    """
    if out.exists() and not out.is_file():
        raise BadInput(f"{out}: expected the name of a file to write")
    files = read_found(logs)
    if not any(file.records for file in files):
        raise BadInput(f"{', '.join(str(log) for log, _ in logs)}: expected a log with at least one intact row")
    try:
        text = page(files, base, base_name, tiles_from)
        write_file(out, [text.encode("utf-8", "xmlcharrefreplace")])
    except OSError as error:
        raise BadInput(f"{out}: expected a place where a page can be written ({error.strerror})") from None
    return files
