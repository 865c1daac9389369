"""Fits of a model to drives over an unknown road, by Fisher scoring.

The score and the information of the marginal likelihood are known, its value is not: each step solves the information
for the score, within the bounds of the numbers (R. A. Fisher 1925).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.unknown_road.likelihood import RoadFitState, SameRoad
from logger.vehicle.effect import Chosen, Scale
from logger.vehicle.effect_parameters import (
    FreeParameter,
    coordinates_of,
    free_parameters_of,
    steps_of,
    with_coordinates,
)

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class RoadFit:
    """A fitted state, with the information on its numbers.

    free_parameters    of its effects
    data               information of the drives on the logs, the free parameters (on their scales) and the roads'
                       numbers (m, m), at the last step for which it was computed
    information        of drives and priors (m, m)
    problem            with a preconditioner for states near this one
    """

    state: RoadFitState
    free_parameters: tuple[FreeParameter, ...]
    data: Array
    information: Array
    problem: SameRoad


def fit(problem: SameRoad, state: RoadFitState, steps: int = 10, converged: float = 0.1,
        many_rounds: int = 8, falling: float = 0.5) -> RoadFit:
    """Fit the most probable state, by so many scoring steps from a state at most.

    converged      the fit ends before a step of a smaller expected gain in the log of the probability
    many_rounds    equations that take more iterations get a new preconditioner, which takes about as long as they
    falling        the information, which takes most of the time, is kept from step to step as long as the expected gain
                   falls to this share or less: at a half steps converge still, if no longer quadratically
    """
    free_parameters = free_parameters_of(state.effects)
    p, q = len(state.logs), len(free_parameters)
    here = np.concatenate([state.logs, coordinates_of(state.effects, free_parameters), state.roads])
    low, high, longest = _limits(state.effects, free_parameters, len(here), p)
    low[-1] = np.log(problem.least_mps2)

    def at(here: Array) -> tuple[Array, tuple[Chosen, ...], Array]:
        return here[:p], with_coordinates(state.effects, free_parameters, here[p : p + q]), here[p + q :]

    probes = 1 if len(problem.stretches) > 2 else None  # where there are many stretches, these are a mean as well
    data, last_gain = np.empty((0, 0)), 0.0
    for count in range(steps):
        logs, effects, roads = at(here)
        gains, slopes = response_and_slopes(problem, effects, free_parameters, logs)
        if problem.rounds > many_rounds:
            problem = problem.preconditioned(RoadFitState(effects, logs, roads, gains))
        tables = problem.tables(gains, slopes)
        off, precision = problem.prior_terms(logs, q, roads)
        for renewed in (False, True) if count else (True,):
            score, found = problem.score_and_information(tables, roads, renewed, probes)
            score -= precision * off
            data = found if renewed else data
            information = data + np.diag(precision)
            step = _step(score, information, here, low, high)
            gain = float(score @ step)
            if gain < falling * last_gain:
                break
        if count and gain < converged:
            break
        last_gain = gain
        here = np.clip(here + np.clip(step, -longest, longest), low, high)
    logs, effects, roads = at(here)
    state = RoadFitState(effects, logs, roads, problem.response(effects, logs))
    return RoadFit(state, tuple(free_parameters), data, information, problem)


def _step(score: Array, information: Array, here: Array, low: Array, high: Array) -> Array:
    """The scoring step within bounds."""
    free = ~(((here <= low) & (score < 0)) | ((here >= high) & (score > 0)))
    step = np.zeros_like(here)
    step[free] = inverse(information[np.ix_(free, free)]) @ score[free]
    return step


def inverse(information: Array, ridge: float = 1e-6) -> Array:
    """Inverse of a symmetric matrix (m, m), scaled to a unit diagonal and regularised by a ridge. Of a number of which
    next to nothing is known, a standard error of 1e8 on its scale, it is 0: no step moves it."""
    known = np.diag(information) > np.finfo(float).eps
    scale = np.where(known, 1 / np.sqrt(np.where(known, np.diag(information), 1.0)), 0.0)
    scaled = information * np.outer(scale, scale) + ridge * np.eye(len(scale))
    return np.asarray(np.linalg.inv(scaled) * np.outer(scale, scale))


def response_and_slopes(problem: SameRoad, effects: tuple[Chosen, ...], free_parameters: Sequence[FreeParameter],
                        logs: Array, step: float = 1e-3) -> tuple[Complex, Complex]:
    """A response (d, x, f) and its derivatives (p + q, d, x, f) by the logs and the free parameters, over steps of this
    share."""
    gains = problem.response(effects, logs)
    slopes = []
    for index in range(len(logs)):
        shifted = logs.copy()
        shifted[index] += step
        slopes.append((problem.response(effects, shifted) - gains) / step)
    here = coordinates_of(effects, free_parameters)
    for index, own_step in enumerate(steps_of(effects, free_parameters, step, step)):
        shifted = here.copy()
        shifted[index] += own_step
        slopes.append((problem.response(with_coordinates(effects, free_parameters, shifted), logs) - gains) / own_step)
    return gains, np.array(slopes).reshape(len(slopes), *gains.shape)


def _limits(effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter], count: int, first: int,
            longest_log: float = 0.5) -> tuple[Array, Array, Array]:
    """Bounds and longest step of each number (count,); those of the free parameters begin at ``first``."""
    low, high, longest = np.full(count, -np.inf), np.full(count, np.inf), np.full(count, longest_log)
    for index, free in enumerate(free_parameters, first):
        parameter = effects[free.effect].effect.parameters[free.parameter]
        low[index], high[index] = sorted(parameter.coordinate(one) for one in (parameter.low, parameter.high))
        if parameter.scale is not Scale.LOG:
            longest[index] = max(parameter.usual_range(), 0.5 * abs(coordinates_of(effects, [free])[0]))
    return low, high, longest
