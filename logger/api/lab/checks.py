"""Whether a vehicle's model and runs can be used together, before anything is searched.

Runs are checked by themselves and with each other, then the model against them: units, ways up, roads, another car.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, compress
from math import log
from statistics import median

import numpy as np

from logger.api.inputs import check_forces
from logger.arrays import Array, Bools
from logger.bounds import BACK_M, QUIETEST_MPS2, SPEED, time_hint
from logger.dsp.channel_faults import at_ends, goes_against, longest_still
from logger.dsp.repeated_samples import find_repeats, stretches_of
from logger.dsp.whole_record import thinned
from logger.errors import BadInput, as_bad_input
from logger.identification.noise_models import DOUBT
from logger.identification.time_scale import at_time_scale
from logger.lab import road_match
from logger.lab.another_car import LikeliestRig, another_car, error_with_best_effect, gains_and_errors, likeliest_rig
from logger.lab.likelihood.lag import SLOWEST_MPS
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.whittle import BLOCK_S, HIGHEST_OF_RATE
from logger.lab.residuals.breakdown import ModelResiduals
from logger.lab.residuals.road_coherence import chance_of_following
from logger.lab.residuals.statistics import rank_correlation
from logger.lab.selection.evidence import FALSE_ALARM
from logger.lab.selection.holdout import AS_PRINTED
from logger.left_out import LeftOut
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.report.quantities import some
from logger.roads.iri import likely_unit
from logger.runs import (
    CLIPPED,
    LEAST_S,
    NO_READING,
    READING,
    SKIP_S,
    Past,
    Run,
    Signal,
    no_readings,
    past_of,
    zero_is_known,
)
from logger.simulation.virtual_drive import SimulatedRuns, steps_hz
from logger.store.formats.drive_file import RUN, Drive
from logger.store.formats.vehicle_file import CarModel
from logger.units import FOOT_M, LBF_N, STANDARD_GRAVITY_MPS2
from logger.vehicle.compose import Car, bounded, compose
from logger.vehicle.effect import Chosen, Effect
from logger.vehicle.effects.sensor_gain import EFFECT as SENSOR_GAIN
from logger.vehicle.models import structure_of
from logger.vehicle.modes import body_and_wheels_hz, undamped_frequencies_hz
from logger.vehicle.named_parameters import WEAKEST
from logger.vehicle.named_parameters import read as read_number
from logger.vehicle.simulate import resampled
from logger.vehicle.uncertain import UNKNOWN
from logger.vehicle.vehicle import Vehicle

_NEAR = 0.3
_RECORD, _PROFILE = "the record seems to be", "the profile seems to be"
# Measured / model, where one of them is in another unit.
_UNITS = (
    (_RECORD, "g", 1 / STANDARD_GRAVITY_MPS2), (_RECORD, "thousandths of g", 1000 / STANDARD_GRAVITY_MPS2),
    (_RECORD, "mm/s2", 1000.0), (_RECORD, "ft/s2", 1 / FOOT_M),
    (_PROFILE, "mm", 0.001), (_PROFILE, "cm", 0.01), (_PROFILE, "inches", FOOT_M / 12), (_PROFILE, "feet", FOOT_M),
)
# The same on rigs, by what is measured: readings in a unit over those in N, m or m/s2.
_LENGTHS = (("mm", 1000.0), ("cm", 100.0), ("inches", 12 / FOOT_M))
_SIZES = {"force": (("kN", 1e-3), ("kgf", 1 / STANDARD_GRAVITY_MPS2), ("lbf", 1 / LBF_N)), "length": _LENGTHS,
          "velocity": tuple((f"{unit}/s", size) for unit, size in _LENGTHS),
          "acceleration": tuple((unit, size) for what, unit, size in _UNITS if what == _RECORD),
          "turning": (("deg/s", 180 / np.pi),)}
_KINDS = {"displacement": "length", "travel": "length", "pitch_rate": "turning", "roll_rate": "turning"}
_APART = 2.0  # kgf and lbf are
_NO_EFFECT = 20.0  # by so many times no effect and no resonance change all of a signal (a judgement)
_NOT_DRIVEN, _FEWEST_AT_REST = 0.01, 50
"""A rig is not driven by less than a hundredth of the most that drives it (a judgement); of so many samples of white
noise von Neumann's ratio is below 1 once in 10,000 times (its standard deviation is 2 over their root)."""
ANYWAY = "--anyway goes on"


def check_model(word: str, model: CarModel, runs: SimulatedRuns, warn: Callable[[str], None],
                known: Mapping[str, Effect], tolerance: Tolerance, anyway: bool = False) -> list[Array]:
    """What the model predicts (n,) per run. Raises BadInput where an effect of the model cannot be on one of the runs,
    the model's motion grows without bound, or the road moves no car; and where the sensor was upside down, a run or its
    profile is in another unit, or the road or the car is another one, unless the user wants to go on ``anyway`` (then
    it is a warning).

    word       by which the user knows the vehicle
    known      effects, by name: where one of them explains the runs as another car would, it may be this car
    tolerance  of the vehicle's numbers
    """
    predictions = check_moves(word, model, runs)
    car = compose(model.vehicle, model.effects)
    followed = _followed(runs, predictions, car, tolerance)
    rig = _likeliest_rig(model, runs, predictions, tolerance)
    # One after the other: whether it is the car is asked of runs that are right, and takes seconds.
    _say(chain(_other_ways_up(followed, rig), _other_units(followed),
               _other_units_on_rig(runs, rig), _other_units_of_signals(runs, predictions, rig),
               _other_roads(runs, followed, car),
               _another_car(word, model, runs, predictions, known, tolerance.largest)), warn, anyway)
    return predictions


