"""What a vehicle's accelerometer would record on a road: ``simulate``, in Python and at the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from logger.api.drive_questions import SimulateCommand, SimulateQuestion
from logger.api.drives import Run
from logger.api.roads import Profile, read_profile
from logger.api.shared_fields import named_numbers
from logger.api.shown import CommandResult
from logger.api.vehicles import car_on, check_forces, model_of
from logger.chart_data import Array, Chart
from logger.errors import BadInput
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.question import function
from logger.report.quantities import numbers_of
from logger.roads.iri import doubt_of
from logger.shipped import vehicle_path
from logger.simulation import virtual_drive
from logger.store.formats import drive_file, profile_file
from logger.store.formats.effect_file import effect_named
from logger.store.formats.vehicle_file import CarModel, check_moves_itself, read_model
from logger.vehicle.compose import Car, with_effect
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.structure import Output, Structure, body_point, suspension_travel, tire_deflection, wheel
from logger.vehicle.uncertain import sized
from logger.vehicle.vehicle import Vehicle

WHEELS = {1: ("front",), 2: ("front", "rear"), 4: ("front_left", "front_right", "rear_left", "rear_right")}
OUTPUTS = ("wheels", "travel", "tires", "displacement", "velocity", "body")


def simulated(question: SimulateQuestion) -> Run:
    """The answer to ``SimulateQuestion``, which says what is raised."""
    model, name = model_of(question.vehicle), question.name
    given = question.profile
    road = given if isinstance(given, profile_file.Wheelpaths) else read_profile(given)
    try:
        track = virtual_drive.with_obstacles(drive_file.track_of(road), _obstacles(question, ""))
        car = car_on(model.vehicle, model.effects, {one.effect.name: name for one in model.effects}, track)
        columns = _columns(question, car, track, _motion(question, car, track), {})
    except ValueError as error:
        raise BadInput(f"{name}: {error}") from None
    return _run(Path(name), question, columns, _profile_of(track))


simulate = function("simulate", SimulateQuestion, simulated)


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(CommandResult):
    """A simulated drive, with the columns that were asked for, on a road or a rig.

    columns    (n,) each, by name, as the drive's file has them
    track      that was driven, with its obstacles, or what moved a rig
    doubts     about the road, a line each
    """

    columns: Mapping[str, Array]
    track: Track | Excitation
    run: Run
    doubts: tuple[str, ...]
    title: ClassVar[str] = "Simulated drive"

    def charts(self) -> Sequence[Chart]:
        """Of the drive."""
        return self.run.charts()

    def remarks(self, written: Mapping[str, Sequence[Path]]) -> Sequence[str]:
        """What makes one doubt the road."""
        return self.doubts

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the road, of which the file is called ``profile.csv``, or the drive. BadInput for the road of a rig."""
        if path.name != drive_file.PROFILE:
            drive_file.write_drive(path, self.columns)
            self._json["file"] = str(path)
        elif isinstance(self.track, Track):
            drive_file.write_profile(path, self.track)
        else:
            raise BadInput(f"{option} {path}: a rig has no road")


def simulation(question: SimulateCommand) -> Simulation:
    """The answer to ``SimulateCommand``, which says what is raised."""
    model, effects, said = _model(str(question.vehicle), question.effects)
    check_moves_itself(model.vehicle)
    doubt = ""
    if question.excitation is not None:
        place = question.excitation.parent
        track: Track | Excitation = profile_file.read_excitation(question.excitation, drive_file.read_forces(place))
        check_forces(model.vehicle, track, str(place / drive_file.RUN))
    else:
        track, doubt = _road(question)
    car = car_on(model.vehicle, effects, said, track)
    outputs = _outputs(question.outputs, car.vehicle, car.structure)
    try:
        motion = _motion(question, car, track)
    except ValueError as error:
        raise BadInput(str(error)) from None
    try:
        columns = _columns(question, car, track, motion, outputs)
    except ValueError as error:
        raise BadInput(f"{car.vehicle.name}: {error}") from None
    run = _run(Path("drive.csv"), question, columns, None)
    accel, rate_hz = run.accel_z_mps2, question.rate_hz
    away = drive_file.COLUMNS[2:] if track.timed else ()
    way = {} if track.timed else {
        "distance_start_m": float(run.distance_m[0]), "distance_end_m": float(run.distance_m[-1]),
        "speed_mean_mps": float(run.speed_mps.mean())}
    made = {
        "vehicle": model.vehicle.name, "model": model.vehicle.model, "file": None, "samples": len(accel),
        "rate_hz": rate_hz, "duration_s": len(accel) / rate_hz, **way,
        "accel_rms_mps2": float(np.sqrt(np.mean(accel**2))),
        "accel_min_mps2": float(accel.min()), "accel_max_mps2": float(accel.max()),
        "noise_mps2": question.noise_mps2, "step_mps2": question.step_mps2, "seed": question.seed,
        "more_columns": list(columns)[len(drive_file.COLUMNS):],
        "effects": [{"effect": one.effect.name, "parameters": dict(one.values)} for one in effects],
    }
    more = f"; also {', '.join(list(columns)[len(drive_file.COLUMNS):])}" * (len(columns) > len(drive_file.COLUMNS))
    for one in effects:
        more += "\n  with " + ", ".join(filter(None, (one.effect.name, numbers_of(one))))
    along = (f"{run.distance_m[0]:.2f} to {run.distance_m[-1]:.2f} m at {run.speed_mps.mean():.2f} m/s on average, "
             * (not track.timed))
    return Simulation(
        f"{model.vehicle.name} ({model.vehicle.model.replace('_', ' ')}), {made['duration_s']:.2f} s in {len(accel)} "
        f"samples, {along}acceleration {made['accel_rms_mps2']:.3f} m/s2 r.m.s., {accel.min():.2f} to "
        f"{accel.max():.2f}{more}", made, {name: one for name, one in columns.items() if name not in away}, track, run,
        (doubt,) if doubt else ())


