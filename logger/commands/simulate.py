"""What a vehicle's accelerometer would record on a road: a drive, simulated.

  ridelog simulate --vehicle rav4-2009 --profile road.csv --speed 20 --out drive.csv
  ridelog simulate --vehicle rav4-2009 --profile road.csv --speed 20 --effect tire_damping:tire_damping_n_s_per_m=200 \\
      --effect wheel_lift --out drive.csv
  ridelog simulate --vehicle rav4-2009 --flat 60 --obstacle bump:start_m=20,height_m=0.08,width_m=3.6 --speed 5 \\
      --out run/drive.csv --profile-out run/profile.csv
  ridelog simulate --vehicle ./rig.yaml --excitation run/excitation.csv --rate 500 --out run/drive.csv

The drive is CSV: t_s,accel_z_mps2,speed_mps,distance_m, then what --output asks for. It starts with the front tires at
the start of the profile, after a flat road, and is sampled as a recorder does it, behind a filter that is flat up to
0.38 of the sample rate. A folder that holds a drive.csv and the profile.csv it was driven on is a run. A rig that is
driven by time (--excitation) has no speed and no distance; its drive.csv lasts as long as the excitation.csv beside it.

Physical effects are those of the vehicle's file, then those of --effect; --list-effects lists them. The speed
asked for is the true one: with speed_scale the drive's own columns say something else.
"""

from __future__ import annotations

import argparse
import json
import sys
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.outputs import check_outs
from logger.api.ranges import ADDED, RATE, SPEED
from logger.api.terms import named_numbers
from logger.commands.numbers import add_number
from logger.commands.pictures import HELP, parted, write_pictures
from logger.errors import EXIT_DONE, BadInput
from logger.files import together
from logger.printable import printable

if TYPE_CHECKING:
    from logger.profiles.excitation import Excitation
    from logger.profiles.track import Track
    from logger.simulation.virtual_drive import FrontAxleMotion
    from logger.vehicle.effect import Chosen, Effect, Parameter
    from logger.vehicle.structure import Output, Structure
    from logger.vehicle.vehicle import Vehicle

_FLAT_M = (1.0, 10_000.0)
WHEELS = {1: ("front",), 2: ("front", "rear"), 4: ("front_left", "front_right", "rear_left", "rear_right")}
OUTPUTS = ("wheels", "travel", "tires", "body")


