"""The road's roughness from a drive's acceleration: IRI of windows with standard errors, and the road's profile.

RUN is a folder with a drive.csv (t_s,accel_z_mps2,speed_mps,distance_m), or such a file. Where a profile.csv lies in
the folder, the estimates are compared with its exact IRI. Beside them stands the limit: what an estimator could reach
that knew the road's spectrum, the sensor's noise and the car exactly.

  ridelog estimate run --vehicle rav4-2009
  ridelog estimate drive.csv --vehicle mycar.yaml --step 0.613 --profile-out road.csv

A distance may go back by up to 1 m, as one corrected by GPS does; it is then computed again, as the integral of
speed_mps plus the moving mean over 2 s of what it differs from that. Samples at another rate than 100 Hz are brought to
100 Hz. Repeated samples, uneven times and values in g are refused, with the option that mends them.

The profile holds only the wavelengths that the readings resolve: it is smoother than the road, and its own IRI too low.
A drive with holes makes several: P.csv, P-2.csv, P-3.csv. R2 depends on the range of IRI:
the limit's R2 is given for a mix of roads (IRI 1 to 10 m/km, as many of each), and for a road as rough as this one.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.outputs import check_outs
from logger.api.ranges import ADDED, AUTO, NOISE, WINDOW
from logger.commands.lab_model import add_anyway, warned
from logger.commands.numbers import add_number
from logger.commands.pictures import HELP, parted, write_pictures
from logger.commands.record_options import add_record_options, tell_doubts
from logger.errors import EXIT_DONE, BadInput
from logger.files import together, write_text

if TYPE_CHECKING:
    from logger.estimation.assessment import Assessment


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("run", type=Path, metavar="RUN", help="folder with drive.csv, or a drive.csv")
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name), which "
                             "also says where the sensor sits")
    parser.add_argument("--noise", type=_noise, metavar="auto|MPS2",
                        help="r.m.s. noise of one reading before rounding [m/s2]; auto: learnt from the drive, with a "
                             "standard error (default: what the run's run.yaml says, or auto)")
    add_number(parser, "--step", *ADDED, metavar="MPS2",
               help="step that readings are rounded to [m/s2], 0: none (default: what the run's run.yaml says)")
    add_number(parser, "--window", *WINDOW, metavar="M", help="length of a window [m] (default: 7.62, 25 ft)")
    parser.add_argument("--out", type=Path, action="append", default=[], metavar="FILE",
                        help=f"write the windows as CSV; FILE.html: {HELP}; may repeat")
    parser.add_argument("--profile-out", type=Path, metavar="FILE", help="write the estimated profile as CSV")
    add_record_options(parser)
    add_anyway(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def _noise(text: str) -> float | str:
    """A noise, or ``AUTO``. BadInput for a number out of range."""
    if text == AUTO:
        return text
    value = float(text)
    NOISE.check("--noise", value)
    return value


_noise.__name__ = "auto or float"  # argparse names it when a text is neither


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog estimate``."""
    from logger.api.drives import assessed, checked_run, estimate_by, sensor_of
    from logger.report.estimate_text import window_lines
    from logger.shipped import vehicle_path
    from logger.store.formats.record_checks import RecordRules
    from logger.store.formats.vehicle_file import read_model
    from logger.units import WINDOW_M

    window_m = WINDOW_M if args.window is None else args.window
    vehicle_yaml = vehicle_path(args.vehicle)
    model = read_model(vehicle_yaml)
    pictures, tables = parted(args.out)
    _check_files(args, vehicle_yaml)
    drive, checked = checked_run(args.run, RecordRules(args.unit, args.resample))
    found = assessed(drive, model, *sensor_of(drive, args.noise, args.step), window_m, warned, args.anyway)
    with together():
        files = [] if args.profile_out is None else _write_road(args.profile_out, found)
        for path in tables:
            write_text(path, window_lines(found), "ascii")
        shown = estimate_by(found, checked, str(args.run), list(map(str, files)))
        write_pictures(pictures, "Roughness from acceleration", str(args.run), shown.text, shown.charts)
    print(json.dumps(shown.as_json(), allow_nan=False) if args.json else shown.text)
    tell_doubts(args.run, (doubt.words for doubt in checked.doubts))
    if args.profile_out is not None and not files:
        print(f"No profile in {args.profile_out}: the readings resolve no wavelengths over a stretch longer than the "
              "longest of them", file=sys.stderr if args.json else sys.stdout)
    return EXIT_DONE


def _check_files(args: argparse.Namespace, vehicle_yaml: Path) -> None:
    """Raise BadInput where a file to write is one that is read, or another one to write."""
    from logger.store.formats.drive_file import DRIVE, PROFILE

    read = (vehicle_yaml, args.run, args.run / DRIVE, args.run / PROFILE)
    check_outs([*(("--out", path) for path in args.out), ("--profile-out", args.profile_out)], read=read)
    if args.profile_out is None:
        return
    taken = {path.resolve() for path in (*read, *args.out, args.profile_out)}
    folder = args.profile_out.parent.resolve()
    beside = {path for path in taken if path.parent == folder} | set(folder.iterdir() if folder.is_dir() else ())
    part = re.compile(rf"{re.escape(args.profile_out.stem)}-[1-9][0-9]*{re.escape(args.profile_out.suffix)}")
    if clash := [path for path in beside if part.fullmatch(path.name) and path.resolve() in taken]:
        raise BadInput(f"--profile-out {args.profile_out}: expected another name, its parts could be written over "
                       f"{clash[0]}")


def _write_road(path: Path, found: Assessment) -> list[Path]:
    """The parts of the profile, each a file of its own; none where the readings do not make one."""
    from logger.profiles.track import Track
    from logger.store.formats.drive_file import write_profile

    files: list[Path] = []
    for number, part in enumerate(found.road.parts if found.road else (), start=1):
        file = path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")
        write_profile(file, Track(part.spacing_m, part.elevation_m, part.start_m))
        files.append(file)
    return files
