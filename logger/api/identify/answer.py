"""Vehicle parameters, and those of effects and roads, from drives: a grey-box prediction-error fit.

The answer, and a fit on measured roads or without one in plain words and for a program: what was found, how sure it is,
whether to believe it; as pictures its residuals, and which numbers can be estimated only together.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from logger.api.identify.question import MEASURED, SAME, IdentifyQuestion
from logger.api.inputs import Model, Run, check_forces, model_of, read_run, run_on_road
from logger.api.lab.bench import slow_words, word_of
from logger.api.lab.checks import (
    check_channels,
    check_rate,
    check_readings,
    check_roads,
    from_rest,
    moves_freely,
    of_rates,
    with_initial_values,
)
from logger.api.shared_fields import each, paths_of
from logger.api.shown import CommandResult
from logger.bounds import UNUSUAL_SIGMA
from logger.chart_data import Array, Bars, Chart, Curves, Line
from logger.dsp.filters import DecimatingLowPass
from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput, CheckFailed, as_bad_input
from logger.fitting.fisher_scoring import correlation_of
from logger.identification import noise_models
from logger.identification.drive_model import DriveModel
from logger.identification.identifiability import NotIdentifiable
from logger.identification.prediction_error_fit import Fit, FitOptions, least_share
from logger.identification.session import LEAST_SAMPLES, drives_of, error_before, fit_options, obstacle_starts
from logger.identification.shared_road_covariance import CommonRoughness, may_have_common, with_common_roughness
from logger.identification.unknown_inputs import EACH, KINDS, RoadInput, expanded, free_input, is_input, run_and_name
from logger.identification.unknown_road.marginal_likelihood import GD_N0, NOISE, OFFSET, Options
from logger.identification.unknown_road.road_fit import RoadFit, fit_roads
from logger.lab.readings_fit import ReadingsFit, fit_to_readings
from logger.left_out import left_out_json, left_out_lines
from logger.profiles.track import Track
from logger.question import function
from logger.report.blocks import SHOWN_ROWS, Blocks, Lines, Table
from logger.report.quantities import WIDTH, measured, unit_of
from logger.report.quantities import known as known_number
from logger.roads.iso8608 import STANDARD_WAVINESS
from logger.runs import Past, no_readings, past_of, runs_left_out, zero_is_known
from logger.runs import Run as Record
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats import vehicle_file
from logger.store.formats.drive_file import RUN
from logger.store.formats.effect_file import check_on, shipped_effects
from logger.vehicle.linear_car import AxleResponse
from logger.vehicle.named_parameters import (
    AXLES,
    BOTH,
    PRELOAD,
    Coordinates,
    Free,
    free,
    free_number,
    free_parameter_named,
)
from logger.vehicle.uncertain import UNKNOWN, Known, NumberErrors

_FREE_WAVINESS = "road.waviness"
# By how much the distances of two drives over one road may disagree.
_PLACES_OFF_M, _SCALE_OFF = 10.0, 0.01


@dataclass(frozen=True, eq=False, repr=False)
class Identification(CommandResult):
    """Parameters that ``identify`` fitted.

    fit            with covariance and correlation, of measured roads with the whitened residuals as well
    model          with the numbers
    cannot_tell    sentences that stand between the numbers and their being believed; empty: none
    parameters     by name, and their ``standard_errors``
    error_before   rms(measured - model) / rms(measured) with every free number where it started, ``error_after`` with
                   those found
    converged      whether the fit came to rest; if not, do not use the numbers
    """

    title: ClassVar[str] = "Fitted parameters"

    fit: Fit | RoadFit
    model: Model
    cannot_tell: tuple[str, ...]
    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    error_before: float
    error_after: float
    converged: bool

    @property
    def exit_status(self) -> int:
        """Of the command."""
        return EXIT_DONE if self.converged else EXIT_CHECK_FAILED

    def charts(self) -> Sequence[Chart]:
        """Of the residuals, and of correlated estimates."""
        return charts(self.fit)

    def next_words(self, question: IdentifyQuestion, written: Mapping[str, Sequence[Path]]) -> str:
        """What to do with the numbers, or to find what stands between them and their being believed."""
        vehicles = [path for paths in written.values() for path in paths if path.suffix == ".yaml"]
        if not self.converged or question.road != MEASURED or not (self.cannot_tell or vehicles):
            return ""
        what = "where the model is off" if self.cannot_tell else "what these parameters leave unexplained"
        car = vehicles[0] if vehicles else question.vehicle
        return f"Next, {what}: ridelog compare --vehicle {car} {question.named().replace(', ', ' ')}"

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the fitted vehicle, its standard errors as comments."""
        comments = [f"# {self.model.vehicle.name} with parameters fitted by ridelog identify; error "
                    f"{self.error_before:.4f} before, {self.error_after:.4f} after"]
        comments += [f"# {name}: {value:.6g}, standard error {self.standard_errors[name]:.2g}"
                     for name, value in self.parameters.items()]
        vehicle_file.write_model(path, self.model, "".join(f"{line}\n" for line in comments))


