"""Vehicle parameters from drives over known roads: a grey-box prediction-error fit.

Each RUN is a folder with drive.csv (t_s,accel_z_mps2,speed_mps,distance_m) and the profile.csv it was driven on. What
is free is named as in the vehicle's file; both.NAME is the front and rear axle together.

  ridelog identify run --vehicle rav4-2009 --free sprung_mass_kg
  ridelog identify run1 run2 run3 --vehicle mycar.yaml --free sprung_mass_kg,both.suspension_damping_n_s_per_m \\
      --start sprung_mass_kg=700 --bounds sprung_mass_kg=500,1500 --low-pass 20 --out fitted.yaml

Every estimate comes with its standard error. What the runs cannot tell is refused in words (exit status 1): numbers
that leave no trace at the sensor, and numbers that can be told only together; masses, springs and dampers share one
scale, so one of them has to be known.
"""

from __future__ import annotations

import argparse
import json
import sys
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput

if TYPE_CHECKING:
    from logger.identification.fit import Fit
    from logger.identification.noise import Noise
    from logger.identification.parameters import Free
    from logger.identification.prediction import Record, VehicleModel
    from logger.vehicle.vehicle import Vehicle

NOISES = ("auto", "white", "ar", "road")
_SAME_RATE = 1e-6
_LEAST_SAMPLES = 50
_MOST_TRIES = 1000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder with drive.csv and profile.csv")
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name); "
                             "what is not free stays as it says")
    parser.add_argument("--free", required=True, metavar="PARAM,...", help="what to find")
    parser.add_argument("--start", action="append", default=[], metavar="PARAM=VALUE",
                        help="where to start instead of the vehicle's value; may repeat")
    parser.add_argument("--bounds", action="append", default=[], metavar="PARAM=LOW,HIGH",
                        help="where to stay (default: within a factor of 20, lengths 3); may repeat")
    parser.add_argument("--tries", type=int, default=0, metavar="N", help="so many further starts, spread around")
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
    from logger.identification.fit import fit
    from logger.identification.prediction import VehicleModel
    from logger.identification.report import as_json, lines, tests
    from logger.identification.verdict import NotIdentifiable
    from logger.shipped import vehicle_path
    from logger.store.vehicle_file import read_vehicle

    vehicle = read_vehicle(vehicle_path(args.vehicle))
    records = [_record(folder, args.skip) for folder in args.runs]
    free = free_of(vehicle, args.free, args.start, args.bounds)
    try:
        model = VehicleModel(vehicle, free, records)
    except ValueError as error:
        raise BadInput(f"--free: {error}") from None
    options = _options(args, model)
    try:
        found = fit(model, model.measured, options)
    except NotIdentifiable as refusal:
        if args.json:
            print(json.dumps(_refused(model, refusal), allow_nan=False))
            print(f"ridelog: {refusal}", file=sys.stderr)
            return EXIT_CHECK_FAILED
        raise
    except ValueError as error:
        raise BadInput(f"{args.runs[0]}: {error}") from None
    checks = tests(model, found)
    if args.out is not None:
        _write(args.out, vehicle, model, found)
    if args.json:
        print(json.dumps({**as_json(found, *checks), "runs": [str(folder) for folder in args.runs]}, allow_nan=False))
    else:
        print("\n".join([_head(vehicle, records, found), *lines(found, *checks)]))
        if args.out is not None:
            print(f"Vehicle: {args.out}")
    return EXIT_DONE if found.converged else EXIT_CHECK_FAILED


# --- what was asked for ---


def free_of(vehicle: Vehicle, wanted: str, starts: list[str], bounds: list[str]) -> list[Free]:
    """The free numbers. BadInput for names, starts and bounds that do not fit."""
    from logger.identification.parameters import free

    names = [name.strip() for name in wanted.split(",") if name.strip()]
    if not names or len(set(names)) < len(names):
        raise BadInput(f"--free {wanted}: expected names with commas between them, each once")
    start = {name: values[0] for name, values in (_numbers(one, "--start", 1) for one in starts)}
    between = {name: (values[0], values[1]) for name, values in (_numbers(one, "--bounds", 2) for one in bounds)}
    for option, given in (("--start", start), ("--bounds", between)):
        if unknown := set(given) - set(names):
            raise BadInput(f"{option} {sorted(unknown)[0]}: expected one of what is free ({', '.join(names)})")
    try:
        return [free(vehicle, name, start.get(name), between.get(name)) for name in names]
    except ValueError as error:
        raise BadInput(f"--free: {error}") from None


