"""Score tests of effects on top of a model of drives over an unknown road."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.fitting.information_matrix import inverse
from logger.lab.selection.screening import scale_strength
from logger.lab.unknown_road.fisher_scoring import SameRoadFit, response_and_slopes
from logger.lab.unknown_road.likelihood import PROBES, SameRoad
from logger.vehicle.effect import Chosen


@dataclass(frozen=True, eq=False)
class Trial:
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


def screen(problem: SameRoad, base: SameRoadFit, ones: Sequence[Chosen]) -> list[Trial]:
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


def _trial(one: Chosen, slope: float, remaining: float, alone: float, share: float, weakest: float = 0.03,
           strongest: float = 3.0) -> Trial:
    """The trial at its best strength by its score and its information, within these bounds.

    remaining, alone    its information with all free numbers projected out, and before; a share below 1e-4 is mostly
                        rounding
    """
    if not remaining > 1e-4 * alone:
        return Trial(one, 0.0, one, 0.0, share)
    strength = float(np.clip(slope / remaining, weakest, strongest))
    scaled = scale_strength(one, strength)
    if scaled is None:
        strength, scaled = 1.0, one
    gain = (2 * strength * slope - strength**2 * remaining) / (1 + 1 / PROBES)
    return Trial(one, gain, scaled, float(np.sqrt(remaining)), share)