def check_moves(word: str, model: CarModel, runs: SimulatedRuns) -> list[Array]:
    """What the model predicts (n,) per run, whatever was measured. Raises BadInput where an effect of the model cannot
    be on one of the runs, the model's motion grows without bound, or the road moves no car."""
    for run in runs.runs:
        for one in model.effects:
            why = one.effect.obstacle_on(model.vehicle, run.two_tracks, run.timed, run.pushed)
            if why is not None:
                raise BadInput(f"{word}: its effect {one.effect.name} cannot be on {run.name}: {why}")
    predictions = predicted(word, model, runs, model.effects)
    if not any(map(_moves, runs.runs, predictions)):
        raise BadInput(f"{runs.runs[0].name}: expected " + (
            "an excitation that moves the rig; it is flat while the record lasts" if runs.runs[0].timed else
            "a drive over a rough profile; the profile is flat where the car drove, or the car stood still"))
    return predictions


def check_roads(word: str, model: CarModel, runs: SimulatedRuns, warn: Callable[[str], None], anyway: bool) -> None:
    """Raise BadInput where a run was driven over another road than that of its profile, or a rig's is in another unit,
    as ``check_model``: all that can be asked where the vehicle's numbers may be far off."""
    car, predictions = compose(model.vehicle, model.effects), predicted(word, model, runs, model.effects)
    tolerance = Tolerance.of(model.known).widened()
    followed = _followed(runs, predictions, car, tolerance)
    rig = _likeliest_rig(model, runs, predictions, tolerance)
    _say(chain(_other_units_on_rig(runs, rig), _other_roads(runs, followed, car)), warn, anyway)


def predicted(word: str, model: CarModel, runs: SimulatedRuns, effects: Sequence[Chosen]) -> list[Array]:
    """What the car with these effects would have recorded. BadInput where it shakes itself to pieces."""
    with as_bad_input(word):
        predictions = runs.predict(compose(model.vehicle, effects))
    if not bounded(predictions):
        names = " and ".join(one.effect.name for one in effects)
        raise BadInput(f"{word}: with {names} the model is unstable: its motion grows without bound")
    return predictions


def _say(complaints: Iterable[str], warn: Callable[[str], None], anyway: bool) -> None:
    """The first complaint as BadInput, or all of them as warnings."""
    for complaint in complaints:
        if not anyway:
            raise BadInput(f"{complaint} ({ANYWAY})")
        warn(complaint)


@dataclass(frozen=True)
class _Followed:
    """How well each run goes with its road: around the body's bounce, in this band [Hz], and below it, at any lag and
    within the half wave at hand. What is wrong with a whole record, its sign or its unit, is wrong in both bands. Below
    is below the lowest bounce that the file allows: between the car's own bounce and the file's a body moves against
    its model."""

    pairs: list[tuple[Run, Array]]
    body_hz: Array
    lowest_body_hz: Array

    @cached_property
    def band_hz(self) -> tuple[float, float]:
        return road_match.bounce_band_hz(self.body_hz)

    @cached_property
    def around(self) -> list[road_match.RoadMatch]:
        return [road_match.road_match(run, prediction, self.band_hz) for run, prediction in self.pairs]

    @cached_property
    def below(self) -> list[road_match.RoadMatch]:
        band_hz = road_match.below_bounce_band_hz(self.lowest_body_hz)
        return [road_match.road_match(run, prediction, band_hz) for run, prediction in self.pairs]

    @cached_property
    def below_at_hand(self) -> list[road_match.RoadMatch]:
        return [road_match.match_below_bounce(run, prediction, self.lowest_body_hz) for run, prediction in self.pairs]


def _followed(runs: SimulatedRuns, predictions: Sequence[Array], car: Car, tolerance: Tolerance) -> _Followed:
    body_hz, _ = body_and_wheels_hz(structure_of(car.vehicle))
    # A bounce is the root of a spring over a mass, each of which may be a standard deviation off.
    lowest = float(np.exp(-min(tolerance.largest, WEAKEST) / np.sqrt(2)))
    return _Followed([(run, run.main(one)) for run, one in zip(runs.runs, predictions, strict=True) if len(body_hz)],
                     body_hz, lowest * body_hz)


def _moves(run: Run, prediction: Array) -> bool:
    model = run.main(prediction)[run.first:]
    if run.timed:  # a small rig, or one whose force is in another unit
        return bool(model.any())
    return float(model @ model) >= QUIETEST_MPS2**2 * len(model)


def _other_ways_up(followed: _Followed, rig: LikeliestRig | None) -> Iterator[str]:
    """Which runs are upside down: none that a rig that the file allows goes along with. (Where nothing moved it
    below the bounce of a file that does not know its spring, a few waves of noise correlate with any sign.)"""
    upright: Iterable[bool] = [False] * len(followed.pairs) if rig is None else rig.goes_along[: len(followed.pairs)]
    for (run, _), around, below, known in zip(followed.pairs, followed.around, followed.below_at_hand, upright,
                                              strict=True):
        if not known and (below.is_upside_down or (around.is_upside_down and below.turned > below.correlation)):
            pushed = isinstance(run.track, Excitation) and bool(run.track.forces)
            yield (f"{run.name}: expected {run.facts.main.name} up positive, found them upside down"
                   f"{', or forces of the opposite sign' * pushed}: with the sign changed they follow the model "
                   f"(correlation {max(around.turned, below.turned):.2f})")


