"""A model with effects added: fitted on all that there is, with what is known of every number.

Problem: whoever adds an effect wants its numbers with their errors, and wants to see what else changed: a missing
effect pulls the car's own numbers away from the truth, and adding it lets them go back. Solution: the car is fitted
with and without the effect on all of the runs, each number comes with its standard error from the information matrix,
and both fits are told side by side. What is written holds on to the numbers that were given; what is told side by side
does not, on either side, so that nothing but the effect makes the difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.fitting import Problem, Slopes, State
from logger.lab.settling import settled
from logger.lab.spread import with_spread
from logger.lab.wandering import aligned_anew, lying, moved_m, relaid
from logger.vehicle.effect import Chosen
from logger.vehicle.named_parameters import read
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Number:
    """A number of the car: as it was given, refitted without the added effects, and with them, as far off as the runs
    ask for; with standard errors, which include how far off it may have been.

    written    with the effects, held near what was given: what the vehicle has then
    """

    name: str
    nominal: float
    without: float
    without_standard_error: float
    found: float
    found_standard_error: float
    written: float


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
    problem            with its runs where they lie beside that model, and by how much they were moved for that, at most
    """

    vehicle: Vehicle
    effects: tuple[Chosen, ...]
    numbers: tuple[Number, ...]
    error_before: float
    error_refitted: float
    error_after: float
    error_as_written: float
    problem: Problem
    moved_m: float
    before: State
    after: State


def add(problem: Problem, loose: Problem, present: Sequence[Chosen], added: Sequence[Chosen]) -> Added:
    """Fit ``problem``'s vehicle, with the effects that are present, without and with those that are added; the values
    that these have are where the fit begins.

    problem    firm, so that what is still missing beside these effects does not bend the car, and they not with it
    loose      the same, not firm: it shows how far the car has to bend without the added effects, and with them
    """
    recorded = problem
    problem, _ = lying(recorded, recorded.start((*present, *added)))
    before, after = _without_and_with(problem, present, added)
    laid = relaid(problem, after[0], recorded)
    if laid is not problem:
        problem = laid
        before, after = _without_and_with(problem, present, added)
    loose = loose.over(problem.runs)
    (bent, spread_before), (freed, spread_after) = (_freed(problem, loose, *one) for one in (before, after))
    effects, _ = with_spread(problem, *after)
    vehicle = problem.nuisance.vehicle(problem.vehicle, after[0].logs)
    without, found = (problem.nuisance.vehicle(problem.vehicle, state.logs) for state in (bent, freed))
    numbers = tuple(
        Number(name, read(problem.vehicle, name), read(without, name), read(without, name) * float(was),
               read(found, name), read(found, name) * float(now), read(vehicle, name))
        for name, was, now in zip(problem.nuisance.names, spread_before, spread_after, strict=True)
    )
    written = recorded.unmoved(after[0].effects, after[0].logs)
    return Added(vehicle, effects, numbers, recorded.error(recorded.start(present)), problem.error(before[0]),
                 problem.error(after[0]), recorded.error(written), problem, moved_m(recorded, problem), before[0],
                 after[0])


def _without_and_with(problem: Problem, present: Sequence[Chosen],
                      added: Sequence[Chosen]) -> tuple[tuple[State, Slopes], tuple[State, Slopes]]:
    """The car fitted without and with the effects, each with slopes near it."""
    before, slopes = settled(problem, aligned_anew(problem, problem.start(present)))
    # A car that was refitted without what is missing may be bent too far, or lie too wrong, to begin with.
    starts = (problem.laid_out((*before.effects, *added), before.logs, before.wander),
              aligned_anew(problem, problem.start((*present, *added))))
    return (before, slopes), settled(problem, min(starts, key=problem.deviance))


def _freed(problem: Problem, loose: Problem, state: State, slopes: Slopes) -> tuple[State, Array]:
    """The model fitted without holding on to the car's numbers, and standard errors of their logarithms (p,)."""
    if problem.nuisance.held(state.logs):
        state, slopes = settled(loose, state, slopes=slopes)
    return state, with_spread(loose, state, slopes)[1]
