"""Fits of a model to drives over an unknown road: Fisher's scoring.

The slopes and the information of the marginal likelihood are known, its value is not: each step solves the information
for the slopes, within the bounds of the numbers (R. A. Fisher 1925).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.unknown_road.likelihood import SameRoad, State
from logger.vehicle.effect import Chosen, Scale
from logger.vehicle.effect_parameters import Move, coordinates_of, moved, moves_of, steps_of

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

_LOG_STEP, _SHARE_STEP = 1e-3, 1e-3
_MOST_STEPS, _LONGEST_LOG, _SETTLED, _MANY_ROUNDS = 10, 0.5, 0.1, 12


@dataclass(frozen=True, eq=False)
class Fitted:
    """A state that was fitted, with the information on its numbers.

    moves          numbers of its effects
    data           (m, m) information of the drives on the logs, the moves (on their scales) and the roads' numbers
    information    the same with what is granted
    problem        quick for states like this one
    """

    state: State
    moves: tuple[Move, ...]
    data: Array
    information: Array
    problem: SameRoad


def fitted(problem: SameRoad, state: State, steps: int = _MOST_STEPS) -> Fitted:
    """The most probable state, by Fisher's steps from this one."""
    moves = moves_of(state.effects)
    p, q = len(state.logs), len(moves)
    here = np.concatenate([state.logs, coordinates_of(state.effects, moves), state.roads])
    low, high = _bounds(state.effects, moves, len(here), p)
    low[-1] = np.log(problem.least_mps2)
    longest = _longest(state.effects, moves, len(here), p)
    for count in range(steps):
        logs, effects, roads = here[:p], moved(state.effects, moves, here[p : p + q]), here[p + q :]
        gains, slopes = sloped(problem, effects, moves, logs)
        if problem.rounds > _MANY_ROUNDS:
            problem = problem.prepared(State(effects, logs, roads, gains))
        scored = problem.scored(problem.table(gains, slopes), roads, information=True)
        pull, prior_precision = prior_terms(problem, logs, q, roads)
        score = scored.slopes - pull
        step = _step(score, scored.information + np.diag(prior_precision), here, low, high)
        if count and float(score @ step) < _SETTLED:
            break
        here = np.clip(here + np.clip(step, -longest, longest), low, high)
    logs, effects, roads = here[:p], moved(state.effects, moves, here[p : p + q]), here[p + q :]
    found = State(effects, logs, roads, problem.response(effects, logs))
    return Fitted(found, tuple(moves), scored.information, scored.information + np.diag(prior_precision), problem)


def prior_terms(problem: SameRoad, logs: Array, moves: int, roads: Array) -> tuple[Array, Array]:
    """How strongly what is granted pulls at each number (m,), and its precision (m,)."""
    off, precision = problem.prior_terms(roads)
    own = problem.prior.deviations**-2
    prior_precision = np.concatenate([own, np.zeros(moves), precision])
    return prior_precision * np.concatenate([logs, np.zeros(moves), off]), prior_precision


def _step(score: Array, information: Array, here: Array, low: Array, high: Array) -> Array:
    """Fisher's step within bounds."""
    free = ~(((here <= low) & (score < 0)) | ((here >= high) & (score > 0)))
    step = np.zeros_like(here)
    step[free] = inverse(information[np.ix_(free, free)]) @ score[free]
    return step


def inverse(information: Array, ridge: float = 1e-6) -> Array:
    """Of a matrix whose rows may differ by powers of ten, held off singularity."""
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information * np.outer(scale, scale) + ridge * np.eye(len(scale))
    return np.asarray(np.linalg.inv(scaled) * np.outer(scale, scale))


def sloped(problem: SameRoad, effects: tuple[Chosen, ...], moves: Sequence[Move],
            logs: Array) -> tuple[Complex, Complex]:
    """A response and its slopes by the logs and the moves."""
    gains = problem.response(effects, logs)
    slopes = []
    for index in range(len(logs)):
        beside = logs.copy()
        beside[index] += _LOG_STEP
        slopes.append((problem.response(effects, beside) - gains) / _LOG_STEP)
    here = coordinates_of(effects, moves)
    for index, step in enumerate(steps_of(effects, moves, _LOG_STEP, _SHARE_STEP)):
        beside = here.copy()
        beside[index] += step
        slopes.append((problem.response(moved(effects, moves, beside), logs) - gains) / step)
    return gains, np.array(slopes).reshape(len(slopes), *gains.shape)


def _bounds(effects: Sequence[Chosen], moves: Sequence[Move], count: int, first: int) -> tuple[Array, Array]:
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    for index, move in enumerate(moves, first):
        parameter = effects[move.effect].effect.parameters[move.parameter]
        ends = sorted(parameter.coordinate(one) for one in (parameter.low, parameter.high))
        low[index], high[index] = ends
    return low, high


def _longest(effects: Sequence[Chosen], moves: Sequence[Move], count: int, first: int) -> Array:
    """How far each number may go in one step."""
    longest = np.full(count, _LONGEST_LOG)
    for index, move in enumerate(moves, first):
        parameter = effects[move.effect].effect.parameters[move.parameter]
        if parameter.scale is not Scale.LOG:
            longest[index] = max(parameter.usual_way(),
                                 0.5 * abs(coordinates_of(effects, [move])[0]))
    return longest
