"""``ridelog simulate`` at a terminal: files are read and written, and what was made is said."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.drive_questions import SIMULATE, SimulateCommand, SimulateQuestion
from logger.api.question import named_numbers
from logger.api.shown import check_outs
from logger.commands import options
from logger.commands.options import parted, write_pictures
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

__doc__ = options.help_of(SimulateQuestion)
WHEELS = {1: ("front",), 2: ("front", "rear"), 4: ("front_left", "front_right", "rear_left", "rear_right")}
OUTPUTS = ("wheels", "travel", "tires", "displacement", "velocity", "body")


USAGE = """ridelog simulate --vehicle NAME|FILE (--profile FILE | --flat M | --excitation FILE)
                        --speed MPS|FILE --out FILE [OPTIONS]
       ridelog simulate --list-effects [--json]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog simulate``."""
    parser.usage = USAGE
    options.declare(parser, SIMULATE)


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog simulate``."""
    with options.respelled(SimulateCommand):
        question: SimulateCommand = options.asked(SIMULATE, args)
    if question.list_effects:
        _list_effects(args.json)
    else:
        _simulate(question, args)
    return EXIT_DONE


def _simulate(question: SimulateCommand, args: argparse.Namespace) -> None:
    import numpy as np

    from logger.api.drives import Run
    from logger.api.vehicles import car_on, check_forces
    from logger.profiles.track import Track
    from logger.simulation.virtual_drive import SensorErrors, recorded_drive
    from logger.store.formats.drive_file import COLUMNS, RUN, TIME, write_drive, write_profile

    pictures, drives = parted(args.out or [])
    _check_given(question, drives)
    _check_files(question, args)
    vehicle, effects, said = _model(str(question.vehicle), question.effects)
    track = _road(question) if question.excitation is None else _rig(question.excitation)
    if question.excitation is not None:
        check_forces(vehicle, track, str(question.excitation.parent / RUN))
    car = car_on(vehicle, effects, said, track)
    outputs = _outputs(question.outputs, car.vehicle, car.structure)
    motion = _motion(question, track, float(car.structure.behind_m.max()))
    away = COLUMNS[2:] if track.timed else ()
    try:
        columns = recorded_drive(car, bool(effects), outputs, track.begun(float(motion.time_s[0])), motion,
                                 question.rate_hz,
                                 SensorErrors(question.noise_mps2, question.step_mps2, question.seed))
    except ValueError as error:
        raise BadInput(f"{car.vehicle.name}: {error}") from None
    accel, speed_mps, distance_m = (columns[name] for name in COLUMNS[1:])
    way = {} if track.timed else {
        "distance_start_m": float(distance_m[0]), "distance_end_m": float(distance_m[-1]),
        "speed_mean_mps": float(speed_mps.mean())}
    made: dict[str, Any] = {
        "vehicle": vehicle.name, "model": vehicle.model, "file": str(drives[0]), "samples": len(accel),
        "rate_hz": question.rate_hz, "duration_s": len(accel) / question.rate_hz, **way,
        "accel_rms_mps2": float(np.sqrt(np.mean(accel**2))),
        "accel_min_mps2": float(accel.min()), "accel_max_mps2": float(accel.max()),
        "noise_mps2": question.noise_mps2, "step_mps2": question.step_mps2, "seed": question.seed,
        "more_columns": list(columns)[len(COLUMNS):],
        "effects": [{"effect": one.effect.name, "parameters": dict(one.values)} for one in effects],
    }
    words = _in_words(made)
    drive = Run(drives[0], question.rate_hz, columns[TIME], accel, speed_mps, distance_m, None, None)
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


def _check_given(question: SimulateCommand, drives: list[Path]) -> None:
    """What is needed for a drive, though not for a list of effects."""
    stands = question.excitation is not None
    needed = {"--vehicle": question.vehicle,
              "--profile or --flat": stands or question.profile or question.flat_m is not None,
              "--speed": stands or question.speed_mps is not None,
              "--out": drives}
    if missing := [name for name, given in needed.items() if not given]:
        raise BadInput(f"simulate: expected {', '.join(missing)} (try 'ridelog simulate --help')")


