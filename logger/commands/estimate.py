"""The road's roughness from a drive's acceleration: IRI of windows with standard errors, and the road's profile.

RUN is a folder with a drive.csv (t_s,accel_z_mps2,speed_mps,distance_m), or such a file. Where a profile.csv lies in
the folder, the estimates are compared with its exact IRI. Beside them stands the limit: what an estimator could reach
that knew the road's spectrum, the sensor's noise and the car exactly.

  ridelog estimate run --vehicle rav4-2009
  ridelog estimate drive.csv --vehicle mycar.yaml --noise 0.1 --step 0.613 --profile-out road.csv

A distance may go back by up to 1 m, as one corrected by GPS does; it is then laid anew, as the integral of speed_mps
plus the moving mean over 2 s of what it differs from that. Samples at another rate than 100 Hz are brought to 100 Hz.

The profile holds only the wavelengths that the readings tell: it is smoother than the road, and its own IRI too low. A
drive with holes makes several: P.csv, P-2.csv, P-3.csv. R2 depends on the range of IRI:
the limit's R2 is given for a mix of roads (IRI 1 to 10 m/km, as many of each), and for a road as rough as this one.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.commands.numbers import add_number
from logger.errors import EXIT_DONE, BadInput
from logger.files import write_text

if TYPE_CHECKING:
    from logger.estimation.assessment import Assessment
    from logger.estimation.sensor_noise import Sensor
    from logger.vehicle.vehicle import Vehicle

NOISE_MPS2, STEP_MPS2 = 0.05, 0.0
_FAR_ABOVE = 1.5
_MOVING_MPS = 1.0
_G_NEAR, _G_CALM_MPS2 = 0.1, 0.5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("run", type=Path, metavar="RUN", help="folder with drive.csv, or a drive.csv")
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name), which "
                             "also says where the sensor sits")
    add_number(parser, "--noise", 1e-4, 100.0, "m/s2", default=NOISE_MPS2, metavar="MPS2",
               help=f"r.m.s. noise of one reading before rounding [m/s2] (default: {NOISE_MPS2:g}); where it blurs the "
                    "steps, what is found on the way corrects it")
    add_number(parser, "--step", 0.0, 100.0, "m/s2", default=STEP_MPS2, metavar="MPS2",
               help="step that readings are rounded to [m/s2] (default: 0, none)")
    add_number(parser, "--window", 1.0, 1000.0, "m", metavar="M", help="length of a window [m] (default: 7.62, 25 ft)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the windows as CSV")
    parser.add_argument("--profile-out", type=Path, metavar="FILE", help="write the estimated profile as CSV")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog estimate``."""
    from logger.estimation.sensor_noise import Sensor
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_vehicle
    from logger.units import WINDOW_M

    window_m = WINDOW_M if args.window is None else args.window
    vehicle_yaml = vehicle_path(args.vehicle)
    vehicle = read_vehicle(vehicle_yaml)
    _check_files(args, vehicle_yaml)
    found = _assessed(args.run, vehicle, Sensor(args.noise, args.step), window_m)
    files = [] if args.profile_out is None else _write_road(args.profile_out, found)
    if args.out is not None:
        write_text(args.out, "".join(_csv(found)), "ascii")
    told = as_json(args.run, found, files)
    print(json.dumps(told, allow_nan=False) if args.json else "\n".join(screen(found, told)))
    if args.profile_out is not None and not files:
        print(f"No profile in {args.profile_out}: the readings tell no wavelengths over a stretch longer than the "
              "longest of them", file=sys.stderr if args.json else sys.stdout)
    return EXIT_DONE


def _check_files(args: argparse.Namespace, vehicle_yaml: Path) -> None:
    """Raise BadInput where a file to write is one that is read, or another one to write."""
    from logger.store.formats.drive_file import DRIVE, PROFILE

    taken = {path.resolve() for path in (vehicle_yaml, args.run, args.run / DRIVE, args.run / PROFILE)}
    for option, path in (("--out", args.out), ("--profile-out", args.profile_out)):
        if path is not None:
            if path.resolve() in taken:
                raise BadInput(f"{option} {path}: expected every file to be another one")
            taken.add(path.resolve())
    if args.profile_out is None:
        return
    folder = args.profile_out.parent.resolve()
    beside = {path for path in taken if path.parent == folder} | set(folder.iterdir() if folder.is_dir() else ())
    part = re.compile(rf"{re.escape(args.profile_out.stem)}-[1-9][0-9]*{re.escape(args.profile_out.suffix)}")
    if clash := [path for path in beside if part.fullmatch(path.name) and path.resolve() in taken]:
        raise BadInput(f"--profile-out {args.profile_out}: expected another name, its parts could be written over "
                       f"{clash[0]}")


