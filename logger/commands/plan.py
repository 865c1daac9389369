"""Before anybody drives: which physical effects runs, or planned drives, could show and distinguish, and which drive
would add most.

Each RUN is a folder as in 'ridelog diagnose'. Planned drives go over all of a profile, one at each speed.

  ridelog plan --vehicle mycar.yaml --profile road.csv --speed 8 --speed 15
  ridelog plan --vehicle mycar.yaml run1 run2 --out plan.html

Numbers are standard deviations of each effect at its usual strength, the car's numbers and the distances being free
within their tolerance. Next drives are tried over the known road: other speeds, a speed bump or a plank on it, a second
sensor.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.api.outputs import check_out
from logger.api.ranges import ADDED, NOISE, SPEED
from logger.commands.lab_model import add_lab_options, bench, progress
from logger.commands.numbers import add_number
from logger.errors import EXIT_DONE
from logger.estimation.sensor_noise import NOISE_MPS2
from logger.files import write_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog plan``."""
    parser.add_argument("runs", nargs="*", type=Path, metavar="RUN",
                        help="folder with drive.csv and profile.csv, or of a rig excitation.csv")
    add_lab_options(parser)
    parser.add_argument("--profile", type=Path, metavar="FILE",
                        help="the road of planned drives, and of the next one (default: that of the longest run)")
    add_number(parser, "--speed", *SPEED, action="append", default=[], metavar="MPS",
               help="plan a drive over all of the profile at this speed [m/s]; may repeat")
    add_number(parser, "--noise", *NOISE, metavar="MPS2",
               help="r.m.s. of the sensor's noise [m/s2] (default: that of the runs; without runs "
                    f"{NOISE_MPS2:g})")
    add_number(parser, "--step", *ADDED, default=0.0, metavar="MPS2",
               help="the planned sensor gives whole multiples of this only [m/s2]")
    parser.add_argument("--out", type=Path, metavar="FILE.html", help="write a page with the matrix as a picture")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog plan``."""
    from logger.api.bench import tolerance_of
    from logger.api.plan import PlannedDrives, planned
    from logger.report.plan_text import as_json, plan_lines
    from logger.shipped import vehicle_path
    from logger.store.formats.drive_file import track_of
    from logger.store.formats.profile_file import read_profile
    from logger.store.formats.vehicle_file import read_model

    road = None if args.profile is None else track_of(read_profile(args.profile, judged=True))
    given = bench(args, searches="ridelog plan") if args.runs else None
    model = given.model if given is not None else read_model(vehicle_path(args.vehicle))
    if args.out is not None:
        read = [vehicle_path(args.vehicle), *([args.profile] if args.profile else []), *map(Path, args.effect_file)]
        check_out(args.out, args.runs, read)
    asked = PlannedDrives(road, str(args.profile), tuple(args.speed), args.noise, args.step)
    with progress() as notify:
        found = planned(args.vehicle, model, given, asked, args.effect_file, tolerance_of(args.tolerance),
                        notify=notify)
    if args.out is not None:
        from logger.report.plan_page import page

        write_text(args.out, page(found, model.vehicle.name))
    if args.json:
        print(json.dumps(as_json(found), allow_nan=False))
        return EXIT_DONE
    print(*plan_lines(found), sep="\n")
    return EXIT_DONE