USAGE = """ridelog simulate --vehicle NAME|FILE (--profile FILE | --flat M | --excitation FILE)
                        (--speed MPS | --speed-file FILE) --out FILE [OPTIONS]
       ridelog simulate --list-effects [--json]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.usage = USAGE
    parser.add_argument("--vehicle", metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name)")
    road = parser.add_mutually_exclusive_group()
    road.add_argument("--profile", type=Path, metavar="FILE",
                      help="CSV (distance_m,elevation_m[,elevation_right_m]) or ERD; of two tracks a full car uses "
                           "both, other cars the left one")
    road.add_argument("--excitation", type=Path, metavar="FILE",
                      help="what stands under the wheels of a rig over time instead: CSV (t_s,elevation_m"
                           "[,elevation_rear_m]); without --speed")
    add_number(road, "--flat", *_FLAT_M, "m", metavar="M", help="a flat road of this length instead [m]")
    parser.add_argument("--obstacle", action="append", default=[], metavar="NAME:PARAM=VALUE,...",
                        help="add one to the road; may repeat. bump (Eq 4.41): start_m, height_m, width_m; step: "
                             "start_m, height_m; ramp: and length_m; plate: start_m, height_m, length_m[, edge_m]; "
                             "pothole: start_m, depth_m, length_m[, edge_m]")
    speed = parser.add_mutually_exclusive_group()
    add_number(speed, "--speed", *SPEED, metavar="MPS", help="the same all the way [m/s]")
    speed.add_argument("--speed-file", type=Path, metavar="FILE",
                       help="CSV with t_s,speed_mps, straight lines between them; the drive lasts as long as the file")
    parser.add_argument("--effect", action="append", default=[], metavar="NAME[:PARAM=VALUE,...]",
                        help="a physical effect, or the path of a Python file with one of your own; may repeat. What "
                             "is not said is at its usual value; takes the place of the vehicle's own effect of that "
                             "name")
    parser.add_argument("--list-effects", action="store_true",
                        help="print the effects there are, with their parameters, and do nothing else")
    parser.add_argument("--out", type=Path, action="append", default=[], metavar="FILE",
                        help="drive to write; DIR/drive.csv beside DIR/profile.csv makes a run. FILE.html: "
                             f"{HELP}; may repeat")
    parser.add_argument("--profile-out", type=Path, metavar="FILE",
                        help="write the road that was driven as well, with its obstacles")
    add_number(parser, "--rate", *RATE, default=100.0, metavar="HZ",
               help="samples a second (default: 100)")
    add_number(parser, "--noise", *ADDED, default=0.0, metavar="MPS2",
               help="r.m.s. of the sensor's noise [m/s2]")
    add_number(parser, "--step", *ADDED, default=0.0, metavar="MPS2",
               help="the sensor gives whole multiples of this only [m/s2]")
    add_number(parser, "--seed", 0, inf, kind=int, default=1, metavar="N",
               help="another number, another noise (default: 1)")
    parser.add_argument("--output", action="append", default=[], metavar="WHAT",
                        help="further columns; may repeat. wheels: their acceleration; travel: extension of the "
                             "suspensions; tires: height of the wheels over the road; body:ahead_m=X,left_m=Y: "
                             "acceleration of another point of the body, from the centre of gravity")
    parser.add_argument("--json", action="store_true", help="print what was made as one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog simulate``."""
    if args.list_effects:
        _list_effects(args.json)
    else:
        _simulate(args)
    return EXIT_DONE


def _simulate(args: argparse.Namespace) -> None:
    import numpy as np

    from logger.api.drives import Run
    from logger.api.vehicles import car_on
    from logger.profiles.track import Track
    from logger.simulation.virtual_drive import SensorErrors, recorded_drive
    from logger.store.formats.drive_file import COLUMNS, TIME, write_drive, write_profile

    pictures, drives = parted(args.out)
    _check_given(args, drives)
    _check_files(args)
    vehicle, effects, said = _model(args.vehicle, args.effect)
    track = _rig(args) if args.excitation is not None else _road(args)
    car = car_on(vehicle, effects, said, track)
    outputs = _outputs(args.output, car.vehicle, car.structure)
    motion = _motion(args, track, float(car.structure.behind_m.max()))
    away = COLUMNS[2:] if track.timed else ()
    try:
        columns = recorded_drive(car, bool(effects), outputs, track.begun(float(motion.time_s[0])), motion, args.rate,
                                 SensorErrors(args.noise, args.step, args.seed))
    except ValueError as error:
        raise BadInput(f"{car.vehicle.name}: {error}") from None
    accel, speed_mps, distance_m = (columns[name] for name in COLUMNS[1:])
    way = {} if track.timed else {
        "distance_start_m": float(distance_m[0]), "distance_end_m": float(distance_m[-1]),
        "speed_mean_mps": float(speed_mps.mean())}
    made: dict[str, Any] = {
        "vehicle": vehicle.name, "model": vehicle.model, "file": str(drives[0]), "samples": len(accel),
        "rate_hz": args.rate, "duration_s": len(accel) / args.rate, **way,
        "accel_rms_mps2": float(np.sqrt(np.mean(accel**2))),
        "accel_min_mps2": float(accel.min()), "accel_max_mps2": float(accel.max()),
        "noise_mps2": args.noise, "step_mps2": args.step, "seed": args.seed,
        "more_columns": list(columns)[len(COLUMNS):],
        "effects": [{"effect": one.effect.name, "parameters": dict(one.values)} for one in effects],
    }
    words = _in_words(made)
    drive = Run(drives[0], args.rate, columns[TIME], accel, speed_mps, distance_m, None, None)
    with together():
        for path in drives:
            write_drive(path, {name: one for name, one in columns.items() if name not in away})
        if args.profile_out is not None:
            assert isinstance(track, Track)
            write_profile(args.profile_out, track)
        write_pictures(pictures, "Simulated drive", str(drives[0]), words, drive.charts)
    print(json.dumps(made) if args.json else words)


