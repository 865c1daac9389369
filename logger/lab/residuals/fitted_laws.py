"""The fitted car: by how much its numbers changed, and the force curves of its springs and dampers; of a part alone on
its bench the forces themselves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.chart_data import CURVE_POINTS, CURVE_REACH
from logger.lab.likelihood.posterior import Posterior, State
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.uncertain import NumberErrors, models_off
from logger.vehicle.vehicle import Vehicle

RATE, TRAVEL = "rate", "travel"


@dataclass(frozen=True, eq=False)
class ForceCurve:
    """The force of one suspension by one motion, without what depends on the other motion.

    axle       front or rear
    motion     RATE [m/s] or TRAVEL [m], positive in extension
    at         motions that the runs reach but for 0.1 % of the time (n,)
    before_n   force of the vehicle's file (n,)
    after_n    force as fitted (n,)
    """

    axle: str
    motion: str
    at: Array
    before_n: Array
    after_n: Array


@dataclass(frozen=True, eq=False)
class BenchForces:
    """The force of a part in all samples (n,) of its runs [N], at these travels and rates: as it was measured, by the
    vehicle's file, and as fitted."""

    travel_m: Array
    rate_mps: Array
    measured_n: Array
    before_n: Array
    after_n: Array


@dataclass(frozen=True, eq=False)
class FittedCar:
    """moved: the relative change of each of the car's numbers, and the standard deviation that it was known to; curves:
    of suspensions whose laws differ from the file's; on_bench: of a part alone, None: it is none."""

    moved: Mapping[str, tuple[float, float]]
    curves: tuple[ForceCurve, ...]
    on_bench: BenchForces | None = None


def fitted_car(posterior: Posterior, stood: State, found: State) -> FittedCar:
    """The car of a fitted state in comparison with another state."""
    prior = posterior.prior
    moved = {name: (float(np.expm1(log)), float(deviation)) for name, log, deviation in zip(
        prior.names, found.logs, prior.deviations, strict=True)}
    before, after = (posterior.car(one.effects, one.logs) for one in (stood, found))
    if after.structure.held or not after.bends_laws:
        return FittedCar(moved, (), bench_forces(posterior, stood, found))
    responses, curves = posterior.runs.respond(after, posterior.distance_error_m(found.record)), []
    for motion, name in ((RATE, "rate_mps"), (TRAVEL, "travel_m")):
        size = np.concatenate([np.abs(getattr(one, name)[run.first:]) for run, one in zip(
            posterior.runs.runs, responses, strict=True)])
        for axle, wheel in _wheels(after).items():
            reach = float(np.quantile(size[:, wheel], CURVE_REACH))
            at = np.linspace(-reach, reach, CURVE_POINTS)
            # An effect such as roll turns two wheels into four: the same axle, another number.
            old, new = (laws.by_rate_n(at) if motion == RATE else laws.stiffness_n_per_m * at + laws.by_travel_n(at)
                        for laws in (car.laws[_wheels(car)[axle]] for car in (before, after)))
            curves.append(ForceCurve(axle, motion, at, old, new))
    return FittedCar(moved, tuple(curves))


def bench_forces(posterior: Posterior, stood: State, found: State) -> BenchForces | None:
    """The forces of a part in a fitted state, in comparison with another state; None of what is no part alone."""
    car = posterior.car(found.effects, found.logs)
    if not car.structure.held:
        return None
    responses = posterior.runs.respond(car, posterior.distance_error_m(found.record))
    samples = [np.stack([response.travel_m[:, 0], response.rate_mps[:, 0], run.measured_mps2,
                         *(run.main(one) for one in by)])[:, run.first:]
               for run, response, *by in zip(posterior.runs.runs, responses, stood.predictions, found.predictions,
                                             strict=True)]
    return BenchForces(*np.concatenate(samples, axis=1))


def force_by_rate(vehicle: Vehicle, effects: Sequence[Chosen], errors: NumberErrors, rate_mps: Array
                  ) -> tuple[Array, Array]:
    """Force (n,) of a part at these rates (n,) and no travel, and its standard errors (n,) [N]; without friction that
    has a memory."""
    def force_n(vehicle: Vehicle, effects: Sequence[Chosen]) -> Array:
        return compose(vehicle, effects).laws[0].by_rate_n(rate_mps)

    there_n = force_n(vehicle, effects)
    off_n = [force_n(*one) - there_n for one in models_off(vehicle, effects, errors)]
    return there_n, np.sqrt(np.sum(np.square(off_n), axis=0))


def _wheels(car: Car) -> dict[str, int]:
    """The number of one wheel of each axle."""
    rear = next((number for number, one in enumerate(car.laws) if one.rear), None)
    return {"front": 0} if rear is None else {"front": 0, "rear": rear}
