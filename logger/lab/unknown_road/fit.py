"""Fits of a model to drives over an unknown road, by Fisher scoring, and score tests of effects on top of one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import Array, Complex
from logger.fitting.fisher_scoring import maximise
from logger.fitting.information_matrix import inverse
from logger.identification.unknown_road.marginal_likelihood import RoadsScore
from logger.lab.likelihood.map_fit import ends_of
from logger.lab.selection.screening import scale_strength
from logger.lab.unknown_road.likelihood import PROBES, RoadFitState, SameRoad
from logger.vehicle.effect import Chosen, Scale
from logger.vehicle.named_parameters import (
    FreeParameter,
    coordinates_of,
    free_parameters_of,
    steps_of,
    with_coordinates,
)


@dataclass(frozen=True, eq=False)
class SameRoadFit:
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


def fit(problem: SameRoad, state: RoadFitState, steps: int = 10, close: float = 0.3) -> SameRoadFit:
    """Fit the most probable state, by so many scoring steps from a state at most.

    close    standard errors from the end that are near enough
    """
    free_parameters = free_parameters_of(state.effects)
    p, q = len(state.logs), len(free_parameters)
    start = np.concatenate([state.logs, coordinates_of(state.effects, free_parameters), state.roads])
    low, high, longest = _limits(state.effects, free_parameters, len(start), p)
    low[-1] = np.log(problem.least_mps2)
    probes = 1 if len(problem.stretches) > 2 else None  # where there are many stretches, these are a mean as well
    rounds = 0

    def at(x: Array) -> tuple[Array, tuple[Chosen, ...], Array]:
        return x[:p], with_coordinates(state.effects, free_parameters, x[p : p + q]), x[p + q :]

    def score(x: Array, information: bool) -> RoadsScore:
        nonlocal problem, rounds
        logs, effects, roads = at(x)
        gains, slopes = response_and_slopes(problem, effects, free_parameters, logs)
        if rounds > 8:  # a new preconditioner takes about as long
            problem = problem.preconditioned(RoadFitState(effects, logs, roads, gains))
        found = problem.score(problem.tables(gains, slopes), roads, information, probes)
        rounds = found.rounds
        off, precision = problem.prior_terms(logs, q, roads)
        return replace(found, slopes=found.slopes - precision * off, information=found.information + np.diag(precision))

    found = maximise(score, start, low, high, longest, close=close, most_steps=steps)
    logs, effects, roads = at(found.x)
    fitted = RoadFitState(effects, logs, roads, problem.response(effects, logs))
    _, precision = problem.prior_terms(logs, q, roads)
    return SameRoadFit(fitted, tuple(free_parameters), found.information - np.diag(precision), found.information,
                       problem)


def response_and_slopes(problem: SameRoad, effects: tuple[Chosen, ...], free_parameters: Sequence[FreeParameter],
                        logs: Array, step: float = 1e-3) -> tuple[Complex, Complex]:
    """A response (d, x, f) and its derivatives (p + q, d, x, f) by the logs and the free parameters, over steps of this
    share."""
    gains, p = problem.response(effects, logs), len(logs)
    here = np.concatenate([logs, coordinates_of(effects, free_parameters)])
    steps = np.concatenate([np.full(p, step), steps_of(effects, free_parameters, step, step)])
    slopes = [(problem.response(with_coordinates(effects, free_parameters, there[p:]), there[:p]) - gains) / one
              for there, one in zip(here + np.diag(steps), steps, strict=True)]
    return gains, np.array(slopes).reshape(len(slopes), *gains.shape)


def _limits(effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter], count: int, first: int
            ) -> tuple[Array, Array, Array]:
    """Bounds and longest step of each number (count,); those of the free parameters begin at ``first``."""
    low, high, longest = np.full(count, -np.inf), np.full(count, np.inf), np.full(count, 0.5)
    for index, free in enumerate(free_parameters, first):
        parameter = effects[free.effect].effect.parameters[free.parameter]
        low[index], high[index] = ends_of(parameter)
        if parameter.scale is not Scale.LOG:
            longest[index] = max(parameter.usual_range(), 0.5 * abs(coordinates_of(effects, [free])[0]))
    return low, high, longest


@dataclass(frozen=True, eq=False)
class TrialOnRoad:
    """An effect at some values on top of a model.

    gain                 expected, in minus twice the log-likelihood
    best                 the effect at its best strength, which has this gain
    deviations           expected significance at its values, all free numbers fitted, in standard deviations
    share_beyond_road    share of its information (0 to 1) that roads and places do not absorb
    """

    chosen: Chosen
    gain: float
    best: Chosen
    deviations: float
    share_beyond_road: float


def screen(problem: SameRoad, base: SameRoadFit, ones: Sequence[Chosen]) -> list[TrialOnRoad]:
    """Score tests of effects on top of a fitted model, along the change that each makes in the response; the car's
    numbers and the roads' are projected out."""
    state = base.state
    gains, own = response_and_slopes(problem, state.effects, base.free_parameters, state.logs)
    changes = [problem.response((*state.effects, one), state.logs) - gains for one in ones]
    k, p = len(ones), len(own)
    tables = problem.tables(gains, np.array([*own, *changes]))
    scored = problem.score(tables, state.roads, information=True)
    slopes, information = scored.slopes, scored.information
    rest, road = np.r_[0:p, p + k : len(slopes)], np.arange(p + k, len(slopes))
    off, precision = problem.prior_terms(state.logs, len(base.free_parameters), state.roads)
    known = inverse(information[np.ix_(rest, rest)] + np.diag(precision))
    by_road = inverse(information[np.ix_(road, road)] + np.diag(precision[p:]))
    score = slopes[rest] - precision * off
    found = []
    for index, one in enumerate(ones, p):
        alone, mixed = information[index, index], information[index, rest]
        remaining = max(float(alone - mixed @ known @ mixed), 0.0)
        with_road = information[index, road]
        share = float(1 - with_road @ by_road @ with_road / alone) if alone > 0 else 0.0
        slope = float(slopes[index] - mixed @ known @ score)
        found.append(_trial(one, slope, remaining, alone, max(share, 0.0)))
    return found


def _trial(one: Chosen, slope: float, remaining: float, alone: float, share: float) -> TrialOnRoad:
    """The trial at its best strength by its score and its information, as far as a quadratic is to be believed.

    remaining, alone    its information with all free numbers projected out, and before; a share below 1e-4 is mostly
                        rounding
    """
    if not remaining > 1e-4 * alone:
        return TrialOnRoad(one, 0.0, one, 0.0, share)
    strength = float(np.clip(slope / remaining, 0.03, 3.0))
    scaled = scale_strength(one, strength)
    if scaled is None:
        strength, scaled = 1.0, one
    gain = (2 * strength * slope - strength**2 * remaining) / (1 + 1 / PROBES)
    return TrialOnRoad(one, gain, scaled, float(np.sqrt(remaining)), share)
