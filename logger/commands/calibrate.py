"""How much a vehicle shakes on roads of known roughness: IRI and Gd(n0) per r.m.s. acceleration, comfort per IRI.

The vehicle's model drives over random roads at 10 to 70 mph; one line per speed comes out, and how far one road lies
off it. The result is kept beside the vehicle's file (NAME.calibration.json), or in the user's cache, and found again.

  ridelog calibrate --vehicle rav4-2009
  ridelog calibrate --vehicle mycar.yaml --passengers 2
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.api.outputs import check_outs
from logger.api.ranges import LOW_PASS, MASS_FACTOR, PASSENGERS, SEED
from logger.commands.lab_model import warned
from logger.commands.numbers import add_number
from logger.errors import EXIT_DONE
from logger.files import write_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name)")
    parser.add_argument("--window", type=float, metavar="M", help="length of a window [m] (default: 7.62, 25 ft)")
    add_number(parser, "--low-pass", *LOW_PASS, metavar="HZ",
               help="low_pass_hz of the recorder's settings (default: none; the filters of every recorder, against "
                    "gravity and aliasing, always apply)")
    add_number(parser, "--passengers", *PASSENGERS, kind=int, default=0, metavar="N",
               help="people of 75 kg more in the car, at its centre of gravity; a half car gets half of their mass, a "
                    "quarter car a quarter")
    add_number(parser, "--sprung-mass-factor", *MASS_FACTOR, default=1.0, metavar="X",
               help="so many times the body's mass, springs and inertias staying as they are (default: 1)")
    add_number(parser, "--seed", *SEED, kind=int, default=1, metavar="N",
               help="another number, other roads (default: 1)")
    parser.add_argument("--recompute", action="store_true", help="do not look for a stored result")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the figures of each speed as CSV")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog calibrate``."""
    from logger.api.calibration import Question, calibrated
    from logger.report.calibration_text import as_json, csv_lines, lines
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model
    from logger.units import WINDOW_M

    path = vehicle_path(args.vehicle)
    model = read_model(path)
    check_outs([("--out", args.out)], read=[path])
    found = calibrated(model, path, Question(
        WINDOW_M if args.window is None else args.window, args.low_pass, args.passengers, args.sprung_mass_factor,
        args.seed, args.recompute, "--window"), warned)
    if args.out is not None:
        write_text(args.out, csv_lines(found.speeds), "ascii")
    if args.json:
        print(json.dumps(as_json(found), allow_nan=False))
    else:
        print(*lines(found), "Next: --out FILE.csv or --json for all figures" + (
            "." if found.load else "; --passengers 2 for what a load changes."), sep="\n")
    return EXIT_DONE
