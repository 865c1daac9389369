"""Vehicle parameters from drives over known roads: a grey-box prediction-error fit.

Each RUN is a drive.csv, or a folder with drive.csv (t_s,accel_z_mps2,speed_mps,distance_m) and the profile.csv it was
driven on. What is free is named as in the vehicle's file; both.NAME is the front and rear axle together.

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
waviness that is said or, with road.waviness free, found. Drives over one road at different speeds tell far more
(--same-road).

  ridelog identify drive.csv --vehicle rav4-2009 --unmeasured-road --free sprung_mass_kg
  ridelog identify slow.csv fast.csv --vehicle mycar.yaml --same-road --free sprung_mass_kg,both.unsprung_mass_kg

Every estimate comes with its standard error. What the runs cannot tell is refused in words (exit status 1): numbers
that leave no trace at the sensor, and numbers that can be told only together; masses, springs and dampers share one
scale, so one of them has to be known.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.commands.numbers import add_number
from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput
from logger.files import write_text

if TYPE_CHECKING:
    from logger.identification.drive_model import DriveModel
    from logger.identification.identifiability import NotIdentifiable
    from logger.identification.prediction_error_fit import Fit, FitOptions
    from logger.identification.unknown_inputs import RoadInput
    from logger.identification.unknown_road.fisher_scoring import RoadFit
    from logger.runs import Run
    from logger.store.formats.vehicle_file import Model
    from logger.vehicle.named_parameters import Free
    from logger.vehicle.vehicle import Vehicle

NOISES = ("auto", "white", "ar", "road")
_MOST_TRIES = 1000
# Of roads that were not measured: how wavy.
_WAVINESS, _FLATTEST, _STEEPEST, _FREE_WAVINESS = 2.0, 1.0, 3.5, "road.waviness"
# By how much the distances of two drives over one road may disagree.
_PLACES_OFF_M, _SCALE_OFF = 10.0, 0.01


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN",
                        help="folder with drive.csv and profile.csv, or a drive.csv")
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
    add_number(parser, "--waviness", _FLATTEST, _STEEPEST, metavar="W",
               help="of a road that was not measured (default: 2); to find it, add road.waviness to --free")
    parser.add_argument("--start", action="append", default=[], metavar="PARAM=VALUE",
                        help="where to start instead of the vehicle's value; may repeat")
    parser.add_argument("--bounds", action="append", default=[], metavar="PARAM=LOW,HIGH",
                        help="where to stay, sizes above 0 (default: within a factor of 20, lengths 3); may repeat")
    add_number(parser, "--tries", 0, _MOST_TRIES, kind=int, default=0, metavar="N",
               help="so many further starts, spread around")
    parser.add_argument("--noise", choices=NOISES, default="auto",
                        help="what the model leaves: white (output error), ar (innovations form), road (roughness that "
                             "the profile does not contain, through the car); auto: the likeliest (default)")
    parser.add_argument("--low-pass", type=float, metavar="HZ", help="leave out what lies above, for example 20")
    parser.add_argument("--robust", action="store_true", help="let single wild readings count less (Huber's loss)")
    parser.add_argument("--skip", type=float, default=2.0, metavar="S",
                        help="beginning of each run that is left out [s] (default: 2)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the vehicle with the fitted values")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog identify``."""
    places = [path.resolve() for path in args.runs]
    if again := next((path for path, place in zip(args.runs, places, strict=True) if places.count(place) > 1), None):
        raise BadInput(f"{again}: expected every run once, found it twice")
    return _unmeasured(args) if args.unmeasured_road or args.same_road else _measured(args)


