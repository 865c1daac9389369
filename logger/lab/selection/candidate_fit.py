"""A model with one more effect, fitted: by the slopes of the model without it, then with its own."""

from __future__ import annotations

from dataclasses import dataclass

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import MapFit, fit, laid_out, minimised, own_slopes
from logger.lab.likelihood.posterior import State
from logger.lab.selection.holdout import HoldOut, held_out
from logger.lab.selection.screening import Baseline, Screened, Trial
from logger.vehicle.effect import Chosen, Effect
from logger.vehicle.effect_parameters import moves_of


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
        linear = self.found.linear(as_sized=True)
        return held_out(linear, own_slopes(linear))


def roughly_fitted(score: float, base: Baseline, screened: Screened) -> list[CandidateFit]:
    """An effect fitted from each of its trials by the slopes of a model without it, best first.

    score    of the model that gains are counted from
    """
    return sorted((_rough_fit(score, base, trial) for trial in screened.trials), key=lambda one: -one.gain)


def refined(score: float, one: CandidateFit, worth: float = 0.0, rounds: int = 3) -> CandidateFit:
    """The same with slopes of its own."""
    found = MapFit.of(fit(one.found.linear(), one.found.numbers, rounds, worth))
    return CandidateFit(found, score - found.score)


def _rough_fit(score: float, base: Baseline, trial: Trial) -> CandidateFit:
    posterior, numbers = base.posterior, base.linear.numbers
    if trial.start is not None:
        linear, state = LinearModel(posterior, trial.start, numbers), trial.start
    else:
        linear = base.linear.holding(trial.one.effect.replaces)
        state = State((*base.state.effects, trial.one), posterior.prior.within_wall(trial.logs), linear.state.record,
                      linear.size, [])
    state = minimised(linear, state, moves_of(state.effects))
    there = laid_out(posterior, state, linear.numbers, score)
    found = MapFit.of(there)
    return CandidateFit(found, score - found.score)
