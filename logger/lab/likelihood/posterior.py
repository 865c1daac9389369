"""The posterior of a car with effects, given runs: predictions, residuals, likelihood and priors."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.distance_error import USUAL, ErrorSize, record_error
from logger.lab.likelihood.priors import Tolerance, VehiclePrior
from logger.lab.likelihood.signals import Readings, bands_of, deviance
from logger.profiles.excitation import Excitation
from logger.profiles.track import WheelTracks
from logger.runs import normalised_rms_error
from logger.simulation.virtual_drive import Beginning, SimulatedRuns
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Predict = Callable[[Sequence[Chosen], Array, Sequence[Array]], list[Array]]
"""Predictions (n,) per run by effects, the car's numbers and the record's errors."""
NotSimulated = (np.linalg.LinAlgError, OverflowError)
"""What a prediction raises of a car that cannot be simulated, as its numbers are too far off."""


@dataclass(frozen=True, eq=False)
class State:
    """A model with all its numbers, and its predictions.

    effects       with their values
    logs          logarithms of the car's numbers over the nominal ones (p,)
    record        numbers of the ``RecordError`` of each run (k,)
    size          of the distance errors
    predictions   of each run, whole, the record's error included (n,) [m/s2]; other signals are joined to it
    """

    effects: tuple[Chosen, ...]
    logs: Array
    record: list[Array]
    size: ErrorSize
    predictions: list[Array]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects, in order."""
        return tuple(one.effect.name for one in self.effects)