def _in_words(made: dict[str, Any]) -> str:
    more = f"; also {', '.join(made['more_columns'])}" if made["more_columns"] else ""
    for one in made["effects"]:
        more += f"\n  with {one['effect']}"
        more += "".join(f", {name} {value:g}" for name, value in one["parameters"].items())
    way = (f"{made['distance_start_m']:.2f} to {made['distance_end_m']:.2f} m at {made['speed_mean_mps']:.2f} m/s on "
           "average, " if "speed_mean_mps" in made else "")
    return (f"{made['file']}: {made['vehicle']} ({made['model'].replace('_', ' ')}), {made['duration_s']:.2f} s in "
            f"{made['samples']} samples, {way}acceleration {made['accel_rms_mps2']:.3f} m/s2 r.m.s., "
            f"{made['accel_min_mps2']:.2f} to {made['accel_max_mps2']:.2f}{more}")


# --- what was asked for ---


def _check_given(args: argparse.Namespace, drives: list[Path]) -> None:
    """What is needed for a drive, though not for a list of effects."""
    if args.excitation is not None:
        others = {"--speed": args.speed is not None, "--speed-file": args.speed_file, "--obstacle": args.obstacle,
                  "--profile-out": args.profile_out}
        if beside := [name for name, given in others.items() if given]:
            raise BadInput(f"{beside[0]}: expected none of it with --excitation: a rig stands, and has no road")
    needed = {"--vehicle": args.vehicle,
              "--profile or --flat": args.profile or args.excitation or args.flat is not None,
              "--speed or --speed-file": args.speed is not None or args.speed_file or args.excitation,
              "--out": drives}
    missing = [name for name, given in needed.items() if not given]
    if missing:
        raise BadInput(f"simulate: expected {', '.join(missing)} (try 'ridelog simulate --help')")


def _check_files(args: argparse.Namespace) -> None:
    from logger.shipped import vehicle_path

    read = (vehicle_path(args.vehicle), args.profile, args.excitation, args.speed_file)
    check_outs([*(("--out", path) for path in args.out), ("--profile-out", args.profile_out)],
               read=[path for path in read if path is not None])


def _model(name: str, wanted: list[str]) -> tuple[Vehicle, tuple[Chosen, ...], dict[str, str]]:
    """The vehicle and its effects, those of its file and those asked for, and where each was said, by name."""
    from logger.shipped import vehicle_path
    from logger.store.formats.effect_file import effect_named
    from logger.store.formats.vehicle_file import read_model
    from logger.vehicle.compose import with_effect
    from logger.vehicle.effect import chosen
    from logger.vehicle.effect_sizes import sized

    model = read_model(vehicle_path(name))
    effects, asked = model.effects, dict[str, str]()
    for text in wanted:
        effect_name, values = named_numbers(text, "--effect")
        effect, file = effect_named(effect_name)
        effect = effect if file else sized(effect, model.vehicle)
        if effect.name in asked:
            raise BadInput(f"--effect {text}: expected each effect once")
        asked[effect.name] = f"--effect {text}"
        try:
            effects = with_effect(effects, chosen(effect, effect.usual | values, file=file))
        except ValueError as error:
            raise BadInput(f"--effect {text}: {error}") from None
    return model.vehicle, effects, {one.effect.name: name for one in model.effects} | asked


