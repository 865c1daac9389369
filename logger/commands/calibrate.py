"""How much a vehicle shakes on roads of known roughness: IRI and Gd(n0) per r.m.s. acceleration, comfort per IRI.

The vehicle's model drives over random roads at 10 to 70 mph; one line per speed comes out, and how far one road lies
off it. The result is kept beside the vehicle's file (NAME.calibration.json), or in the user's cache, and found again.

  ridelog calibrate --vehicle rav4-2009
  ridelog calibrate --vehicle mycar.yaml --passengers 2
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.commands.numbers import add_number
from logger.errors import EXIT_DONE, BadInput
from logger.files import write_text

if TYPE_CHECKING:
    from logger.estimation.rms_calibration import Array, Line, Settings, SpeedCalibration
    from logger.vehicle.vehicle import Vehicle

_MOST_PASSENGERS = 60
_MASS_FACTORS = (0.2, 10.0)
_LOW_PASSES_HZ = (1.0, 45.0)
_COMFORT_WORD = "uncomfortable"
# Lines by what their figures are called in JSON and CSV, after the slope under its own name.
_PREFIXES = {"iri_per_accel_rms": "", "window_iri_per_accel_rms": "window_", "accel_rms_per_root_gd": "accel_rms_",
             "a_w_per_iri": "a_w_"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name)")
    parser.add_argument("--window", type=float, metavar="M", help="length of a window [m] (default: 7.62, 25 ft)")
    add_number(parser, "--low-pass", *_LOW_PASSES_HZ, metavar="HZ",
               help="low_pass_hz of the recorder's settings (default: none; what every recorder does, to leave out "
                    "gravity and what 100 Hz cannot hold, is always in)")
    add_number(parser, "--passengers", 0, _MOST_PASSENGERS, kind=int, default=0, metavar="N",
               help="people of 75 kg more in the car, at its centre of gravity; a half car gets half of their mass, a "
                    "quarter car a quarter")
    add_number(parser, "--sprung-mass-factor", *_MASS_FACTORS, default=1.0, metavar="X",
               help="so many times the body's mass, springs and inertias staying as they are (default: 1)")
    add_number(parser, "--seed", 0, 2**63, kind=int, default=1, metavar="N",
               help="another number, other roads (default: 1)")
    parser.add_argument("--recompute", action="store_true", help="do not look for a stored result")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the figures of each speed as CSV")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog calibrate``."""
    from logger.estimation.rms_calibration import loaded
    from logger.service.signal_chain import recorder_gain
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_vehicle

    path = vehicle_path(args.vehicle)
    vehicle = read_vehicle(path)
    if args.out is not None and args.out.exists() and args.out.samefile(path):
        raise BadInput(f"--out {args.out}: expected another file than the vehicle's")
    ask = Question(path, recorder_gain(args.low_pass), _settings(args), args.recompute)
    plain = answer(ask, vehicle, vehicle.name)
    with_people = None
    if args.passengers or args.sprung_mass_factor != 1.0:
        heavy = loaded(vehicle, args.passengers, args.sprung_mass_factor)
        with_people = Load(args.passengers, args.sprung_mass_factor, vehicle.sprung_mass_kg, heavy.sprung_mass_kg,
                           answer(ask, heavy, f"{vehicle.name} with its load"))
    if args.out is not None:
        write_text(args.out, "".join(_csv(with_people.speeds if with_people else plain)), "ascii")
    if args.json:
        print(json.dumps(as_json(vehicle, ask.settings, plain, with_people), allow_nan=False))
    else:
        print("\n".join(screen(vehicle, ask.settings, plain, with_people)))
    return EXIT_DONE


def _settings(args: argparse.Namespace) -> Settings:
    from logger.estimation.rms_calibration import Settings
    from logger.units import WINDOW_M

    try:
        return Settings(window_m=WINDOW_M if args.window is None else args.window, seed=args.seed)
    except ValueError as error:
        raise BadInput(f"--window: {error}") from None


# --- found or computed ---


@dataclass(frozen=True)
class Question:
    """What is asked of a vehicle, and where an answer may lie."""

    path: Path
    gain: Callable[[Array], Array]
    settings: Settings
    recompute: bool


@dataclass(frozen=True)
class Load:
    """A car with a load, and its lines."""

    passengers: int
    sprung_mass_factor: float
    empty_kg: float
    sprung_mass_kg: float
    speeds: tuple[SpeedCalibration, ...]


def answer(ask: Question, vehicle: Vehicle, title: str) -> tuple[SpeedCalibration, ...]:
    """The stored calibration of this vehicle, or a new one, which is then stored. Says on stderr which it is."""
    from logger.estimation.rms_calibration import calibrate
    from logger.store.formats.calibration_file import find, fingerprint, keep, places

    kept_in, key = places(ask.path), fingerprint(vehicle, ask.gain, ask.settings)
    found = None if ask.recompute else find(kept_in, key)
    if found is not None:
        print(f"{title}: found in {found.path}", file=sys.stderr)
        return found.speeds
    started_s = time.perf_counter()
    speeds = calibrate(vehicle, ask.gain, ask.settings)
    took_s = time.perf_counter() - started_s
    path = keep(kept_in, key, speeds)
    where = f"kept in {path}" if path else f"not kept: {' or '.join(map(str, kept_in))} cannot be written"
    print(f"{title}: computed in {took_s:.1f} s, {where}", file=sys.stderr)
    return speeds


