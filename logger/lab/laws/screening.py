"""What a drafted law would gain on top of a model, by slopes: where a fit of it may begin.

A law with one strength is tried as an effect of the list is (``selection.screening``). A curve has many: what each of
them does to the predictions is taken near nothing, and all are solved for together with the car's numbers (one step of
Gauss and Newton).
"""

from __future__ import annotations

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.likelihood.map_fit import effect_slopes
from logger.lab.selection.screening import Baseline, Screened, Trial, screened
from logger.vehicle.effect import Misalignment, chosen
from logger.vehicle.effect_parameters import Move, coordinates_of, moved


def screened_law(base: Baseline, draft: Draft, seen: Misalignment) -> Screened:
    """Trials of a law on top of a model, the most promising first."""
    if len(draft.strengths) < 2:
        return screened(base, draft.effect, [seen])
    effect = draft.effect
    null = {one.name: float(one.null) for one in effect.parameters if one.name in draft.strengths
            and one.null is not None}
    trials = [_solved(base, draft, {**values, **null}) for values in effect.trials(seen)[:1]]
    return Screened(effect, tuple(sorted(trials, key=lambda trial: -trial.gain)))


def count_of(one: Screened) -> int:
    """Of the numbers of an effect that a fit moves."""
    return sum(parameter.moves for parameter in one.effect.parameters)


def _solved(base: Baseline, draft: Draft, values: dict[str, float]) -> Trial:
    linear, state = base.linear, base.state
    effects = (*state.effects, chosen(draft.effect, values))
    last = len(effects) - 1
    moves = [Move(last, place) for place, one in enumerate(draft.effect.parameters) if one.name in draft.strengths]
    slopes = effect_slopes(linear, effects, state.logs, moves, state.record, base.rough)
    white, residuals = linear.whitened(slopes), linear.eliminated(state.predictions).residuals
    gradient, information = linear.gradient(residuals, state.logs, white), linear.information(state.logs, white)
    p = linear.count
    # A point of a curve that no motion comes to does nothing, and stays where it is.
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.where(size > 0, size, 1.0)
    step = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-8, hermitian=True) @ (gradient / scale) / scale
    without = np.linalg.solve(information[:p, :p], gradient[:p]) if p else np.empty(0)
    there = moved(effects, moves, coordinates_of(effects, moves) + step[p:])
    change = [step[p:] @ one for one in slopes]
    return Trial(there[-1], float(gradient @ step - gradient[:p] @ without), state.logs + step[:p], change)
