"""Drives: simulated ones, and the roughness of the road as a drive shows it."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from logger import bounds
from logger.api.drive_questions import EstimateQuestion, SimulateQuestion
from logger.api.inputs import Profile, Run, car_on, check_forces, checked_run, model_of, read_profile, write_profile
from logger.api.shared_fields import named_numbers
from logger.api.shown import CommandResult, checks_json, checks_lines
from logger.chart_data import Array, Chart, Curves, Line
from logger.errors import BadInput, as_bad_input
from logger.estimation import batch
from logger.estimation.rms_calibration import LEVELS_IRI
from logger.estimation.sensor_noise import NOISE_MPS2, Sensor
from logger.files import write_text
from logger.printable import Notify, silent
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.question import function
from logger.report.blocks import Block, Blocks, Hint, Lines, Table
from logger.report.quantities import known, numbers_of
from logger.roads.iri import doubt_of
from logger.runs import SKIP_S, SLOWEST_MPS
from logger.runs import Run as Record
from logger.simulation import virtual_drive
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats import drive_file, profile_file, vehicle_file
from logger.store.formats.effect_file import effect_named
from logger.store.formats.record_checks import RecordRules
from logger.store.formats.vehicle_file import CarModel, check_moves_itself
from logger.vehicle.compose import Car, with_effect
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.named_parameters import WEAKEST
from logger.vehicle.structure import Output, Structure, body_point, suspension_travel, tire_deflection, wheel
from logger.vehicle.uncertain import sized
from logger.vehicle.vehicle import Vehicle

# --- the road as a drive shows it ---


@dataclass(frozen=True, eq=False, repr=False)
class Estimate(CommandResult):
    """The road's roughness from a drive's acceleration, in w windows.

    found                all of it, as it was estimated
    mean_iri_m_per_km    of the windows that are known; NaN: none is
    edges_m              (w + 1,) ends of the windows [m]
    speed_mps            (w,) mean speed in each [m/s]
    iri_m_per_km         (w,) IRI; NaN where it is not known, ``flags`` say why
    iri_std_m_per_km     (w,) its standard error
    iri_exact_m_per_km   (w,) that of the run's profile; NaN where there is none
    limit_std_m_per_km   (w,) standard error that an estimator would reach which knew everything but the road
    flags                w sets of words
    profile              the road, as far as the readings resolve it, in its parts; it is smoother than the road
    doubts               what may be wrong with the drive's record, a line each
    """

    found: batch.Assessment
    mean_iri_m_per_km: float
    edges_m: Array
    speed_mps: Array
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    iri_exact_m_per_km: Array
    limit_std_m_per_km: Array
    flags: tuple[frozenset[str], ...]
    profile: tuple[Profile, ...]
    doubts: tuple[str, ...] = ()

    title: ClassVar[str] = "Roughness from acceleration"

    def remarks(self, written: Mapping[str, Sequence[Path]]) -> Sequence[str]:
        """The doubts, and that there is no profile, where one was to be written."""
        none = [f"No profile in {path}: no stretch is longer than the longest wavelength that the readings "
                "resolve" for path in written.get("--profile-out", ()) if not self.profile]
        return [*self.doubts, *none]

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the windows as CSV, or the profile, each of its parts as a file of its own."""
        if option == "--out":
            write_text(path, window_lines(self.found), "ascii")
            return
        for number, part in enumerate(self.profile, start=1):
            file = path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")
            write_profile(file, part)
            self._json["profile_files"].append(str(file))

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """Where the profile is."""
        return "\n".join(f"Profile: {file}" for file in self._json["profile_files"])

    def charts(self) -> Sequence[Chart]:
        """The IRI along the way with its standard error, and that of the profile where it is known."""
        at_m = (self.edges_m[1:] + self.edges_m[:-1]) / 2
        known, exact = np.isfinite(self.iri_m_per_km), np.isfinite(self.iri_exact_m_per_km)
        lines = [Line("estimate", at_m[known], self.iri_m_per_km[known], self.iri_std_m_per_km[known])]
        if exact.any():
            lines.append(Line("profile", at_m[exact], self.iri_exact_m_per_km[exact]))
        return [Curves(self.title, "distance [m]", "IRI [m/km]", tuple(lines))] if known.any() else []


