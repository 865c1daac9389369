"""Vehicle parameters from drives over known roads: a grey-box prediction-error fit.

Each RUN is a drive.csv, or a folder with drive.csv (t_s,accel_z_mps2,speed_mps,distance_m) and the profile.csv it was
driven on, or, of a rig, with drive.csv (t_s,accel_z_mps2) and the excitation.csv (t_s,elevation_m[,elevation_rear_m])
that drove it. What is free is named as in the vehicle's file; both.NAME is the front and rear axle together.

  ridelog identify run --vehicle rav4-2009 --free sprung_mass_kg
  ridelog identify run1 run2 run3 --vehicle mycar.yaml --free sprung_mass_kg,both.suspension_damping_n_s_per_m \\
      --start sprung_mass_kg=700 --bounds sprung_mass_kg=500,1500 --low-pass 20 --out fitted.yaml

The numbers of an effect that the vehicle's file has are free by the effect's name:

  ridelog identify run --vehicle mycar.yaml --free sprung_mass_kg,dry_friction.friction_force_n

What is not known of the road can be free as well: a bump (Eq 4.41) or a step of which only the kind is known, and the
scale of the recorded speed. A run then needs no profile.csv; the road is flat but for the obstacle, and its start is
looked for where none is given. run2.NAME is that of one run, each.NAME one for every run (of a single run, NAME).

  ridelog identify drive.csv --vehicle rav4-2009 --bump height_m=0.15,width_m=2.6 --free sprung_mass_kg,bump.height_m
  ridelog identify drive.csv --vehicle rav4-2009 --step start_m=50,height_m=-0.03 --free step.height_m,speed_scale

With no profile at all the road is taken for a random one of ISO 8608 (--unmeasured-road): of unknown roughness, of the
waviness that is said or, with road.waviness free, found. Drives over one road at different speeds say far more
(--same-road).

  ridelog identify drive.csv --vehicle rav4-2009 --unmeasured-road --free sprung_mass_kg
  ridelog identify slow.csv fast.csv --vehicle mycar.yaml --same-road --free sprung_mass_kg,both.unsprung_mass_kg

Every estimate comes with its standard error. What the runs cannot tell is refused in words (exit status 1): numbers
that leave no trace at the sensor, and numbers of which only a combination can be estimated; masses, springs and dampers
share one scale, so one of them has to be known.
"""

from __future__ import annotations

import argparse
import json
import sys
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.outputs import check_outs
from logger.api.ranges import NOISE_MODELS, TRIES, WAVINESS
from logger.commands.lab_model import add_anyway
from logger.commands.numbers import add_number
from logger.commands.pictures import parted, write_pictures
from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput
from logger.files import together

if TYPE_CHECKING:
    from logger.api.identification import FittedNumbers, Question
    from logger.identification.identifiability import NotIdentifiable
    from logger.identification.prediction_error_fit import Fit
    from logger.identification.unknown_road.fisher_scoring import RoadFit
    from logger.profiles.excitation import Excitation
    from logger.profiles.track import Track
    from logger.store.formats.drive_file import Drive
    from logger.store.formats.vehicle_file import Model


