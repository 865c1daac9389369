"""The search for effects that a model lacks: add, swap, drop, while the evidence gains.

Problem: something differs, and twenty effects, alone or together, might be why; or none of them; or nothing. Solution:
every effect is screened beside the model, the promising ones are fitted, and the one with the most evidence is added if
noise alone would hardly gain as much in so many trials and imitations do not. Then each of the others is taken out:
whatever gains most in its place stays, or nothing. The next round begins on that model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from types import MappingProxyType

import numpy as np

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import aligned, fit
from logger.lab.likelihood.posterior import Posterior
from logger.lab.selection.candidate_fit import CandidateFit, refined, roughly_fitted
from logger.lab.selection.evidence import CONFUSED, IMITATION, least_gain
from logger.lab.selection.holdout import HoldOut
from logger.lab.selection.screening import (
    Baseline,
    Screened,
    as_recorded,
    misalignment_of_record,
    others,
    screened,
    shared_numbers,
    taken_out,
)
from logger.vehicle.effect import Chosen, Effect, Misalignment
from logger.vehicle.effect_parameters import moves_of

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Effort:
    """How much work a search takes; more of it finds no less.

    effects                      no more than so many are looked for
    fitted, refined              how many effects are fitted at most, and how many of them with slopes of their own
    worth_fitting, worth_refining    of the gain of the best one, or of one that would count: what an effect has to
                                 promise for that (with a tenth for fitting, a sensor's bandwidth was missed)
    as_good                      fits of one effect from different starts that gain so much of what the best of them
                                 gains are all refined
    worth_a_round                of what is left to explain: what a round of a fit has to gain to be worth another one;
                                 little has to be settled where much is still to be found
    """

    effects: int = 4
    fitted: int = 6
    refined: int = 3
    worth_fitting: float = 0.03
    worth_refining: float = 0.25
    as_good: float = 0.9
    worth_a_round: float = 0.02


@dataclass(frozen=True, eq=False)
class Round:
    """All effects tried on a model: those that were fitted, best first, and what the others promised."""

    fits: tuple[CandidateFit, ...]
    promises: tuple[Screened, ...]


@dataclass(frozen=True, eq=False)
class Selection:
    """What the search came to.

    before     the model without effects that it lacks
    now        with those that were chosen
    gains      what each of these gains beside the others, by name, the most first
    rivals     effects that explain as well in the place of each, by name
    first      the first round
    steps      names of the effects that were added, with the model as it was then on what its fit did not see
    """

    before: Baseline
    now: Baseline
    gains: dict[str, float]
    rivals: dict[str, tuple[str, ...]]
    first: Round
    steps: tuple[tuple[str, HoldOut], ...]


@dataclass(frozen=True, eq=False)
class Instead:
    """One of a model's effects, in whose place others are tried."""

    now: Baseline
    one: Chosen


@dataclass(eq=False)
class Search:
    """A search among effects, on models that have ``present`` others before them."""

    effects: Sequence[Effect]
    present: int
    seen: Misalignment
    progress: Progress = lambda words: None
    workers: int = 2
    effort: Effort = Effort()
    _promising: set[str] = field(default_factory=set)
    _rivals: dict[str, tuple[str, ...]] = field(default_factory=dict)
    _reduced: tuple[Baseline, dict[str, Baseline]] | None = None

    def run(self, before: Baseline) -> Selection:
        """From a model without effects that it lacks."""
        now = before
        steps: list[tuple[str, HoldOut]] = []
        first = Round((), ())
        while len(now.state.effects) - self.present < self.effort.effects:
            left = [one for one in self.effects if one.name not in now.state.names]
            if not left:
                break
            self.progress(f"round {len(steps) + 1}")
            tried = self.round(now, left, self._enough(now) if steps else 0.0)
            first = first if steps else tried
            best = self._simplest(now, tried)
            if best is None:
                break
            self.progress(f"{best.effect.name} is missing; fitting the car with it")
            self._rivals[best.effect.name] = self._alike(now, best.gain, best.effect.name, tried)
            now = self._akin_instead(now, self.refit(best))
            added = now.state.names[-1]
            earlier = [name for name in now.state.names[self.present:] if name != added]
            steps.append((added, now.hold_out))
            for name in earlier:
                now, _ = self._reconsidered(now, name)
        now, gains = self.needed(before, now)
        rivals = {name: tuple(one for one in self._rivals.get(name, ()) if one not in gains) for name in gains}
        self._reduced = None
        return Selection(before, now, gains, rivals, first, tuple(steps))

    def left_out(self, found: Selection, name: str) -> Selection:
        """The same without one of the effects that were chosen."""
        now, gains = self.needed(found.before, self.without(found.now, name))
        return replace(found, now=now, gains=gains)

    def round(self, now: Baseline, effects: Sequence[Effect], enough: float = 0.0,
              instead: Instead | None = None) -> Round:
        """Every effect tried on a model; those that realign runs beside these as they were recorded as well, where the
        model lies far from there: what such an effect does may have been taken for a start or a factor of the
        distance.

        enough     what an effect has to gain to count
        instead    of which effect; None: of none
        """
        effort = self.effort
        with ThreadPoolExecutor(self.workers) as pool:
            near = instead.one.values if instead is not None else {}
            promises = self._screened(pool, now, effects, near)
            worth = [(now, one) for one in self._worth_fitting(promises, enough)]
            if instead is not None:
                there = taken_out(instead.now, instead.one.effect.name)
                worth += [(there, one) for one in self._worth_fitting(
                    self._screened(pool, there, effects, near), enough)]
            self._promising |= {one.effect.name for _, one in worth}
            aligning = [one for one in effects if one.realigns]
            if now.state.size.is_unusual and aligning:
                there = as_recorded(now)
                worth += [(there, one) for one in self._worth_fitting(self._screened(pool, there, aligning), enough)]
            self.progress(f"fitting {len(worth)} of them")
            tries = _roughly_fitted(pool, now.score, worth)
            rough = _best_of_each(tries)
            best = {one.effect.name: one.gain for one in rough[: effort.refined]
                    if one.gain > effort.worth_refining * max(rough[0].gain, enough)}
            good = [one for one in tries if one.gain > effort.as_good * best.get(one.effect.name, np.inf)]
            if len(good) == 1 and self.accepted(now, good[0]):
                good = []  # it stands alone, and is fitted in full where it is chosen
            self.progress(f"refining {len(good)} of them")
            fine = list(pool.map(lambda one: refined(now.score, one, effort.worth_a_round * now.explanation), good))
        # A fit that is much worse than the model without the effect went astray: its promise says more.
        fits = [one for one in _best_of_each([*fine, *(one for one in rough if one not in good)])
                if one.gain > -least_gain(len(self.effects))]
        fitted = {one.effect.name for one in fits}
        return Round(tuple(fits), tuple(one for one in promises if one.effect.name not in fitted))

    def _screened(self, pool: ThreadPoolExecutor, base: Baseline, effects: Sequence[Effect],
                  near: Mapping[str, float] = MappingProxyType({})) -> list[Screened]:
        """Effects tried beside a model, the most promising first."""
        seen = [self.seen, misalignment_of_record(base)] if base.state.size.is_unusual else [self.seen]
        found = []
        for done, one in enumerate(pool.map(lambda effect: screened(base, effect, seen, near), effects), 1):
            self.progress(f"screened {done} of {len(effects)} effects")
            found.append(one)
        return sorted(found, key=lambda one: -one.gain)

    def _worth_fitting(self, promises: Sequence[Screened], enough: float) -> list[Screened]:
        """Those that promise something, of some that are sorted by what they promise."""
        least = self.effort.worth_fitting * max(promises[0].gain, enough)
        return [one for one in promises[: self.effort.fitted] if one.gain > least]

    def accepted(self, now: Baseline, one: CandidateFit) -> bool:
        """Whether an effect is there: neither by chance nor by imitation, not at an end of its range, and nowhere that
        the record does not show."""
        return self._is_evident(now, one.gain) and not out_of_sight(now.posterior, one.chosen)

    def _is_evident(self, without: Baseline, gain: float) -> bool:
        """Whether so much is gained over a model neither by chance nor by imitation."""
        return gain > self._enough(without)

    def _enough(self, without: Baseline) -> float:
        """More than chance or imitation gains over a model."""
        return max(least_gain(len(self.effects)), IMITATION * without.explanation)

    def _simplest(self, now: Baseline, tried: Round) -> CandidateFit | None:
        """Of those that are there and cannot be distinguished from the likeliest, the plainest."""
        there = [one for one in tried.fits if self.accepted(now, one)]
        return min((one for one in there if one.gain > there[0].gain - CONFUSED),
                   key=lambda one: self._complexity(one.chosen), default=None)

    def _complexity(self, one: Chosen) -> tuple[bool, int]:
        """What the records show anyhow is plainest, and then what has the fewest numbers."""
        return not one.effect.is_seen(one.values, self.seen), len(moves_of([one]))

    def without(self, now: Baseline, name: str) -> Baseline:
        """A model without one of its effects, fitted; kept as long as this is the model."""
        if self._reduced is None or self._reduced[0] is not now:
            self._reduced = now, {}
        kept = self._reduced[1]
        if name not in kept:
            kept[name] = self._fitted_without(now, name)
        return kept[name]

    def _fitted_without(self, now: Baseline, name: str) -> Baseline:
        rest = others(now.state, name)
        away = next(one for one in now.state.effects if one.effect.name == name)
        posterior = now.posterior
        if away.effect.realigns:
            return Baseline.of(fit(aligned(posterior, posterior.at(rest, now.state.logs))))
        start = LinearModel(posterior, posterior.at(rest, now.state.logs, now.state.record, now.state.size))
        return Baseline.of(fit(start, now.linear.numbers, worth=self.effort.worth_a_round * now.explanation))

    def refit(self, one: CandidateFit) -> Baseline:
        """A model with one more effect, fitted in full."""
        posterior = one.found.posterior
        return Baseline.of(fit(aligned(posterior, one.found.state), one.found.numbers))

    def _akin_instead(self, without: Baseline, now: Baseline) -> Baseline:
        """The model, or one with another effect in the place of the one that was added last, where that has numbers in
        common with it, and explains more, or as much and is plainer: a sharp resonance promises nothing beside the
        place where it is, and hardly anything is screened there."""
        here, gain = now.state.effects[-1], without.score - now.score
        akin = [one for one in self.effects if one.name not in now.state.names and shared_numbers(one, here.values)]
        if not akin:
            return now
        self.progress(f"is it {here.effect.name}, or {' or '.join(one.name for one in akin)}?")
        with ThreadPoolExecutor(self.workers) as pool:
            worth = self._worth_fitting(self._screened(pool, without, akin, here.values), gain)
            rough = _best_of_each(_roughly_fitted(pool, without.score, [(without, one) for one in worth]))
            fine = _best_of_each(list(pool.map(partial(refined, without.score), rough)))
        best = self._simplest(without, Round(tuple(fine), ()))
        if best is None or not self._outdoes(best, here, gain):
            return now
        self._rivals[best.effect.name] = (here.effect.name,) if abs(best.gain - gain) < CONFUSED else ()
        return self.refit(best)

    def _outdoes(self, other: CandidateFit, one: Chosen, gain: float) -> bool:
        """Whether an effect in the place of one that gains so much explains more, or as much and is plainer."""
        plainer = self._complexity(other.chosen) < self._complexity(one)
        return other.gain > gain + (-CONFUSED if plainer else CONFUSED)

    def _reconsidered(self, now: Baseline, name: str) -> tuple[Baseline, float]:
        """The model with whatever gains most in the place of an effect, or as much and is plainer, of all that any
        round found worth a fit and all that is described by the same numbers, which may be the same effect elsewhere;
        and what it gains."""
        self.progress(f"is {name} still what it was?")
        without, here = self.without(now, name), next(one for one in now.state.effects if one.effect.name == name)
        gain = without.score - now.score
        may_be = [one for one in self.effects if one.name == name or (one.name not in now.state.names and (
            one.name in self._promising or shared_numbers(one, here.values)))]
        tried = self.round(without, may_be, gain, Instead(now, here))
        best = self._simplest(without, tried)
        if best is not None and self._outdoes(best, here, gain):
            now, gain = self.refit(best), best.gain
            self._rivals.pop(name, None)
            name = best.effect.name
        self._rivals[name] = self._alike(without, gain, name, tried)
        return now, gain

    def _alike(self, without: Baseline, gain: float, name: str, tried: Round) -> tuple[str, ...]:
        """Effects that explain as well as one that gains so much."""
        return tuple(one.effect.name for one in tried.fits
                     if one.effect.name != name and abs(one.gain - gain) < CONFUSED
                     and not out_of_sight(without.posterior, one.chosen))

    def needed(self, before: Baseline, now: Baseline) -> tuple[Baseline, dict[str, float]]:
        """The model without effects that are not needed beside the others, or with which the error on what no fit saw
        is larger than without; and what each of those that stay gains."""
        names = list(now.state.names[self.present:])
        if len(names) == 1:
            if _raises(now, before, names[0]):
                return before, {}
            return now, {names[0]: before.score - now.score}
        gains: dict[str, float] = {}
        while names:
            self.progress(f"are all of {', '.join(names)} needed?")
            with ThreadPoolExecutor(self.workers) as pool:
                without = dict(zip(names, pool.map(partial(self.without, now), names), strict=True))
            gains = {name: other.score - now.score for name, other in without.items()}
            least = min(gains, key=lambda name: gains[name])
            raising = [name for name in names if _raises(now, without[name], name)]
            if raising:
                least = min(raising, key=lambda name: gains[name])
            elif len(names) == 1 or self._is_evident(without[least], gains[least]):
                break
            now = without[least]
            names.remove(least)
            gains.pop(least)
        return now, self._findings(now, dict(sorted(gains.items(), key=lambda pair: -pair[1])))

    def _findings(self, now: Baseline, gains: dict[str, float]) -> dict[str, float]:
        """Without those that only mend what is uncertain of a filter, where that is found as well."""
        by_name = {one.effect.name: one for one in now.state.effects}
        if not any(by_name[name].effect.is_seen(by_name[name].values, self.seen) for name in gains):
            return gains
        return {name: gain for name, gain in gains.items()
                if not by_name[name].effect.is_trifle(by_name[name].values, self.seen)}


def _raises(now: Baseline, without: Baseline, name: str) -> bool:
    """Whether the error on what no fit saw is larger with one of a model's effects. Of an effect that does no more than
    move runs nothing is asked: without it the distance errors do the same, and these are known on all of a run."""
    effect = next(one.effect for one in now.state.effects if one.effect.name == name)
    return effect.reshapes and now.hold_out.raises(without.hold_out)


def out_of_sight(posterior: Posterior, one: Chosen) -> bool:
    """Whether an effect is at an end of its range, or resonates above all that the records hold; that is seen by what
    it does below, if at all, and not where a record was filtered, which looks alike."""
    runs = posterior.runs.runs
    filtered = any(run.facts.pass_band_hz is not None for run in runs)
    return one.at_an_end or one.resonates_above(max(run.pass_band_hz[1] for run in runs), by_flank=not filtered)


def _roughly_fitted(pool: ThreadPoolExecutor, score: float,
                    worth: Sequence[tuple[Baseline, Screened]]) -> list[CandidateFit]:
    """All that is worth a fit, each beside its model."""
    return [one for some in pool.map(lambda pair: roughly_fitted(score, *pair), worth) for one in some]


def _best_of_each(fits: Sequence[CandidateFit]) -> list[CandidateFit]:
    """Of every effect the fit that is best, best first."""
    found: dict[str, CandidateFit] = {}
    for one in sorted(fits, key=lambda one: -one.gain):
        found.setdefault(one.effect.name, one)
    return list(found.values())
