"""Make runs for the lab out of what the box in the car recorded.

Each continuous drive of a dump becomes a folder DIR/NAME, DIR/NAME-2, ... with drive.csv and run.yaml. With --profile,
a measured line with lat_deg,lon_deg, only what was driven on it is kept, laid on the line's own distance: first by the
positions, then by the road as the car felt it; profile.csv lies beside it then.

  ridelog extract drive.dump.gz --out runs --profile line.csv
  ridelog diagnose --vehicle mycar.yaml runs/*

Exit status 1: one of several dumps could not be used; it is named, and the others are done.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput
from logger.printable import printable

if TYPE_CHECKING:
    from logger.api.extraction import Extracted


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog extract``."""
    parser.add_argument("dumps", nargs="+", type=Path, metavar="DUMP", help="recorded drive (.dump or .dump.gz)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the runs")
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings of those drives")
    parser.add_argument("--profile", type=Path, metavar="PROFILE.csv",
                        help="the measured line that was driven: distance_m,elevation_m[,elevation_right_m],lat_deg,"
                             "lon_deg; places may be empty in most rows")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of text")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog extract``."""
    from drivers.errors import DriverError
    from logger.api.extraction import extract_dump, name_of, read_measured_profile
    from logger.commands.lab_model import on_screen, wipe
    from logger.service.config import load_config

    names = [name_of(one) for one in args.dumps]
    if again := next((one for number, one in enumerate(args.dumps) if names[number] in names[:number]), None):
        raise BadInput(f"{again}: expected dumps of different names, so that each has a folder of its own")
    config = load_config(args.config) if args.config else None
    measured = read_measured_profile(args.profile) if args.profile else None
    done: list[Extracted] = []
    for dump in args.dumps:
        try:
            found = extract_dump(dump, args.out, config, measured, on_screen())
        except (BadInput, DriverError) as error:
            wipe()
            if len(args.dumps) == 1:
                raise
            print(f"ridelog: {printable(str(error))}", file=sys.stderr)
            continue
        wipe()
        done.append(found)
        if not args.json:
            _show(dump, found)
    if not done:
        raise BadInput(f"expected a dump that can be used, found none among {len(args.dumps)}")
    if args.json:
        print(json.dumps({"runs": [one.as_json() for each in done for one in each.runs],
                          "left_out_s": sum(each.left_out_s for each in done),
                          "torn_tail": any(each.torn_tail for each in done)}))
    return EXIT_DONE if len(done) == len(args.dumps) else EXIT_CHECK_FAILED


def _show(dump: Path, found: Extracted) -> None:
    for one in found.runs:
        words = f"{one.run}: {one.seconds:.0f} s, {one.metres:.0f} m"
        if one.place_std_m is not None:
            how = "matched to the road" if one.by_road else "by the receiver alone: the road was not recognised"
            words += f" on the profile, places +- {one.place_std_m:.2g} m ({how})"
        if one.gaps:
            words += f", {one.gaps} short gaps" if one.gaps > 1 else ", 1 short gap"
        print(f"{words}; taken out: a receiver's delay of {one.delay_s:.2f} +- {one.delay_std_s:.2f} s")
    if found.left_out_s >= 1:
        print(f"{dump}: {found.left_out_s:.0f} s of driving left out, off the profile or too short")
    if found.torn_tail:
        print(f"{dump}: the recording was cut short; everything before the cut was used")