def _measured(args: argparse.Namespace) -> int:
    """A fit over roads that are known, but for a few numbers."""
    from logger.identification.identifiability import NotIdentifiable
    from logger.identification.session import UnusableRun, error_before, upright_fit
    from logger.identification.shared_road_covariance import with_common_roughness
    from logger.report.identification_text import as_json, common_words, lines, tests
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model

    if args.waviness is not None:
        raise BadInput("--waviness: expected --unmeasured-road or --same-road with it")
    given = read_model(vehicle_path(args.vehicle))
    vehicle = given.vehicle
    road, unplaced = _road(args)
    records = _records(args, flat_will_do=bool(road.obstacles))
    _check_effects(args, given, records)
    model_of = partial(_model, args, given, road, unplaced)
    model = model_of(records)
    try:
        found = upright_fit(model_of, records, partial(_options, args))
    except UnusableRun as error:
        raise BadInput(f"{args.runs[error.run]}: {error}") from None
    except ValueError as error:
        raise BadInput(f"{args.runs[0]}: {error}") from None
    except NotIdentifiable as refusal:
        if args.json:
            print(json.dumps(_nothing_told(refusal, error_before(model)), allow_nan=False))
            print(f"ridelog: {refusal}", file=sys.stderr)
            return EXIT_CHECK_FAILED
        raise
    checks = tests(model, found)
    common = with_common_roughness(model, found)
    found = common.fit
    if args.out is not None:
        _write(args.out, _fitted(given, model, found), found)
    if args.json:
        print(json.dumps({**as_json(found, *checks), "common_roughness": common.share,
                          "runs": [str(folder) for folder in args.runs]}, allow_nan=False))
    else:
        low = "" if found.low_pass.cutoff_hz is None else f", below {found.low_pass.cutoff_hz:g} Hz"
        print("\n".join([_head(vehicle, len(found.free), [len(one.kept_mps2) for one in records], records[0].rate_hz,
                               f"{low}; the first {args.skip:g} s of a run left out"),
                         *lines(found, *checks), *common_words(model, common)]))
        if args.out is not None:
            print(f"Vehicle: {args.out}")
    return EXIT_DONE if found.converged else EXIT_CHECK_FAILED


def _model(args: argparse.Namespace, given: Model, road: RoadInput, unplaced: list[str],
           records: list[Run]) -> DriveModel:
    from logger.identification.session import drive_model, obstacle_starts

    try:
        starts = obstacle_starts(given.vehicle, records, road, unplaced)
    except ValueError as error:
        raise BadInput(f"--{error}") from None
    free = _free(args, given, road, starts)
    try:
        return drive_model(given.vehicle, given.effects, free, records, road)
    except ValueError as error:
        raise BadInput(f"--free: {error}") from None


def _check_effects(args: argparse.Namespace, given: Model, records: Sequence[Run]) -> None:
    """Raise BadInput for an effect that cannot be there on these roads, or one that is to be found and is not there."""
    from logger.commands.lab_model import tell_slow
    from logger.store.formats.effect_file import check_on, shipped_effects

    for one in given.effects:
        check_on(given.vehicle, one, all(record.two_tracks for record in records))
    tell_slow([one.effect for one in given.effects])
    there = [one.effect.name for one in given.effects]
    for name in map(str.strip, args.free.split(",")):
        effect = name.partition(".")[0]
        if "." in name and effect in shipped_effects() and effect not in there:
            raise BadInput(f"--free {name}: expected an effect that is in the vehicle's file, {args.vehicle} has "
                           f"{', '.join(there) or 'none'}; add it with 'ridelog add-effect {effect} --vehicle "
                           f"{args.vehicle} --out FILE RUN...', or write it under 'effects' in the file")


def _unmeasured(args: argparse.Namespace) -> int:
    """A fit over roads of which only the kind is known."""
    import numpy as np

    from logger.identification.identifiability import NotIdentifiable
    from logger.identification.session import UnusableRun, drives_of
    from logger.identification.unknown_inputs import RoadInput
    from logger.identification.unknown_road.road_fit import fit_roads
    from logger.report.unknown_road_text import as_json, lines
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import Model, read_model
    from logger.vehicle.frequency_response import AxleResponse

    options = _road_options(args)
    given = read_model(vehicle_path(args.vehicle))
    if given.effects:
        raise BadInput(f"{args.vehicle}: expected a car without effects where the road was not measured, found "
                       f"{', '.join(one.effect.name for one in given.effects)}")
    vehicle = given.vehicle
    records = _records(args, flat_will_do=True)
    try:
        drives = drives_of(records)
    except UnusableRun as error:
        raise BadInput(f"{args.runs[error.run]}: {error}") from None
    free = _free(args, given, RoadInput(), {})
    try:
        car = AxleResponse(vehicle, free, drives[0].rate_hz)
    except ValueError as error:
        raise BadInput(f"--free: {error}") from None
    try:
        found = fit_roads(car, [drives] if args.same_road else [[drive] for drive in drives], options)
    except NotIdentifiable as refusal:
        if not args.json:
            raise
        print(json.dumps(_nothing_told(refusal, None), allow_nan=False))
        print(f"ridelog: {refusal}", file=sys.stderr)
        return EXIT_CHECK_FAILED
    if args.out is not None:
        _write(args.out, Model(car.vehicle_with(np.array(list(found.parameters.values())))), found)
    if args.json:
        print(json.dumps({**as_json(found, free), "runs": [str(path) for path in args.runs]}, allow_nan=False))
    else:
        where = "one road that was not measured" if args.same_road else "roads that were not measured"
        print("\n".join([_head(vehicle, len(free), [len(drive.measured_mps2) for drive in drives], drives[0].rate_hz,
                               f"; over {where}, the first {args.skip:g} s of a run left out"), *lines(found, free)]))
        if args.out is not None:
            print(f"Vehicle: {args.out}")
    return EXIT_DONE if found.converged else EXIT_CHECK_FAILED