@function(IdentifyQuestion)
def identify(question: IdentifyQuestion) -> Identification:
    """The numbers. BadInput and ``NotIdentifiable`` as ``IdentifyQuestion`` says."""
    given = each(question.runs)
    if not given:
        raise BadInput("identify: expected a run, found none")
    paths = paths_of(question.runs)
    places = [path.resolve() for path in paths]
    if again := next((path for path in paths if places.count(path.resolve()) > 1), None):
        raise BadInput(f"{again}: expected every run once, found it twice")
    if question.road == SAME and len(given) < 2:
        raise question.wrong("same_road", ": expected two runs or more")
    flat_will_do = bool(question.obstacles) or question.road != MEASURED
    drives = [run_on_road(one, question.warn) if not flat_will_do else one if isinstance(one, Run) else read_run(one)
              for one in given]
    model = model_of(with_initial_values(model_of(question.vehicle), drives))
    records = _records(drives, model)
    if question.free is None and (question.road != MEASURED or question.obstacles):
        raise question.wrong("free", ": expected the parameters to fit, as the road was not measured")
    if question.road != MEASURED:
        return _on_unmeasured_roads(model, records, question)
    return _on_measured_roads(model, records, _narrowed(question, drives))


def refusal_json(refusal: CheckFailed) -> dict[str, Any]:
    """What a program reads where the runs do not determine the numbers."""
    assert isinstance(refusal, NotIdentifiable)
    return {"parameters": {}, "standard_errors": {}, "error_before": refusal.error_before, "error_after": None,
            "converged": False, "cannot_tell": [finding.words for finding in refusal.findings]}


def _narrowed(question: IdentifyQuestion, drives: Sequence[Run]) -> IdentifyQuestion:
    """The question without what lies above the pass band of a drive (``run.yaml``), as ``low_pass_hz`` asks for it."""
    bands = [(drive.facts.pass_band_hz, drive.rate_hz) for drive in drives]
    ends_hz = [question.low_pass_hz, *(band[1] for band, rate_hz in bands if band and band[1] < rate_hz / 2)]
    return replace(question, low_pass_hz=min((one for one in ends_hz if one is not None), default=None))


def _records(drives: Sequence[Run], model: Model) -> list[Record]:
    """Drives with their roads, or on a flat one. BadInput for one too short, or that cannot be what it says, and for
    rates that differ."""
    records, vehicle = [], model.vehicle
    for number, drive in enumerate(drives):
        check_readings(drive, drives[:number])
        check_channels(drive, model)
        zero = 0.0 if zero_is_known(drive.facts.main, drive.track) else float(drive.accel_z_mps2.mean())
        record = from_rest(Record(
            str(drive.path), drive.rate_hz, drive.accel_z_mps2 - zero, drive.distance_m, drive.speed_mps,
            Track(1.0, np.zeros(2)) if drive.track is None else drive.track, past_of(drive.track).value,
            replace(drive.facts, signals=()), drive.marks(), left_out=no_readings(drive.usable)))
        if record.count - record.first <= LEAST_SAMPLES:
            raise BadInput(f"{drive.path}: expected {LEAST_SAMPLES} samples or more after the first {record.skip_s:g} "
                           f"s, which are left out, found a drive of {record.count / drive.rate_hz:g} s")
        check_forces(vehicle, record.track, str(drive.path / RUN))
        if record.timed:
            check_rate(drive, vehicle)
        records.append(record)
    return [of_rates(record) for record in records] if moves_freely(vehicle) else records


# --- roads that are known, but for a few numbers ---