def _assessed(run: Path, vehicle: Vehicle, sensor: Sensor, window_m: float) -> Assessment:
    """The road of a run. BadInput ("file:line: expected ..., found ...") for files that are not what they should be."""
    from logger.estimation.assessment import Unusable, assess, estimable
    from logger.store.formats.drive_file import DRIVE, MAX_SPEED_MPS, PROFILE, read_drive, track_of
    from logger.store.formats.profile_file import read_profile

    drive = read_drive(run / DRIVE if run.is_dir() else run)
    try:
        ready = estimable(drive.rate_hz, drive.accel_z_mps2, drive.speed_mps, drive.distance_m, MAX_SPEED_MPS)
    except Unusable as error:
        line = "" if error.sample is None else f":{error.sample + 2}"
        raise BadInput(f"{drive.path}{line}: {error}") from None
    profile = run / PROFILE
    track = track_of(read_profile(profile)) if run.is_dir() and profile.exists() else None
    return assess(ready, vehicle, sensor, window_m, track)


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


# --- for programs ---


def as_json(run: Path, found: Assessment, files: list[Path]) -> dict[str, Any]:
    """Settings, the run as a whole, per class of speed, per window; null for what is not known."""
    from logger.estimation.assessment import SPEED_CLASS_MPS, figures, speed_classes

    drive, windows, road = found.drive, found.windows, found.road
    return {
        "run": str(run), "vehicle": found.vehicle.name, "rate_hz": drive.rate_hz,
        "noise_mps2": found.sensor.noise_rms_mps2, "step_mps2": found.sensor.step_mps2, "window_m": found.window_m,
        "distance_start_m": float(drive.distance_m[0]), "distance_end_m": float(drive.distance_m[-1]),
        "distance_relaid_m": drive.relaid_m, "compared": found.compared,
        **figures(found, windows.speed_mps > 0),
        "unanswered": dict(Counter("|".join(sorted(flags)) for flags in windows.flags if flags)),
        "shortest_wavelength_m": road.shortest_m if road else None,
        "longest_wavelength_m": road.longest_m if road else None,
        "profile_files": [str(file) for file in files],
        "speeds": [{"from_mps": low, "to_mps": low + SPEED_CLASS_MPS, **figures(found, which)}
                   for low, which in speed_classes(windows)],
        "windows": list(_rows(found)),
    }


def _rows(found: Assessment) -> Iterator[dict[str, Any]]:
    from math import isfinite

    windows = found.windows
    columns = {
        "distance_start_m": windows.edges_m[:-1], "distance_end_m": windows.edges_m[1:],
        "speed_mps": windows.speed_mps, "iri_m_per_km": windows.iri_m_per_km,
        "iri_std_m_per_km": windows.iri_std_m_per_km, "told": windows.told,
        "limit_std_m_per_km": found.least_error_m_per_km,
    } | ({"iri_exact_m_per_km": found.exact_m_per_km} if found.compared else {})
    for *values, flags in zip(*(column.tolist() for column in columns.values()), windows.flags, strict=True):
        row = {name: value if isfinite(value) else None for name, value in zip(columns, values, strict=True)}
        yield row | {"flags": sorted(flags)}


def _csv(found: Assessment) -> Iterator[str]:
    for number, row in enumerate(_rows(found)):
        if number == 0:
            yield ",".join(row) + "\n"
        *values, flags = row.values()
        yield ",".join("" if value is None else f"{value:.7g}" for value in values) + f",{'|'.join(flags)}\n"


# --- for a person ---