# --- what was asked for ---


def _road_options(args: argparse.Namespace) -> Any:
    from logger.identification.unknown_road.road_state import Options

    unused = {"--bump": args.bump, "--step": args.step, "--low-pass": args.low_pass, "--robust": args.robust,
              "--tries": args.tries, "--noise": args.noise != "auto"}
    if given := [option for option, value in unused.items() if value]:
        raise BadInput(f"{given[0]}: expected a road whose profile is known, not --unmeasured-road or --same-road")
    if args.unmeasured_road and args.same_road:
        raise BadInput("--unmeasured-road: expected no --same-road beside it: runs have roads of their own, or one")
    if args.same_road and len(args.runs) < 2:
        raise BadInput("--same-road: expected two runs or more")
    waviness = _WAVINESS if args.waviness is None else args.waviness
    names = [name.strip() for name in args.free.split(",")]
    args.free = ",".join(name for name in names if name != _FREE_WAVINESS)
    return Options(waviness=waviness, free_waviness=_FREE_WAVINESS in names, place_off_m=_PLACES_OFF_M,
                   scale_off=_SCALE_OFF)


def _free(args: argparse.Namespace, given: Model, road: RoadInput, found: dict[str, float]) -> list[Free]:
    """The free numbers; where an obstacle's start was found and not named, it is one of them. BadInput for names,
    starts and bounds that do not fit."""
    from logger.identification.unknown_inputs import EACH, expanded, is_input, run_and_name

    runs = len(args.runs)
    wanted = [name.strip() for name in args.free.split(",") if name.strip()]
    if cars := [name for name in wanted if name.startswith(f"{EACH}.") and not is_input(name)]:
        raise BadInput(f"--free {cars[0]}: expected a number of the road after {EACH}., as all runs have one car")
    names = [one for name in wanted for one in expanded(name, runs)]
    if not names or len(set(names)) < len(names):
        raise BadInput(f"--free {args.free}: expected names with commas between them, each once")
    named = {run_and_name(name)[1] for name in names}
    names += [name for name in found if run_and_name(name)[1] not in named]
    start = {one: values[0] for name, values in (_numbers(text, "--start", 1) for text in args.start)
             for one in expanded(name, runs)}
    between = {one: (values[0], values[1]) for name, values in (_numbers(text, "--bounds", 2) for text in args.bounds)
               for one in expanded(name, runs)}
    for option, said in (("--start", start), ("--bounds", between)):
        if unknown := set(said) - set(names):
            raise BadInput(f"{option} {sorted(unknown)[0]}: expected one of what is free ({', '.join(names)})")
    first = {run_and_name(name)[1]: place for name, place in reversed(found.items())}
    start = {**first, **found, **start}
    try:
        return [_free_number(given, road, name, start.get(name), between.get(name)) for name in names]
    except ValueError as error:
        raise BadInput(f"--free: {error}") from None


def _free_number(given: Model, road: RoadInput, name: str, start: float | None,
                 between: tuple[float, float] | None) -> Free:
    """A number of the road, of an effect or of the car. ValueError for one that none of them has."""
    from logger.identification.unknown_inputs import free_input, is_input
    from logger.vehicle.effect_parameters import free_number, move_named
    from logger.vehicle.named_parameters import free

    if is_input(name):
        return free_input(road, name, start, between)
    if (move := move_named(given.effects, name)) is not None:
        return free_number(given.effects, move, start, between)
    return free(given.vehicle, name, start, between)


def _road(args: argparse.Namespace) -> tuple[RoadInput, list[str]]:
    """What lies on the road, and the names of what has no start yet. BadInput for what is no bump or step."""
    from logger.identification.obstacle_paths import Bump, RoadStep
    from logger.identification.unknown_inputs import RoadInput

    found: dict[str, Any] = {}
    unplaced = []
    for name, kind, needed in (("bump", Bump, ("height_m", "width_m")), ("step", RoadStep, ("height_m",))):
        text = getattr(args, name)
        if text is None:
            continue
        numbers = {key: values[0] for key, values in (_numbers(one, f"--{name}", 1) for one in text.split(","))}
        if not set(needed) <= set(numbers) <= {"start_m", *needed}:
            raise BadInput(f"--{name} {text}: expected [start_m=M,]{','.join(f'{one}=M' for one in needed)}")
        if "start_m" not in numbers:
            unplaced.append(name)
        try:
            found[name] = kind(**{"start_m": 0.0, **numbers})
        except ValueError as error:
            raise BadInput(f"--{name} {text}: {error}") from None
    return RoadInput(**found), unplaced