def _outputs(wanted: list[str], vehicle: Vehicle, structure: Structure) -> dict[str, Output]:
    """Outputs by the names of their columns, the sensor's first."""
    from logger.simulation.virtual_drive import SENSOR
    from logger.vehicle.structure import body_point, suspension_travel, tire_deflection, wheel

    found = {SENSOR: body_point(structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m)}
    each = {"wheels": ("wheel_{}_mps2", wheel), "travel": ("travel_{}_m", suspension_travel),
            "tires": ("tire_{}_m", tire_deflection)}
    for text in wanted:
        name, place = named_numbers(text, "--output")
        if name in each and not place:
            column, output = each[name]
            found |= {column.format(side): output(structure, index)
                      for index, side in enumerate(WHEELS[len(structure.wheels)])}
        elif name == "body" and set(place) <= {"ahead_m", "left_m"}:
            ahead_m, left_m = place.get("ahead_m", 0.0), place.get("left_m", 0.0)
            try:
                found[f"body_{ahead_m:g}_{left_m:g}_mps2"] = body_point(structure, ahead_m, left_m)
            except ValueError as error:
                raise BadInput(f"--output {text}: {error}") from None
        else:
            raise BadInput(f"--output {text}: expected one of {', '.join(OUTPUTS[:-1])}, body:ahead_m=X,left_m=Y")
    return found


# --- the road and the way ---


def _road(args: argparse.Namespace) -> Track:
    """The road with the obstacles on it. BadInput for files and obstacles that are not what they should be."""
    import numpy as np

    from logger.profiles.track import Track
    from logger.roads.plausible import doubt_of
    from logger.simulation.virtual_drive import Obstacle, with_obstacles
    from logger.store.formats.drive_file import track_of
    from logger.store.formats.profile_file import read_profile

    if args.flat is not None:
        track = Track(args.flat, np.zeros(2))
    else:
        profile = read_profile(args.profile, judged=True)
        track = track_of(profile)
        if words := doubt_of(profile.elevation_m, profile.spacing_m):
            print(printable(f"ridelog: {args.profile}: {words}"), file=sys.stderr)
    wanted = [Obstacle(*named_numbers(text, "--obstacle"), f"--obstacle {text}") for text in args.obstacle]
    try:
        return with_obstacles(track, wanted)
    except ValueError as error:
        raise BadInput(str(error)) from None


def _rig(args: argparse.Namespace) -> Excitation:
    from logger.store.formats.excitation_file import read_excitation

    return read_excitation(args.excitation)


def _motion(args: argparse.Namespace, track: Track | Excitation, wheelbase_m: float) -> FrontAxleMotion:
    from logger.profiles.excitation import Excitation
    from logger.simulation.virtual_drive import at_one_speed, motion_along, standing
    from logger.store.formats.drive_file import read_speeds

    if isinstance(track, Excitation):
        return standing(track, args.rate)
    knots = (at_one_speed(track, wheelbase_m, args.speed) if args.speed is not None else read_speeds(args.speed_file))
    try:
        return motion_along(*knots, track.start_m, args.rate)
    except ValueError as error:
        raise BadInput(str(error)) from None


# --- the effects there are ---


def _list_effects(as_json: bool) -> None:
    from logger.store.formats.effect_file import shipped_effects

    if as_json:
        print(json.dumps({"effects": [_effect_json(effect) for effect in shipped_effects().values()]}))
    else:
        print("\n\n".join(map(_effect_in_words, shipped_effects().values())))


def _effect_json(effect: Effect) -> dict[str, Any]:
    return {"name": effect.name, "title": effect.title, "parameters": list(map(_parameter_json, effect.parameters)),
            "source": effect.source, "signature": effect.signature, "shown_by": effect.shown_by}


def _parameter_json(one: Parameter) -> dict[str, Any]:
    from math import isinf

    vanishes = "infinity" if one.null is not None and isinf(one.null) else one.null
    return {"name": one.name, "meaning": one.meaning, "start": one.start, "low": one.low, "high": one.high,
            "choices": list(one.choices), "default": one.default, "vanishes_at": vanishes}


def _effect_in_words(effect: Effect) -> str:
    numbers = [f"  {one.name}={one.start:g}  ({one.allowed})  {one.meaning}" for one in effect.parameters]
    return "\n".join([f"{effect.name}: {effect.title}", *numbers, f"  leaves: {effect.signature}",
                      f"  to see it: {effect.shown_by}", f"  source: {effect.source}"])