def screen(found: Assessment, told: dict[str, Any]) -> list[str]:
    """The lines a person sees; ``told``: the same as JSON."""
    from logger.estimation.assessment import MIX_IRI

    way_m = told["distance_end_m"] - told["distance_start_m"]
    lines = [
        f"{told['run']}: {way_m:.0f} m in a {told['vehicle']}, "
        f"{len(found.drive.distance_m) / told['rate_hz']:.0f} s at {told['rate_hz']:.5g} Hz; windows of "
        f"{told['window_m']:.4g} m",
        f"Taken for granted: noise of {told['noise_mps2']:g} m/s2 in a reading (--noise), "
        + (f"rounded to {told['step_mps2']:g} m/s2 (--step)" if told["step_mps2"] else "not rounded (--step)"),
    ]
    if told["distance_relaid_m"]:
        lines.append("The distance went back here and there: laid anew by the speed, "
                     f"{told['distance_relaid_m']:.2f} m off at most.")
    if hint := _unit_hint(found):
        lines.append(hint)
    if not told["answered_count"]:
        return [*lines, f"No IRI: {_unanswered(told) or 'not one whole window was driven'}"]
    limit = told["limit"]
    lines += [
        "", f"IRI {told['iri_m_per_km']:.2f} m/km on the mean, {told['iri_min_m_per_km']:.2f} to "
        f"{told['iri_max_m_per_km']:.2f}; {told['answered_count']} of {told['window_count']} windows"
        + (f" ({_unanswered(told)})" if told["unanswered"] else "") + ".",
        f"An estimator that knew everything would reach R2 {limit['r2_iri_1_to_10']:.3f} over roads of IRI "
        f"{MIX_IRI[0]} to {MIX_IRI[-1]}, {limit['r2_this_road']:.3f} on a road like this one; standard error "
        f"{limit['std_m_per_km']:.2f} m/km at {told['speed_mps']:.0f} m/s.",
        "Wavelengths told: " + _range_words(found),
    ]
    if (factor := told["iri_std_m_per_km"] / limit["std_m_per_km"]) > _FAR_ABOVE:
        lines.append(f"The standard errors are {factor:.1f} times as large: no vehicle file is trusted beyond a few "
                     "percent, and there may be more in the readings than vehicle and noise explain.")
    lines += ["", *_table(told)]
    return lines + [f"Profile: {file}" for file in told["profile_files"]]


def _unit_hint(found: Assessment) -> str:
    """What makes one doubt that the readings on the way are in m/s2; empty if nothing does."""
    import numpy as np

    drive = found.drive
    moving = np.diff(drive.distance_m, prepend=drive.distance_m[0]) * drive.rate_hz > _MOVING_MPS
    if not moving.any():
        return ""
    mean, rms = float(drive.accel_z_mps2[moving].mean()), float(drive.accel_z_mps2[moving].std())
    if abs(abs(mean) - 1) < _G_NEAR and rms < _G_CALM_MPS2:
        return f"Acceleration in g? On the way it is {mean:.2f} on the mean and {rms:.3g} r.m.s. about it."
    if rms < found.sensor.noise_rms_mps2:
        return (f"Acceleration in g? On the way it is {rms:.3g} r.m.s., less than the noise of "
                f"{found.sensor.noise_rms_mps2:g} "
                "(--noise).")
    return ""


def _unanswered(told: dict[str, Any]) -> str:
    return ", ".join(f"{count} {flags.replace('|', ' and ')}" for flags, count in told["unanswered"].items())


def _range_words(found: Assessment) -> str:
    from logger.estimation.road_profile import TOLD_OVER

    road = found.road
    if road is None:
        return f"none over {TOLD_OVER:.0%} of the way."
    left_out = f"; {road.left_out_m:.0f} m in short stretches are left out" if road.left_out_m else ""
    return (f"{road.shortest_m:.2g} to {road.longest_m:.3g} m (each end over {TOLD_OVER:.0%} of the way); that is what "
            f"a profile holds{left_out}.")


def _table(told: dict[str, Any]) -> Iterator[str]:
    """Per class of speed: the estimates, then the comparison where there is one."""
    compared = "comparison" in told
    yield (f"{'m/s':>10}{'windows':>9}{'answered':>10}{'IRI':>8}{'std. error':>12}{'limit':>8}"
           + (f"   {'R2':>7}{'limit':>7}{'bias':>8}{'in 1':>7}{'in 2':>6}" if compared else ""))
    total = [{"from_mps": None, **told}] if len(told["speeds"]) > 1 else []
    for row in [*told["speeds"], *total]:
        name = "all" if row["from_mps"] is None else f"{row['from_mps']:.0f} to {row['to_mps']:.0f}"
        line = f"{name:>10}{row['window_count']:9d}{row['answered_count']:10d}"
        if row["answered_count"]:
            line += f"{row['iri_m_per_km']:8.2f}{row['iri_std_m_per_km']:12.3f}{row['limit']['std_m_per_km']:8.3f}"
        if found := row.get("comparison"):
            line += (f"   {found['r2']:7.3f}{found['limit_r2']:7.3f}{found['bias']:+8.1%}{found['within_one']:7.2f}"
                     f"{found['within_two']:6.2f}")
        yield line
    if compared:
        yield "R2 against the profile; in 1, in 2: windows within one and two standard errors (right: 0.68, 0.95)."
