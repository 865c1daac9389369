"""Whether a model and runs belong together, before anything is concluded from them: wrong input is no physics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from math import log
from statistics import median
from typing import TYPE_CHECKING

from logger.errors import BadInput
from logger.units import FOOT_M, STANDARD_GRAVITY_MPS2

if TYPE_CHECKING:
    from logger.lab.another_car import AnotherCar
    from logger.lab.road_match import RoadMatch
    from logger.runs import Array, Run
    from logger.simulation.simulated_runs import SimulatedRuns
    from logger.store.formats.vehicle_file import Model
    from logger.vehicle.compose import Car
    from logger.vehicle.effect import Chosen, Effect

_LEAST_MPS2 = 1e-4
_NEAR = 0.3
_RECORD, _PROFILE = "the record seems to be", "the profile seems to be"
# Measured / model, where one of them is in another unit.
_UNITS = (
    (_RECORD, "g", 1 / STANDARD_GRAVITY_MPS2), (_RECORD, "thousandths of g", 1000 / STANDARD_GRAVITY_MPS2),
    (_RECORD, "mm/s2", 1000.0), (_RECORD, "ft/s2", 1 / FOOT_M),
    (_PROFILE, "mm", 0.001), (_PROFILE, "cm", 0.01), (_PROFILE, "inches", FOOT_M / 12), (_PROFILE, "feet", FOOT_M),
)
_SENSOR_GAIN = (0.2, 5.0)
"""Within these a factor may be a sensor's: the bounds of the effect ``sensor_gain``."""
ANYWAY = "--anyway goes on"
_NAMED = 4
"""Of the numbers of another car, so many are said."""


def check_model(word: str, model: Model, runs: SimulatedRuns, warn: Callable[[str], None], known: Mapping[str, Effect],
                numbers: float, anyway: bool = False) -> list[Array]:
    """What the model predicts (n,) per run. Raises BadInput where an effect of the model cannot be on one of the runs,
    the model's motion grows without bound, or the road moves no car; and where the sensor was upside down, a run or its
    profile is in another unit, or the road or the car is another one, unless the user wants to go on ``anyway`` (then
    it is a warning).

    word       by which the user knows the vehicle
    known      effects, by name: where one of them explains the runs as another car would, it may be this car
    numbers    deviation of what the car's numbers are usually off by, as a share
    """
    from logger.vehicle.compose import compose

    predictions = check_moves(word, model, runs)
    car = compose(model.vehicle, model.effects)
    followed = _followed(runs, predictions, car)
    # One after the other: whether it is the car is asked of runs that are right, and takes seconds.
    _say(chain(_other_ways_up(runs, followed), _other_units(runs, followed), _other_roads(runs, followed, car),
               _another_car(word, model, runs, predictions, known, numbers)), warn, anyway)
    return predictions


def check_moves(word: str, model: Model, runs: SimulatedRuns) -> list[Array]:
    """What the model predicts (n,) per run, whatever was measured. Raises BadInput where an effect of the model cannot
    be on one of the runs, the model's motion grows without bound, or the road moves no car."""
    for run in runs.runs:
        for one in model.effects:
            why = one.effect.obstacle_on(model.vehicle, run.two_tracks, run.timed)
            if why is not None:
                raise BadInput(f"{word}: its effect {one.effect.name} cannot be on {run.name}: {why}")
    predictions = predicted(word, model, runs, model.effects)
    if not any(map(_moves, runs.runs, predictions)):
        raise BadInput(f"{runs.runs[0].name}: expected " + (
            "an excitation that moves the car; it is flat while the record lasts" if runs.runs[0].timed else
            "a drive over a road that moves the car; where it was the profile is flat, or it stood still"))
    return predictions


def check_roads(word: str, model: Model, runs: SimulatedRuns, warn: Callable[[str], None], anyway: bool) -> None:
    """Raise BadInput where a run was driven over another road than that of its profile, as ``check_model``: all that
    can be asked where the vehicle's numbers may be far off."""
    from logger.vehicle.compose import compose

    car = compose(model.vehicle, model.effects)
    followed = _followed(runs, predicted(word, model, runs, model.effects), car)
    _say(_other_roads(runs, followed, car), warn, anyway)


