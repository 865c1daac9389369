"""Effects tried on top of a model of drives over an unknown road, by its slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.lab.selection.screening import scale_strength
from logger.lab.unknown_road.fisher_scoring import RoadFit, inverse, response_and_slopes
from logger.lab.unknown_road.likelihood import PROBES, SameRoad
from logger.vehicle.effect import Chosen


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect at some values on top of a model.

    gain           what it promises, in minus twice the log-likelihood
    at             the values at which it does
    deviations     how many standard errors it stands out by at its values, all that is free being fitted
    share_beyond_road    the same share of its information (0 to 1) that roads and places do not take
    """

    one: Chosen
    gain: float
    at: Chosen
    deviations: float
    share_beyond_road: float


def screen(problem: SameRoad, base: RoadFit, ones: Sequence[Chosen]) -> list[Trial]:
    """Effects tried on top of a fitted model, by its slopes along the change that each makes in the response: a score
    test, the car's numbers and the roads' projected out."""
    state = base.state
    gains, own = response_and_slopes(problem, state.effects, base.moves, state.logs)
    changes = [problem.response((*state.effects, one), state.logs) - gains for one in ones]
    k, p = len(ones), len(own)
    table = problem.table(gains, np.array([*own, *changes]))
    slopes, information = problem.score_and_information(table, state.roads, information=True)
    rest = np.r_[0:p, p + k : p + k + problem.count]
    road = np.arange(p + k, p + k + problem.count)
    off, precision = problem.prior_terms(state.logs, len(base.moves), state.roads)
    known = inverse(information[np.ix_(rest, rest)] + np.diag(precision))
    by_road = inverse(information[np.ix_(road, road)] + np.diag(precision[p:]))
    score = slopes[rest] - precision * off
    found = []
    for index, one in enumerate(ones, p):
        alone, mixed = information[index, index], information[index, rest]
        left = max(float(alone - mixed @ known @ mixed), 0.0)
        taken = information[index, road]
        share = float(1 - taken @ by_road @ taken / alone) if alone > 0 else 0.0
        slope = float(slopes[index] - mixed @ known @ score)
        found.append(_trial(one, slope, left, alone, max(share, 0.0)))
    return found


def _trial(one: Chosen, slope: float, left: float, alone: float, share: float, weakest: float = 0.03,
           strongest: float = 3.0) -> Trial:
    """A trial at the strength that its slope and its information promise, within these bounds.

    left, alone    its information with all that is free fitted, and by itself; of less than 1e-4 of that rounding is
                   most
    """
    if not left > 1e-4 * alone:
        return Trial(one, 0.0, one, 0.0, share)
    strength = float(np.clip(slope / left, weakest, strongest))
    scaled = scale_strength(one, strength)
    if scaled is None:
        strength, scaled = 1.0, one
    gain = (2 * strength * slope - strength**2 * left) / (1 + 1 / PROBES)
    return Trial(one, gain, scaled, float(np.sqrt(left)), share)