# --- for programs ---


def as_json(
    vehicle: Vehicle, settings: Settings, plain: Sequence[SpeedCalibration], load: Load | None
) -> dict[str, Any]:
    """``vehicle`` and ``speeds``, of the car with its load if there is one; then what the roads were."""
    result = {
        "vehicle": vehicle.name, "speeds": [_row(speed) for speed in (load.speeds if load else plain)],
        "window_m": settings.window_m, "road_m": settings.road_m, "roads": settings.roads, "seed": settings.seed,
        "sprung_mass_kg": load.sprung_mass_kg if load else vehicle.sprung_mass_kg,
    }
    if load is not None:
        result |= {"passengers": load.passengers, "sprung_mass_factor": load.sprung_mass_factor,
                   "speeds_without_load": [_row(speed) for speed in plain]}
    return result


def _row(speed: SpeedCalibration) -> dict[str, float]:
    row = {"speed_mps": speed.speed_mps}
    for name, prefix in _PREFIXES.items():
        line: Line = getattr(speed, name)
        row |= {name: line.slope, f"{prefix}spread": line.spread, f"{prefix}standard_error": line.standard_error,
                f"{prefix}r2": line.r2}
    return row


def _csv(speeds: Sequence[SpeedCalibration]) -> Iterator[str]:
    yield ",".join(_row(speeds[0])) + "\n"
    for speed in speeds:
        yield ",".join(f"{value:.7g}" for value in _row(speed).values()) + "\n"


# --- for a person ---


def screen(
    vehicle: Vehicle, settings: Settings, plain: Sequence[SpeedCalibration], load: Load | None
) -> list[str]:
    """The lines a person sees."""
    from logger.comfort.iso2631 import COMFORT_WORDS
    from logger.estimation.rms_calibration import LEVELS_IRI
    from logger.units import MPH_MPS

    limit_mps2 = next(lowest for lowest, word in COMFORT_WORDS if word == _COMFORT_WORD)
    lines = [
        f"{vehicle.name}{', with its load' if load else ''}: {settings.roads} random roads of {settings.road_m:.0f} m, "
        f"IRI {LEVELS_IRI[0]:g} to {LEVELS_IRI[-1]:g} m/km", "",
        f"{'':12}{f'roads of {settings.road_m:.0f} m':^33}{f'windows of {settings.window_m:.4g} m':^26}"
        f"{'rms per':>9}{'comfort':>10}{_COMFORT_WORD[:6]:>9}",
        f"{'m/s':>6}{'mph':>5} {'IRI per rms':>16}{'spread':>9}{'R2':>8} {'IRI per rms':>12}{'spread':>8}{'R2':>6}"
        f"{'root Gd':>9}{'a_w/IRI':>10}{'from IRI':>9}",
    ]
    for speed in load.speeds if load else plain:
        road, window = speed.iri_per_accel_rms, speed.window_iri_per_accel_rms
        slope = f"{road.slope:.3f} +- {road.standard_error:.3f}"
        lines.append(
            f"{speed.speed_mps:6.2f}{speed.speed_mps / MPH_MPS:5.0f} {slope:>16}{road.spread:9.1%}{road.r2:8.4f} "
            f"{window.slope:12.3f}{window.spread:8.1%}{window.r2:6.2f}{speed.accel_rms_per_root_gd.slope:9.5f}"
            f"{speed.a_w_per_iri.slope:10.5f}{limit_mps2 / speed.a_w_per_iri.slope:9.1f}")
    lines += ["", "IRI [m/km] = 'IRI per rms' x r.m.s. vertical acceleration [m/s2]; 68 of 100 lie within the spread.",
              f"ISO 2631-1 calls the ride '{_COMFORT_WORD}' from the last column's IRI on."]
    if load is not None:
        lines += ["", *_comparison(plain, load)]
    return [*lines, "Next: --out FILE.csv or --json for all figures" + (
        "." if load else "; --passengers 2 for what a load changes.")]


def _comparison(plain: Sequence[SpeedCalibration], load: Load) -> Iterator[str]:
    """What the load changes on the same roads (Fig 6.7, 6.8)."""
    yield (f"The same roads without the load ({load.empty_kg:.4g} kg on the springs) and with it "
           f"({load.sprung_mass_kg:.4g} kg):")
    yield f"{'m/s':>6} {'IRI per rms without':>20}{'with':>9}{'r.m.s. with the load':>23}{'a_w with the load':>20}"
    for empty, full in zip(plain, load.speeds, strict=True):
        rms = full.accel_rms_per_root_gd.slope / empty.accel_rms_per_root_gd.slope - 1
        a_w = full.a_w_per_iri.slope / empty.a_w_per_iri.slope - 1
        yield (f"{empty.speed_mps:6.2f} {empty.iri_per_accel_rms.slope:20.3f}{full.iri_per_accel_rms.slope:9.3f}"
               f"{rms:+23.1%}{a_w:+20.1%}")