def _numbers(text: str, option: str, count: int) -> tuple[str, list[float]]:
    name, _, rest = text.partition("=")
    try:
        values = [float(piece) for piece in rest.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(isfinite, values)):
        raise BadInput(f"{option} {text}: expected PARAM={','.join(['NUMBER'] * count)}")
    return name, values


def _records(args: argparse.Namespace, flat_will_do: bool) -> list[Run]:
    """The runs, on their roads or where that will do on a flat one. BadInput for files that are not what they should
    be, runs too short, and rates that differ."""
    from logger.identification.session import UnusableRun, check_records, off_rate

    records = [_record(path, args.skip, flat_will_do) for path in args.runs]
    try:
        check_records(records)
    except UnusableRun as error:
        raise BadInput(f"{args.runs[error.run]}: {error}") from None
    rates_hz = [record.rate_hz for record in records]
    if (run := off_rate(rates_hz)) is not None:
        raise BadInput(f"{args.runs[run]}: expected {rates_hz[0]:g} samples a second as in {args.runs[0]}, found "
                       f"{rates_hz[run]:g}")
    return records


def _record(path: Path, skip_s: float, flat_will_do: bool) -> Run:
    import numpy as np

    from logger.identification.session import LEAST_SAMPLES
    from logger.profiles.track import Track
    from logger.runs import Run
    from logger.store.formats.drive_file import DRIVE, PROFILE, DriveOnRoad, read_drive, read_run

    folder = path.is_dir()
    if flat_will_do and not (folder and (path / PROFILE).exists()):
        drive = read_drive(path / DRIVE if folder else path)
    else:
        drive = read_run(path)
    track = drive.track if isinstance(drive, DriveOnRoad) else Track(1.0, np.zeros(2))
    if not 0 <= skip_s < len(drive.time_s) / drive.rate_hz - LEAST_SAMPLES / drive.rate_hz:
        raise BadInput(f"{path}: expected at least {LEAST_SAMPLES} samples after the first {skip_s:g} s, which are "
                       f"left out (--skip), found {len(drive.time_s) / drive.rate_hz:g} s in all")
    return Run(str(path), drive.rate_hz, drive.accel_z_mps2, drive.distance_m, drive.speed_mps, track, skip_s)


def _options(args: argparse.Namespace, model: DriveModel) -> FitOptions:
    from logger.identification.session import fit_options

    rate_hz = model.records[0].rate_hz
    if args.low_pass is not None and not 0 < args.low_pass < rate_hz / 2:
        raise BadInput(f"--low-pass {args.low_pass:g}: expected above 0 and below {rate_hz / 2:g} Hz")
    return fit_options(model, args.noise, args.low_pass, args.robust, args.tries)


# --- what is told ---


def _head(vehicle: Vehicle, free: int, samples: list[int], rate_hz: float, more: str) -> str:
    runs = "1 run" if len(samples) == 1 else f"{len(samples)} runs"
    return (f"{vehicle.name} ({vehicle.model.replace('_', ' ')}): {free} free, {runs}, {sum(samples)} samples at "
            f"{rate_hz:.5g} Hz{more}")


def _nothing_told(refusal: NotIdentifiable, before: float | None) -> dict[str, Any]:
    return {"parameters": {}, "standard_errors": {}, "error_before": before, "error_after": None, "converged": False,
            "cannot_tell": [finding.words for finding in refusal.findings]}


def _fitted(given: Model, model: DriveModel, found: Fit) -> Model:
    """The model with the numbers that were found, and the standard errors of its effects'."""
    import numpy as np

    values = np.array(list(found.parameters.values()))
    effects = []
    for one in model.effects_with(values):
        errors = {name.partition(".")[2]: error for name, error in found.standard_errors.items()
                  if name.partition(".")[0] == one.effect.name and name.partition(".")[2] in one.values}
        effects.append(replace(one, standard_errors={**one.standard_errors, **errors}))
    return replace(given, vehicle=model.vehicle_with(values), effects=tuple(effects))


def _write(path: Path, made: Model, found: Fit | RoadFit) -> None:
    """The fitted vehicle, its standard errors as comments."""
    from logger.store.formats.vehicle_file import write_model

    write_model(path, made)
    comments = [f"# {made.vehicle.name} with numbers fitted by ridelog identify; error {found.error_before:.4f} "
                f"before, {found.error_after:.4f} after"]
    comments += [f"# {name}: {value:.6g}, standard error {found.standard_errors[name]:.2g}"
                 for name, value in found.parameters.items()]
    write_text(path, "\n".join([*comments, path.read_text("utf-8")]))
