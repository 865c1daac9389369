"""Run a recorded drive through the service and show the result; needs no hardware.

The drive is simulated: a half car over generated roads, recorded as the bytes that a BMA220 and a GPS would have
sent. It goes through recorded buses into the real drivers and the real service. --lab finds what a car has that its
model lacks; --field does so from recorded bytes, and shows what it does to the IRI.

  ridelog demo
  ridelog demo --lab
  ridelog demo --field
"""

from __future__ import annotations

import argparse
import json
from importlib import resources
from pathlib import Path

from logger.commands.replay import replay
from logger.errors import EXIT_DONE, BadInput
from logger.files import make_folder, write_file

REPORT_NAME, DUMP_NAME = "report.html", "drive.dump.gz"
DRIVE_DIR, LAB_DIR, FIELD_DIR = "ridelog-demo", "ridelog-lab", "ridelog-field"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog demo``."""
    parser.add_argument("--out", metavar="DIR", type=Path,
                        help=f"folder for what is written (default: {DRIVE_DIR}, with --lab {LAB_DIR}, with --field "
                             f"{FIELD_DIR})")
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--lab", action="store_true",
                       help="show the lab instead: two drives of a car that has something its model lacks, found")
    shown.add_argument("--field", action="store_true",
                       help="show the loop from a car's recordings to a better IRI: four drives, two measured lines")
    parser.add_argument("--unpack", action="store_true",
                        help="with --lab or --field: only write the drives, to find it yourself")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of text")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog demo``."""
    if args.unpack and not (args.lab or args.field):
        raise BadInput("demo: expected --lab or --field with --unpack")
    if args.lab:
        from logger.commands.demo_lab import lab

        lab(args.out or Path(LAB_DIR), args.unpack, args.json)
    elif args.field:
        from logger.commands.demo_field import field

        field(args.out or Path(FIELD_DIR), args.unpack, args.json)
    else:
        _drive(args.out or Path(DRIVE_DIR), args.json)
    return EXIT_DONE


def _drive(out: Path, as_json: bool) -> None:
    """The drive through the service."""
    from logger.commands.report import write_report

    dump = out / DUMP_NAME
    make_folder(out)
    write_file(dump, [(resources.files("logger.demo") / DUMP_NAME).read_bytes()])
    outcome = replay(dump, out, None, rate=0.0, vehicle=None, quiet=as_json)
    report = out / REPORT_NAME
    write_report([(log, None) for log in outcome.files], report)
    if as_json:
        print(json.dumps(outcome.as_json() | {"report": str(report), "dump": str(dump)}))
    else:
        print(outcome.text())
        print(f"Recording: {dump} (ridelog replay and ridelog extract read it)")
        print(f"Report: {report} (open it in a browser; it needs no network)")