def _numbers(text: str, option: str, count: int) -> tuple[str, list[float]]:
    name, _, rest = text.partition("=")
    try:
        values = [float(piece) for piece in rest.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(isfinite, values)):
        raise BadInput(f"{option} {text}: expected PARAM={','.join(['NUMBER'] * count)}")
    return name, values


def _record(folder: Path, skip_s: float) -> Record:
    from logger.identification.prediction import Record
    from logger.store.drive_file import read_run

    drive = read_run(folder)
    if not 0 <= skip_s < len(drive.time_s) / drive.rate_hz - _LEAST_SAMPLES / drive.rate_hz:
        raise BadInput(f"{folder}: expected at least {_LEAST_SAMPLES} samples after the first {skip_s:g} s, which are "
                       f"left out (--skip), found {len(drive.time_s) / drive.rate_hz:g} s in all")
    return Record(drive.time_s, drive.accel_z_mps2, drive.distance_m, drive.speed_mps, drive.track, skip_s)


def _options(args: argparse.Namespace, model: VehicleModel) -> Any:
    from logger.identification.fit import Options, spread_starts
    from logger.identification.noise import Autoregressive, RoadNoise, White

    rate_hz = model.records[0].rate_hz
    for folder, record in zip(args.runs, model.records, strict=True):
        if abs(record.rate_hz / rate_hz - 1) > _SAME_RATE:
            raise BadInput(f"{folder}: expected {rate_hz:g} samples a second as in {args.runs[0]}, "
                           f"found {record.rate_hz:g}")
    if args.low_pass is not None and not 0 < args.low_pass < rate_hz / 2:
        raise BadInput(f"--low-pass {args.low_pass:g}: expected above 0 and below {rate_hz / 2:g} Hz")
    if not 0 <= args.tries <= _MOST_TRIES:
        raise BadInput(f"--tries {args.tries}: expected 0 to {_MOST_TRIES}")
    kinds: dict[str, Noise] = {"white": White(), "ar": Autoregressive(), "road": RoadNoise(model.road_spectra)}
    return Options(rate_hz=rate_hz, low_pass_hz=args.low_pass, robust=args.robust,
                   noise=list(kinds.values()) if args.noise == "auto" else [kinds[args.noise]],
                   starts=spread_starts(model.parameters, args.tries))


# --- what is told ---


def _head(vehicle: Vehicle, records: list[Record], found: Fit) -> str:
    kept = sum(len(record.kept_mps2) for record in records)
    runs = "1 run" if len(records) == 1 else f"{len(records)} runs"
    low = "" if found.low_pass.cutoff_hz is None else f", below {found.low_pass.cutoff_hz:g} Hz"
    return (f"{vehicle.name} ({vehicle.model.replace('_', ' ')}): {len(found.free)} free, {runs}, {kept} samples at "
            f"{records[0].rate_hz:.5g} Hz{low}; the first {records[0].skip_s:g} s of a run left out")


def _refused(model: VehicleModel, refusal: Any) -> dict[str, Any]:
    import numpy as np

    from logger.identification.fit import normalised_error

    predictions = model.predict(np.array([one.start for one in model.parameters]))
    before = normalised_error(model.measured, [seen - one for seen, one in
                                               zip(model.measured, predictions, strict=True)])
    return {"parameters": {}, "standard_errors": {}, "error_before": before if isfinite(before) else None,
            "error_after": None, "converged": False, "cannot_tell": [finding.words for finding in refusal.findings]}


def _write(path: Path, vehicle: Vehicle, model: VehicleModel, found: Fit) -> None:
    """The fitted vehicle, its standard errors as comments."""
    import numpy as np

    from logger.store.vehicle_file import write_vehicle

    write_vehicle(path, model.vehicle_with(np.array(list(found.parameters.values()))))
    comments = [f"# {vehicle.name} with numbers fitted by ridelog identify; error {found.error_before:.4f} before, "
                f"{found.error_after:.4f} after"]
    comments += [f"# {name}: {value:.6g}, standard error {found.standard_errors[name]:.2g}"
                 for name, value in found.parameters.items()]
    path.write_text("\n".join([*comments, path.read_text("utf-8")]), "utf-8")