def _other_units(followed: _Followed) -> Iterator[str]:
    """Which runs on roads, or profiles, are in another unit, the nearest one. Below the bounce the body moves with the
    road whatever is missing, but one run holds few such waves: the median of the runs has to be nearer to a unit than
    to 1. A factor that a sensor's gain may be is a unit only if it is one, and all runs and that median agree."""
    if not followed.pairs or followed.pairs[0][0].timed:
        return
    clear = [(run, around.gain, below) for (run, _), around, below in
             zip(followed.pairs, followed.around, followed.below, strict=True)
             if around.is_clear and run.facts.main.measures == "acceleration"]
    waves = [below.gain for _, _, below in clear if max(below.correlation, below.turned) > 0]
    below_gain = [median(waves)] if waves else []
    factors = np.log([1.0, *(size for _, _, size in _UNITS)])
    if below_gain and np.abs(np.log(below_gain) - factors).argmin() == 0:
        return
    for run, gain, _ in clear:
        what, unit, size = min(_UNITS, key=lambda one: abs(log(gain / one[2])))
        may_be_else = SENSOR_GAIN.parameters[0].low < gain < SENSOR_GAIN.parameters[0].high
        gains = [*(around for _, around, _ in clear), *below_gain]
        if not may_be_else or all(abs(one / size - 1) < _NEAR for one in gains):
            yield (f"{run.name}: expected accelerations in m/s2 and elevations in m, found {gain:.3g} times what the "
                   f"model says: {what} in {unit}")


def _likeliest_rig(model: CarModel, runs: SimulatedRuns, predictions: Sequence[Array], tolerance: Tolerance
                   ) -> LikeliestRig | None:
    """Of the runs that something drives; of what was let go it says nothing."""
    driven = [isinstance(run.track, Excitation) and not run.track.is_still for run in runs.runs]
    found = likeliest_rig(list(compress(runs.runs, driven)), model.given or model.vehicle, model.effects,
                          list(compress(predictions, driven)), tolerance) if any(driven) else None
    if found is None:
        return None
    def of_all(some: Sequence[Array], otherwise: float) -> list[Array]:
        each = iter(some)
        return [next(each) if one else np.full(1 + len(run.signals), otherwise)
                for one, run in zip(driven, runs.runs, strict=True)]

    return replace(found, gains=of_all(found.gains, 1.0), errors=of_all(found.errors, np.inf),
                   as_read=of_all(found.as_read, np.inf) if found.as_read else ())


def _other_units_on_rig(runs: SimulatedRuns, rig: LikeliestRig | None) -> Iterator[str]:
    """That what rigs did, or what drives them, was written in another unit."""
    if rig is None:
        return
    for run, (gain, *_) in compress(zip(runs.runs, rig.gains, strict=True), rig.is_misread):
        main, track = run.facts.main, run.track
        assert isinstance(track, Excitation)
        drives = {"force": "force_n"} if track.forces else {"displacement": (
            "displacement_m" if track.moves_part else "elevation_m")}
        # An axis is looked at by its rates, whatever was read (``of_rates``).
        sizes = [(main.name, unit.removesuffix("/s" * main.name.endswith("_m")), size)
                 for unit, size in _SIZES[_KINDS.get(main.measures, main.measures)]]
        sizes += [(name, unit, 1 / size) for kind, name in drives.items()
                  for unit, size in _SIZES[_KINDS.get(kind, kind)]]
        nearest = min((size for _, _, size in sizes), key=lambda size: abs(log(gain / size)))
        likely = " or ".join(f"{name} in {unit}" for name, unit, size in sizes
                             if abs(size / nearest - 1) < _NEAR and abs(log(gain / nearest)) < log(_APART))
        forces = f", or forces that count {gain:.3g} times what they say" if track.forces and (
            abs(gain / nearest - 1) > 0.5 * _NEAR) else ""
        yield (f"{run.name}: expected N, m and m/s2, found {main.name} {gain:.3g} times as large as any rig "
               "within the vehicle's file would give: "
               + (f"it looks like {likely}{forces}" if likely else f"a column in another unit{forces}?"))


def _other_units_of_signals(runs: SimulatedRuns, predictions: Sequence[Array], rig: LikeliestRig | None
                            ) -> Iterator[str]:
    """Which further signals have another sign or unit: those that follow the model, times a factor, though the first
    signal is as it says, and those that differ by more than any missing effect makes them do."""
    if rig is None:
        plain = list(map(gains_and_errors, runs.runs, predictions))
        rig = LikeliestRig([gain for gain, _ in plain], [error for _, error in plain], np.inf)
    misread = rig.misread_signals(runs.runs)
    for run, prediction, gains, off in zip(runs.runs, predictions, rig.gains, misread, strict=True):
        models = prediction.reshape(-1, run.count)[1:]
        for signal, read, model, gain, is_off in zip(run.signals, run.more, models, gains[1:], off, strict=True):
            moved = float(model[run.first:].std())
            if not is_off:
                gain = float(read[run.first:].std()) / moved if moved else np.nan
            sizes = [(unit, size) for unit, size in _SIZES.get(_KINDS.get(signal.measures, signal.measures), ())
                     if (is_off or abs(log(size)) > log(_NO_EFFECT)) and 1 / _APART < abs(gain) / size < _APART]
            if sizes or is_off:
                unit, _ = min(sizes, key=lambda one: abs(log(abs(gain) / one[1])), default=("another unit", 0))
                turned = gain < 0 and abs(log(-gain)) < log(SENSOR_GAIN.parameters[0].high)
                yield (f"{run.name}: expected {signal.name} in {signal.unit}, found {gain:.3g} times what the model "
                       f"says: it looks like {'the opposite sign' if turned else unit}")