def _on_measured_roads(given: Model, records: list[Record], question: IdentifyQuestion) -> Identification:
    """The fit over roads that are known, but for a few numbers. BadInput and ``NotIdentifiable`` as ``identify``."""
    word = word_of(question.vehicle, given)
    known = given.known if question.free is None else {}
    question = _with_unknown_numbers(given, word, question)
    _check_effects(given, word, records, question)
    _check_rigs(records, question)
    if not question.obstacles:
        check_roads(word, given, SimulatedRuns(records), question.warn, question.anyway)
    road, unplaced = _road(question)

    def model_of_records(of: list[Record]) -> DriveModel:
        return _drive_model(given, of, road, unplaced, question, known)

    try:
        found = fit_to_readings(model_of_records, records, lambda one: _options(one, question))
    except ValueError as error:
        raise BadInput(f"{records[0].name}: {error}") from None
    except NotIdentifiable as refusal:
        raise NotIdentifiable(refusal.findings, error_before(model_of_records(records))) from None
    model, checks = found.model, tests(found.model, found.fit)
    fit = (common := with_common_roughness(model, found.fit)).fit
    low = "" if fit.low_pass.cutoff_hz is None else f", below {fit.low_pass.cutoff_hz:g} Hz"
    first = _first_lines(fit, _head(given, len(fit.free), records, low), "rms(measured - model) / rms(measured)")
    lines = [_in_words_of(records, one) for one in measured_lines(fit, *checks)]
    return _identification(
        records, fit, fit.free, first, [*lines, *common_words(model, common), *record_words(found)],
        measured_json(fit, *checks) | {"common_roughness": common.share, "rounding_by_bounds": found.rounded,
                                       "moved_m": found.moved_m},
        _fitted(given, model, fit), [_in_words_of(records, one) for one in doubts(fit, *checks)])


def _identification(records: Sequence[Record], fit: Fit | RoadFit, free: Sequence[Free], first: Iterable[str],
                    lines: Iterable[str], summary: Mapping[str, Any], model: vehicle_file.CarModel,
                    cannot_tell: Sequence[str]) -> Identification:
    """A fit as it is shown: its first lines, a table of its numbers, and more lines."""
    # The first line says that the beginnings are left out.
    left_out = left_out_lines(runs_left_out([replace(one, skip_s=0.0) for one in records]))
    return Identification(
        Blocks([Lines([*first]), _table(fit, free), Lines([*lines]), Lines(left_out)]),
        {**summary, "runs": [record.name for record in records], **left_out_json(runs_left_out(records))},
        fit, model_of(model), tuple(cannot_tell), fit.parameters, fit.standard_errors, fit.error_before,
        fit.error_after, fit.converged)


def _with_unknown_numbers(given: vehicle_file.CarModel, word: str, question: IdentifyQuestion) -> IdentifyQuestion:
    """The question with those numbers free as well that the vehicle's file calls unknown; where none is named, all that
    it does not know exactly, those of its effects too, but for what an effect has by default. BadInput where it knows
    all."""
    known, free = given.known, [*(question.free or ())]
    if question.free is None:
        free = [name for name in known if known[name].words != UNKNOWN]
        free += [f"{one.effect.name}.{parameter.name}" for one in given.effects for parameter in one.effect.parameters
                 if parameter.is_free and one.values[parameter.name] != parameter.default]
    named = {one.replace(f"{BOTH}.", f"{axle}.") for one in free for axle in AXLES}
    free += [name for name, one in known.items() if one.words == UNKNOWN and name not in named]
    if not free and question.free is None:
        raise question.wrong("free", f": expected the parameters to fit, as {word} gives all of them exactly (or "
                                     "write 875 +- 5%, or unknown, for one in the file)")
    return replace(question, free=free)


def _ranges(given: vehicle_file.CarModel, records: Sequence[Record]) -> dict[str, tuple[float, float]]:
    """The ranges that the vehicle's file gives, of both axles together where theirs overlap; a preload is at most twice
    as large as what was measured, either way."""
    most_n = 2 * max(float(np.abs(record.measured_mps2).max()) for record in records)
    ends = {name: one.ends for name, one in given.known.items() if one.ends}
    front, rear = (f"{axle}." for axle in AXLES)
    both = {name.replace(front, f"{BOTH}."): (max(low, other[0]), min(high, other[1])) for name, (low, high)
            in ends.items() if name.startswith(front) and (other := ends.get(name.replace(front, rear)))}
    return {PRELOAD: (-most_n, most_n), **both, **ends}


def _in_words_of(records: Sequence[Record], line: str) -> str:
    """A line for a person, with the unit that was measured."""
    return line.replace("m/s2", records[0].facts.main.unit)


def _check_effects(given: vehicle_file.CarModel, word: str, records: Sequence[Record],
                   question: IdentifyQuestion) -> None:
    """Raise BadInput for an effect that cannot be there on these roads, or one that is to be found and is not there."""
    for one in given.effects:
        check_on(given.vehicle, one, all(record.two_tracks for record in records),
                 all(record.timed for record in records), all(record.pushed for record in records))
    if words := slow_words([one.effect for one in given.effects]):
        question.warn(words)
    there = [one.effect.name for one in given.effects]
    for name in question.free or ():
        effect = name.partition(".")[0]
        if "." in name and effect in shipped_effects() and effect not in there:
            raise question.wrong("free", (
                f" {name}: expected an effect that is in the vehicle's file, {word} has {', '.join(there) or 'none'}; "
                f"add it with 'ridelog add-effect {effect} --vehicle {word} --out FILE RUN...', or write it under "
                "'effects' in the file"))


