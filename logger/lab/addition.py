"""A model with effects added: fitted on all that there is, with what is known of every number.

Problem: whoever adds an effect wants its numbers with their errors, and wants to see what else changed: a missing
effect pulls the car's own numbers away from the truth, and adding it lets them go back. Solution: the car is fitted
with and without the effect on all of the runs, each number comes with its standard error from the information matrix,
and both fits are told side by side.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.identification.parameters import read
from logger.lab.fitting import Move, Problem, State, Weighed, coordinates_of, effect_slopes, moves_of, settled
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

_TINY_STEP = 1e-4


@dataclass(frozen=True)
class Number:
    """A number of the car: as its file says, refitted without the added effects, and with them; with standard errors,
    which include how far off it may have been."""

    name: str
    nominal: float
    without: float
    without_standard_error: float
    found: float
    found_standard_error: float


@dataclass(frozen=True, eq=False)
class Added:
    """A vehicle with effects added.

    vehicle            with its numbers refitted
    effects            all, with values and standard errors
    numbers            of the car
    error_before       of the vehicle and effects as they were
    error_refitted     of those with their numbers refitted and the distance's wander taken out
    error_after        of the model with the effects, fitted in the same way
    error_as_written   of that model without the wander taken out: what a comparison with it begins at
    """

    vehicle: Vehicle
    effects: tuple[Chosen, ...]
    numbers: tuple[Number, ...]
    error_before: float
    error_refitted: float
    error_after: float
    error_as_written: float
    before: State
    after: State


def add(problem: Problem, present: Sequence[Chosen], added: Sequence[Chosen]) -> Added:
    """Fit ``problem``'s vehicle, with the effects that are present, without and with those that are added; the values
    that these have are where the fit begins."""
    nominal = problem.start(present)
    before, _ = settled(problem, nominal)
    start = problem.laid_out((*before.effects, *added), before.logs, before.wander)
    after, _ = settled(problem, start)
    count = len(problem.nuisance.names)
    spread_before = _spread(problem, before)
    spread = _spread(problem, after)
    vehicle = problem.nuisance.vehicle(problem.vehicle, after.logs)
    earlier = problem.nuisance.vehicle(problem.vehicle, before.logs)
    numbers = tuple(
        Number(name, read(problem.vehicle, name), read(earlier, name), read(earlier, name) * float(was),
               read(vehicle, name), read(vehicle, name) * float(now))
        for name, was, now in zip(problem.nuisance.names, spread_before[:count], spread[:count], strict=True)
    )
    effects = _with_errors(after.effects, moves_of(after.effects), spread[count:])
    written = problem.laid_out(after.effects, after.logs, [np.zeros_like(k) for k in after.wander])
    return Added(vehicle, effects, numbers, problem.error(nominal), problem.error(before), problem.error(after),
                 problem.error(written), before, after)


def _spread(problem: Problem, state: State) -> Array:
    """Standard errors: of logarithms of the car's numbers (p,), then of effects' numbers on their scales (m,)."""
    slopes = problem.slopes(state)
    weighed = Weighed(problem, slopes, problem.whiteners(state))
    moves = moves_of(state.effects)
    own = [whitener(columns) for whitener, columns in zip(
        weighed.whiteners, effect_slopes(problem, slopes, state, moves), strict=True)]
    mixed = weighed.against(own) if moves else np.zeros((weighed.count, 0))
    alone = np.sum([one @ one.T for one in own], axis=0) if moves else np.zeros((0, 0))
    information = np.block([[weighed.information, mixed], [mixed.T, alone]])
    deviations = np.sqrt(np.maximum(np.diag(np.linalg.pinv(information, hermitian=True)), 0.0))
    return np.concatenate([deviations[: len(problem.nuisance.names)], deviations[weighed.count:]])


def _with_errors(effects: Sequence[Chosen], moves: Sequence[Move], spread: Array) -> tuple[Chosen, ...]:
    errors: list[Mapping[str, float]] = [{} for _ in effects]
    for move, here, deviation in zip(moves, coordinates_of(effects, moves), spread, strict=True):
        parameter = effects[move.effect].effect.parameters[move.parameter]
        step = _TINY_STEP * max(abs(here), _TINY_STEP)
        rise = abs(parameter.value(here + step) - parameter.value(here - step)) / (2 * step)
        errors[move.effect] = {**errors[move.effect], parameter.name: float(rise * deviation)}
    return tuple(replace(one, standard_errors=found) for one, found in zip(effects, errors, strict=True))