def _check_files(question: SimulateCommand, args: argparse.Namespace) -> None:
    from logger.shipped import vehicle_path

    check_outs([*(("--out", path) for path in args.out), ("--profile-out", args.profile_out)],
               read=[vehicle_path(str(question.vehicle)), *question.files_read()])


def _model(name: str, wanted: Sequence[str]) -> tuple[Vehicle, tuple[Chosen, ...], dict[str, str]]:
    """The vehicle and its effects, those of its file and those asked for, and where each was said, by name."""
    from logger.shipped import vehicle_path
    from logger.store.formats.effect_file import effect_named
    from logger.store.formats.vehicle_file import read_model
    from logger.vehicle.compose import with_effect
    from logger.vehicle.effect import chosen
    from logger.vehicle.uncertain import sized

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


def _outputs(wanted: Sequence[str], vehicle: Vehicle, structure: Structure) -> dict[str, Output]:
    """Outputs by the names of their columns, the sensor's first."""
    from logger.simulation.virtual_drive import SENSOR
    from logger.vehicle.structure import body_point, suspension_travel, tire_deflection, wheel

    found = {SENSOR: body_point(structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m)}
    each = {"wheels": ("wheel_{}_mps2", wheel), "travel": ("travel_{}_m", suspension_travel),
            "tires": ("tire_{}_m", tire_deflection)}
    for text in wanted:
        name, place = named_numbers(text, "--output")
        if name in ("displacement", "velocity") and not place:
            order = ("displacement", "velocity").index(name)
            found[("displacement_m", "velocity_mps")[order]] = body_point(
                structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m, order)
        elif structure.on_base and text == "travel":
            found["travel_m"] = suspension_travel(structure, 0)
        elif structure.on_base and name in each:
            raise BadInput(f"--output {text}: expected displacement, velocity or travel of a single mass")
        elif name in each and not place:
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


def _road(question: SimulateCommand) -> Track:
    """The road with the obstacles on it. BadInput for files and obstacles that are not what they should be."""
    import numpy as np

    from logger.profiles.track import Track
    from logger.roads.iri import doubt_of
    from logger.simulation.virtual_drive import Obstacle, with_obstacles
    from logger.store.formats.drive_file import track_of
    from logger.store.formats.profile_file import read_profile

    if question.flat_m is not None:
        track = Track(question.flat_m, np.zeros(2))
    else:
        assert question.profile is not None  # as was checked
        profile = read_profile(question.profile, judged=True)
        track = track_of(profile)
        if words := doubt_of(profile.elevation_m, profile.spacing_m):
            print(printable(f"ridelog: {question.profile}: {words}"), file=sys.stderr)
    wanted = [Obstacle(*named_numbers(text, "--obstacle"), f"--obstacle {text}") for text in question.obstacles or ()]
    try:
        return with_obstacles(track, wanted)
    except ValueError as error:
        raise BadInput(str(error)) from None


def _rig(path: Path) -> Excitation:
    from logger.store.formats.drive_file import read_forces
    from logger.store.formats.profile_file import read_excitation

    return read_excitation(path, read_forces(path.parent))


def _motion(question: SimulateCommand, track: Track | Excitation, wheelbase_m: float) -> FrontAxleMotion:
    from logger.profiles.excitation import Excitation
    from logger.simulation.virtual_drive import at_one_speed, motion_along, standing
    from logger.store.formats.drive_file import read_speeds

    if isinstance(track, Excitation):
        return standing(track, question.rate_hz)
    if isinstance(question.speed_mps, Path):
        knots = read_speeds(question.speed_mps)
    else:
        assert question.speed_mps is not None  # as was checked
        knots = at_one_speed(track, wheelbase_m, question.speed_mps)
    try:
        return motion_along(*knots, track.start_m, question.rate_hz)
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