def _check_rigs(records: Sequence[Record], question: IdentifyQuestion) -> None:
    """Raise BadInput for what asks for a road, or a speed, of a rig."""
    rig = next((record.name for record in records if record.timed), None)
    if rig is None:
        return
    if asked := [name for name in question.free or () if is_input(name)] + list(question.obstacles or {}):
        raise BadInput(f"{rig}: expected a road for {asked[0]}; the run is driven by time")
    if question.noise == "road":
        raise question.wrong("noise", f" road: expected white, ar or auto; {rig} is driven by time, on no road")


def _road(question: IdentifyQuestion) -> tuple[RoadInput, list[str]]:
    """What lies on the road, and the names of what has no start yet. BadInput for what is no bump or step."""
    found = dict[str, Any]()
    for name, numbers in (question.obstacles or {}).items():
        if name not in KINDS:
            raise BadInput(f"obstacle {name}: expected {' or '.join(KINDS)}")
        needed, said = KINDS[name].sizes, ",".join(f"{key}={value:g}" for key, value in numbers.items())
        if not set(needed) <= set(numbers) <= {"start_m", *needed}:
            raise question.wrong("obstacles", f" {name}:{said}: expected [start_m=M,]"
                                              f"{','.join(f'{one}=M' for one in needed)}")
        try:
            found[name] = KINDS[name](**{"start_m": 0.0, **numbers})
        except ValueError as error:
            raise question.wrong("obstacles", f" {name}:{said}: {error}") from None
    return RoadInput(**found), [name for name, one in (question.obstacles or {}).items() if "start_m" not in one]


def _drive_model(given: vehicle_file.CarModel, records: list[Record], road: RoadInput, unplaced: list[str],
                 question: IdentifyQuestion, known: Mapping[str, Known]) -> DriveModel:
    try:
        starts = obstacle_starts(given.vehicle, records, road, unplaced)
    except ValueError as error:
        obstacle, _, words = str(error).partition(":")
        raise question.wrong("obstacles", f" {obstacle}:{words}") from None
    parameters = _free(given, road, starts, records, question, known)
    try:
        return DriveModel(given.vehicle, parameters, records, road, given.effects)
    except ValueError as error:
        raise question.wrong("free", f": {error}") from None


def _free(given: vehicle_file.CarModel, road: RoadInput, found: Mapping[str, float], records: Sequence[Record],
          question: IdentifyQuestion, known: Mapping[str, Known] = MappingProxyType({})) -> list[Free]:
    """The free numbers; where an obstacle's start was found and not named, it is one of them. BadInput for names that
    do not fit."""
    free = question.free or ()
    if cars := [name for name in free if name.startswith(f"{EACH}.") and not is_input(name)]:
        raise question.wrong("free", f" {cars[0]}: expected a parameter of the road after {EACH}., as all runs share "
                                     "one car")
    names = [one for name in free for one in expanded(name, len(records))]
    if not names or len(set(names)) < len(names):
        raise question.wrong("free", f" {','.join(free)}: expected names with commas between them, each once")
    named = {run_and_name(name)[1] for name in names}
    names += [name for name in found if run_and_name(name)[1] not in named]
    start = {**{run_and_name(name)[1]: place for name, place in reversed(list(found.items()))}, **found}
    between = _ranges(given, records)
    try:
        return [_free_number(given, road, name, start.get(name), between.get(name), known.get(name)) for name in names]
    except ValueError as error:
        raise question.wrong("free", f": {error}") from None


def _free_number(given: vehicle_file.CarModel, road: RoadInput, name: str, start: float | None,
                 between: tuple[float, float] | None, known: Known | None) -> Free:
    """A number of the road, of an effect or of the car, with how well it was ``known``. ValueError for one that none of
    them has."""
    if is_input(name):
        return free_input(road, name, start)
    if (move := free_parameter_named(given.effects, name)) is not None:
        return free_number(given.effects, move)
    prior = (known.value, known.deviation) if known is not None and known.is_guess else None
    return free(given.vehicle, name, None, between, prior)