def _other_roads(runs: SimulatedRuns, followed: _Followed, car: Car) -> Iterator[str]:
    """Which runs do not follow their road, and where they would fit."""
    strangers = [k for k, one in enumerate(followed.around) if one.is_refuted]
    if not strangers and followed.around and road_match.pool(followed.around).is_refuted:
        strangers = list(range(len(followed.around)))
    for k in strangers:
        found, run = followed.around[k], runs.runs[k]
        # Nothing drives what is let go, and its mode may lie anywhere.
        if run.past is Past.FREE or (run.timed and _follows(run, car, followed.body_hz)):
            continue
        what = "a record that follows its excitation" if run.timed else "a drive that follows the road of its profile"
        yield (f"{run.name}: expected {what}, found one that does not (correlation {found.correlation:.2f} around the "
               f"body bounce; chance gives up to {found.chance:.2f}): {_advice(run, car, followed.band_hz)}")


def _follows(run: Run, car: Car, body_hz: Array) -> bool:
    """Whether what drives a rig predicts its record, whatever its numbers are: at three samples a period of the upper
    edge of the band around its bounce, one more than the two that any signal needs."""
    still = ModelResiduals([run], car, [np.zeros(run.count)], [])
    return chance_of_following(still, 3.0 * road_match.bounce_band_hz(body_hz)[1]) < FALSE_ALARM


def _another_car(word: str, model: CarModel, runs: SimulatedRuns, predictions: Sequence[Array],
                 known: Mapping[str, Effect], numbers: float) -> Iterator[str]:
    """That the runs are of another car, which explains them as no effect does, and how it differs."""
    mains = [run.main(one) for run, one in zip(runs.runs, predictions, strict=True)]
    found = another_car(runs.runs, model.vehicle, model.effects, mains, numbers)
    # An effect in the model's car may explain as much as another car does, and both may have come down to the noise.
    if found is not None and error_with_best_effect(found.runs, model.vehicle, model.effects, known, numbers) > (
            1 + AS_PRINTED) * found.found_error:
        from logger.vehicle.stepping_loop import COMPILED  # loads the compiler, if there is one

        far = some([f"{name} {share:+.0%}" for name, share in found.shares.items()], more="more parameters far off")
        yield (f"{runs.runs[0].name}: expected a drive of the car in {word}, found one of another car: the file's "
               f"model explains next to nothing of it (NRMSE {found.error:.2f}), a model with "
               f"{far} leaves {found.found_error:.2f}. "
               "Is this the right vehicle file? ridelog identify fits a model's parameters"
               + ("" if COMPILED else "; force effects were not tried, as they need the lab extra"))


def _advice(run: Run, car: Car, band_hz: tuple[float, float]) -> str:
    """Where a run that does not follow its road would fit."""
    track = run.track
    if not isinstance(track, Track):
        return "is it another run's excitation, or another clock's?"
    reverse = Track(track.spacing_m, track.elevation_m[::-1].copy(), track.start_m)
    both = {False: SimulatedRuns([run]), True: SimulatedRuns([replace(run, track=reverse)])}

    def predict(farther_m: Array, backwards: bool) -> Array:
        return run.main(both[backwards].predict(car, [farther_m], rough=True)[0])

    found = road_match.better_placement(run, predict, band_hz, (track.start_m, track.end_m))
    if found is None:
        return "the record fits nowhere on the profile. Does one of them belong to another road?"
    if found.backwards:
        return "the record follows the profile read backwards. Was the road driven in the other direction?"
    return f"the record fits the profile {found.farther_m:+.0f} m farther along. Do both begin at the same place?"


_SAME_RATE = 1e-3  # times that are written to a millisecond leave the rate of a few seconds so uncertain
_LEAST_OF_PART_S = 1.0  # a damper's bench makes five turns a second
_CLIPPED_SHARE = 0.005  # of a record: fewer are a blow or two (a judgement)
_DIES_DOWN = 0.95  # of the r.m.s.: a damping ratio of 0.3 % does so within six periods (a judgement)
_LEAST_PERIODS = 3.0  # of what swings: fewer leave its damping to chance (a judgement)
# The lab looks up to 0.37 of the rate (lab/stretches.py): wheels that hop at 10 to 18 Hz are seen from 50 samples a
# second on. A recorder's clock may be off by a per cent.
_LEAST_RATE_HZ, _CLOCK = 50.0, 0.01
_MOST_MEAN_MPS2 = 2.0
_DISAGREE, _DISAGREE_M = 0.5, 5.0


def with_initial_values(model: CarModel, drives: Sequence[Drive]) -> CarModel:
    """The model with what its file calls unknown of a rig where a fit to these drives begins (``at_time_scale``); what
    was fitted once stays. BadInput as ``check_forces`` and ``check_channels``."""
    unknown = [name for name, one in model.known.items() if one.words == UNKNOWN]
    if not unknown or model.given is not None:
        return model
    for one in drives:
        if one.track is None or not one.track.timed:
            return model
        check_forces(model.vehicle, one.track, str(one.path / RUN))
        check_channels(one, model)
    runs = [run for one in drives for run in driven_stretches(one, past_of(one.track).value)]
    vehicle = at_time_scale(model.vehicle, unknown, runs)
    return replace(model, vehicle=vehicle, known={**model.known, **{
        name: replace(model.known[name], value=read_number(vehicle, name)) for name in unknown}})