def _columns(question: SimulateQuestion, car: Car, track: Track | Excitation,
             motion: virtual_drive.FrontAxleMotion, outputs: Mapping[str, Output]) -> dict[str, Array]:
    """What is recorded (n,), by name. ValueError for what no car can do."""
    place = car.vehicle.sensor
    sensor = {virtual_drive.SENSOR: body_point(car.structure, place.ahead_m, place.left_m)}
    return virtual_drive.recorded_drive(
        car, {**sensor, **outputs}, track.begun(float(motion.time_s[0])), motion, question.rate_hz,
        virtual_drive.SensorErrors(question.noise_mps2, question.step_mps2, question.seed))


def _motion(question: SimulateQuestion, car: Car, track: Track | Excitation) -> virtual_drive.FrontAxleMotion:
    """ValueError for a drive that is too short, too long, or not on the road."""
    speed: Any = question.speed_mps    # at the terminal the name of a file
    if isinstance(track, Excitation):
        return virtual_drive.standing(track, question.rate_hz)
    if isinstance(speed, tuple | list):
        times_s, speeds_mps = speed
        knots = _knots(times_s, speeds_mps, question.name)
    elif isinstance(speed, Path):
        knots = drive_file.read_speeds(speed)
    else:
        knots = virtual_drive.at_one_speed(track, float(car.structure.behind_m.max()), speed)
    return virtual_drive.motion_along(*knots, track.start_m, question.rate_hz)


def _run(path: Path, question: SimulateQuestion, columns: Mapping[str, Array], profile: Profile | None) -> Run:
    time_s, accel_z_mps2, speed_mps, distance_m = (columns[name] for name in (drive_file.TIME, *drive_file.COLUMNS[1:]))
    return Run(path, question.rate_hz, time_s, accel_z_mps2, speed_mps, distance_m, None, None, profile)


def _obstacles(question: SimulateQuestion, dashes: str) -> list[virtual_drive.Obstacle]:
    """``dashes``: before the option's name, at the terminal."""
    given = question.obstacles or {}
    if isinstance(given, Mapping):
        return [virtual_drive.Obstacle(kind, values, f"obstacle {kind}") for kind, values in given.items()]
    return [virtual_drive.Obstacle(*named_numbers(text, f"{dashes}obstacle"), f"{dashes}obstacle {text}")
            for text in given]


def _knots(time_s: npt.ArrayLike, speed_mps: npt.ArrayLike, name: str) -> tuple[Array, Array]:
    times, speeds = (np.asarray(one, dtype=np.float64) for one in (time_s, speed_mps))
    grows, possible = (np.diff(times) > 0).all(), ((speeds >= 0) & (speeds <= 100)).all()
    if not 1 < len(times) == len(speeds) or not (grows and possible):
        raise BadInput(f"{name}: expected two or more increasing times, and as many speeds of 0 to 100 m/s")
    return times, speeds


def _profile_of(track: Track) -> Profile:
    tracks = track.elevation_m.reshape(len(track.elevation_m), -1).T
    return Profile(track.start_m, track.spacing_m, tracks[0], tracks[1] if len(tracks) > 1 else None)


def _model(name: str, wanted: Sequence[str]) -> tuple[CarModel, tuple[Chosen, ...], dict[str, str]]:
    """The vehicle, its effects and those that are asked for, and where each was said, by name."""
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
    return model, effects, {one.effect.name: name for one in model.effects} | asked


def _outputs(wanted: Sequence[str], vehicle: Vehicle, structure: Structure) -> dict[str, Output]:
    """Outputs by the names of their columns."""
    found: dict[str, Output] = {}
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


def _road(question: SimulateCommand) -> tuple[Track, str]:
    """The road with its obstacles, and what makes one doubt it. BadInput for files and obstacles that are wrong."""
    given: Any = question.profile    # a file, as this is no rig
    if isinstance(given, float):
        track, doubt = Track(given, np.zeros(2)), ""
    else:
        profile = profile_file.read_profile(given, judged=True)
        track, doubt = drive_file.track_of(profile), doubt_of(profile.elevation_m, profile.spacing_m)
    try:
        return virtual_drive.with_obstacles(track, _obstacles(question, "--")), doubt
    except ValueError as error:
        raise BadInput(str(error)) from None