def add_arguments(parser: argparse.ArgumentParser) -> None:
    from logger.runs import SKIP_S

    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN",
                        help="folder with drive.csv and profile.csv, or of a rig excitation.csv, or a drive.csv")
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name); "
                             "what is not free stays as it says")
    parser.add_argument("--free", required=True, metavar="PARAM,...", help="what to find")
    parser.add_argument("--bump", metavar="PARAM=M,...",
                        help="a speed bump on the road: [start_m=M,]height_m=M,width_m=M; free as bump.height_m ...")
    parser.add_argument("--step", metavar="PARAM=M,...",
                        help="a step, up or with a negative height down: [start_m=M,]height_m=M; free as step.height_m")
    parser.add_argument("--unmeasured-road", action="store_true",
                        help="the roads were not measured; each run has one of its own")
    parser.add_argument("--same-road", action="store_true",
                        help="the road was not measured; all runs are over the same one; their places may be "
                             "off by 10 m, their distances by 1 per cent")
    add_number(parser, "--waviness", *WAVINESS, metavar="W",
               help="of a road that was not measured (default: 2); to find it, add road.waviness to --free")
    parser.add_argument("--start", action="append", default=[], metavar="PARAM=VALUE",
                        help="where to start instead of the vehicle's value; may repeat")
    parser.add_argument("--bounds", action="append", default=[], metavar="PARAM=LOW,HIGH",
                        help="where to stay, sizes above 0 (default: within a factor of 20, lengths 3); may repeat")
    add_number(parser, "--tries", *TRIES, kind=int, default=0, metavar="N",
               help="so many further starts, spread around")
    parser.add_argument("--noise", choices=NOISE_MODELS, default="auto",
                        help="model of the residual: white (output error), ar (innovations form), road (roughness that "
                             "the profile does not contain, through the car); auto: the likeliest (default)")
    parser.add_argument("--low-pass", type=float, metavar="HZ",
                        help="leave out frequencies above it, for example 20; so does the pass_band_hz of a run.yaml")
    parser.add_argument("--robust", action="store_true", help="let single wild readings count less (Huber's loss)")
    parser.add_argument("--skip", type=float, default=SKIP_S, metavar="S",
                        help=f"beginning of each run that is left out [s] (default: {SKIP_S:g})")
    add_anyway(parser)
    parser.add_argument("--out", type=Path, metavar="FILE", action="append", default=[],
                        help="write the vehicle with the fitted values; FILE.html, .png, .svg, .pdf: pictures of the "
                             "residual and of correlated numbers; may repeat")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog identify``."""
    from logger.identification.identifiability import NotIdentifiable
    from logger.report.identification_charts import charts

    _check_given(args)
    pictures, vehicles = parted(args.out)
    check_outs([("--out", path) for path in args.out], args.runs)
    try:
        found = _found(args)
    except NotIdentifiable as refusal:
        if not args.json:
            raise
        print(json.dumps(_refusal_json(refusal), allow_nan=False))
        print(f"ridelog: {refusal}", file=sys.stderr)
        return EXIT_CHECK_FAILED
    with together():
        for vehicle in vehicles:
            _write(vehicle, found.model, found.fit)
        write_pictures(pictures, "Fitted numbers", ", ".join(map(str, args.runs)), "\n".join(found.lines),
                       lambda: charts(found.fit))
    print(json.dumps(found.as_json, allow_nan=False) if args.json else "\n".join(found.lines))
    return EXIT_DONE if found.fit.converged else EXIT_CHECK_FAILED


def _found(args: argparse.Namespace) -> FittedNumbers:
    from logger.api.identification import narrowed, on_measured_roads, on_unmeasured_roads, records_of
    from logger.commands.lab_model import warned
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model

    question = _question(args)
    given = read_model(vehicle_path(args.vehicle))
    unmeasured = args.unmeasured_road or args.same_road
    flat_will_do = bool(question.obstacles) or unmeasured
    drives = [_drive(path, flat_will_do) for path in args.runs]
    records = records_of(drives, args.skip, question)
    if unmeasured:
        return on_unmeasured_roads(given, args.vehicle, records, question, args.same_road)
    question = narrowed(question, [drive for drive, _ in drives])
    return on_measured_roads(given, args.vehicle, records, question, warned)


# --- what was asked for ---


def _check_given(args: argparse.Namespace) -> None:
    """BadInput for options that do not go together."""
    places = [path.resolve() for path in args.runs]
    if again := next((path for path, place in zip(args.runs, places, strict=True) if places.count(place) > 1), None):
        raise BadInput(f"{again}: expected every run once, found it twice")
    if args.waviness is not None and not (args.unmeasured_road or args.same_road):
        raise BadInput("--waviness: expected --unmeasured-road or --same-road with it")
    if args.unmeasured_road and args.same_road:
        raise BadInput("--unmeasured-road: expected no --same-road with it: runs have roads of their own, or one")
    if args.same_road and len(args.runs) < 2:
        raise BadInput("--same-road: expected two runs or more")


def _question(args: argparse.Namespace) -> Question:
    from logger.api.identification import USUAL_WAVINESS, Question

    obstacles = {name: {key: values[0] for key, values in (_numbers(one, f"--{name}", 1) for one in text.split(","))}
                 for name, text in (("bump", args.bump), ("step", args.step)) if text is not None}
    return Question(
        [name.strip() for name in args.free.split(",") if name.strip()],
        {name: values[0] for name, values in (_numbers(text, "--start", 1) for text in args.start)},
        {name: (values[0], values[1]) for name, values in (_numbers(text, "--bounds", 2) for text in args.bounds)},
        obstacles, args.noise, args.low_pass, args.robust, args.tries,
        USUAL_WAVINESS if args.waviness is None else args.waviness, args.anyway, "--{}")


def _numbers(text: str, option: str, count: int) -> tuple[str, list[float]]:
    name, _, rest = text.partition("=")
    try:
        values = [float(piece) for piece in rest.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(isfinite, values)):
        raise BadInput(f"{option} {text}: expected PARAM={','.join(['NUMBER'] * count)}")
    return name, values


def _drive(path: Path, flat_will_do: bool) -> tuple[Drive, Track | Excitation | None]:
    """A drive on its road, or where that will do on none."""
    from logger.store.formats.drive_file import EXCITATION, PROFILE, read_drive, read_run

    if flat_will_do and not any((path / name).exists() for name in (PROFILE, EXCITATION)):
        return read_drive(path), None
    run = read_run(path)
    return run, run.track


# --- what is printed ---


def _refusal_json(refusal: NotIdentifiable) -> dict[str, Any]:
    return {"parameters": {}, "standard_errors": {}, "error_before": refusal.error_before, "error_after": None,
            "converged": False, "cannot_tell": [finding.words for finding in refusal.findings]}


def _write(path: Path, made: Model, found: Fit | RoadFit) -> None:
    """The fitted vehicle, its standard errors as comments."""
    from logger.store.formats.vehicle_file import write_model

    comments = [f"# {made.vehicle.name} with numbers fitted by ridelog identify; error {found.error_before:.4f} "
                f"before, {found.error_after:.4f} after"]
    comments += [f"# {name}: {value:.6g}, standard error {found.standard_errors[name]:.2g}"
                 for name, value in found.parameters.items()]
    write_model(path, made, "".join(f"{line}\n" for line in comments))