def _options(model: DriveModel, question: IdentifyQuestion) -> FitOptions:
    rate_hz, low_pass_hz = model.records[0].rate_hz, question.low_pass_hz
    if low_pass_hz is not None and not 0 < low_pass_hz < rate_hz / 2:
        raise question.wrong("low_pass_hz", f" {low_pass_hz:g}: expected above 0 and below {rate_hz / 2:g} Hz")
    reach = DecimatingLowPass(rate_hz, low_pass_hz).reach
    if short := next((one for one in model.records if one.count - one.first <= reach), None):
        raise BadInput(f"{short.name}: expected more than {reach} samples for a low pass of {low_pass_hz:g} Hz, found "
                       f"{short.count - short.first} after the first {short.skip_s:g} s")
    return fit_options(model, question.noise, low_pass_hz, question.tries)


def _fitted(given: vehicle_file.CarModel, model: DriveModel, fit: Fit) -> vehicle_file.CarModel:
    """The model with the numbers that were found and their standard errors, those of its effects with them too."""
    values = np.array(list(fit.parameters.values()))
    effects = []
    for one in model.effects_with(values):
        errors = {name.partition(".")[2]: error for name, error in fit.standard_errors.items()
                  if name.partition(".")[0] == one.effect.name and name.partition(".")[2] in one.values}
        effects.append(replace(one, standard_errors={**one.standard_errors, **errors}))
    return replace(given, vehicle=model.vehicle_with(values), effects=tuple(effects),
                   given=given.given or given.vehicle, errors=_errors(list(fit.parameters), fit.covariance))


def _errors(found: Sequence[str], covariance: Array) -> NumberErrors:
    """How far the numbers of car and effects may be off, without those of the road."""
    kept = [place for place, name in enumerate(found) if not is_input(name)]
    return NumberErrors.of_covariance([found[place] for place in kept], covariance[np.ix_(kept, kept)])


# --- roads of which only the kind is known ---


def _on_unmeasured_roads(given: Model, records: list[Record], question: IdentifyQuestion) -> Identification:
    """The fit over roads that were not measured: one for all runs, or one for each. BadInput and ``NotIdentifiable`` as
    ``identify``."""
    options, question = _road_options(question)
    if given.effects:
        raise BadInput(f"{word_of(question.vehicle, given)}: expected a car without effects where the road was not "
                       f"measured, found {', '.join(one.effect.name for one in given.effects)}")
    with as_bad_input():
        drives = drives_of(records)
    parameters = _free(given, RoadInput(), {}, records, question)
    try:
        car = AxleResponse(given.vehicle, parameters, drives[0].rate_hz)
    except ValueError as error:
        raise question.wrong("free", f": {error}") from None
    one_road = question.road == SAME
    fit = fit_roads(car, [drives] if one_road else [[drive] for drive in drives], options)
    where = "one road that was not measured" if one_road else "roads that were not measured"
    fitted = car.vehicle_with(np.array(list(fit.parameters.values())))
    model = vehicle_file.CarModel(fitted, errors=_errors(list(fit.parameters), fit.covariance),
                                  given=given.given or given.vehicle, known=given.known)
    first = _first_lines(fit, _head(given, len(parameters), records, f"; over {where}", ","),
                         "rms(residual) / rms(measured) over the most probable road")
    cannot_tell = [finding.words for finding in fit.verdict]
    return _identification(
        records, fit, parameters, first, unmeasured_lines(fit, parameters),
        _fit_json(fit, parameters) | {"road": fit.roads, "road_standard_errors": fit.road_errors,
                                      "cannot_tell": cannot_tell}, model, cannot_tell)


def _road_options(question: IdentifyQuestion) -> tuple[Options, IdentifyQuestion]:
    """How to fit, and the question without what is not the car's. BadInput for what needs a known road."""
    unused = {"obstacles": question.obstacles, "low_pass_hz": question.low_pass_hz, "tries": question.tries,
              "noise": question.noise != "auto"}
    if given := [option for option, value in unused.items() if value]:
        raise question.wrong(given[0], ": expected a road whose profile is known, found one that was not measured")
    free = question.free or ()
    names = [name for name in free if name != _FREE_WAVINESS]
    return (Options(waviness=question.waviness or STANDARD_WAVINESS, free_waviness=_FREE_WAVINESS in free,
                    place_off_m=_PLACES_OFF_M, scale_off=_SCALE_OFF), replace(question, free=names))


def _head(given: vehicle_file.CarModel, free: int, records: Sequence[Record], more: str, stop: str = ";") -> str:
    vehicle, runs = given.vehicle, "1 run" if len(records) == 1 else f"{len(records)} runs"
    begun = (f"the first {records[0].skip_s:g} s of a run left out" if records[0].skip_s else
             "no excitation: identify estimates the initial state as well" if records[0].past is Past.FREE else
             "at rest until it is driven")
    return (f"{vehicle.name} ({vehicle.model.replace('_', ' ')}): {free} free, {runs}, "
            f"{sum(len(one.kept_mps2) for one in records)} samples at {records[0].rate_hz:.5g} Hz{more}{stop} {begun}")


