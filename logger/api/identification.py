"""Vehicle parameters, and those of effects and roads, from drives: a grey-box prediction-error fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from logger.api.bench import silent, slow_words
from logger.api.drives import Run, read_run
from logger.api.model_checks import check_roads
from logger.api.ranges import NOISE_MODELS, TRIES, WAVINESS
from logger.api.shown import CommandResult
from logger.api.vehicles import Model, model_of
from logger.errors import BadInput
from logger.left_out import LeftOut, left_out_json, left_out_paragraph
from logger.runs import SKIP_S, runs_left_out
from logger.runs import Run as Record
from logger.store.formats import vehicle_file

if TYPE_CHECKING:
    from logger.identification.drive_model import DriveModel
    from logger.identification.prediction_error_fit import Fit, FitOptions
    from logger.identification.unknown_inputs import RoadInput
    from logger.identification.unknown_road.fisher_scoring import RoadFit
    from logger.identification.unknown_road.road_state import Options as RoadOptions
    from logger.profiles.excitation import Excitation
    from logger.profiles.track import Track
    from logger.store.formats.drive_file import Drive
    from logger.vehicle.named_parameters import Free
    from logger.vehicle.uncertain import NumberErrors

Array = npt.NDArray[np.float64]

USUAL_WAVINESS = 2.0
_FREE_WAVINESS = "road.waviness"
# By how much the distances of two drives over one road may disagree.
_PLACES_OFF_M, _SCALE_OFF = 10.0, 0.01
_OBSTACLES = {"bump": ("height_m", "width_m"), "step": ("height_m",)}


@dataclass(frozen=True)
class Question:
    """What is to be found, and how.

    free            names, as of ``identify``
    start, bounds   where numbers start and stay, by name
    obstacles       on the road: numbers [m] of a ``bump`` or a ``step``; without ``start_m`` it is looked for
    noise           what the model leaves: one of ``NOISE_MODELS``
    low_pass_hz     what lies above is left out [Hz]; None: nothing is
    robust          single wild readings count less
    tries           further starts
    waviness        of roads that were not measured
    anyway          go on where a run does not seem to be of its road
    said            how an option is written in a complaint
    """

    free: Sequence[str]
    start: Mapping[str, float] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    obstacles: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    noise: str = "auto"
    low_pass_hz: float | None = None
    robust: bool = False
    tries: int = 0
    waviness: float = USUAL_WAVINESS
    anyway: bool = False
    said: str = "{}"

    def wrong(self, option: str, words: str) -> BadInput:
        """The complaint about an option."""
        return BadInput(f"{self.said.format(option)}{words}")


@dataclass(frozen=True, eq=False)
class FittedNumbers:
    """A fit, the model with its numbers, the object for a program, and the lines for a person."""

    fit: Fit | RoadFit
    model: vehicle_file.Model
    as_json: dict[str, Any]
    lines: list[str]


@dataclass(frozen=True, eq=False, repr=False)
class Identification(CommandResult):
    """Numbers that were found.

    parameters        by name; ``standard_errors`` likewise
    error_before      rms(measured - model) / rms(measured) with every free number where it started
    error_after       with those found
    converged         whether the fit came to rest; if not, do not use the numbers
    cannot_tell       sentences that stand between the numbers and their being believed; empty: none
    model             with the numbers
    """

    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    error_before: float
    error_after: float
    converged: bool
    cannot_tell: tuple[str, ...]
    model: Model


def identify(
    vehicle: Model | Path | str, runs: Run | Path | str | Sequence[Run | Path | str], free: Sequence[str], *,
    start: Mapping[str, float] | None = None, bounds: Mapping[str, tuple[float, float]] | None = None,
    obstacles: Mapping[str, Mapping[str, float]] | None = None, noise: str = "auto", low_pass_hz: float | None = None,
    robust: bool = False, tries: int = 0, skip_s: float = SKIP_S, road: str = "measured",
    waviness: float = USUAL_WAVINESS, anyway: bool = False,
) -> Identification:
    """Find numbers of a vehicle, of its effects, and of what is not known of the road, each with its standard error.

    vehicle       as in ``read_vehicle``; what is not free stays as it says
    runs          of one sample rate, with their profiles unless ``obstacles`` or ``road`` say otherwise; what their
                  run.yaml says of steps, samples and places is used (``lab.readings_fit``)
    free          names as in the vehicle's file (``sprung_mass_kg``, ``front.suspension_damping_n_s_per_m``; ``both.``
                  for the two axles together), ``dry_friction.friction_force_n`` of an effect that the vehicle has,
                  ``bump.height_m``, ``step.start_m``, ``speed_scale`` of the road; ``run2.`` before them for one run
    start         where numbers start, by name; ``bounds`` where they stay
    obstacles     ``{"bump": {"height_m": 0.1, "width_m": 3.0}}`` (Eq 4.41 of Blum 2015) or a step lies on the road [m];
                  without ``start_m`` it is looked for
    noise         what the model leaves: white (output error), ar (innovations form), road (roughness that the profile
                  does not contain, through the car), or auto, the likeliest
    low_pass_hz   what lies above is left out [Hz], and what lies above the ``pass_band_hz`` of a run's run.yaml;
                  ``skip_s`` the beginning of each run [s]
    robust        let single wild readings count less (Huber's loss); ``tries`` so many further starts
    road          "measured" (``anyway``: go on where a run does not seem to be of its road); "unmeasured": each run has
                  a road of its own, of ``waviness``; or "same": all are over one

    Raises BadInput for what does not fit together, ``NotIdentifiable`` for numbers that the runs do not determine.
    Source: L. Ljung, System Identification (1999), chapters 7 and 9.

    >>> true = car.with_numbers({"sprung_mass_kg": 900.0})
    >>> drive = simulate(true, random_road(iso_class="C", length_m=150.0), 12.0, noise_mps2=0.03)
    >>> found = identify(car, drive, ["sprung_mass_kg"])
    >>> abs(found.parameters["sprung_mass_kg"] - 900.0) < 4 * found.standard_errors["sprung_mass_kg"], found.converged
    (True, True)
    """
    for name, word, known in (("road", road, ("measured", "unmeasured", "same")), ("noise", noise, NOISE_MODELS)):
        if word not in known:
            raise BadInput(f"{name} {word}: expected one of {', '.join(known)}")
    TRIES.check("tries", tries)
    WAVINESS.check("waviness", waviness)
    model = model_of(vehicle)
    word = str(vehicle) if isinstance(vehicle, Path | str) else model.vehicle.name
    given = [runs] if isinstance(runs, Run | Path | str) else runs
    if not (drives := [one if isinstance(one, Run) else read_run(one) for one in given]):
        raise BadInput("identify: expected a run, found none")
    question = Question(free, start or {}, bounds or {}, obstacles or {}, noise, low_pass_hz, robust, tries, waviness,
                        anyway)
    flat_will_do = bool(obstacles) or road != "measured"
    if bare := [drive for drive in drives if drive.track is None and not flat_will_do]:
        raise BadInput(f"{bare[0].path}: expected a run with the profile that it was driven on")
    records = records_of([(drive, drive.track) for drive in drives], skip_s, question)
    if road == "measured":
        question = narrowed(question, drives)
    found = (on_measured_roads(model, word, records, question) if road == "measured" else
             on_unmeasured_roads(model, word, records, question, one_road=road == "same"))
    summary = found.as_json
    return Identification("\n".join(found.lines), summary, summary["parameters"], summary["standard_errors"],
                          summary["error_before"], summary["error_after"], summary["converged"],
                          tuple(summary["cannot_tell"]), model_of(found.model))


def narrowed(question: Question, drives: Sequence[Drive]) -> Question:
    """The question without what lies above the pass band of a drive (``run.yaml``), as ``low_pass_hz`` asks for it."""
    bands = [(drive.facts.pass_band_hz, drive.rate_hz) for drive in drives]
    ends_hz = [question.low_pass_hz, *(band[1] for band, rate_hz in bands if band and band[1] < rate_hz / 2)]
    return replace(question, low_pass_hz=min((one for one in ends_hz if one is not None), default=None))


def records_of(drives: Sequence[tuple[Drive, Track | Excitation | None]], skip_s: float,
               question: Question) -> list[Record]:
    """Drives with their roads, or on a flat one. BadInput for one too short, or that cannot be what it says, and for
    rates that differ."""
    from logger.identification.session import LEAST_SAMPLES, UnusableRun, check_records, off_rate
    from logger.profiles.track import Track

    records = []
    for drive, track in drives:
        lasts_s = len(drive.time_s) / drive.rate_hz
        if not 0 <= skip_s < lasts_s - LEAST_SAMPLES / drive.rate_hz:
            raise BadInput(f"{drive.path}: expected at least {LEAST_SAMPLES} samples after the first {skip_s:g} s, "
                           f"which are left out ({question.said.format('skip')}), found {lasts_s:g} s in all")
        records.append(Record(str(drive.path), drive.rate_hz, drive.accel_z_mps2, drive.distance_m, drive.speed_mps,
                              Track(1.0, np.zeros(2)) if track is None else track, skip_s, drive.facts, drive.marks()))
    try:
        check_records(records)
    except UnusableRun as error:
        raise BadInput(f"{records[error.run].name}: {error}") from None
    rates_hz = [record.rate_hz for record in records]
    if (run := off_rate(rates_hz)) is not None:
        raise BadInput(f"{records[run].name}: expected {rates_hz[0]:g} samples a second as in {records[0].name}, found "
                       f"{rates_hz[run]:g}")
    return records


# --- roads that are known, but for a few numbers ---


def on_measured_roads(given: vehicle_file.Model, word: str, records: list[Record], question: Question,
                      warn: Callable[[str], None] = silent) -> FittedNumbers:
    """The fit over roads that are known, but for a few numbers. BadInput and ``NotIdentifiable`` as ``identify``.

    word    by which the user knows the vehicle
    warn    called where it will take long
    """
    from logger.identification.identifiability import NotIdentifiable
    from logger.identification.session import UnusableRun, error_before
    from logger.identification.shared_road_covariance import with_common_roughness
    from logger.lab.readings_fit import fit_to_readings
    from logger.report.identification_text import as_json, common_words, lines, record_json, record_words, tests
    from logger.simulation.simulated_runs import SimulatedRuns

    _check_effects(given, word, records, question, warn)
    _check_rigs(records, question)
    if not question.obstacles:
        check_roads(word, given, SimulatedRuns(records), warn, question.anyway)
    road, unplaced = _road(question)

    def model_of_records(of: list[Record]) -> DriveModel:
        return _drive_model(given, of, road, unplaced, question)

    try:
        found = fit_to_readings(model_of_records, records, lambda one: _options(one, question))
    except UnusableRun as error:
        raise BadInput(f"{records[error.run].name}: {error}") from None
    except ValueError as error:
        raise BadInput(f"{records[0].name}: {error}") from None
    except NotIdentifiable as refusal:
        raise NotIdentifiable(refusal.findings, error_before(model_of_records(records))) from None
    model, checks = found.model, tests(found.model, found.fit)
    fit = (common := with_common_roughness(model, found.fit)).fit
    low = "" if fit.low_pass.cutoff_hz is None else f", below {fit.low_pass.cutoff_hz:g} Hz"
    return FittedNumbers(
        fit, _fitted(given, model, fit),
        as_json(fit, *checks) | record_json(found, common, records) | left_out_json(runs_left_out(records)),
        [_head(given, len(fit.free), records, low), *lines(fit, *checks), *common_words(model, common),
         *record_words(found), *left_out_paragraph(_beside_beginnings(records))])


def _beside_beginnings(records: Sequence[Record]) -> tuple[LeftOut, ...]:
    """What is left out, but the beginnings, which the first line says."""
    return runs_left_out([replace(one, skip_s=0.0) for one in records])


def _check_effects(given: vehicle_file.Model, word: str, records: Sequence[Record], question: Question,
                   warn: Callable[[str], None]) -> None:
    """Raise BadInput for an effect that cannot be there on these roads, or one that is to be found and is not there."""
    from logger.store.formats.effect_file import check_on, shipped_effects

    for one in given.effects:
        check_on(given.vehicle, one, all(record.two_tracks for record in records),
                 all(record.timed for record in records))
    if words := slow_words([one.effect for one in given.effects]):
        warn(words)
    there = [one.effect.name for one in given.effects]
    for name in question.free:
        effect = name.partition(".")[0]
        if "." in name and effect in shipped_effects() and effect not in there:
            raise question.wrong("free", (
                f" {name}: expected an effect that is in the vehicle's file, {word} has {', '.join(there) or 'none'}; "
                f"add it with 'ridelog add-effect {effect} --vehicle {word} --out FILE RUN...', or write it under "
                "'effects' in the file"))


def _check_rigs(records: Sequence[Record], question: Question) -> None:
    """Raise BadInput for what asks for a road, or a speed, of a rig."""
    from logger.identification.unknown_inputs import is_input

    rig = next((record.name for record in records if record.timed), None)
    if rig is None:
        return
    if asked := [name for name in question.free if is_input(name)] + list(question.obstacles):
        raise BadInput(f"{rig}: expected a road for {asked[0]}; the run is driven by time")
    if question.noise == "road":
        raise question.wrong("noise", f" road: expected white, ar or auto; {rig} is driven by time, on no road")


def _road(question: Question) -> tuple[RoadInput, list[str]]:
    """What lies on the road, and the names of what has no start yet. BadInput for what is no bump or step."""
    from logger.identification.obstacle_paths import Bump, RoadStep
    from logger.identification.unknown_inputs import RoadInput

    kinds, found = {"bump": Bump, "step": RoadStep}, dict[str, Any]()
    for name, numbers in question.obstacles.items():
        if name not in kinds:
            raise BadInput(f"obstacle {name}: expected {' or '.join(kinds)}")
        needed, said = _OBSTACLES[name], ",".join(f"{key}={value:g}" for key, value in numbers.items())
        if not set(needed) <= set(numbers) <= {"start_m", *needed}:
            raise question.wrong(name, f" {said}: expected [start_m=M,]{','.join(f'{one}=M' for one in needed)}")
        try:
            found[name] = kinds[name](**{"start_m": 0.0, **numbers})
        except ValueError as error:
            raise question.wrong(name, f" {said}: {error}") from None
    return RoadInput(**found), [name for name, numbers in question.obstacles.items() if "start_m" not in numbers]


def _drive_model(given: vehicle_file.Model, records: list[Record], road: RoadInput, unplaced: list[str],
                 question: Question) -> DriveModel:
    from logger.identification.session import drive_model, obstacle_starts

    try:
        starts = obstacle_starts(given.vehicle, records, road, unplaced)
    except ValueError as error:
        raise question.wrong("", str(error)) from None
    parameters = _free(given, road, starts, len(records), question)
    try:
        return drive_model(given.vehicle, given.effects, parameters, records, road)
    except ValueError as error:
        raise question.wrong("free", f": {error}") from None


def _free(given: vehicle_file.Model, road: RoadInput, found: Mapping[str, float], runs: int,
          question: Question) -> list[Free]:
    """The free numbers; where an obstacle's start was found and not named, it is one of them. BadInput for names,
    starts and bounds that do not fit."""
    from logger.identification.unknown_inputs import EACH, expanded, is_input, run_and_name

    if cars := [name for name in question.free if name.startswith(f"{EACH}.") and not is_input(name)]:
        raise question.wrong("free", f" {cars[0]}: expected a number of the road after {EACH}., as all runs have one "
                                     "car")
    names = [one for name in question.free for one in expanded(name, runs)]
    if not names or len(set(names)) < len(names):
        raise question.wrong("free", f" {','.join(question.free)}: expected names with commas between them, each once")
    named = {run_and_name(name)[1] for name in names}
    names += [name for name in found if run_and_name(name)[1] not in named]
    start = {one: value for name, value in question.start.items() for one in expanded(name, runs)}
    between = {one: ends for name, ends in question.bounds.items() for one in expanded(name, runs)}
    for option, said in (("start", set(start)), ("bounds", set(between))):
        if unknown := said - set(names):
            raise question.wrong(option, f" {sorted(unknown)[0]}: expected one of what is free ({', '.join(names)})")
    first = {run_and_name(name)[1]: place for name, place in reversed(list(found.items()))}
    start = {**first, **found, **start}
    try:
        return [_free_number(given, road, name, start.get(name), between.get(name)) for name in names]
    except ValueError as error:
        raise question.wrong("free", f": {error}") from None


def _free_number(given: vehicle_file.Model, road: RoadInput, name: str, start: float | None,
                 between: tuple[float, float] | None) -> Free:
    """A number of the road, of an effect or of the car. ValueError for one that none of them has."""
    from logger.identification.unknown_inputs import free_input, is_input
    from logger.vehicle.effect_parameters import free_number, free_parameter_named
    from logger.vehicle.named_parameters import free

    if is_input(name):
        return free_input(road, name, start, between)
    if (move := free_parameter_named(given.effects, name)) is not None:
        return free_number(given.effects, move, start, between)
    return free(given.vehicle, name, start, between)


def _options(model: DriveModel, question: Question) -> FitOptions:
    from logger.identification.session import fit_options

    half_hz, low_pass_hz = model.records[0].rate_hz / 2, question.low_pass_hz
    if low_pass_hz is not None and not 0 < low_pass_hz < half_hz:
        raise question.wrong("low-pass", f" {low_pass_hz:g}: expected above 0 and below {half_hz:g} Hz")
    return fit_options(model, question.noise, low_pass_hz, question.robust, question.tries)


def _fitted(given: vehicle_file.Model, model: DriveModel, fit: Fit) -> vehicle_file.Model:
    """The model with the numbers that were found and their standard errors, those of its effects with them too."""
    values = np.array(list(fit.parameters.values()))
    effects = []
    for one in model.effects_with(values):
        errors = {name.partition(".")[2]: error for name, error in fit.standard_errors.items()
                  if name.partition(".")[0] == one.effect.name and name.partition(".")[2] in one.values}
        effects.append(replace(one, standard_errors={**one.standard_errors, **errors}))
    return replace(given, vehicle=model.vehicle_with(values), effects=tuple(effects),
                   errors=_errors(list(fit.parameters), fit.covariance))


def _errors(found: Sequence[str], covariance: Array) -> NumberErrors:
    """How far the numbers of car and effects may be off, without those of the road."""
    from logger.identification.unknown_inputs import is_input
    from logger.vehicle.uncertain import NumberErrors

    kept = [place for place, name in enumerate(found) if not is_input(name)]
    return NumberErrors.of_covariance([found[place] for place in kept], covariance[np.ix_(kept, kept)])


# --- roads of which only the kind is known ---


def on_unmeasured_roads(given: vehicle_file.Model, word: str, records: list[Record], question: Question,
                        one_road: bool) -> FittedNumbers:
    """The fit over roads that were not measured: one for all runs, or one for each. BadInput and ``NotIdentifiable`` as
    ``identify``."""
    from logger.identification.session import UnusableRun, drives_of
    from logger.identification.unknown_inputs import RoadInput
    from logger.identification.unknown_road.road_fit import fit_roads
    from logger.report.unknown_road_text import as_json, lines
    from logger.vehicle.frequency_response import AxleResponse

    options, question = _road_options(question)
    if given.effects:
        raise BadInput(f"{word}: expected a car without effects where the road was not measured, found "
                       f"{', '.join(one.effect.name for one in given.effects)}")
    try:
        drives = drives_of(records)
    except UnusableRun as error:
        raise BadInput(f"{records[error.run].name}: {error}") from None
    parameters = _free(given, RoadInput(), {}, len(records), question)
    try:
        car = AxleResponse(given.vehicle, parameters, drives[0].rate_hz)
    except ValueError as error:
        raise question.wrong("free", f": {error}") from None
    fit = fit_roads(car, [drives] if one_road else [[drive] for drive in drives], options)
    where = "one road that was not measured" if one_road else "roads that were not measured"
    return FittedNumbers(
        fit, vehicle_file.Model(car.vehicle_with(np.array(list(fit.parameters.values()))),
                                errors=_road_fit_errors(fit)),
        {**as_json(fit, parameters), "runs": [record.name for record in records],
         **left_out_json(runs_left_out(records))},
        [_head(given, len(parameters), records, f"; over {where}", ","), *lines(fit, parameters),
         *left_out_paragraph(_beside_beginnings(records))])


def _road_fit_errors(fit: RoadFit) -> NumberErrors:
    """Of the car's numbers, whose covariance holds shares of sizes."""
    from logger.vehicle.uncertain import NumberErrors

    kept = [fit.names.index(name) for name in fit.parameters]
    relative = fit.covariance[np.ix_(kept, kept)]
    errors = np.array([fit.standard_errors[name] for name in fit.parameters])
    units = errors / np.sqrt(np.maximum(np.diag(relative), 1e-300))
    return NumberErrors.of_covariance(list(fit.parameters), relative * np.outer(units, units))


def _road_options(question: Question) -> tuple[RoadOptions, Question]:
    """How to fit, and the question without what is not the car's. BadInput for what needs a known road."""
    from logger.identification.unknown_road.road_state import Options

    unused = {**dict.fromkeys(question.obstacles, True), "low-pass": question.low_pass_hz, "robust": question.robust,
              "tries": question.tries, "noise": question.noise != "auto"}
    if given := [option for option, value in unused.items() if value]:
        raise question.wrong(given[0], f": expected a road whose profile is known, not "
                                       f"{question.said.format('unmeasured-road')} or "
                                       f"{question.said.format('same-road')}")
    names = [name for name in question.free if name != _FREE_WAVINESS]
    return (Options(waviness=question.waviness, free_waviness=_FREE_WAVINESS in question.free,
                    place_off_m=_PLACES_OFF_M, scale_off=_SCALE_OFF), replace(question, free=names))


def _head(given: vehicle_file.Model, free: int, records: Sequence[Record], more: str, stop: str = ";") -> str:
    vehicle, runs = given.vehicle, "1 run" if len(records) == 1 else f"{len(records)} runs"
    return (f"{vehicle.name} ({vehicle.model.replace('_', ' ')}): {free} free, {runs}, "
            f"{sum(len(one.kept_mps2) for one in records)} samples at {records[0].rate_hz:.5g} Hz{more}{stop} the "
            f"first {records[0].skip_s:g} s of a run left out")