@function(EstimateQuestion)
def estimate(question: EstimateQuestion) -> Estimate:
    model = model_of(question.vehicle)
    drive, checked = checked_run(question.run, RecordRules(question.unit, question.resample_hz))
    found = assessed(drive, model, *sensor_of(drive, question.noise_mps2, question.step_mps2), question.window_m,
                     question.warn, question.anyway)
    summary = as_json(str(drive.path), found) | checks_json(checked)
    windows = found.windows
    parts = found.road.parts if found.road else ()
    content = Blocks([Lines(checks_lines(checked)), *blocks(found, summary)])
    return Estimate(content, summary, found, summary.get("iri_m_per_km", np.nan), windows.edges_m,
                    windows.speed_mps, windows.iri_m_per_km, windows.iri_std_m_per_km, found.exact_m_per_km,
                    found.least_error_m_per_km, windows.flags,
                    tuple(Profile(one.start_m, one.spacing_m, one.elevation_m, None) for one in parts),
                    tuple(doubt.words for doubt in checked.doubts))


def sensor_of(run: Run, noise_mps2: float | str | None = None, step_mps2: float | None = None) -> tuple[Sensor, bool]:
    """What a reading is, by what somebody said, or where that is None by the run's facts; and whether its noise is a
    guess and to be learned: where nobody knows it, or ``AUTO`` is said."""
    step_mps2 = (run.facts.step_mps2 or 0.0) if step_mps2 is None else step_mps2
    known_mps2 = run.facts.noise_mps2 if noise_mps2 is None else noise_mps2
    if known_mps2 is None or isinstance(known_mps2, str):
        return Sensor(NOISE_MPS2, step_mps2), True
    return Sensor(float(known_mps2), step_mps2), False


def assessed(run: Run, model: vehicle_file.CarModel, sensor: Sensor, learns_noise: bool, window_m: float,
             warn: Notify = silent, anyway: bool = False) -> batch.Assessment:
    """The road of a run, in windows; where the noise is to be learned, the sensor's is a guess. BadInput ("file:line:
    expected ...") for a drive that cannot be used, and for a profile of another road, unless the user wants to go on
    ``anyway`` (then ``warn`` is called)."""
    if run.excitation is not None:
        raise BadInput(f"{run.path}: expected a drive over a road, found a run that is driven by time")
    road = None if run.profile is None else drive_file.track_of(run.profile)
    try:
        ready = batch.estimable(run.rate_hz, run.accel_z_mps2, run.speed_mps, run.distance_m, bounds.SPEED.largest)
    except batch.Unusable as error:
        raise BadInput(f"{run.file}{'' if error.sample is None else f':{error.sample + 2}'}: {error}") from None
    if road is not None:
        _check_road(run, ready.distance_m, road, model, warn, anyway)
    with as_bad_input(model.vehicle.name):
        return batch.assess(ready, model.vehicle, sensor, window_m, road, learns_noise, model.effects, model.errors)


def _check_road(run: Run, distance_m: Array, road: Track, model: vehicle_file.CarModel, warn: Notify,
                anyway: bool) -> None:
    """Raise BadInput where a profile that an estimate is compared with is of another road. Effects of the model are
    left out: whether it is the road can be decided without them, and some take long."""
    from logger.api.lab.checks import check_roads  # loads the lab

    if len(distance_m) > SKIP_S * run.rate_hz + 2:
        record = Record(str(run.path), run.rate_hz, run.accel_z_mps2, distance_m, run.speed_mps, road)
        check_roads(model.vehicle.name, replace(model, effects=()), SimulatedRuns([record]), warn, anyway)


_FAR_ABOVE = 1.5
_G_NEAR, _G_CALM_MPS2 = 0.1, 0.5


# --- for programs ---


