"""Score tests of drafted laws: how much each would gain on top of a model, before it is fitted.

A law with one strength is tried as an effect of the list is (``selection.screening``). A curve has many: the
derivatives by all of them are taken at 0, and they are solved for together with the car's numbers (one Gauss-Newton
step).
"""

from __future__ import annotations

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.likelihood.map_fit import effect_slopes
from logger.lab.selection.screening import Baseline, Screened, Trial, screen
from logger.vehicle.effect import Misalignment, chosen
from logger.vehicle.effect_parameters import FreeParameter, coordinates_of, with_coordinates


def screen_law(base: Baseline, draft: Draft, misalignment: Misalignment) -> Screened:
    """Trials of a law on top of a model, the largest gain first."""
    if len(draft.strengths) < 2:
        return screen(base, draft.effect, [misalignment])
    effect = draft.effect
    null = {one.name: float(one.null) for one in effect.parameters if one.name in draft.strengths
            and one.null is not None}
    trials = [_gauss_newton_trial(base, draft, {**values, **null}) for values in effect.trials(misalignment)[:1]]
    return Screened(effect, tuple(sorted(trials, key=lambda trial: -trial.gain)))


def free_count(one: Screened) -> int:
    """Number of free parameters of an effect."""
    return sum(parameter.is_free for parameter in one.effect.parameters)


def _gauss_newton_trial(base: Baseline, draft: Draft, values: dict[str, float]) -> Trial:
    """The trial of a law with several strengths, after one Gauss-Newton step from these values."""
    linear, state = base.linear, base.state
    effects = (*state.effects, chosen(draft.effect, values))
    last = len(effects) - 1
    strengths = [FreeParameter(last, place) for place, one in enumerate(draft.effect.parameters)
                 if one.name in draft.strengths]
    slopes = effect_slopes(linear, effects, state.logs, strengths, state.record, base.rough)
    white, residuals = linear.whitened(slopes), linear.fit_record_errors(state.predictions).residuals
    gradient, information = linear.gradient(residuals, state.logs, white), linear.information(white)
    p = linear.count
    # A point of a curve beyond all motions has no derivative, and stays at 0.
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.where(size > 0, size, 1.0)
    step = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-8, hermitian=True) @ (gradient / scale) / scale
    without = np.linalg.solve(information[:p, :p], gradient[:p]) if p else np.empty(0)
    there = with_coordinates(effects, strengths, coordinates_of(effects, strengths) + step[p:])
    change = [step[p:] @ one for one in slopes]
    return Trial(there[-1], float(gradient @ step - gradient[:p] @ without), state.logs + step[:p], change)