NORMAL_95 = 1.959964
_MENTIONED = 0.7
_DOUBTFUL = 0.1


def tests(model: DriveModel, fit: Fit) -> tuple[noise_models.Test, noise_models.Test]:
    """Whether the fit's residuals are white, and whether they are free of the road; untested where they are no more
    than the predictions' own inaccuracy."""
    if fit.error_after < least_share(model):
        return noise_models.UNTESTED, noise_models.UNTESTED
    inputs = [whitener(fit.low_pass.apply(one)) for whitener, one in
              zip(fit.noise.whiteners, model.inputs(np.array(list(fit.parameters.values()))), strict=True)]
    return (noise_models.autocorrelation(fit.white, fit.noise.parameters - 1),
            noise_models.cross_correlation(fit.white, inputs, fit.sensitivities))


def measured_json(fit: Fit, white: noise_models.Test, free_of_road: noise_models.Test) -> dict[str, Any]:
    """All of it for a program; null where nothing is known."""
    return _fit_json(fit, fit.free) | {
        "interval_95": {one.name: list(interval(fit, one)) for one in fit.free},
        "noise": {"model": fit.noise.name, **fit.noise.levels},
        "residuals_white_p_value": _p_value(white), "residuals_free_of_road_p_value": _p_value(free_of_road),
        "cannot_tell": list(doubts(fit, white, free_of_road)),
    }


def _fit_json(fit: Fit | RoadFit, free: Sequence[Free]) -> dict[str, Any]:
    """What every fit has."""
    return {
        "parameters": fit.parameters, "standard_errors": fit.standard_errors,
        "error_before": known_number(fit.error_before), "error_after": known_number(fit.error_after),
        "converged": fit.converged, "start": {one.name: one.start for one in free},
        "bounds": {one.name: [one.low, one.high] for one in free},
        "correlation": {name: dict(zip(fit.names, row, strict=True)) for name, row in zip(
            fit.names, correlation_of(fit.covariance).tolist(), strict=True)},
        "at_bound": fit.at_bound, "iterations": fit.iterations}


def doubts(fit: Fit, white: noise_models.Test, free_of_road: noise_models.Test) -> Iterator[str]:
    """What stands between the estimates and their being believed, each in words; nothing when all is well."""
    if not fit.converged:
        yield "the fit did not converge."
    if fit.at_bound:
        yield (f"{', '.join(fit.at_bound)} ended at a bound: the bound stopped the fit there; it is not a measured "
               "value.")
    yield from _far_from_file(fit)
    if not white.passed:
        yield (f"residuals are not white (p = {white.p_value:.2g}): the noise model is incomplete, and the standard "
               "errors are a guide only.")
    if not free_of_road.passed:
        yield (f"residuals follow the input (p = {free_of_road.p_value:.2g}): the model lacks an effect, "
               "which biases the estimates.")


def _far_from_file(fit: Fit) -> Iterator[str]:
    """Which numbers are not what was known of them."""
    precision, pull = fit.prior
    for name, off in zip(fit.parameters, np.abs(pull) / np.sqrt(np.maximum(precision, 1e-300)), strict=True):
        if off > UNUSUAL_SIGMA:
            yield (f"{name} came out {off:.1f} standard deviations from its prior in the vehicle's file: either the "
                   "file is wrong there, or the model lacks something that biases it.")


def _p_value(test: noise_models.Test) -> float | None:
    return test.p_value if test.degrees else None


def interval(fit: Fit | RoadFit, one: Free) -> tuple[float, float]:
    """The 95 % interval of an estimate; of a size in the logarithm, so that it stays above 0."""
    value, error = fit.parameters[one.name], fit.standard_errors[one.name]
    if one.by_factors:
        factor = float(np.exp(NORMAL_95 * error / value))
        return value / factor, value * factor
    return value - NORMAL_95 * error, value + NORMAL_95 * error


def _first_lines(fit: Fit | RoadFit, head: str, error: str) -> Iterator[str]:
    """The answer: the numbers with their standard errors, as many as a line holds, or that there are none to be used;
    then what they are from, how the fit ended and how far it explains the runs."""
    said = [f"{name} {measured(value, fit.standard_errors[name])} {unit_of(name)}".rstrip()
            + " (at its bound)" * (name in fit.at_bound) for name, value in fit.parameters.items()]
    held = max((count for count in range(1, len(said) + 1) if len(", ".join(said[:count])) <= WIDTH), default=1)
    yield (f"{', '.join(said[:held])}{f', and {len(said) - held} more below' * (held < len(said))}" if fit.converged
           else f"NOT CONVERGED in {fit.iterations} steps: do not use these values; give a nearer vehicle file, or "
                "free fewer parameters.")
    yield head
    yield (f"{f'Converged in {fit.iterations} steps. ' * fit.converged}NRMSE, {error}: {fit.error_before:.4f} before, "
           f"{fit.error_after:.4f} after.")
    if isinstance(fit, Fit) and len(fit.ends) > 1:
        yield _ends(fit)