def predicted(word: str, model: Model, runs: SimulatedRuns, effects: Sequence[Chosen]) -> list[Array]:
    """What the car with these effects would have recorded. BadInput where it shakes itself to pieces."""
    from logger.vehicle.compose import bounded, compose

    try:
        predictions = runs.predict(compose(model.vehicle, effects))
    except ValueError as error:
        raise BadInput(f"{word}: {error}") from None
    if not bounded(predictions):
        names = " and ".join(one.effect.name for one in effects)
        raise BadInput(f"{word}: with {names} the car's motion grows without bound")
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
    within the half wave at hand. What is wrong with a whole record, its sign or its unit, is wrong in both bands."""

    pairs: list[tuple[Run, Array]]
    body_hz: Array

    @cached_property
    def band_hz(self) -> tuple[float, float]:
        from logger.lab.road_match import bounce_band_hz

        return bounce_band_hz(self.body_hz)

    @cached_property
    def around(self) -> list[RoadMatch]:
        from logger.lab.road_match import road_match

        return [road_match(run, prediction, self.band_hz) for run, prediction in self.pairs]

    @cached_property
    def below(self) -> list[RoadMatch]:
        from logger.lab.road_match import below_bounce_band_hz, road_match

        band_hz = below_bounce_band_hz(self.body_hz)
        return [road_match(run, prediction, band_hz) for run, prediction in self.pairs]

    @cached_property
    def below_at_hand(self) -> list[RoadMatch]:
        from logger.lab.road_match import match_below_bounce

        return [match_below_bounce(run, prediction, self.body_hz) for run, prediction in self.pairs]


def _followed(runs: SimulatedRuns, predictions: Sequence[Array], car: Car) -> _Followed:
    from logger.vehicle.models import structure_of
    from logger.vehicle.modes import undamped_frequencies_hz

    structure = structure_of(car.vehicle)
    return _Followed([(run, run.main(one)) for run, one in zip(runs.runs, predictions, strict=True)],
                     undamped_frequencies_hz(structure)[: -len(structure.wheels)])


def _moves(run: Run, prediction: Array) -> bool:
    model = run.main(prediction)[run.first:]
    return float(model @ model) >= _LEAST_MPS2**2 * len(model)


def _other_ways_up(runs: SimulatedRuns, followed: _Followed) -> Iterator[str]:
    """Which runs are upside down."""
    for k, (run, around) in enumerate(zip(runs.runs, followed.around, strict=True)):
        if around.is_upside_down and (below := followed.below_at_hand[k]).turned > below.correlation:
            yield (f"{run.name}: expected accelerations up positive, found them upside down: turned over, they go with "
                   f"the model (correlation {around.turned:.2f})")


def _other_units(runs: SimulatedRuns, followed: _Followed) -> Iterator[str]:
    """Which runs or profiles are in another unit, the nearest one. A factor that a sensor's gain may be is a unit only
    if it is one, and all runs agree, and below the bounce the median of the runs as well: there the body moves with the
    road whatever is missing, but one run holds few such waves."""
    clear = [(run.name, around.gain, below.gain) for run, around, below in
             zip(runs.runs, followed.around, followed.below, strict=True) if around.is_clear]
    for name, gain, _ in clear:
        what, unit, size = min(_UNITS, key=lambda one: abs(log(gain / one[2])))
        of_a_sensor = _SENSOR_GAIN[0] < gain < _SENSOR_GAIN[1]
        gains = [*(around for _, around, _ in clear), median(below for _, _, below in clear)]
        if not of_a_sensor or all(abs(one / size - 1) < _NEAR for one in gains):
            yield (f"{name}: expected accelerations in m/s2 and elevations in m, found {gain:.3g} times what the model "
                   f"says: {what} in {unit}")


def _other_roads(runs: SimulatedRuns, followed: _Followed, car: Car) -> Iterator[str]:
    """Which runs do not follow their road, and where they would fit."""
    from logger.lab.road_match import pool

    strangers = [k for k, one in enumerate(followed.around) if one.is_refuted]
    if not strangers and pool(followed.around).is_refuted:
        strangers = list(range(len(followed.around)))
    for k in strangers:
        found, run = followed.around[k], runs.runs[k]
        what = "a record of what its excitation does" if run.timed else "a drive over the road of its profile"
        yield (f"{run.name}: expected {what}, found one that does not follow it (correlation {found.correlation:.2f} "
               f"around the body's bounce, by chance up to {found.chance:.2f}): {_advice(run, car, followed.band_hz)}")


def _another_car(word: str, model: Model, runs: SimulatedRuns, predictions: Sequence[Array],
                 known: Mapping[str, Effect], numbers: float) -> Iterator[str]:
    """That the runs are of another car, which explains them as no effect does, and how it differs."""
    from logger.lab.another_car import another_car
    from logger.vehicle.stepping_loop import COMPILED

    mains = [run.main(one) for run, one in zip(runs.runs, predictions, strict=True)]
    found = another_car(runs.runs, model.vehicle, model.effects, mains, numbers)
    if found is not None and not _explained_by_an_effect(found, model, known, numbers):
        far = list(found.shares.items())[:_NAMED]
        more = f" and {len(found.shares) - _NAMED} more numbers far off" if len(found.shares) > _NAMED else ""
        yield (f"{runs.runs[0].name}: expected a drive of the car in {word}, found one of another car: this one says "
               f"next to nothing of it (error {found.error:.2f}), one with "
               f"{', '.join(f'{name} {share:+.0%}' for name, share in far)}{more} leaves {found.found_error:.2f}. "
               "Is it another car's file? ridelog identify fits a car's numbers"
               + ("" if COMPILED else "; effects that are forces were not tried, which takes the lab extra"))


def _explained_by_an_effect(found: AnotherCar, model: Model, known: Mapping[str, Effect], numbers: float) -> bool:
    """Whether an effect, in the model's car, explains as much as another car does."""
    from logger.lab.best_effect import error_with_best_effect

    return error_with_best_effect(found.runs, model.vehicle, model.effects, known, numbers) <= found.found_error


def _advice(run: Run, car: Car, band_hz: tuple[float, float]) -> str:
    """Where a run that does not follow its road would fit."""
    from logger.lab.road_match import better_placement
    from logger.profiles.track import Track
    from logger.simulation.simulated_runs import SimulatedRuns

    track = run.track
    if not isinstance(track, Track):
        return "is it another run's excitation, or another clock's?"
    reverse = Track(track.spacing_m, track.elevation_m[::-1].copy(), track.start_m)
    both = {False: SimulatedRuns([run]), True: SimulatedRuns([replace(run, track=reverse)])}

    def predict(farther_m: Array, backwards: bool) -> Array:
        return run.main(both[backwards].predict(car, [farther_m], rough=True)[0])

    found = better_placement(run, predict, band_hz, (track.start_m, track.end_m))
    if found is None:
        return "it fits nowhere on it. Is it the profile of another road, or another drive's record?"
    if found.backwards:
        return "it follows the profile read backwards. Was it driven in the other direction?"
    return f"it fits about {found.farther_m:+.0f} m farther along. Do distances begin where the profile does?"
