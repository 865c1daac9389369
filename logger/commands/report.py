"""``ridelog report``: segment logs as one web page."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from logger.commands.options import PICTURES
from logger.errors import BadInput
from logger.files import write_file
from logger.left_out import left_out_json, left_out_lines
from logger.printable import counted
from logger.question import Answer, Argument, Option, Question, Verb
from logger.report.page import MapLine, notices, page
from logger.report.placed import of_files
from logger.report.summary import summarise, summary_json
from logger.store.formats.road_lines import read_road_lines
from logger.store.log.log_reader import LoggedFile, find_logs_in, read_found

STREETS = "https://tile.openstreetmap.org/{z}/{x}/{y}.png"
"""Where pictures of streets come from when they are asked for: OpenStreetMap's standard tiles."""


def _tiles(address: str) -> None:
    whole = re.fullmatch(r"https?://[\w.-]+(:\d+)?/\S*", address, re.ASCII)
    if address and not (whole and all(key in address for key in ("{z}", "{x}", "{y}"))):
        raise ValueError(f"expected an address such as {STREETS}")


def _web_page(out: Path) -> None:
    if out.suffix.lower() in PICTURES[1:]:
        raise ValueError(f"expected the name of a web page, such as {out.stem}.html")


@dataclass(frozen=True, kw_only=True)
class ReportQuestion(Question):
    """Make one web page of segment logs: an interactive map, curves and tables.

      ridelog report ridelog-demo --out drive.html
      ridelog report /media/RIDELOG --out all.html --base roads.geojson

    It opens without a network.
    """

    logs: Annotated[list[Path], Argument(
        "log files, folders of them, exported sticks; duplicate logs count once", metavar="LOGS", read=Path,
        many=list)]
    out: Annotated[Path, Option("page to write", metavar="FILE.html", read=Path, check=_web_page)]
    base: Annotated[Path | None, Option(
        "roads as background, such as an extract of OpenStreetMap, stored in the page",
        metavar="ROADS.geojson", read=Path)] = None
    tiles: Annotated[str, Option(
        "draw a street map beneath the drives; the page then loads it from a server (ADDRESS with {z}, {x} and {y}; "
        "default: OpenStreetMap's)", metavar="ADDRESS", bare=STREETS, check=_tiles)] = ""


VERB = Verb(ReportQuestion, "logger.commands.report:reported")


def reported(asked: ReportQuestion) -> Answer:
    """Write the page."""
    base = [] if asked.base is None else [MapLine("", *line) for line in read_road_lines(asked.base)]
    files = write_report(find_logs_in(asked.logs), asked.out, base=base,
                         base_name="" if asked.base is None else asked.base.name, tiles_from=asked.tiles)
    records = [record for file in files for record in file.records]
    lines = [f"Report: {asked.out} ({counted(len(records), 'window')} from {counted(len(files), 'file')})",
             *notices(files), *left_out_lines(of_files(files))]
    return Answer("\n".join(lines), {
        "report": str(asked.out), "files": [file.name for file in files],
        "summary": summary_json(summarise(records)), "notices": notices(files), **left_out_json(of_files(files))})


def write_report(logs: Sequence[tuple[Path, Path | None]], out: Path, *, base: Sequence[MapLine] = (),
                 base_name: str = "", tiles_from: str = "") -> list[LoggedFile]:
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
