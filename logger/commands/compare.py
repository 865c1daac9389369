"""Compare a vehicle's model with measurements: the error, where it sits, and what kind of thing is missing.

Each RUN is a folder with drive.csv (t_s,accel_z_mps2,speed_mps,distance_m) and the profile.csv it was driven on, or, of
a rig, drive.csv (t_s,accel_z_mps2) and the excitation.csv (t_s,elevation_m[,elevation_rear_m]) that drove it.

  ridelog compare --vehicle mycar.yaml run1 run2
  ridelog compare --vehicle mycar.yaml run1 run2 --out compare.html

The error is rms(measured - model) / rms(measured), the first 2 s of each run left out. Then the car's numbers and the
distances are refitted within their usual errors, and the residual is analysed: only that is evidence of physics that
the model lacks. ridelog diagnose says which.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.api.outputs import check_out
from logger.commands.lab_model import add_model_and_runs, warned
from logger.errors import EXIT_DONE
from logger.files import write_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog compare``."""
    add_model_and_runs(parser)
    parser.add_argument("--out", type=Path, metavar="FILE.html", help="write a page with pictures")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog compare``."""
    from logger.api.bench import bench_of, tolerance_of
    from logger.api.run_checks import lab_runs
    from logger.report.comparison_text import as_json
    from logger.report.lab_text import comparison_lines
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model

    path = vehicle_path(args.vehicle)
    model = read_model(path)
    if args.out is not None:
        check_out(args.out, args.runs, [path, *(Path(one.file) for one in model.effects if one.file is not None)])
    runs = lab_runs(args.runs, thin=False, vehicle=model.vehicle)  # an error is that of all samples
    found = bench_of(args.vehicle, model, runs, (), tolerance_of(args.tolerance), warn=warned,
                     low_pass_hz=args.low_pass, anyway=args.anyway).compared()
    if args.out is not None:
        from logger.report.lab_page import page

        write_text(args.out, page(found))
    if args.json:
        print(json.dumps(as_json(found), allow_nan=False))
    else:
        print("\n".join(comparison_lines(found)))
    return EXIT_DONE