def measured_lines(fit: Fit, white: noise_models.Test, free_of_road: noise_models.Test) -> Iterator[str]:
    """What a person reads below the numbers of a fit over roads that are known."""
    yield from _far_from_file(fit)
    yield f"The residual is modelled as {fit.noise.words}."
    yield from _correlated(fit)
    sound = not any(doubts(fit, white, free_of_road))
    yield from _checks(white, free_of_road, sound)
    yield from _measured_limits(fit, sound)


def common_words(model: DriveModel, common: CommonRoughness) -> Iterator[str]:
    """Whether drives over one obstacle, or one profile, were over one road, and what that means for the errors."""
    runs = len(model.records)
    if common.share:
        yield (f"These {runs} runs are over one road: they share {common.share:.0%} of the roughness that the profile "
               f"does not contain. The standard errors include that; they are up to {common.growth:.2f} times those "
               "of runs over different roads.")
    elif may_have_common(model) and common.fit.noise.name != "road":
        yield (f"If these {runs} runs are over the same stretch, they share the error of its profile: true standard "
               f"errors are then up to {np.sqrt(runs):.2f} times those above.")


def record_words(found: ReadingsFit) -> Iterator[str]:
    """What of the records was used in addition to their samples."""
    if found.rounded:
        yield "Readings are rounded: each is known to within one step (step_mps2 in run.yaml)."
    if found.moved_m:
        yield (f"Positions are uncertain (place_std_m in run.yaml): they were corrected by up to {found.moved_m:.2g} m"
               ", and the standard errors include that uncertainty.")


def _ends(fit: Fit) -> str:
    scale = np.array([fit.standard_errors[one.name] for one in fit.free])
    best = fit.ends[np.argmin(np.abs((fit.ends - np.array(list(fit.parameters.values()))) / scale).max(axis=1))]
    same = int((np.abs((fit.ends - best) / scale).max(axis=1) < 1.0).sum())
    return f"{same} of {len(fit.ends)} starts end at the same values; these are the best ones."


def _table(fit: Fit | RoadFit, free: Sequence[Free]) -> Table:
    """The free numbers, then those of roads that were not measured."""
    rows = []
    for one in free:
        value, error = fit.parameters[one.name], fit.standard_errors[one.name]
        low, high = interval(fit, one)
        relative = f"{error / abs(value):.2%}" if one.by_factors else "-"
        moved = f"{value / one.start - 1:+.1%}" if one.by_factors else f"{value - one.start:+.3g}"
        rows.append((one.name, f"{one.start:.5g}", f"{value:.6g}", f"{error:.3g}", relative, f"{low:.5g} to {high:.5g}",
                     moved, "AT ITS BOUND" if one.name in fit.at_bound else ""))
    roads, errors = (fit.roads, fit.road_errors) if isinstance(fit, RoadFit) else ({}, {})
    for name, value in roads.items():
        error = errors[name]
        low, high = value - NORMAL_95 * error, value + NORMAL_95 * error
        rows.append((name, "", f"{value:.4g}", f"{error:.3g}", "", f"{low:.5g} to {high:.5g}", "",
                     _UNITS.get(name.rpartition(".")[2], "")))
    return Table(("parameter", "start", "estimate", "std. error", "relative", "95 % interval", "moved", ""), rows,
                 (0, 7))


def _pairs(fit: Fit | RoadFit, between: str) -> list[tuple[str, float]]:
    """Each two numbers with the correlation of their errors, the most correlated first."""
    names, found = fit.names, correlation_of(fit.covariance)
    return sorted(((f"{names[i]}{between}{names[j]}", float(found[i, j]))
                   for i, j in combinations(range(len(names)), 2)), key=lambda pair: -abs(pair[1]))


def _correlated(fit: Fit | RoadFit) -> Iterator[str]:
    if large := [f"{both} {value:+.2f}" for both, value in _pairs(fit, " and ") if abs(value) > _MENTIONED]:
        yield f"Correlated estimates (correlation beyond {_MENTIONED:g}): {'; '.join(large)}."