def as_json(run: str, found: batch.Assessment) -> dict[str, Any]:
    """Settings, the run as a whole, per class of speed, per window; null for what is not known.

    run    as the user knows it
    """
    drive, windows, road = found.drive, found.windows, found.road
    return {
        "run": run, "vehicle": found.vehicle.name, "rate_hz": drive.rate_hz,
        "noise_mps2": found.sensor.noise_rms_mps2,
        "noise_std_mps2": None if found.noise is None else found.noise.std_mps2,
        "noise_learned": (found.noise is not None) if found.learns_noise else None,
        "step_mps2": found.sensor.step_mps2, "window_m": found.window_m,
        "distance_start_m": float(drive.distance_m[0]), "distance_end_m": float(drive.distance_m[-1]),
        "distance_moved_m": drive.moved_m, "compared": found.compared,
        **({"road_effects": list(found.road_effects)} if found.road_effects else {}),
        **batch.figures(found, windows.speed_mps > 0),
        "unanswered": dict(Counter("|".join(sorted(flags)) for flags in windows.flags if flags)),
        "shortest_wavelength_m": road.shortest_m if road else None,
        "longest_wavelength_m": road.longest_m if road else None,
        "profile_files": [],
        "speeds": [{"from_mps": low, "to_mps": low + batch.SPEED_CLASS_MPS, **batch.figures(found, which)}
                   for low, which in batch.speed_classes(windows)],
        "windows": list(_rows(found)),
    }


def _rows(found: batch.Assessment) -> Iterator[dict[str, Any]]:
    windows = found.windows
    columns = {
        "distance_start_m": windows.edges_m[:-1], "distance_end_m": windows.edges_m[1:],
        "speed_mps": windows.speed_mps, "iri_m_per_km": windows.iri_m_per_km,
        "iri_std_m_per_km": windows.iri_std_m_per_km, "resolved_share": windows.resolved,
        "limit_std_m_per_km": found.least_error_m_per_km,
    } | ({"iri_exact_m_per_km": found.exact_m_per_km} if found.compared else {})
    for *values, flags in zip(*(column.tolist() for column in columns.values()), windows.flags, strict=True):
        row = {name: known(value) for name, value in zip(columns, values, strict=True)}
        yield row | {"flags": sorted(flags)}


def window_lines(found: batch.Assessment) -> Iterator[str]:
    """The windows as CSV."""
    for number, row in enumerate(_rows(found)):
        if number == 0:
            yield ",".join(row) + "\n"
        *values, flags = row.values()
        yield ",".join("" if value is None else f"{value:.7g}" for value in values) + f",{'|'.join(flags)}\n"


# --- for a person ---


def blocks(found: batch.Assessment, summary: dict[str, Any]) -> Iterator[Block]:
    """What a person sees; ``summary``: the same as JSON."""
    way_m = summary["distance_end_m"] - summary["distance_start_m"]
    details = [
        f"{summary['run']}: {way_m:.0f} m in a {summary['vehicle']}, "
        f"{len(found.drive.distance_m) / summary['rate_hz']:.0f} s at {summary['rate_hz']:.5g} Hz; windows of "
        f"{summary['window_m']:.4g} m",
        *_sensor_lines(summary),
    ]
    if summary["distance_moved_m"]:
        details.append("The distance ran backwards in places; estimate recomputed it from the speed, which moved it by "
                       f"up to {summary['distance_moved_m']:.2f} m.")
    if found.road_effects:
        details.append(f"Compared with the profile as changed by {' and '.join(found.road_effects)} in the vehicle's "
                       "file.")
    doubts = [hint] if (hint := _unit_hint(found)) else []
    if not summary["answered_count"]:
        yield Lines([f"No IRI: {_unanswered(summary) or 'the drive is shorter than one window'}", *doubts, *details])
        return
    limit = summary["limit"]
    limits = [
        "The limit (if road, car and noise were known exactly): standard error "
        f"{limit['std_m_per_km']:.2f} m/km at {summary['speed_mps']:.0f} m/s; R2 {limit['r2_iri_1_to_10']:.3f} over "
        f"roads of IRI {LEVELS_IRI[0]:g} to {LEVELS_IRI[-1]:g}, {limit['r2_this_road']:.3f} on a road like this one.",
        "Wavelengths resolved: " + _range_words(found),
    ]
    if (factor := summary["iri_std_m_per_km"] / limit["std_m_per_km"]) > _FAR_ABOVE:
        limits.append(f"The standard errors are {factor:.1f} times that limit: they include a few percent of error in "
                       "the vehicle file, and readings that vehicle and noise do not explain.")
    answer = (f"IRI {summary['iri_m_per_km']:.2f} m/km on average, {summary['iri_min_m_per_km']:.2f} to "
              f"{summary['iri_max_m_per_km']:.2f}; standard error of one window {summary['iri_std_m_per_km']:.2f}; "
              f"{summary['answered_count']} of {summary['window_count']} windows"
              + (f" ({_unanswered(summary)})" if summary["unanswered"] else "") + ".")
    yield Lines([answer, *doubts])
    yield from _table(summary)
    yield Lines(limits)
    yield Lines(details)