class Posterior:
    """Runs, a nominal vehicle, and priors of its numbers and of the runs' records.

    start_vehicle    where fits begin, if not at the nominal vehicle
    prior            of the vehicle's numbers; None: that of the tolerance
    readings         what predictions are compared with, per run; None: readings with their rounding taken as noise

    size_mps2 is the r.m.s. of what was measured, by which errors are divided.
    """

    def __init__(self, runs: SimulatedRuns, vehicle: Vehicle, tolerance: Tolerance,
                 start_vehicle: Vehicle | None = None, prior: VehiclePrior | None = None,
                 readings: Sequence[Readings] | None = None) -> None:
        self.runs, self.vehicle, self.tolerance = runs, vehicle, tolerance
        self.start_vehicle = start_vehicle or vehicle
        self.prior = prior or VehiclePrior.of(vehicle, tolerance)
        scale_std = self.prior.scale_deviation if self.shows_forces else 0.0
        self.record_errors = [record_error(run, tolerance, scale_std) for run in runs.runs]
        self.bands = [bands_of(run) for run in runs.runs]
        self.readings = list(map(Readings.of, runs.runs)) if readings is None else list(readings)
        counted = np.concatenate([run.kept_mps2[run.read[run.first:]] for run in runs.runs])
        self.size_mps2 = float(np.sqrt((counted**2).mean()))
        self.freedom = float(sum(one.freedom.sum() for one in self.bands))
        self._inputs: dict[tuple[float, float], list[WheelTracks]] = {}
        self._predicted: dict[Hashable, list[Array]] = {}

    @property
    def shows_forces(self) -> bool:
        """Whether a force was measured, that drives a rig or that a part pulls back with: else a car in which all
        masses and forces are larger by one factor moves the same."""
        return self.measures_forces or any(isinstance(run.track, Excitation) and run.track.forces
                                           for run in self.runs.runs)

    @property
    def measures_forces(self) -> bool:
        """Whether a signal is a force."""
        return any(signal.measures == "force" for run in self.runs.runs for signal in (run.facts.main, *run.signals))

    @property
    def ends(self) -> Array:
        """Lowest and highest logarithms of the car's numbers (2, p) that a fit goes to."""
        starts = self.prior.logs(self.vehicle, self.start_vehicle)
        return np.stack([np.minimum(starts, 0.0) - self.prior.reach, np.maximum(starts, 0.0) + self.prior.reach])

    def simulated(self, fine_hz: float) -> Posterior:
        """The posterior with runs simulated in so many steps a second."""
        found = copy(self)
        found.runs = self.runs.in_steps(fine_hz)
        return found

    def with_free_gains(self) -> Posterior:
        """The posterior with the gains free that fits hold; itself where none is held."""
        if not any(one.scale_std for one in self.record_errors):
            return self
        found = copy(self)
        found.record_errors = [replace(one, scale_std=0.0) for one in self.record_errors]
        return found

    def with_rounding_at(self, state: State) -> Posterior:
        """The posterior with rounded readings taken for bounds, given the predictions of a state; itself where rounding
        is noise in all of them."""
        readings = [one.given(prediction) for one, prediction in zip(self.readings, state.predictions, strict=True)]
        if all(one.rounding_is_noise for one in (*readings, *self.readings)):
            return self
        return self._with_readings(readings)

    def without_rounding(self) -> Posterior:
        """The posterior with all rounding taken as noise."""
        if all(one.rounding_is_noise for one in self.readings):
            return self
        return self._with_readings(list(map(Readings.of, self.runs.runs)))

    def _with_readings(self, readings: list[Readings]) -> Posterior:
        found = copy(self)
        found.readings = readings
        return found

    def car(self, effects: Sequence[Chosen], logs: Array) -> Car:
        """The car with these numbers and effects."""
        return compose(self.prior.vehicle(self.vehicle, logs), effects)

    def distance_error_m(self, record: Sequence[Array]) -> list[Array]:
        """Distance driven minus distance recorded (n,) [m], per run."""
        return [one.distance_error_m(k) for one, k in zip(self.record_errors, record, strict=True)]

    def predict(self, effects: Sequence[Chosen], logs: Array, record: Sequence[Array], rough: bool = False,
                near: Sequence[Beginning | None] | None = None) -> list[Array]:
        """Predicted record of each run (n,); arguments as of ``SimulatedRuns.predict``. Those of the cars that were
        asked for last are kept, as many as a set of derivatives takes: a fit asks for the one that it is at for its
        fine and rough record, its cost, and each such set."""
        key = (self.runs, *((one.effect, *one.values.items()) for one in effects), logs.tobytes(),
               *(k.tobytes() for k in record), rough, near if near is None else tuple(near))
        known = dict(self._predicted)
        if (found := known.pop(key, None)) is None:
            predictions = self.runs.predict(self.car(effects, logs), self.distance_error_m(record), rough, near=near)
            found = [one.with_recorder_error(prediction, k) for one, prediction, k in zip(
                self.record_errors, predictions, record, strict=True)]
            if len(known) > len(logs) + sum(len(one.values) for one in effects):
                del known[next(iter(known))]
        known[key] = found
        self._predicted = known
        return list(found)

    def beginnings(self, effects: Sequence[Chosen], logs: Array, record: Sequence[Array]) -> list[Beginning | None]:
        """How the runs begin, by a rough simulation, whose initial state nobody knows; None of the others."""
        return self.runs.beginnings(self.car(effects, logs), self.distance_error_m(record))

    def predictor(self, state: State) -> Predict:
        """A function that predicts models near a state: by rough simulations, corrected by the difference of a fine and
        a rough one of the state itself."""
        given = state.effects, state.logs, state.record
        fine, near = state.predictions or self.predict(*given), self.beginnings(*given)
        off = [one - rough for one, rough in zip(fine, self.predict(*given, rough=True, near=near), strict=True)]

        def predict(effects: Sequence[Chosen], logs: Array, record: Sequence[Array]) -> list[Array]:
            there = self.predict(effects, logs, record, rough=True, near=near)
            return [one + more for one, more in zip(there, off, strict=True)]

        return predict

    def state_at(self, effects: Sequence[Chosen], logs: Array, record: Sequence[Array] | None = None,
           size: ErrorSize = USUAL) -> State:
        """The state with these numbers; ``record`` None: exact records."""
        found = [np.zeros(one.count) for one in self.record_errors] if record is None else list(record)
        return State(tuple(effects), logs, found, size, self.predict(effects, logs, found))

    def start(self, effects: Sequence[Chosen] = ()) -> State:
        """The state of the vehicle that fits begin at, with these effects."""
        return self.state_at(effects, self.prior.logs(self.vehicle, self.start_vehicle))

    def residuals(self, state: State) -> list[Array]:
        """Measured minus predicted (n,), per run."""
        return self.residuals_of(state.predictions)

    def residuals_of(self, predictions: Sequence[Array]) -> list[Array]:
        """Readings minus predictions (n,), per run."""
        return [one.residual(prediction) for one, prediction in zip(self.readings, predictions, strict=True)]

    def without_insensitive_samples(self, columns: Sequence[Array], predictions: Sequence[Array]) -> list[Array]:
        """Derivatives of predictions in each run, (n,) or (m, n), zero where its readings would not change."""
        return [readings.without_insensitive_samples(one, prediction) for readings, one, prediction in zip(
            self.readings, columns, predictions, strict=True)]

    def carried_noise(self, state: State, draw: int) -> list[Array]:
        """Changes (n,) of the predictions, per run, by noise like what is still in the measured input of a rig, signals
        joined: what the model makes of it in each. One draw of the noise by its number."""
        return self._changed_by(state, [
            one.with_noise_left(draw, index) if isinstance(one, Excitation) and one.is_noisy else one
            for index, one in enumerate(run.track for run in self.runs.runs)])  # repeats have noise of their own

    def carried_gain(self, state: State) -> list[Array]:
        """The same by one standard deviation of the gain of what measured the input."""
        gain = 1 + self.tolerance.scale
        return self._changed_by(state, self._input_times(gain, gain))

    def size_slopes(self, state: State, carried_gain: Sequence[Array] = ()) -> list[Array]:
        """Derivatives (1, n) of the predictions, per run, by the logarithm of all masses and forces of the car and of
        its effects together: what forces that drive it do less. With the ``carried_gain`` of the state (2, n), by that
        of all lengths and forces, too: what was measured of the motion is larger by it, what the input does with it
        less."""
        step = self.tolerance.scale
        slopes = [-one[None] / step for one in self._changed_by(state, self._input_times(1.0, 1 + step))]
        if not carried_gain:
            return slopes
        moves = (one.reshape(-1, run.count) for one, run in zip(state.predictions, self.runs.runs, strict=True))
        return [np.vstack([of_mass, (move - move.mean(axis=1, keepdims=True)).ravel() - driven / step])
                for of_mass, move, driven in zip(slopes, moves, carried_gain, strict=True)]

    def _input_times(self, table: float, forces: float) -> list[WheelTracks]:
        if (by := (table, forces)) not in self._inputs:  # simulations are prepared once for each such object
            self._inputs[by] = [one.times(*by) if isinstance(one, Excitation) and (table != 1 or one.forces) else one
                                for one in (run.track for run in self.runs.runs)]
        return self._inputs[by]

    def _changed_by(self, state: State, tracks: Sequence[WheelTracks]) -> list[Array]:
        if all(one is run.track for one, run in zip(tracks, self.runs.runs, strict=True)):
            return [np.zeros_like(one) for one in state.predictions]
        there = self.runs.predict(self.car(state.effects, state.logs), self.distance_error_m(state.record),
                                  tracks=tracks)
        return [error.with_recorder_error(one, k) - here for error, one, k, here in zip(
            self.record_errors, there, state.record, state.predictions, strict=True)]

    def deviance(self, state: State) -> float:
        """Minus twice the log-likelihood, with the most likely noise levels."""
        return deviance(self.bands, self.residuals(state))

    def cost(self, state: State) -> float:
        """Minus twice the log-density of the priors of the car's numbers and of the record's errors."""
        return self.prior.cost(state.logs) + state.size.cost + sum(
            float(k @ one.precision(state.size) @ k) for one, k in zip(self.record_errors, state.record, strict=True))

    def error(self, state: State) -> float:
        """Normalised r.m.s. error of all samples that count."""
        return normalised_rms_error(self.runs.runs, state.predictions)

    def number_slopes(self, state: State, steps: Array) -> list[Array]:
        """Derivatives of the predictions by the logarithms of the car's numbers: (p, n) per run, of rough simulations,
        which are near enough: of a linear car all at once, else by differences over steps (p,).

        Where only the prior knows the common scale of masses and forces, the derivatives by all of them cancel. Those
        by one-sided differences of a mode that little damps do not: they would measure the scale. There the differences
        are central; those of a model with effects are rid of the scale with theirs."""
        error_m, car = self.distance_error_m(state.record), partial(self.car, state.effects)
        exact, slopes = self.runs.linear_slopes(car, state.logs, error_m)
        rest = steps.copy()
        rest[exact] = 0.0
        if not rest.any():
            return slopes
        near = self.beginnings(state.effects, state.logs, state.record)

        def predict(logs: Array) -> list[Array]:
            return self.runs.predict(car(logs), error_m, rough=True, near=near)

        here = predict(state.logs)
        found = derivatives(predict, state.logs, rest, here)
        if exact:
            for one, more in zip(found, slopes, strict=True):
                one[exact] = more
        elif self.prior.is_vague and not self.shows_forces and not state.effects:
            below = derivatives(predict, state.logs, -rest, here)
            found = [(one + other) / 2 for one, other in zip(found, below, strict=True)]
        return found


def derivatives(predict: Callable[[Array], Sequence[Array]], here: Array, steps: Array,
                predictions: Sequence[Array]) -> list[Array]:
    """Derivatives (m, n) per run of predictions (n,) by numbers (m,), by differences over steps (m,);
    0 where such a step is 0."""
    found = [np.zeros((len(steps), len(one))) for one in predictions]
    for index in np.flatnonzero(steps):
        step, there = steps[index], here.copy()
        there[index] += step
        for column, high, low in zip(found, predict(there), predictions, strict=True):
            column[index] = (high - low) / step
    return found