def checked_runs(drives: Sequence[Drive], thin: bool = True, model: CarModel | None = None) -> SimulatedRuns:
    """Runs of one sample rate; of about 100 samples a second, or as many as the ``model`` needs, if they have many
    more and may be thinned (``thin``).

    Raises BadInput for one that is not what ``check_record`` asks for, or stands nowhere on its own profile.
    """
    vehicle = None if model is None else model.vehicle
    for number, drive in enumerate(drives):
        assert drive.track is not None
        if isinstance(drive.track, Track):
            first_m, last_m = float(drive.distance_m.min()), float(drive.distance_m.max())
            if last_m < drive.track.start_m or first_m > drive.track.end_m:
                raise BadInput(f"{drive.file}: expected distances on the profile, {drive.track.start_m:g} to "
                               f"{drive.track.end_m:g} m, found {first_m:g} to {last_m:g} m")
        check_record(drive, drives[:number], vehicle)
        if not drive.track.timed:
            check_distances(drive)
        if model is not None:
            check_forces(model.vehicle, drive.track, str(drive.path / RUN))
            check_channels(drive, model)
    runs = [run for one in drives for run in driven_stretches(one, least_s(one, vehicle))]
    if vehicle is not None and moves_freely(vehicle):
        runs = [of_rates(run) for run in runs]
    kept = thinned_runs(runs, vehicle) if thin else runs
    return SimulatedRuns(kept) if vehicle is None else SimulatedRuns(kept, steps_hz(vehicle))


def moves_freely(vehicle: Vehicle) -> bool:
    """Whether it is an axis: a mass that no spring holds, which keeps in its place every push that it ever had."""
    return vehicle.model == "single_mass" and vehicle.front.suspension_stiffness_n_per_m == 0


def of_rates(run: Run) -> Run:
    """The run of an axis with the rates of its places in their stead: a small force, or a start that is not known,
    moves a place without bound, and the rate by no more than the damper allows. Rates are those of cubic splines, right
    to a part in 10,000 up to a thirtieth of the sample rate, and have a zero."""
    from scipy.interpolate import CubicSpline

    def is_place(signal: Signal) -> bool:
        return signal.measures in ("displacement", "travel")

    def rate(samples: Array) -> Array:
        return np.asarray(CubicSpline(time_s, samples)(time_s, 1))

    time_s, facts = np.arange(run.count) / run.rate_hz, run.facts
    if not any(map(is_place, (facts.main, *facts.signals))):
        return run
    usable, main = run.usable, facts.main
    if is_place(main):
        if usable is not None:  # what was not read, or clipped, spoils the rates beside it
            usable = np.where(np.convolve(usable != READING, np.ones(5), "same") > 0, NO_READING, usable)
        main = replace(main, measures="velocity")
        facts = replace(facts, step_mps2=None, range_mps2=None, noise_mps2=None)
    more = [rate(samples) if is_place(one) else samples for one, samples in zip(facts.signals, run.more, strict=True)]
    return replace(
        run, measured_mps2=rate(run.measured_mps2) if is_place(facts.main) else run.measured_mps2, usable=usable,
        more=np.array([samples - samples.mean() for samples in more]) if more else run.more,
        facts=replace(facts, main=main, signals=tuple(
            replace(one, measures="velocity") if is_place(one) else one for one in facts.signals)))


def check_distances(drive: Drive) -> None:
    """Raise BadInput for distances that are none: they fall, leap, or have nothing to do with the speed."""
    distance_m = drive.distance_m
    for wrong, words in (
        (np.diff(distance_m) > SPEED.largest / drive.rate_hz + BACK_M, "that grow steadily"),
        (np.maximum.accumulate(distance_m)[:-1] - distance_m[1:] > BACK_M, "that grow, as the car drives forward"),
    ):
        if wrong.any():
            at = int(np.argmax(wrong))
            raise BadInput(f"{drive.file}:{at + 3}: expected distances {words}, found {distance_m[at + 1]:.6g} m after "
                           f"{distance_m[:at + 1].max():.6g} m")
    way_m, by_speed_m = float(distance_m[-1] - distance_m[0]), float(drive.speed_mps.sum() / drive.rate_hz)
    if abs(way_m - by_speed_m) > _DISAGREE * max(way_m, by_speed_m) + _DISAGREE_M:
        raise BadInput(f"{drive.file}: expected speed_mps [m/s] and distance_m [m] to agree, found {by_speed_m:.4g} m "
                       f"from the speed and {way_m:.4g} m from the distance ({likely_unit(by_speed_m, way_m)})")


def driven_stretches(drive: Drive, shortest_s: float = LEAST_S) -> list[Run]:
    """The parts of a drive in which the car moved, or it is known what drove the rig, and there were readings
    (``driven_parts``), each a run. A part says in its name which seconds it is of. BadInput as ``driven_parts``."""
    driven = None
    track = drive.track
    assert track is not None
    if isinstance(track, Excitation):
        near_s, time_s = 0.5 / drive.rate_hz, drive.time_s - drive.time_s[0]
        driven = (time_s > track.start_s - near_s) & (time_s < track.end_s + near_s)
        if drive.facts.main.measures == "force" and drive.marks() is None:
            track = track.answered_by(drive.accel_z_mps2, drive.rate_hz)
    parts = driven_parts(drive, driven, shortest_s)
    whole = len(parts) == 1 and parts[0] == slice(0, len(drive.time_s))
    cut = LeftOut((len(drive.time_s) - sum(part.stop - part.start for part in parts)) / drive.rate_hz, "s",
                  "without excitation or readings")
    def main(part: slice) -> Array:
        samples = drive.accel_z_mps2[part]
        return samples if zero_is_known(drive.facts.main, track) else samples - samples.mean()

    runs = [Run(str(drive.path) if whole else
                f"{drive.path} ({drive.time_s[part.start]:.0f} to {drive.time_s[part.stop - 1]:.0f} s)",
                drive.rate_hz, main(part), drive.distance_m[part], drive.speed_mps[part],
                track.begun(part.start / drive.rate_hz), past_of(track).value, facts=drive.facts,
                usable=drive.marks(part), more=_more(drive, part),
                left_out=(*([cut] if part is parts[0] else []), *no_readings(drive.marks(part))))
            for part in parts]
    return list(map(from_rest, runs))