def _checks(white: noise_models.Test, free_of_road: noise_models.Test, sound: bool) -> Iterator[str]:
    if white.degrees:
        yield (f"Are residuals white (Ljung-Box)? p = {white.p_value:.2g} over {white.degrees} degrees of freedom: "
               + (f"yes{', standard errors can be trusted' * sound}." if white.passed else
                  "no, the noise model is incomplete; the standard errors are a guide only."))
    if not white.degrees and not free_of_road.degrees:
        yield "There is no residual to test."
    if free_of_road.degrees:
        yield (f"Do residuals follow the input? p = {free_of_road.p_value:.2g} over {free_of_road.degrees} degrees of "
               "freedom: " + ("no." if free_of_road.passed else
                              "yes, the model lacks an effect, which biases the estimates."))


def _measured_limits(fit: Fit, sound: bool) -> Iterator[str]:
    if fit.at_bound:
        yield (f"At a bound: {', '.join(fit.at_bound)}. The bound stopped the fit there; it is not a measured "
               "value, and its standard error means nothing. Check the vehicle's file, or run ridelog compare: the "
               "model may lack an effect.")
        if fit.noise.name != "white":
            yield ("Coloured noise can absorb what the model lacks, most of all in a sweep, which has one frequency "
                   "at a time: try --noise white.")
    sizes = [one.name for one in fit.free if one.by_factors]
    vague = {name: error / abs(fit.parameters[name]) for name, error in fit.standard_errors.items()
             if name in sizes and error > _DOUBTFUL * abs(fit.parameters[name])}
    if vague:
        listed = ", ".join(f"{name} ({share:.0%})" for name, share in vague.items())
        yield f"Poorly determined by these runs: {listed}."
    elif sound:
        yield "These runs determine every free parameter."
    if len(fit.parameters) > 1:
        yield _least_known(fit)


def _least_known(fit: Fit) -> str:
    """The combination that is known worst: the longest axis of the error ellipsoid in relative changes."""
    names = list(fit.parameters)
    scale = np.abs(Coordinates(fit.free).slopes(np.array(list(fit.parameters.values()))))
    powers, directions = np.linalg.eigh(fit.covariance / np.outer(scale, scale))
    ends = [directions[:, 0], directions[:, -1]]
    said = []
    for direction, power in zip(ends, (powers[0], powers[-1]), strict=True):
        shares = direction / direction[np.argmax(np.abs(direction))]
        large = sorted(zip(-np.abs(shares), names, shares, strict=True))[:4]
        along = ", ".join(f"{name} {share:+.2f}" for size, name, share in large if -size > 0.1)
        said.append(f"{along} ({np.sqrt(max(power, 0.0)):.2%})")
    return f"Best determined combination: {said[0]}; worst: {said[1]}."


_UNITS = {GD_N0: "cm3", NOISE: "m/s2", OFFSET: "m"}


def unmeasured_lines(fit: RoadFit, free: Sequence[Free]) -> Iterator[str]:
    """What a person reads below the numbers of a fit over roads that were not measured."""
    yield from _correlated(fit)
    for finding in fit.verdict:
        yield f"Cannot tell: {finding.words}"
    sizes = [one.name for one in free if one.by_factors]
    vague = {name: fit.standard_errors[name] / abs(fit.parameters[name]) for name in sizes}
    if rough := [f"{name} ({share:.0%})" for name, share in vague.items() if share > _DOUBTFUL]:
        yield (f"Poorly determined without the road's profile: {', '.join(rough)}. Several drives over one road at "
               "different speeds (--same-road) determine them better.")
    yield ("The road is assumed to be one of ISO 8608 with this waviness; bumps, holes or a spectrum of another shape "
           "bias the estimates. Masses, springs and dampers are known only relative to those that were held fixed.")


def charts(fit: Fit | RoadFit) -> list[Chart]:
    """Of a fit on measured roads the residuals' autocorrelation, with the band that chance stays in; of every fit with
    two numbers or more how they hang together."""
    bars = Bars("Correlated estimates", "correlation of their errors", tuple(_pairs(fit, ", ")[:SHOWN_ROWS]))
    return [*([_left(fit.white)] if isinstance(fit, Fit) else []), *([bars] if bars.bars else [])]


def _left(white: list[Array]) -> Curves:
    """G. M. Ljung and G. E. P. Box 1978: of white residuals each is nearly normal, of variance 1 / n."""
    found = noise_models.autocorrelations(white, min(noise_models.LAGS, min(map(len, white)) - 1))
    lags = np.arange(1.0, len(found) + 1)
    bound = np.full(len(lags), NORMAL_95 / np.sqrt(sum(map(len, white))))
    return Curves("Autocorrelation of the residuals", "lag [samples]", "correlation", (
        Line("residuals", lags, found), Line("95 % of white noise", lags, bound, faint=True),
        Line("", lags, -bound, faint=True)), (0.0, ""))
