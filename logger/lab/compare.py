"""A model compared with measurements: its error, the parts of the error, and tests of its residuals.

Problem: the numbers of a car are never exact, and an error because of them says nothing about physics. Solution: the
error is computed and broken down for the model as it stands; then the car's numbers and the distances of the runs are
refitted under their priors, and the residuals of that are tested. A number that moves much farther than its prior
allows is reported: a missing effect biases it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from logger.arrays import Array
from logger.bounds import DISCREPANCY
from logger.lab.likelihood.noise_floor import (
    Repeats,
    excess_by_signal,
    find_repeats,
    floor_error,
    sensor_noise_with_rounding,
    signals_with_noise,
)
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.record_band import ComparedBand, compared_band
from logger.lab.likelihood.standard_errors import standard_errors
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.residual_tests import run_residual_tests
from logger.lab.residual_tests.tests import ResidualEvidence, ResidualTestResult, ResidualTestResults
from logger.lab.residuals.breakdown import Breakdown, ModelResiduals, breakdown
from logger.lab.residuals.force_gain import force_gain
from logger.lab.residuals.unexplained import Removed, removed_from
from logger.lab.selection.evidence import FALSE_ALARM
from logger.lab.selection.holdout import REFITTED, ErrorStep, as_filed, cross_validate
from logger.lab.selection.starts import fitted_from_starts
from logger.runs import normalised_rms_error
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import Car, Response, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle


@dataclass(frozen=True, eq=False)
class Standing:
    """A model with its residuals, its error (rms residual / rms measured, all samples that count) and the parts of
    that, and its errors of other signals, by name."""

    residuals: ModelResiduals
    error: float
    where: Breakdown
    signals: Mapping[str, float]

    @staticmethod
    def of(posterior: Posterior, car: Car, predictions: Sequence[Array], responses: Sequence[Response]) -> "Standing":
        """The standing of a car with these predictions and motions."""
        runs = posterior.runs.runs
        main = [run.main(one) for run, one in zip(runs, predictions, strict=True)]
        residuals = ModelResiduals(runs, car, main, responses)
        signals = signals_with_noise(posterior, posterior.residuals_of(predictions))
        return Standing(residuals, normalised_rms_error(runs, main), breakdown(residuals),
                        {name: error for name, (error, _) in signals.items() if name})


@dataclass(frozen=True, eq=False)
class LabComparison:
    """The result of a comparison.

    plain       the model as it stands
    refitted    with its numbers and the distances refitted under their priors
    moves       relative change of each number of the car, and of its effects, by the refit
    far         numbers of the car whose change is unusual under their prior, the largest first
    steps       the model as it stands and refitted, with their errors on what no fit saw
    floor       the error that the sensor's noise alone makes
    removed     sensor drift, distance error and filtering, which are removed from the error before it is judged
    tests       of the residuals of the refitted model, without the drift of its sensors
    force_gain  how many times what they say the forces that drive a rig count, as ``force_gain``
    excess_of   as ``excess_by_signal`` of the refitted model, where more than one signal was measured
    """

    vehicle: str
    effects: tuple[Chosen, ...]
    plain: Standing
    refitted: Standing
    moves: Mapping[str, float]
    far: tuple[str, ...]
    steps: tuple[ErrorStep, ...]
    floor: float
    removed: Removed
    tests: ResidualTestResults
    force_gain: float | None = None
    excess_of: Mapping[str, float] = field(default_factory=dict)

    @property
    def unexplained_signals(self) -> tuple[str, ...]:
        """Signals beside the first whose residual is above their noise."""
        return tuple(name for name, excess in self.excess_of.items() if name and excess > UNEXPLAINED)

    @property
    def band(self) -> ComparedBand | None:
        """The band in which the runs were compared; None: all."""
        return compared_band(self.plain.residuals.runs)

    @cached_property
    def repeats(self) -> Repeats | None:
        """Repeatability of runs of one excitation; None where none repeats another."""
        left = self.refitted.residuals
        return find_repeats(left.runs, [run.residual(run.main(one)) for run, one in zip(
            left.runs, left.predictions, strict=True)])

    @property
    def exceeds_discrepancy(self) -> bool:
        """Whether the residual is larger than what two right simulations of a car differ by."""
        return self.removed.error >= DISCREPANCY

    @property
    def tests_found(self) -> tuple[ResidualTestResult, ...]:
        """Tests that are significant and large enough to matter."""
        return self.tests.found if self.exceeds_discrepancy else ()

    @property
    def missing(self) -> bool:
        """Whether an effect may explain the residual: a test relates it to the road or the car's motion, or numbers
        changed unusually far."""
        return bool(self.far) or any(test.road for test in self.tests_found)


def compare(runs: SimulatedRuns, vehicle: Vehicle, effects: Sequence[Chosen] = (), given: Vehicle | None = None,
            tolerance: Tolerance | None = None) -> LabComparison:
    """Compare a vehicle and its effects, with the values they have, with runs of one sample rate.

    given        the vehicle before any fit, if it has been refitted: the mean of the prior
    tolerance    standard deviations of the priors; None: the usual ones

    ValueError when the vehicle lacks what an effect needs.
    """
    car = compose(vehicle, effects)
    posterior = Posterior(runs, given or vehicle, tolerance or Tolerance(), vehicle)
    plain = Standing.of(posterior, car, runs.predict(car), runs.respond(car))
    names = posterior.prior.names
    linear = fitted_from_starts(posterior, effects)
    state = linear.state
    car = posterior.car(state.effects, state.logs)
    refitted = Standing.of(posterior, car, state.predictions,
                           runs.respond(car, posterior.distance_error_m(state.record)))
    removed, errors = removed_from(posterior, plain.residuals.predictions, state), standard_errors(linear)
    moves = {name: float(np.expm1(log)) for name, log in zip(names, state.logs, strict=True)}
    for before, after in zip(effects, state.effects, strict=True):
        moves |= {f"{before.effect.name}.{name}": after.values[name] / value - 1
                  for name, value in before.values.items() if value}
    return LabComparison(vehicle.name, tuple(effects), plain, refitted, moves,
                         tuple(posterior.prior.beyond_tolerance(state.logs, errors.covariance)),
                         (ErrorStep(as_filed(posterior.tolerance), plain.error),
                          ErrorStep(REFITTED, cross_validate(linear).error)),
                         floor_error(posterior, sensor_noise_with_rounding(posterior, state)),
                         removed, _tests(refitted, removed, runs.predict(car)), force_gain(linear),
                         excess_by_signal(posterior, state, FALSE_ALARM) if refitted.signals else {})


def _tests(refitted: Standing, removed: Removed, as_recorded: Sequence[Array]) -> ResidualTestResults:
    """Tests of the residuals without the sensors' drift.

    as_recorded    predictions (n,) of the refitted model at the recorded distances, per run
    """
    residuals, where = refitted.residuals, refitted.where
    unmoved = replace(residuals, predictions=[
        run.main(one) for run, one in zip(residuals.runs, as_recorded, strict=True)])
    if removed.drifting_sensors:
        residuals = replace(residuals, predictions=removed.with_drifts(residuals.predictions))
        where = breakdown(residuals)
    return run_residual_tests(ResidualEvidence(residuals, where, unmoved))