def from_rest(run: Run) -> Run:
    """The run, with nothing left out for its past where that is known: it rests until it is driven."""
    return replace(run, skip_s=0.0) if _rests_until_driven(run) else run


def _rests_until_driven(run: Run) -> bool:
    """Whether a rig's run begins at rest, as before the first blow of a hammer: until something drives it, each of its
    signals moves by less than its noise, by J. von Neumann's ratio (Annals of Mathematical Statistics 12, 1941), which
    is 2 of white noise and 1 where as much power is motion."""
    track = run.track
    if not isinstance(track, Excitation) or track.moves_part or track.start_s > 0:
        return False
    driven = np.hstack([track.elevation_m.reshape(len(track.elevation_m), -1),
                        *([] if track.force_n is None else [track.force_n])])
    driven = np.abs(driven - driven[0])
    first = int(np.argmax((driven > _NOT_DRIVEN * driven.max(axis=0)).any(axis=1)))
    count = int((first / track.rate_hz + track.start_s) * run.rate_hz)
    still = np.stack([run.measured_mps2, *run.more])[:, :max(count, 0)]
    still = still - still[:, :1]  # exactly 0 where a coarse sensor reads the same throughout
    return count >= _FEWEST_AT_REST and bool((np.diff(still).var(axis=1) >= still.var(axis=1)).all())


def least_s(drive: Drive, vehicle: Vehicle | None = None) -> float:
    """How long a drive, or a test of a part, has to be; of a rig three periods of the vehicle's slowest vibration after
    what is left out for its past, and of one that nothing drives what there is where that is not known [s]."""
    past = past_of(drive.track)
    if past is Past.OF_PART:
        return _LEAST_OF_PART_S
    slowest_hz = 0.0
    if isinstance(drive.track, Excitation) and vehicle is not None:
        slowest_hz = float(undamped_frequencies_hz(structure_of(vehicle))[0])
    if not slowest_hz:
        return 0.0 if past is Past.FREE else LEAST_S
    return min(past.value + _LEAST_PERIODS / slowest_hz, LEAST_S)


def check_decay(drive: Drive) -> None:
    """Raise BadInput for a record that does not die down, of a run that nothing drives: what little damps does so from
    swing to swing, though its second half is hardly less than the first."""
    if past_of(drive.track) is Past.FREE:
        half = len(drive.accel_z_mps2) // 2
        first, last = (float(part.std()) for part in (drive.accel_z_mps2[:half], drive.accel_z_mps2[half:]))
        if last > _DIES_DOWN * first and not _swings_shrink(drive.accel_z_mps2):
            raise BadInput(f"{drive.file}: expected an excitation that moves the rig, or a free decay: nothing drives "
                           f"this record, yet its second half has {last / max(first, 1e-300):.2g} "
                           "times the r.m.s. of the first")


def _swings_shrink(samples: Array) -> bool:
    """Whether the swings, from one peak between zero crossings to the next, fall with time, by C. Spearman's rank
    correlation (American Journal of Psychology 15, 1904)."""
    around = samples - samples.mean()
    starts = np.flatnonzero(np.diff(np.signbit(around), prepend=around[0] < 0))
    peaks = np.maximum.reduceat(np.abs(around), starts)[:-1] if len(starts) else np.empty(0)
    swings = peaks[:-1] + peaks[1:]
    found, p_value = rank_correlation(np.arange(float(len(swings))), swings, fewest=3)
    return found < 0 and p_value / 2 < DOUBT


_ORDERS = {"displacement": 0, "travel": 0, "velocity": 1, "acceleration": 2}


def check_channels(drive: Drive, model: CarModel) -> None:
    """Raise BadInput for a channel of a rig that was at its end or out for a time, which no column ``usable`` says, and
    for a force of the wrong sign, as the model's effects have it act."""
    track, main = drive.track, drive.facts.main
    if not isinstance(track, Excitation):
        return
    read = [(main, drive.accel_z_mps2), *((one, drive.more[one.name]) for one in drive.facts.signals)]
    whole = np.full(len(drive.time_s), True) if drive.usable is None else drive.usable == READING
    to_judge = read if drive.usable is None or drive.guessed else []
    for signal, samples in ((signal, every[whole]) for signal, every in to_judge):
        if (share := float(at_ends(samples).mean())) > _CLIPPED_SHARE:
            raise BadInput(f"{drive.file}: {signal.name}: expected readings, found {share:.0%} of them exactly at the "
                           "largest or smallest value, as from a saturated amplifier. Set a wider range, or add a "
                           "column usable, 2 there and 1 elsewhere (1 everywhere if this is right)")
        if signal.measures == "force" and (still := longest_still(samples, drive.rate_hz)):
            from_s, to_s = (float(drive.time_s[whole][min(one, len(samples) - 1)]) for one in still)
            raise BadInput(f"{drive.file}: {signal.name}: expected readings, found {samples[still[0]]:g} from "
                           f"{from_s:.4g} to {to_s:.4g} s, as from a disconnected cable: add a column usable, 0 there "
                           "and 1 elsewhere (1 everywhere if this is right)")
    times_s = track.start_s + np.arange(len(track.elevation_m)) / track.rate_hz

    def then(samples: Array) -> Array:
        return np.interp(drive.time_s - drive.time_s[0], times_s, samples)

    part = track.moves_part and main.measures == "force"
    alone = (model.vehicle.model == "single_mass" and track.acts_on == (("body",),) and main.measures in _ORDERS
             and not track.elevation_m.any())
    if part and goes_against(drive.accel_z_mps2, then(track.elevation_m), 0, range(2), drive.rate_hz):
        raise BadInput(f"{drive.file}: {main.name}: expected the force that pulls the part back, positive when it is "
                       "longer, found the opposite sign: change the sign of the force or of displacement_m")
    with as_bad_input(model.vehicle.name):
        acting_n = track.as_it_is((), compose(model.vehicle, model.effects).structure.actuators).force_n
    if alone and acting_n is not None and goes_against(
            then(acting_n[:, 0]), drive.accel_z_mps2, _ORDERS[main.measures], range(3), drive.rate_hz):
        raise BadInput(f"{drive.file}: {main.name}: expected it to follow {track.forces[0].name}, found the opposite "
                       "sign: change the sign of one of them (both are positive up)")


