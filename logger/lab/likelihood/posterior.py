"""The posterior of a car with effects, given runs: predictions, and what each state of it costs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.clocked_record import record_error
from logger.lab.likelihood.distance_error import USUAL, ErrorSize
from logger.lab.likelihood.priors import Tolerance, VehiclePrior
from logger.lab.likelihood.readings import Readings
from logger.lab.likelihood.signals import bands_of
from logger.lab.likelihood.whittle import deviance
from logger.runs import normalised_rms_error
from logger.simulation.simulated_runs import SimulatedRuns, steps_hz
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]
Predict = Callable[[Sequence[Chosen], Array, Sequence[Array]], list[Array]]
"""Predictions (n,) per run by effects, the car's numbers and the record's errors."""


@dataclass(frozen=True, eq=False)
class State:
    """A model with all its numbers, and what it predicts.

    effects       with their values
    logs          (p,) logarithms of the car's numbers over the nominal ones
    record        (k,) per run, numbers of its ``RecordError``
    size          of the distance errors
    predictions   (n,) per run, whole, the record's error included [m/s2]; other signals are joined to it
    """

    effects: tuple[Chosen, ...]
    logs: Array
    record: list[Array]
    size: ErrorSize
    predictions: list[Array]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects, in order."""
        return tuple(one.effect.name for one in self.effects)


class Posterior:
    """SimulatedRuns, a nominal vehicle, and priors of what may be a little off.

    stands    the vehicle as it stands, where fits begin, if that is another than the nominal one
    prior     of the vehicle's numbers; None: that of the tolerance
    readings  what predictions are compared with, per run; None: the readings as they were read

    size_mps2 is the r.m.s. of what was measured, by which errors are divided.
    """

    def __init__(self, runs: SimulatedRuns, vehicle: Vehicle, tolerance: Tolerance, stands: Vehicle | None = None,
                 prior: VehiclePrior | None = None, readings: Sequence[Readings] | None = None) -> None:
        self.runs, self.vehicle, self.tolerance = runs, vehicle, tolerance
        self.stands = stands or vehicle
        self.prior = prior or VehiclePrior.of(vehicle, tolerance)
        self.record_errors = [record_error(run, tolerance) for run in runs.runs]
        self.bands = [bands_of(run) for run in runs.runs]
        self.readings = list(map(Readings.of, runs.runs)) if readings is None else list(readings)
        counted = np.concatenate([run.kept_mps2[run.read[run.first:]] for run in runs.runs])
        self.size_mps2 = float(np.sqrt((counted**2).mean()))
        self.freedom = float(sum(one.freedom.sum() for one in self.bands))

    def without_wall(self, fine: bool = False) -> Posterior:
        """The same with a car that may bend as far as the runs ask; simulated as finely as what is reported is, or as
        now."""
        runs = SimulatedRuns(self.runs.runs, steps_hz(self.vehicle)) if fine else self.runs
        return Posterior(runs, self.vehicle, self.tolerance, self.stands, self.prior.without_wall(), self.readings)

    def beside(self, state: State) -> Posterior:
        """The same with rounded readings that say what they do beside this state; itself where none do."""
        readings = [one.beside(prediction) for one, prediction in zip(self.readings, state.predictions, strict=True)]
        if all(one.as_read for one in (*readings, *self.readings)):
            return self
        return Posterior(self.runs, self.vehicle, self.tolerance, self.stands, self.prior, readings)

    def as_read(self) -> Posterior:
        """The same with rounding taken as noise."""
        if all(one.as_read for one in self.readings):
            return self
        return Posterior(self.runs, self.vehicle, self.tolerance, self.stands, self.prior)

    def car(self, effects: Sequence[Chosen], logs: Array) -> Car:
        """The car with these numbers and effects."""
        return compose(self.prior.vehicle(self.vehicle, logs), effects)

    def moved_m(self, record: Sequence[Array]) -> list[Array]:
        """By how much the car was farther than its distance signal said (n,), per run."""
        return [one.moved_m(k) for one, k in zip(self.record_errors, record, strict=True)]

    def predict(self, effects: Sequence[Chosen], logs: Array, record: Sequence[Array],
                rough: bool = False) -> list[Array]:
        """What would have been recorded in each run (n,)."""
        predictions = self.runs.predict(self.car(effects, logs), self.moved_m(record), rough)
        return [one.recorded(prediction, k) for one, prediction, k in zip(
            self.record_errors, predictions, record, strict=True)]

    def predictor(self, state: State) -> Predict:
        """Predictions of models that are not far from one: as rough ones are, and as much off these as a fine one of
        that model is, which is made if the state has none."""
        given = state.effects, state.logs, state.record
        if not self.car(state.effects, state.logs).rubs:
            return self.predict
        fine = state.predictions or self.predict(*given)
        off = [one - rough for one, rough in zip(fine, self.predict(*given, rough=True), strict=True)]

        def predict(effects: Sequence[Chosen], logs: Array, record: Sequence[Array]) -> list[Array]:
            return [one + more for one, more in zip(self.predict(effects, logs, record, rough=True), off, strict=True)]

        return predict

    def at(self, effects: Sequence[Chosen], logs: Array, record: Sequence[Array] | None = None,
           size: ErrorSize = USUAL) -> State:
        """A state; ``record`` None: on the distances as they were recorded."""
        found = [np.zeros(one.count) for one in self.record_errors] if record is None else list(record)
        return State(tuple(effects), logs, found, size, self.predict(effects, logs, found))

    def start(self, effects: Sequence[Chosen] = ()) -> State:
        """The car as it stands."""
        return self.at(effects, self.prior.logs(self.vehicle, self.stands))

    def residuals(self, state: State) -> list[Array]:
        """Measured minus predicted (n,), per run."""
        return self.left_by(state.predictions)

    def left_by(self, predictions: Sequence[Array]) -> list[Array]:
        """What predictions (n,) per run leave of the readings."""
        return [one.left_by(prediction) for one, prediction in zip(self.readings, predictions, strict=True)]

    def deviance(self, state: State) -> float:
        """Minus twice the log-likelihood, its levels the most likely ones."""
        return deviance(self.bands, self.residuals(state))

    def cost(self, state: State) -> float:
        """Minus twice the log-density of the priors of the car's numbers and of the record's errors."""
        return self.prior.cost(state.logs) + state.size.cost + sum(
            float(k @ one.precision(state.size) @ k) for one, k in zip(self.record_errors, state.record, strict=True))

    def error(self, state: State) -> float:
        """Normalised r.m.s. error of all samples that count."""
        return normalised_rms_error(self.runs.runs, state.predictions)

    def number_slopes(self, state: State, steps: Array) -> list[Array]:
        """What the car's numbers do to the predictions: (p, n) per run, by differences over steps (p,). They are known
        well enough by a rough simulation."""
        found = [np.empty((len(steps), run.joined_count)) for run in self.runs.runs]
        moved = self.moved_m(state.record)
        here = self.runs.predict(self.car(state.effects, state.logs), moved, rough=True)
        for index, step in enumerate(steps):
            logs = state.logs.copy()
            logs[index] += step
            there = self.runs.predict(self.car(state.effects, logs), moved, rough=True)
            for column, high, low in zip(found, there, here, strict=True):
                column[index] = (high - low) / step
        return found
