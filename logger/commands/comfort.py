"""How a recorded ride feels and what it does to health: ISO 2631-1 values of an acceleration record.

FILE is CSV with the columns t_s and accel_z_mps2 (vertical, at the seat), evenly sampled at 80 Hz or more, perhaps
accel_x_mps2 and accel_y_mps2 as well. Its mean is taken off. The weighting is the standard's formula, magnitude and
phase, applied to the whole record by Fourier transform.

A record that repeats samples, whose times are uneven, or that is in g is refused, with the option that mends it. What
is doubtful is named on stderr: samples at an end of the sensor's range, accelerations that no moving car has.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from drivers.catalogue import names
from logger.commands.pictures import add_out, check_pictures, write_pictures
from logger.commands.record_options import add_record_options, tell_doubts
from logger.errors import EXIT_DONE, BadInput

USUAL = "wk"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    known = names("logger.dsp.weightings", "WEIGHTING")
    parser.add_argument("file", type=Path, metavar="FILE", help="CSV with t_s,accel_z_mps2[,accel_x_mps2,accel_y_mps2]")
    parser.add_argument("--weighting", default=USUAL, metavar="NAME",
                        help=f"weighting of accel_z_mps2: one of {', '.join(known)} (default: {USUAL}). "
                             "With wk, accel_x_mps2 and accel_y_mps2 are weighted by wd and combined with it")
    parser.add_argument("--daily-hours", type=float, metavar="H",
                        help="hours a day of such riding, for the health values (default: the length of the record)")
    add_record_options(parser)
    add_out(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog comfort``."""
    from logger.api.rides import comfort

    if args.daily_hours is not None and not 0.0 < args.daily_hours <= 24.0:
        raise BadInput(f"--daily-hours: expected more than 0 and at most 24 hours, found {args.daily_hours:g}")
    check_pictures(args.out, [args.file])
    found = comfort(args.file, args.weighting, daily_hours=args.daily_hours, unit=args.unit,
                    resample_hz=args.resample)
    write_pictures(args.out, "Ride comfort", args.file.name, found.text, found.charts)
    print(json.dumps(found.as_json(), allow_nan=False) if args.json else found.text)
    tell_doubts(args.file, found.doubts)
    return EXIT_DONE
