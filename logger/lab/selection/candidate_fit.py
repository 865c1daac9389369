"""A model with one more effect, fitted: by the slopes of the model without it, then with its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import NEAR_M, MapFit, aligned, effect_slopes, fit, minimised
from logger.lab.likelihood.posterior import State
from logger.lab.selection.holdout import HoldOut, held_out
from logger.lab.selection.screening import Baseline, Screened, Trial
from logger.vehicle.effect import Chosen, Effect
from logger.vehicle.effect_parameters import moves_of

_STEPS, _ROUNDS = 5, 3
_WORTH_ALIGNING = 0.02


@dataclass(frozen=True, eq=False)
class CandidateFit:
    """A model with one more effect, its last.

    gain    by how much the score of the model without it falls
    """

    found: MapFit
    gain: float

    @property
    def effect(self) -> Effect:
        """That which was added."""
        return self.chosen.effect

    @property
    def chosen(self) -> Chosen:
        """The effect with its values."""
        return self.found.state.effects[-1]

    @property
    def hold_out(self) -> HoldOut:
        """The model on what its fit did not see."""
        linear, state = self.found.linear, self.found.state
        moves = moves_of(state.effects)
        own = effect_slopes(linear, state.effects, state.logs, moves, state.predictions) if moves else None
        return held_out(linear, own)


def roughly_fitted(base: Baseline, screened: Screened) -> list[CandidateFit]:
    """An effect fitted from each of its trials by the slopes of the model without it, best first."""
    return sorted((_rough_fit(base, trial) for trial in screened.trials), key=lambda one: -one.gain)


def refined(base: Baseline, one: CandidateFit, worth: float = 0.0, rounds: int = _ROUNDS) -> CandidateFit:
    """The same with slopes of its own."""
    found = fit(base.posterior, one.found.state, one.found.numbers, rounds, worth)
    return CandidateFit(found, base.score - found.linear.score)


def every_choice(one: Chosen) -> list[Chosen]:
    """An effect at its values, with each of the choices that no fit moves, its own first."""
    choices = {parameter.name: parameter.choices for parameter in one.effect.parameters if parameter.choices}
    own = tuple(one.values[name] for name in choices)
    picked = sorted(product(*choices.values()), key=lambda values: values != own)
    return [replace(one, values={**one.values, **dict(zip(choices, values, strict=True))}) for values in picked]


def best_choice(tries: Sequence[CandidateFit]) -> CandidateFit:
    """Of one effect with other choices, the likeliest."""
    return max(tries, key=lambda one: one.gain)


def _rough_fit(base: Baseline, trial: Trial) -> CandidateFit:
    posterior = base.posterior
    if trial.start is not None:
        linear = LinearModel(posterior, trial.start, base.found.numbers)
        state = trial.start
    else:
        linear = base.linear.holding(trial.one.effect.replaces)
        state = State((*base.state.effects, trial.one), trial.logs, linear.state.record, linear.size, [])
    state = minimised(linear, state, moves_of(state.effects), _STEPS)
    before, after = (posterior.moved_m(record) for record in (linear.state.record, state.record))
    state = posterior.at(state.effects, state.logs, state.record, state.size)
    if max(float(np.abs(new - old).max()) for new, old in zip(after, before, strict=True)) > NEAR_M:
        state = aligned(posterior, state, _WORTH_ALIGNING)
    there = LinearModel(posterior, state, linear.numbers)
    return CandidateFit(MapFit(there, list(linear.numbers or ())), base.score - there.score)
