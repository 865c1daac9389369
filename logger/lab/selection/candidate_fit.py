"""Fits of a model with one more effect: first with the derivatives of the model without it, then with its own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.by_squares import BySquares
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import fit, optimise_numbers, relinearise
from logger.lab.likelihood.noise_floor import gain_of_full_explanation
from logger.lab.likelihood.posterior import NotSimulated, Posterior, State
from logger.lab.selection.evidence import (
    INDISTINGUISHABLE,
    min_gain,
    probability_by_chance,
    probability_of_likelihood_gain,
)
from logger.lab.selection.holdout import HoldOut, cross_validate, most_of
from logger.lab.selection.screening import Baseline, Screened, Trial
from logger.vehicle.effect import AXLE, Chosen, Effect, Sought
from logger.vehicle.named_parameters import free_parameters_of


@dataclass(frozen=True, eq=False)
class CandidateFit:
    """A fitted model with one more effect, its last, without its linearisation, which takes much memory.

    state      the fitted numbers and their predictions
    numbers    derivatives by the car's numbers (p, n) per run, taken near the state
    score      minus twice the log of its evidence
    gain       by how much this is below the score of the model without the effect
    """

    posterior: Posterior
    state: State
    numbers: list[Array]
    score: float
    gain: float

    @staticmethod
    def of(score: float, fitted: LinearModel) -> CandidateFit:
        """A fitted model, over one with this score."""
        return CandidateFit(fitted.posterior, fitted.state, list(fitted.numbers or ()), fitted.score,
                            score - fitted.score)

    def further(self, rounds: int = 6, least: float = 0.0) -> LinearModel:
        """The model fitted from there on, in so many rounds at most, until one gains less than this."""
        return fit(LinearModel(self.posterior, self.state, self.numbers), self.numbers, rounds, min_gain=least)

    @property
    def effect(self) -> Effect:
        """The effect that was added."""
        return self.chosen.effect

    @property
    def chosen(self) -> Chosen:
        """The effect that was added, with its values."""
        return self.state.effects[-1]

    @cached_property
    def hold_out(self) -> HoldOut:
        """Cross-validation of the model."""
        return cross_validate(self)


def chance_of(effects: Sequence[Chosen], gain: float, freedom: float, candidates: int) -> float:
    """Probability, at most, that noise alone gains so much in minus twice the log of the evidence by adding such
    effects, chosen among so many, to a model of records with so many degrees of freedom. Effects that shift runs
    compete with the distance errors, whose likelihood is no normal one, and among how many more a law was chosen that
    is drafted by the records nobody knows: for them only the bound of the evidence holds."""
    bound = probability_by_chance(gain, candidates)
    if any(one.effect.realigns or one.effect.sought is Sought.NEVER for one in effects):
        return bound
    numbers = len(free_parameters_of(effects))
    trials = candidates * prod(_shapes(one) for one in effects)
    return min(bound, probability_of_likelihood_gain(gain + numbers * float(np.log(freedom)), numbers, trials))


def _shapes(one: Chosen) -> int:
    """From how many shapes, such as frequencies or knees, a search for an effect starts; one axle alone is one of the
    choices that are tried after both."""
    trials, numbers = one.effect.trials(), [each.name for each in one.effect.parameters if each.null is None]
    count = len({tuple(values[name] for name in numbers) for values in trials})
    return count * (len(AXLE.choices) if one.where else 1)


def fit_roughly(score: float, base: Baseline, screen: Screened, least: float = -np.inf) -> list[CandidateFit]:
    """Fit an effect from each of its trials, with the derivatives of the model without it; best first. A trial whose
    car cannot be simulated, where it begins or ends, is left out: its numbers were extrapolated too far.

    score    of the model that gains are counted from
    least    gain of a trial below which it is no start, if it is not the first
    """
    fits = []
    for place, trial in enumerate(screen.trials):
        if not place or trial.gain > least:
            with suppress(*NotSimulated):
                fits.append(_rough_fit(score, base, trial))
    return sorted(fits, key=lambda one: -one.gain)


def refine(score: float, one: CandidateFit, worth: float = 0.0, rounds: int = 3) -> CandidateFit:
    """Fit a candidate again with derivatives of its own."""
    return CandidateFit.of(score, one.further(rounds, worth))


def reshaped(found: LinearModel | CandidateFit, name: str, ways: Iterable[Mapping[str, float]], least: float = 0.0
             ) -> LinearModel:
    """The model with other refinements of one of its effects, fitted from where it is until a round gains less than
    ``least``, with the likeliest of some ways. NotSimulated where none can be simulated."""
    state, begun = found.state, []
    for way in ways:
        effects = [replace(one, values={**one.values, **{each: way[each] for each in one.effect.refinements}})
                   if one.effect.name == name else one for one in state.effects]
        begun.append(LinearModel(found.posterior, found.posterior.state_at(
            effects, state.logs, state.record, state.size), found.numbers))
    return fit(min(begun, key=lambda each: each.score), found.numbers, min_gain=least)


def with_refinements(now: Baseline, name: str, least: float) -> Baseline:
    """The model, or one with refinements of one of its effects, which has its plain form, that begins there, if that
    explains most of what the plain one leaves, and of what one that begins where it ended leaves, too. It is asked of
    fits that end with a round that gains less than ``least``."""
    place = [one.effect.name for one in now.effects].index(name)
    effect = now.effects[place].effect
    plain = CandidateFit.of(now.score, now.linear)
    ways = [way for way in effect.trials() if not Chosen(effect, way).is_plain]
    try:
        refined = CandidateFit.of(now.score, reshaped(plain, name, ways, least))
        if (refined.state.effects[place].is_refined_too_far or not _explains_most(refined, plain)
                or not _explains_most(refined, CandidateFit.of(now.score, reshaped(
                    refined, name, [effect.usual], least)))):
            return now
    except NotSimulated:
        return now
    return Baseline.of(refined.further())


def _explains_most(more: CandidateFit, less: CandidateFit) -> bool:
    """Whether one fit explains most of what another leaves: of its power on stretches held out, or of its evidence in
    all signals, as the power of the first is mostly noise where it leaves little."""
    gain = more.gain - less.gain
    return gain > INDISTINGUISHABLE and (
        more.hold_out.explains_most_beyond(less.hold_out)
        or gain > most_of(gain_of_full_explanation(less.posterior, less.state)))


def _rough_fit(score: float, base: Baseline, trial: Trial) -> CandidateFit:
    posterior, numbers = base.posterior, base.linear.numbers
    if trial.start is not None:
        linear, state = LinearModel(posterior, trial.start, numbers), trial.start
    else:
        linear = base.linear.hold_fixed(trial.one.effect.replaces)
        state = State((*base.state.effects, trial.one), trial.logs,
                      linear.state.record, linear.size, [])
    found = optimise_numbers(linear, state, free_parameters_of(state.effects))
    one = CandidateFit.of(score, relinearise(posterior, found, linear.numbers, score))
    lost = one.score - base.score - len(free_parameters_of([one.chosen])) * float(np.log(posterior.freedom))
    return _fit_by_squares(score, base, state) if lost > min_gain(1) else one


def _fit_by_squares(score: float, base: Baseline, start: State) -> CandidateFit:
    """A fit that the likelihood led astray, to where it is far worse than the model without the effect, fitted by
    squares first."""
    by_squares = BySquares.of(base.posterior)
    begun = by_squares.at(start.effects, start.logs, start)
    # The likelihood decides from there on. (Measured: after such a round less than a thousandth was left to gain.)
    state = start if begun is None else by_squares.of_all(by_squares.improved(begun[1], min_share=0.02)[1], start)
    return CandidateFit.of(score, fit(LinearModel(base.posterior, state), rounds=3))
