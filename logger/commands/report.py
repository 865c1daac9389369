"""Make one web page of segment logs: map, plots, table. It opens with no network."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from logger.errors import EXIT_DONE, BadInput
from logger.files import replace_bytes
from logger.report.page import page
from logger.report.summary import summarise, summary_json
from logger.store.log.log_reader import LoggedFile, find_logs, read_logged


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog report``."""
    parser.add_argument("logs", metavar="LOGDIR", type=Path,
                        help="folder of segment logs, exported stick, or one log file")
    parser.add_argument("--out", metavar="FILE.html", type=Path, required=True, help="page to write")
    parser.add_argument("--json", action="store_true", help="also print the summary, as one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog report``."""
    logs = find_logs(args.logs)
    files = write_report(logs, args.out, args.logs)
    records = [record for file in files for record in file.records]
    if args.json:
        print(json.dumps({"report": str(args.out), "files": [file.name for file in files],
                          "summary": summary_json(summarise(records))}))
    else:
        print(f"Report: {args.out} ({len(records)} windows from {len(files)} file{'s' * (len(files) != 1)})")
    return EXIT_DONE


def write_report(logs: Sequence[Path], out: Path, place: Path | None = None) -> list[LoggedFile]:
    """Write the page of some log files, whole or not at all; give what was read, each named from ``place`` on.

    What a service has finished since is read as what it has become, what it has removed to make room is left out.
    Raises BadInput when no log has an intact row, or the page cannot be written.
    """
    if out.exists() and not out.is_file():
        raise BadInput(f"{out}: expected the name of a file to write")
    files = [logged for log in logs if (logged := read_logged(log, place)) is not None]
    if not any(file.records for file in files):
        raise BadInput(f"{', '.join(map(str, logs))}: expected a log with at least one intact row")
    try:
        replace_bytes(out, page(files).encode("utf-8", "xmlcharrefreplace"))
    except OSError as error:
        raise BadInput(f"{out}: expected a place where a page can be written ({error.strerror})") from None
    return files
