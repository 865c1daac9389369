"""A model compared with measurements: how large the error is, where it sits, and what kind of thing is missing.

Problem: the numbers of a car are never exact, and a small mistake in them leaves an error that says nothing about
physics. Solution: the error is computed and broken down as the model stands; then the car's numbers and the distances
of the runs are refitted within what they are usually off, and the residuals are tested after that. When a number has to
move much farther than such numbers are off, that is reported: a missing effect pulls at it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.map_fit import align, fit, fit_rounded_readings
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import UNUSUAL_SIGMA, Tolerance
from logger.lab.likelihood.record_band import ComparedBand, compared_band
from logger.lab.likelihood.repeats import Repeats, find_repeats
from logger.lab.likelihood.whittle import DISCREPANCY
from logger.lab.residuals.breakdown import Breakdown, ModelResiduals, breakdown
from logger.lab.residuals.removed import Removed, removed_from
from logger.lab.residuals.residual_tests import ResidualTest, ResidualTests, run_residual_tests
from logger.runs import normalised_rms_error, signal_errors
from logger.simulation.simulated_runs import SimulatedRuns
from logger.vehicle.compose import Car, Response, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Standing:
    """A model with its residuals, its error (rms residual / rms measured, all samples that count), and where it is; and
    its errors of other signals, by name."""

    residuals: ModelResiduals
    error: float
    where: Breakdown
    signals: Mapping[str, float]

    @staticmethod
    def of(runs: SimulatedRuns, car: Car, predictions: Sequence[Array], responses: Sequence[Response]) -> Standing:
        """Of a car, by what it would have recorded and how it moved."""
        main = [run.main(one) for run, one in zip(runs.runs, predictions, strict=True)]
        residuals = ModelResiduals(runs.runs, car, main, responses)
        return Standing(residuals, normalised_rms_error(runs.runs, main), breakdown(residuals),
                        signal_errors(runs.runs, predictions))


@dataclass(frozen=True, eq=False)
class Comparison:
    """What a comparison found.

    plain       the model as it stands
    refitted    with its numbers and the distances refitted within what they are usually off
    moves       by which share each number of the car, and of its effects, moved for that
    far         those that moved farther than such numbers are usually off, the farthest first
    removed     what is taken out of the error before it is judged
    tests       of the residuals of the refitted model, without what its sensors drift
    """

    vehicle: str
    effects: tuple[Chosen, ...]
    plain: Standing
    refitted: Standing
    moves: Mapping[str, float]
    far: tuple[str, ...]
    removed: Removed
    tests: ResidualTests

    @property
    def band(self) -> ComparedBand | None:
        """What of the runs was compared; None: all of it."""
        return compared_band(self.plain.residuals.runs)

    @cached_property
    def repeats(self) -> Repeats | None:
        """What runs that repeat each other differ by; None where none does."""
        return find_repeats(self.plain.residuals.runs)

    @property
    def exceeds_discrepancy(self) -> bool:
        """Whether the residual is larger than what two right simulations of a car differ by."""
        return self.removed.error >= DISCREPANCY

    @property
    def tests_found(self) -> tuple[ResidualTest, ...]:
        """Those that find more than noise, and matter."""
        return self.tests.found if self.exceeds_discrepancy else ()

    @property
    def missing(self) -> bool:
        """Whether the residual is tied to the road or the car's motion, or numbers had to move far: an effect may
        explain it."""
        return bool(self.far) or any(test.road for test in self.tests_found)


def compare(runs: SimulatedRuns, vehicle: Vehicle, effects: Sequence[Chosen] = (), given: Vehicle | None = None,
            tolerance: Tolerance | None = None) -> Comparison:
    """Compare a vehicle and its effects, with the values they have, with runs of one sample rate. Where the refitted
    model is no better than the plain one, that is the refitted one as well.

    given        the vehicle before any fit, if it has been refitted: what its numbers are usually off from
    tolerance    what is usually off, and by how much; None: the usual

    ValueError when the vehicle lacks what an effect needs.
    """
    car = compose(vehicle, effects)
    plain = Standing.of(runs, car, runs.predict(car), runs.respond(car))
    posterior = Posterior(runs, given or vehicle, tolerance or Tolerance(), vehicle).without_soft_bounds()
    names, deviations = posterior.prior.names, posterior.prior.deviations
    state = fit_rounded_readings(fit(align(posterior, posterior.start(effects)))).state
    if posterior.error(state) > plain.error:
        # The fit weighs every frequency by its noise, and may buy a better top with a worse body bounce.
        state = posterior.start(effects)
        removed = removed_from(posterior, state.predictions, state)
        return Comparison(vehicle.name, tuple(effects), plain, plain, dict.fromkeys(names, 0.0), (), removed,
                          _tests(plain, removed, plain))
    car = posterior.car(state.effects, state.logs)
    refitted = Standing.of(runs, car, state.predictions, runs.respond(car, posterior.distance_error_m(state.record)))
    removed = removed_from(posterior, plain.residuals.predictions, state)
    away = np.abs(state.logs / deviations)
    moves = {name: float(np.expm1(log)) for name, log in zip(names, state.logs, strict=True)}
    for before, after in zip(effects, state.effects, strict=True):
        moves |= {f"{before.effect.name}.{name}": after.values[name] / value - 1
                  for name, value in before.values.items() if value}
    return Comparison(vehicle.name, tuple(effects), plain, refitted, moves,
                      tuple(names[index] for index in np.argsort(-away) if away[index] > UNUSUAL_SIGMA),
                      removed, _tests(refitted, removed, plain))


def _tests(refitted: Standing, removed: Removed, plain: Standing) -> ResidualTests:
    """Tests of the residual without the sensors' drift."""
    residuals, where = refitted.residuals, refitted.where
    if removed.drifting_sensors:
        residuals = replace(residuals, predictions=removed.without_drift(residuals.predictions))
        where = breakdown(residuals)
    return run_residual_tests(residuals, where, plain.residuals)
