"""What a diagnosis made of the car: how far its numbers moved, and the forces of its springs and dampers as fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.posterior import Posterior, State
from logger.vehicle.compose import Car
from logger.vehicle.laws import CornerLaws

Array = npt.NDArray[np.float64]

# Of a curve: smooth to the eye at the width of a page; its ends are motions that one in a thousand samples goes beyond.
_POINTS, _REACHED = 201, 0.999
RATE, TRAVEL = "rate", "travel"


@dataclass(frozen=True, eq=False)
class ForceCurve:
    """The force of one suspension by one motion, what goes with the other motion left out.

    axle       front or rear
    motion     RATE [m/s] or TRAVEL [m], positive in extension
    at         (n,) over what the runs reached but for 0.1 % of the time
    before_n   (n,) as the vehicle's file has it
    after_n    (n,) as fitted
    """

    axle: str
    motion: str
    at: Array
    before_n: Array
    after_n: Array


@dataclass(frozen=True, eq=False)
class FittedCar:
    """moved: of each of the car's numbers the share by which it was refitted, and the share that its tolerance is;
    curves: of suspensions whose laws are no longer the file's."""

    moved: Mapping[str, tuple[float, float]]
    curves: tuple[ForceCurve, ...]


def fitted_car(posterior: Posterior, stood: State, found: State) -> FittedCar:
    """Beside the model as it stood."""
    prior = posterior.prior
    moved = {name: (float(np.expm1(log)), float(np.expm1(deviation))) for name, log, deviation in zip(
        prior.names, found.logs, prior.deviations, strict=True)}
    before, after = (posterior.car(one.effects, one.logs) for one in (stood, found))
    if not after.bends_laws:
        return FittedCar(moved, ())
    responses = posterior.runs.respond(after, posterior.distance_error_m(found.record))
    curves = []
    for motion, name in ((RATE, "rate_mps"), (TRAVEL, "travel_m")):
        size = np.concatenate([np.abs(getattr(one, name)[run.first:]) for run, one in zip(
            posterior.runs.runs, responses, strict=True)])
        for axle, number in _axles(after):
            reach = float(np.quantile(size[:, number], _REACHED))
            at = np.linspace(-reach, reach, _POINTS)
            old, new = (_force_n(car, number, motion, at) for car in (before, after))
            curves.append(ForceCurve(axle, motion, at, old, new))
    return FittedCar(moved, tuple(curves))


def _axles(car: Car) -> list[tuple[str, int]]:
    """Axles and the number of one of their wheels."""
    rear = next((number for number, one in enumerate(car.laws) if one.rear), None)
    return [("front", 0)] if rear is None else [("front", 0), ("rear", len(car.laws) - 1)]


def _force_n(car: Car, number: int, motion: str, at: Array) -> Array:
    laws = car.laws[number]
    axle = car.vehicle.rear if laws.rear and car.vehicle.rear is not None else car.vehicle.front
    still = np.zeros_like(at)
    if motion == RATE:
        force = laws.damper(at) + _friction_n(laws, at)
        return np.asarray(force + sum((one(still, at) for one in laws.others), still))
    force = axle.suspension_stiffness_n_per_m * at + sum((one(at) for one in laws.springs), still)
    return np.asarray(force + sum((one(at, still) for one in laws.others), still))


def _friction_n(laws: CornerLaws, rate_mps: Array) -> Array:
    if laws.friction_transition_mps > 0:
        return np.asarray(laws.dry_friction_n * np.tanh(rate_mps / laws.friction_transition_mps))
    return np.asarray(laws.dry_friction_n * np.sign(rate_mps))