def _sensor_lines(summary: dict[str, Any]) -> list[str]:
    """What a reading is, and whether that was learned or given."""
    noise, std = summary["noise_mps2"], summary["noise_std_mps2"]
    rounded = f"rounded to {summary['step_mps2']:g} m/s2 (--step)" if summary["step_mps2"] else "not rounded (--step)"
    if summary["noise_learned"] is False:
        return [f"This drive does not show the sensor's noise. Assumed: {noise:g} m/s2 in a reading, {rounded}"]
    if std is None:
        return [f"Assumed: noise of {noise:g} m/s2 in a reading (--noise), {rounded}"]
    shown = (f"noise of {noise:.3g} ± {std:.1g} m/s2 in a reading" if std < WEAKEST * noise else
             f"noise of about {noise:.2g} m/s2 or less in a reading; this drive cannot resolve it")
    return [f"Learned from the drive: {shown}", f"Assumed: {rounded}"]


def _unit_hint(found: batch.Assessment) -> str:
    """What makes one doubt that the readings on the way are in m/s2; empty if nothing does."""
    drive = found.drive
    moving = np.diff(drive.distance_m, prepend=drive.distance_m[0]) * drive.rate_hz > SLOWEST_MPS
    if not moving.any():
        return ""
    mean, rms = float(drive.accel_z_mps2[moving].mean()), float(drive.accel_z_mps2[moving].std())
    if abs(abs(mean) - 1) < _G_NEAR and rms < _G_CALM_MPS2:
        return f"Acceleration in g? While driving it is {mean:.2f} on average and {rms:.3g} r.m.s. about it."
    noise_mps2 = NOISE_MPS2 if found.learns_noise else found.sensor.noise_rms_mps2
    if rms < noise_mps2:
        return (f"Acceleration in g? While driving it is {rms:.3g} r.m.s., less than the noise of "
                f"{noise_mps2:g} {'that sensors have' if found.learns_noise else '(--noise)'}.")
    return ""


def _unanswered(summary: dict[str, Any]) -> str:
    return ", ".join(f"{count} {flags.replace('|', ' and ')}" for flags, count in summary["unanswered"].items())


def _range_words(found: batch.Assessment) -> str:
    road = found.road
    if road is None:
        return f"none over {batch.RESOLVED_SHARE:.0%} of the drive."
    left_out = f"; {road.left_out_m:.0f} m in short stretches are left out" if road.left_out_m else ""
    return (f"{road.shortest_m:.2g} to {road.longest_m:.3g} m (over {batch.RESOLVED_SHARE:.0%} of the drive); "
            f"the profile holds no others{left_out}.")


def _table(summary: dict[str, Any]) -> Iterator[Block]:
    """Per class of speed: the estimates, then the comparison where there is one."""
    rows = []
    total = [{"from_mps": None, **summary}] if len(summary["speeds"]) > 1 else []
    for row in [*summary["speeds"], *total]:
        iri, beside = ("",) * 3, ("",) * 5
        if row["answered_count"]:
            iri = (f"{row['iri_m_per_km']:.2f}", f"{row['iri_std_m_per_km']:.3f}",
                   f"{row['limit']['std_m_per_km']:.3f}")
        if found := row.get("comparison"):
            beside = (f"{found['r2']:.3f}", f"{found['limit_r2']:.3f}", f"{found['bias']:+.1%}",
                      f"{found['within_one']:.2f}", f"{found['within_two']:.2f}")
        name = "all" if row["from_mps"] is None else f"{row['from_mps']:.0f} to {row['to_mps']:.0f}"
        rows.append((name, f"{row['window_count']}", f"{row['answered_count']}", *iri, *beside))
    yield Table(("m/s", "windows", "with IRI", "IRI", "std. error", "limit", "R2", "limit", "bias", "in 1", "in 2"),
                rows)
    if "comparison" in summary:
        yield Hint("R2 against the profile; in 1, in 2: share of windows within one and two standard errors (ideal: "
                   "0.68, 0.95).")