def driven_parts(drive: Drive, on_rig: Bools | None = None, shortest_s: float = LEAST_S) -> list[slice]:
    """Where in a drive the car moved, or was driven ``on_rig`` (n,), and there were readings.

    A gap between readings is left in a part, as samples that nobody read: a cut there would lose the next ``SKIP_S`` as
    well. One that lasts longer than that is cut out, and so are those at the ends of a part.

    Raises BadInput where no part has readings for so long (``least_s``).
    """
    driven = drive.speed_mps >= SLOWEST_MPS if on_rig is None else on_rig
    read = driven if drive.usable is None else driven & (drive.usable != NO_READING)
    kept = read.copy()
    for gap in map(slice, *stretches_of(driven & ~read)):
        between = gap.start > 0 and gap.stop < len(read) and read[gap.start - 1] and read[gap.stop]
        kept[gap] = between and gap.stop - gap.start <= SKIP_S * drive.rate_hz
    parts = [part for part in map(slice, *stretches_of(kept))
             if np.count_nonzero(read[part]) >= shortest_s * drive.rate_hz]
    if not parts:
        moving = f" at {SLOWEST_MPS:g} m/s or faster" if on_rig is None else " while its excitation lasts"
        raise BadInput(f"{drive.path}: expected {shortest_s:.3g} s with readings{moving}, without a break of more "
                       f"than {SKIP_S:g} s")
    return parts


def _more(drive: Drive, part: slice) -> Array:
    """The other signals (s, n) of a part of a drive, without their means."""
    columns = [drive.more[one.name][part] for one in drive.facts.signals]
    return np.stack([one - one.mean() for one in columns]) if columns else np.empty((0, 0))


def thinned_runs(runs: Sequence[Run], vehicle: Vehicle | None = None) -> list[Run]:
    """Runs of one rate, of about 100 samples a second, or as many as the ``vehicle`` needs, and on a rig what it lacks,
    if they had many more. What is thinned is no longer rounded; a sample is as usable as the least of those beside it.

    Little of a car's motion lies where the recorder's filter begins; what jerks a rig of little mass is there as well,
    so that its record goes through the filter that its model goes through.
    """
    def factor_to(needed_hz: float) -> int:
        return int(runs[0].rate_hz / needed_hz + 0.25)  # nearly twice as many are thinned as well

    factor = factor_to(_needed_hz(vehicle))
    if factor > 1 and vehicle is not None and runs[0].timed:
        predictions = SimulatedRuns(runs, steps_hz(vehicle)).predict(compose(vehicle, []))
        lacks_hz = max(unexplained_up_to_hz(run, run.main(one)) for run, one in zip(runs, predictions, strict=True))
        factor = min(factor, max(factor_to(lacks_hz / HIGHEST_OF_RATE), 1))
    if factor < 2:
        return list(runs)

    def fewer(one: Run, samples: Array) -> Array:
        return resampled(samples, factor) if one.timed else thinned(samples, factor)

    return [replace(one, rate_hz=one.rate_hz / factor, thinned_by=factor, measured_mps2=fewer(one, one.measured_mps2),
                    distance_m=one.distance_m[::factor], speed_mps=one.speed_mps[::factor],
                    facts=replace(one.facts, step_mps2=None), usable=_thinned_marks(one.usable, factor),
                    more=np.array([fewer(one, samples) for samples in one.more]) if one.signals else one.more)
            for one in runs]


def unexplained_up_to_hz(run: Run, prediction: Array) -> float:
    """The frequency above which a prediction (n,) leaves less than a per cent of the power that was measured: the share
    that ITU-R SM.328 leaves out of an occupied bandwidth. The quietest of 20 bands of the residual is noise. A part of
    a rig that its model lacks may swing above all that the model has."""
    from scipy.signal import welch

    f_hz, density = welch(np.stack([run.measured_mps2, run.measured_mps2 - prediction]), run.rate_hz,
                          nperseg=min(run.count, int(BLOCK_S * run.rate_hz)))
    noise = min(band.mean() for band in np.array_split(density[1], min(20, len(f_hz))))
    above = np.cumsum((density[1] - noise)[::-1])[::-1]
    return float(max(f_hz[above > 0.01 * density[0].sum()], default=f_hz[1]))


