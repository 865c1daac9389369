"""Run a recorded drive through the service and show the result; needs no hardware.

The drive is simulated: a half car over generated roads, recorded as the bytes that a BMA220 and a GPS would have
sent. It goes through recorded buses into the real drivers and the real service.
"""

from __future__ import annotations

import argparse
import json
from importlib import resources
from pathlib import Path

from logger.commands.replay import replay

REPORT_NAME = "report.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog demo``."""
    parser.add_argument(
        "--out", metavar="DIR", type=Path, default=Path("ridelog-demo"), help="folder for logs and report"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object instead of text")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog demo``."""
    from logger.commands.report import write_report

    with resources.as_file(resources.files("logger.demo") / "drive.dump.gz") as dump:
        outcome = replay(dump, args.out, None, rate=0.0, vehicle=None, quiet=args.json)
    report = args.out / REPORT_NAME
    write_report(outcome.files, report)
    if args.json:
        print(json.dumps(outcome.as_json() | {"report": str(report)}))
        return 0
    print(outcome.text())
    print(f"Report: {report} (open it in a browser; it needs no network)")
    return 0