# --- simulated drives ---

WHEELS = {1: ("front",), 2: ("front", "rear"), 4: ("front_left", "front_right", "rear_left", "rear_right")}
OUTPUTS = ("wheels", "travel", "tires", "displacement", "velocity", "body")


@function(SimulateQuestion)
def simulate(question: SimulateQuestion) -> Run:
    return simulation(question).run


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


def simulation(question: SimulateQuestion) -> Simulation:
    """The answer to ``SimulateQuestion``, which says what is raised."""
    model, effects, said = _model(question)
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
    with as_bad_input():
        motion = _motion(question, car, track)
    with as_bad_input(car.vehicle.name):
        columns = _columns(question, car, track, motion, outputs)
    run = _run(question, columns, track)
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
    speed = question.speed_mps
    if isinstance(track, Excitation):
        return virtual_drive.standing(track, question.rate_hz)
    if isinstance(speed, tuple | list):
        times_s, speeds_mps = speed
        knots = _knots(times_s, speeds_mps, question.name)
    elif isinstance(speed, Path):
        knots = drive_file.read_speeds(speed)
    else:
        assert speed is not None    # this is no rig
        knots = virtual_drive.at_one_speed(track, float(car.structure.behind_m.max()), speed)
    return virtual_drive.motion_along(*knots, track.start_m, question.rate_hz)


def _run(question: SimulateQuestion, columns: Mapping[str, Array], track: Track | Excitation) -> Run:
    time_s, accel, speed_mps, distance_m = (columns[name] for name in (drive_file.TIME, *drive_file.COLUMNS[1:]))
    profile, excitation = ((None, track.begun(float(time_s[0]))) if isinstance(track, Excitation) else
                           (profile_of(track), None))
    more = {name: one for name, one in columns.items() if name not in (drive_file.TIME, *drive_file.COLUMNS)}
    return Run(Path(question.name), question.rate_hz, time_s, accel, speed_mps, distance_m, None, None, profile,
               excitation, more=more)


def _obstacles(question: SimulateQuestion) -> list[virtual_drive.Obstacle]:
    given = question.obstacles or {}
    if isinstance(given, Mapping):
        return [virtual_drive.Obstacle(kind, values, f"obstacle {kind}") for kind, values in given.items()]
    return [virtual_drive.Obstacle(*named_numbers(text, "--obstacle"), f"--obstacle {text}") for text in given]


def _knots(time_s: npt.ArrayLike, speed_mps: npt.ArrayLike, name: str) -> tuple[Array, Array]:
    times, speeds = (np.asarray(one, dtype=np.float64) for one in (time_s, speed_mps))
    grows, possible = (np.diff(times) > 0).all(), ((speeds >= 0) & (speeds <= 100)).all()
    if not 1 < len(times) == len(speeds) or not (grows and possible):
        raise BadInput(f"{name}: expected two or more increasing times, and as many speeds of 0 to 100 m/s")
    return times, speeds


def profile_of(track: Track) -> Profile:
    """A road as the profile that a person reads."""
    tracks = track.elevation_m.reshape(len(track.elevation_m), -1).T
    return Profile(track.start_m, track.spacing_m, tracks[0], tracks[1] if len(tracks) > 1 else None)


def _model(question: SimulateQuestion) -> tuple[CarModel, tuple[Chosen, ...], dict[str, str]]:
    """The vehicle, its effects and those that are asked for, and where each was said, by name."""
    model = model_of(question.vehicle)
    name = str(question.vehicle) if isinstance(question.vehicle, Path | str) else model.vehicle.name
    effects, asked = model.effects, dict[str, str]()
    for text in question.effects:
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


def _road(question: SimulateQuestion) -> tuple[Track, str]:
    """The road with its obstacles, and what makes one doubt it. BadInput for files and obstacles that are wrong."""
    given = question.profile
    assert given is not None    # this is no rig
    if isinstance(given, int | float):
        track, doubt = Track(float(given), np.zeros(2)), ""
    else:
        profile = given if isinstance(given, profile_file.Wheelpaths) else read_profile(given)
        track, doubt = drive_file.track_of(profile), doubt_of(profile.elevation_m, profile.spacing_m)
    with as_bad_input():
        return virtual_drive.with_obstacles(track, _obstacles(question)), doubt