def _thinned_marks(usable: Array | None, factor: int) -> Array | None:
    """What every ``factor``-th sample is (n,), with those within reach of it: none where one has no reading, else
    clipped where one is."""
    if usable is None:
        return None

    def near(mark: float) -> Bools:
        around = np.pad(np.asarray(usable == mark, bool), factor)
        return np.asarray(np.lib.stride_tricks.sliding_window_view(around, 2 * factor + 1)[::factor].max(axis=1))

    return np.where(near(NO_READING), NO_READING, np.where(near(CLIPPED), CLIPPED, READING))


def _needed_hz(vehicle: Vehicle | None) -> float:
    """Samples a second that the lab needs: what it looks at reaches an octave above the vehicle's quickest vibration.
    """
    enough_hz = 100.0  # for most: what the lab looks at of a car lies below 40 Hz
    if vehicle is None:
        return enough_hz
    return max(enough_hz, 2 * float(undamped_frequencies_hz(structure_of(vehicle))[-1]) / HIGHEST_OF_RATE)


def _least_hz(drive: Drive, vehicle: Vehicle | None) -> tuple[float, str]:
    """The fewest samples a second that show what the lab looks at, and what that is: on a rig the vehicle's slowest
    vibration, and on a road the wheels' hop."""
    if vehicle is None or drive.track is None or not drive.track.timed:
        return _LEAST_RATE_HZ, "the wheels hop"
    slowest_hz = float(undamped_frequencies_hz(structure_of(vehicle))[0])
    return slowest_hz / HIGHEST_OF_RATE, f"its vibration at {slowest_hz:.3g} Hz"


def check_rate(drive: Drive, vehicle: Vehicle | None) -> None:
    """Raise BadInput for a drive of fewer samples a second than what is looked at needs."""
    least_hz, seen = _least_hz(drive, vehicle)
    if drive.rate_hz < (1 - _CLOCK) * least_hz:
        raise BadInput(f"{drive.file}: expected {least_hz:.4g} samples a second or more, to see {seen}, found "
                       f"{drive.rate_hz:.4g}{time_hint(drive.rate_hz)}")


def check_record(drive: Drive, others: Sequence[Drive], vehicle: Vehicle | None = None) -> None:
    """Raise BadInput for a drive of fewer samples a second than what is looked at needs, that is too short, has
    another rate than the others, recorded nothing, or repeats samples."""
    shortest_s = least_s(drive, vehicle)
    check_rate(drive, vehicle)
    lasts_s = len(drive.time_s) / drive.rate_hz
    if lasts_s < shortest_s:
        raise BadInput(f"{drive.file}: expected a record of {shortest_s:.3g} s or longer, found {lasts_s:.3g} s")
    check_readings(drive, others)
    for signal in drive.facts.signals:
        _check_varies(drive, signal, drive.more[signal.name], signal.name)


def _check_varies(drive: Drive, signal: Signal, samples: Array, said: str) -> None:
    """Raise BadInput for a signal that is one number wherever it counts."""
    past_s = past_of(drive.track).value
    counted = samples[int(past_s * drive.rate_hz):]
    if np.ptp(counted) == 0:
        found = f"{counted[0]:g} {signal.unit} throughout" if counted[0] else "zeros only"
        raise BadInput(f"{drive.file}: expected {said} after the first {past_s:g} s, found {found}")


def check_readings(drive: Drive, others: Sequence[Drive]) -> None:
    """Raise BadInput for a drive of another rate than the others, or whose first signal has another unit, that recorded
    nothing, or gravity as well, does not die down, or repeats samples."""
    past_s = past_of(drive.track).value
    if others and abs(drive.rate_hz / others[0].rate_hz - 1) > _SAME_RATE:
        raise BadInput(f"{drive.file}: expected {others[0].rate_hz:g} samples a second, as in {others[0].path}, found "
                       f"{drive.rate_hz:g}")
    main, first = (one.facts.main for one in (drive, (*others, drive)[0]))
    if main.unit != first.unit:  # errors of all runs are summed
        raise BadInput(f"{drive.file}: expected a column {first.name}, as in {others[0].path}, found {main.name} "
                       "first")
    counted = drive.accel_z_mps2[int(past_s * drive.rate_hz):]
    is_acceleration = drive.facts.main.measures == "acceleration"
    _check_varies(drive, drive.facts.main, drive.accel_z_mps2,
                  "accelerations" if is_acceleration else drive.facts.main.name)
    check_decay(drive)
    if is_acceleration and counted.std() < QUIETEST_MPS2:
        raise BadInput(f"{drive.file}: expected accelerations in m/s2, found none above {np.abs(counted).max():.2g}")
    # Three periods of what rings loudly have a mean of their own, and so has what moves for a short time: at most the
    # range of its speed over that time.
    own_mean_mps2 = counted.std() if past_of(drive.track) is Past.FREE else float(
        np.ptp(np.cumsum(counted - counted.mean()))) / len(counted)
    if is_acceleration and abs(counted.mean()) > max(_MOST_MEAN_MPS2, own_mean_mps2):
        raise BadInput(f"{drive.file}: expected gravity to be removed, found {counted.mean():.3g} m/s2 on average")
    # What was laid across gaps is on no step of a coarse sensor, and one at the end of its range rightly stays there.
    read = drive.accel_z_mps2 if drive.usable is None else drive.accel_z_mps2[drive.usable == READING]
    if drive.facts.main.never_repeats and (repeats := find_repeats(read[:, None])):
        raise BadInput(f"{drive.file}: {repeats.complaint}: write a record only as often as the sensor is read")
