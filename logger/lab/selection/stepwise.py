"""The search for effects that a model lacks: add, swap, drop, while the evidence gains.

Problem: something differs, and twenty effects, alone or together, might be why; or none of them; or nothing. Solution:
every effect is screened on top of the model, the promising ones are fitted, and the one with the most evidence is added
if it gains more than noise in so many trials, or an imitation, would. Then each effect found before is removed, and
whatever gains most in its place is kept, or nothing. The next round begins with that model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Generic, Protocol, TypeVar, cast

import numpy as np

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import align, fit, fit_to_the_end
from logger.lab.likelihood.noise_floor import excess_by_signal, is_within_discrepancy
from logger.lab.likelihood.posterior import NotSimulated, Posterior
from logger.lab.likelihood.signals import deviance_standard_error
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.residuals.unexplained import is_coloured_noise
from logger.lab.selection.candidate_fit import CandidateFit, chance_of, fit_roughly, refine, reshaped, with_refinements
from logger.lab.selection.evidence import FALSE_ALARM, IMITATION, INDISTINGUISHABLE, min_gain
from logger.lab.selection.holdout import HoldOut
from logger.lab.selection.screening import (
    Baseline,
    Screened,
    effects_without,
    misalignment_of_record,
    screen,
    shared_parameters,
    without_distance_trend,
    without_effect,
)
from logger.printable import Notify, silent
from logger.vehicle.effect import Chosen, Effect, Misalignment
from logger.vehicle.named_parameters import free_parameters_of


@dataclass(frozen=True)
class SearchEffort:
    """How much work a search takes; more of it finds no less.

    effects                    most effects that are added
    beginnings                 of how many others that it might have begun with it tries each with one more
    fitted                     how many effects are fitted at most
    fit_share, refine_share    of what has to be gained, as far as that is known, an effect that is fitted has gained so
                               much by its screening, and one that is fitted with derivatives of its own by its rough
                               fit: fits gain up to seven times what their screening did (measured on cases of the
                               examination)
    tie_share                  all fits of an effect from different starts that gain this share of the best of its form,
                               plain or with refinements, are refined
    round_share                least gain of a round of a fit, as a share of what is left to explain: where much is
                               left, a rough fit is enough
    """

    effects: int = 4
    beginnings: int = 0
    fitted: int = 6
    fit_share: float = 0.1
    refine_share: float = 0.25
    tie_share: float = 0.9
    round_share: float = 0.02


class FittedModel(Protocol):
    """A fitted model that effects are sought on top of.

    score          minus twice the log of its evidence, over any one for all models of a search
    explanation    gain of a full explanation of what it leaves
    effects        with their values
    hold_out       on data that no fit saw
    """

    @property
    def score(self) -> float: ...

    @property
    def explanation(self) -> float: ...

    @property
    def effects(self) -> tuple[Chosen, ...]: ...

    @property
    def hold_out(self) -> HoldOut: ...


class Promise(Protocol):
    """An effect that was screened, and its expected gain, its numbers not counted."""

    @property
    def effect(self) -> Effect: ...

    @property
    def gain(self) -> float: ...


class Fitted(Protocol):
    """A fit of a model with one more effect, its last, and by how much its score is below that of the model without."""

    @property
    def effect(self) -> Effect: ...

    @property
    def chosen(self) -> Chosen: ...

    @property
    def hold_out(self) -> HoldOut: ...

    @property
    def gain(self) -> float: ...


M = TypeVar("M", bound=FittedModel)
P = TypeVar("P", bound=Promise)
F = TypeVar("F", bound=Fitted)


class Likelihood(Protocol[M, P, F]):
    """What a search asks of a likelihood: of drives over a measured road, or over one that is integrated out."""

    def screened(self, base: M, effects: Sequence[Effect], seen: Misalignment, near: Chosen | None,
                 pool: ThreadPoolExecutor, progress: Notify) -> list[P]:
        """Effects screened on a model, the largest gain first; ``near`` is the one in whose place they are tried, and
        no trial of its own, ``seen`` how the runs are misaligned."""

    def laid_anew(self, base: M) -> M | None:
        """The model for effects that shift runs, where what they do may have been taken for a distance error; unless
        a likelihood says otherwise, there is none."""
        return None

    def stripped(self, now: M, name: str) -> M | None:
        """The model without one of its effects, all other numbers unchanged; None: it is the fitted one, as it is
        unless a likelihood says otherwise."""
        return None

    def without(self, now: M, name: str) -> M:
        """The model without one of its effects, fitted."""

    def fitted_roughly(self, score: float, base: M, one: P, least: float) -> list[F]:
        """Rough fits of an effect on a model, best first, from its first trial and from those that gain more than
        this; gains are counted from a score."""

    def refined(self, base: M, one: F, least: float) -> F:
        """A rough fit that goes on until a round gains less than this; its gain is counted from a model."""

    def with_effect(self, one: F) -> M:
        """The model with one more effect, fitted in full."""

    def refined_beside(self, now: M, name: str, least: float) -> M:
        """The model, or one with refinements of one of its effects, where they explain most of what it leaves by fits
        that go on until a round gains less than this."""
        return now

    def plain(self, now: M, name: str) -> M | None:
        """The model with one of its effects in its plain form, fitted; None: it cannot be simulated."""
        return None

    def chance(self, one: Chosen, gain: float, base: M, candidates: int) -> float:
        """Probability, at most, that noise alone gains as much over a model with any of so many candidates."""

    def is_doubtful(self, base: M, one: F) -> bool:
        """Whether a fit is at an end of its range, beyond what the records show, or predicts no better."""

    def gain_uncertainty(self, one: M | F, other: F) -> float:
        """How far the difference of two models' gains may be off, by what the records themselves say of it."""
        return 0.0

    def leaves_noise(self, there: M | F) -> bool:
        """Whether what is left is noise though it is louder than expected."""
        return False

    def is_at_floor(self, now: M) -> bool:
        """Whether what is left is no louder than noise, of the measured input too."""
        return False

    def explains_most(self, without: M | F, there: M | F) -> bool:
        """Whether more than half of the power of what was left is explained, on data that no fit saw."""
        return False

    def is_within_calibration(self, without: M) -> bool:
        """Whether what a model leaves is within what calibrated sensors may be off by."""
        return False

    def imitates_any(self, one: Effect) -> bool:
        """Whether an effect imitates a part of anything, and it shows whether it explains most of it."""
        return False

    def stops_before(self, what: str, share: float = 1.0) -> bool:
        """Whether a search has done this share of all that it may, so that it does not try something."""
        return False


class MeasuredRoad:
    """The likelihood of drives over a road that was measured."""

    def screened(self, base: Baseline, effects: Sequence[Effect], seen: Misalignment, near: Chosen | None,
                 pool: ThreadPoolExecutor, progress: Notify) -> list[Screened]:
        """Effects screened by simulations at their trial values; those of one name are forms of one."""
        misaligned = [seen]
        if base.state.size.is_unusually_large:
            misaligned.append(misalignment_of_record(base))
        _ = base.quadratic  # worked out once, before several threads ask for it
        found: dict[str, Screened] = {}
        for done, one in enumerate(pool.map(lambda effect: screen(base, effect, misaligned, near), effects), 1):
            progress(f"screened {done} of {len(effects)} effects")
            if one.trials:
                name = one.effect.name
                found[name] = one.with_form(found[name]) if name in found else one
        return sorted(found.values(), key=lambda one: -one.gain)

    def laid_anew(self, base: Baseline) -> Baseline | None:
        """The model with the recorded distances, where its distance errors are large."""
        return without_distance_trend(base) if base.state.size.is_unusually_large else None

    def stripped(self, now: Baseline, name: str) -> Baseline:
        """The model without an effect, before the others have moved to compensate for it."""
        return without_effect(now, name)

    def without(self, now: Baseline, name: str) -> Baseline:
        """The model without an effect, fitted to its end."""
        rest = effects_without(now.state, name)
        removed = next(one for one in now.effects if one.effect.name == name)
        posterior = now.posterior
        if removed.effect.realigns:
            return Baseline.of(fit_to_the_end(align(posterior, posterior.state_at(rest, now.state.logs))))
        start = LinearModel(posterior, posterior.state_at(rest, now.state.logs, now.state.record, now.state.size))
        return Baseline.of(fit_to_the_end(start, now.linear.numbers))

    def fitted_roughly(self, score: float, base: Baseline, one: Screened, least: float) -> list[CandidateFit]:
        """Fits from each trial, with the derivatives of the model."""
        return fit_roughly(score, base, one, least)

    def refined(self, base: Baseline, one: CandidateFit, least: float) -> CandidateFit:
        """The fit with derivatives of its own."""
        return refine(base.score, one, worth=least)

    def with_effect(self, one: CandidateFit) -> Baseline:
        """The model with the effect, its runs aligned again."""
        return Baseline.of(fit(align(one.posterior, one.state), one.numbers))

    def refined_beside(self, now: Baseline, name: str, least: float) -> Baseline:
        """Begun where the model ended."""
        return with_refinements(now, name, least)

    def plain(self, now: Baseline, name: str) -> Baseline | None:
        """Begun where the model ended."""
        effect = next(one.effect for one in now.effects if one.effect.name == name)
        try:
            return Baseline.of(reshaped(now.linear, name, [effect.usual]))
        except NotSimulated:
            return None

    def chance(self, one: Chosen, gain: float, base: Baseline, candidates: int) -> float:
        """By the evidence and by the likelihood."""
        return chance_of([one], gain, base.posterior.freedom, candidates)

    def is_doubtful(self, base: Baseline, one: CandidateFit) -> bool:
        """Whether a fit is at an end of its range, or beyond what the records show, or of a rig predicts what no fit
        saw worse, or no other than two right simulations of one model would. (On a road the distance errors, which are
        fitted to all of a run, do the same as many an effect.)"""
        return is_outside_data(base.posterior, one.chosen) or (base.on_rig and (
            one.hold_out.is_worse_than(base.hold_out)
            or is_within_discrepancy(base.posterior, base.state, one.state)))

    def gain_uncertainty(self, one: Baseline | CandidateFit, other: CandidateFit) -> float:
        """Two standard errors of the difference of their deviances."""
        left, right = (each.posterior.residuals(each.state) for each in (one, other))
        return 2 * deviance_standard_error(one.posterior.bands, left, right)

    def leaves_noise(self, there: Baseline | CandidateFit) -> bool:
        """Whether what is left is noise of a colour."""
        return is_coloured_noise(there.posterior, there.state)

    def is_at_floor(self, now: Baseline) -> bool:
        """Were sensors right but for their noise."""
        return max(excess_by_signal(now.posterior, now.state, FALSE_ALARM, sigma=0.0).values()) < UNEXPLAINED

    def explains_most(self, without: Baseline | CandidateFit, there: Baseline | CandidateFit) -> bool:
        """By the errors on held-out stretches."""
        return there.hold_out.explains_most_beyond(without.hold_out)

    def is_within_calibration(self, without: Baseline) -> bool:
        """Of rigs."""
        return without.is_within_calibration

    def imitates_any(self, one: Effect) -> bool:
        """As the effect says."""
        return one.imitates_any

    def stops_before(self, what: str, share: float = 1.0) -> bool:
        """A search takes as long as it takes."""
        return False


@dataclass(frozen=True, eq=False)
class SearchRound(Generic[P, F]):
    """All effects tried on a model: those that were fitted, best first, and the screening of the others; on which, and
    what that has gained since by another fit of its car, which is still among what the screening promises."""

    fits: tuple[F, ...]
    unfitted: tuple[P, ...]
    on: object = None
    refit_gain: float = 0.0

    def without(self, one: F, now: object) -> SearchRound[P, F] | None:
        """The round on a model without one of its fits; None: it was on another."""
        return replace(self, fits=tuple(fit for fit in self.fits if fit is not one)) if self.on is now else None


UNTRIED: SearchRound[Any, Any] = SearchRound((), ())
_MORE, _OTHERS = "one more effect", "others in the place of what it had found"


@dataclass(frozen=True, eq=False)
class Selection(Generic[M, P, F]):
    """The result of a search.

    before     the model without the effects that were found
    now        the model with them
    gains      of each of them with the others present, by name, the largest first
    rivals     effects that explain as well in the place of each, by name
    first      the first round
    steps      names of the effects that were added, each with the model on data that no fit saw
    last       the last round, in which nothing was added
    """

    before: M
    now: M
    gains: dict[str, float]
    rivals: dict[str, tuple[str, ...]]
    first: SearchRound[P, F]
    steps: tuple[tuple[str, HoldOut], ...]
    last: SearchRound[P, F] = UNTRIED


@dataclass(eq=False)
class Search(Generic[M, P, F]):
    """A search among effects, on models whose first ``present`` effects are given.

    share    that it may do of all that a search may; a quarter is kept for effects that are tried last
    """

    effects: Sequence[Effect]
    present: int
    misalignment: Misalignment
    progress: Notify = silent
    workers: int = 2
    effort: SearchEffort = SearchEffort()
    likelihood: Likelihood[Any, Any, Any] = field(default_factory=MeasuredRoad)
    share: float = 0.75
    _promising: set[str] = field(default_factory=set)
    _rivals: dict[str, tuple[str, ...]] = field(default_factory=dict)
    _reduced: tuple[M, dict[str, M]] | None = None

    def best_of(self, effect: Effect, base: M, values: Mapping[str, float]) -> M:
        """A model with one effect more, with these of its choices, whatever it gains; with its refinements where they
        explain most of what its plain form leaves, or that gains nothing."""
        with ThreadPoolExecutor(self.workers) as pool:
            one = self._screen_all(pool, base, [effect])[0]
        tries = self.likelihood.fitted_roughly(base.score, base, one, -np.inf)
        if not tries:
            raise ValueError(f"expected a car that can be simulated with {effect.name}, found none at its usual values")
        said = [each for each in tries if all(each.chosen.values[name] == value for name, value in values.items())]
        ends = [self.likelihood.refined(base, each, 0.0) for each in said or tries]
        best = self._best_of_each([each for each in ends if each.gain > 0] or ends)[0]
        return self._refined(self.likelihood.with_effect(best))

    def run(self, before: M) -> Selection[M, P, F]:
        """Search on top of a fitted model. Where it ends with refinements of an effect and leaves more than noise, they
        may imitate others together: these are sought without that effect, and taken where they are likelier."""
        found = self._begun_otherwise(self._begun(before))
        refined = [one.effect for one in found.now.effects[self.present:] if not one.is_plain]
        if not refined or not self._leaves_more_than_noise(found.now) or self._stops_before(_OTHERS):
            return found
        self.progress(f"is it {' and '.join(one.name for one in refined)}, or others together?")
        rest = replace(self, effects=[one for one in self.effects if one not in refined], _promising=set(), _rivals={})
        other = rest.run(found.before)
        if other.now.score > found.now.score - INDISTINGUISHABLE:
            return found
        return replace(other, first=found.first) if other.before is found.before else other

    def _begun_otherwise(self, found: Selection[M, P, F]) -> Selection[M, P, F]:
        """The result of a search, or a likelier one. Of two effects that act in series each alone explains little, and
        another may stand for both, with a sensor's effect or others beside it. Where it leaves more than noise, others
        of the first round are begun with, too, and gone on with where one more explains as much as all that was found:
        without what imitates a part of anything, as a sensor does, which is sought after that, in their place too."""
        rest = replace(self, effects=[one for one in self.effects if not self.likelihood.imitates_any(one)], _rivals={})
        rivals = [one for one in found.first.fits if one.effect in rest.effects and one.effect not in {
            each.effect for each in found.now.effects} and (
                self.is_accepted(found.before, one) or self.may_imitate(found.before, one))] if found.gains else []
        for one in rivals[: self.effort.beginnings]:
            if not self._leaves_more_than_noise(found.now):
                break
            self.progress(f"is it {one.effect.name} and another?")
            begun, least = self.likelihood.with_effect(one), found.now.score
            tried = rest.round(begun, [other for other in rest.effects if other is not one.effect])
            best = rest._simplest(begun, tried)
            if best is not None and begun.score - best.gain < least + INDISTINGUISHABLE:
                other = rest.go_on(Selection(found.before, begun, {}, {}, found.first, (
                    (one.effect.name, begun.hold_out),)), tried)
                if other.now.score < least - INDISTINGUISHABLE:
                    _, found = rest.with_more(other, [one for one in self.effects if one not in rest.effects])
        return found

    def _stops_before(self, what: str) -> bool:
        return self.likelihood.stops_before(what, self.share)

    def _leaves_more_than_noise(self, now: M) -> bool:
        return now.explanation > 0 and not (self.likelihood.leaves_noise(now) or self.likelihood.is_at_floor(now))

    def _begun(self, before: M) -> Selection[M, P, F]:
        """The search without a second look at its refinements."""
        return self.go_on(Selection(before, before, {}, {}, UNTRIED, ()))

    def go_on(self, begun: Selection[M, P, F], known: SearchRound[P, F] | None = None) -> Selection[M, P, F]:
        """A search that ended because it had found as many effects as it might, with more of them; ``known``: the round
        on the model that it goes on from."""
        before, now, first, steps = begun.before, begun.now, begun.first, list(begun.steps)
        last, asked = begun.last, set[str]()
        while len((now := self._refined(now)).effects) - self.present < self.effort.effects:
            untried = [one for one in self.effects if one.name not in names_of(now)]
            if not untried or (len(steps) > len(begun.steps) and self._stops_before(_MORE)):
                break
            self.progress(f"round {len(steps) + 1}")
            new = [one.effect.name for one in now.effects[self.present:]
                   if not (one.is_plain or one.effect.name in asked)]
            asked.update(new)
            best, grown, tried = self._before_refinements(now, new, untried)
            if best is None:
                last = tried = known or self.round(now, untried)
                known = None
                first = first if steps else tried
                best = self._simplest(now, tried)
            if best is None and not steps and (under := self._underlaid(now, tried)) is not None:
                tried = self.round(under, [one for one in untried if one.name not in names_of(under)])
                if (best := self._simplest(under, tried)) is not None:
                    now = under
                    steps.append((names_of(now)[-1], now.hold_out))
            if best is None and any(one.effect.refinements for one in now.effects[self.present:]):
                best, grown = self._with_refinements(now, now, tried)
            if best is None:
                other = self._reconsidered(before, now, tried)
                if other is now:
                    break
                now = other
                continue
            self.progress(f"{best.effect.name} is missing; fitting the model with it")
            self._rivals[best.effect.name] = self._rivals_of(now, best, best.gain, best.effect.name, tried)
            there = self._in_range(self._reconsider(
                before, grown or self.likelihood.with_effect(best), best.effect.name, now), now)
            if there is None:
                known = tried.without(best, now)
                continue
            now = there
            *earlier, added = names_of(now)[self.present:]
            last = UNTRIED
            if not earlier and (refitted := self.without(now, added)).score < before.score - INDISTINGUISHABLE:
                # The effect led the fit of the car's own numbers out of a wrong minimum: of the others those are tried
                # there, too, whose gain before would be enough.
                gain = refitted.score - now.score
                may_win = [one.effect for one in first.fits if one.effect.name != added and one.gain > gain]
                if may_win and (self._reached(refitted, self.round(refitted, may_win, to_gain=gain).fits)
                                > gain - INDISTINGUISHABLE):
                    return self._begun(refitted)
                fits, lost, before = cast(tuple[Any, ...], first.fits), before.score - refitted.score, refitted
                first = replace(first, fits=tuple(replace(one, gain=one.gain - lost) for one in fits), refit_gain=lost)
            steps.append((added, now.hold_out))
            now = self._all_reconsidered(before, now, earlier)
        now, gains = self.eliminate_backward(before, now)
        rivals = {name: tuple(one for one in self._rivals.get(name, ()) if one not in gains) for name in gains}
        self._reduced = None
        return Selection(before, now, gains, rivals, first, tuple(steps), last)

    def with_more(self, begun: Selection[M, P, F], more: Sequence[Effect]
                  ) -> tuple[Search[M, P, F], Selection[M, P, F]]:
        """A search that has ended, gone on with more effects. These are tried on the model that it began with and on
        the one that it ended with, and in the place of what it found; what was tried before is not tried again. Where
        none is taken, or may be beside refinements, the result is that of before."""
        wider = replace(self, effects=[*self.effects, *more], share=1.0, _promising=set(), _rivals=dict(begun.rivals))
        before, now = begun.before, begun.now
        first = wider.round(before, more, beside=begun.first)
        best = wider._simplest(before, first)
        if now is before or (best is not None and best.effect in more):
            return wider, wider.go_on(Selection(before, before, {}, {}, first, ()), first)
        now = wider._all_reconsidered(before, now, names_of(now)[self.present:] if wider._promising else ())
        wider._promising |= self._promising
        known = None
        if now is begun.now:
            known = wider.round(now, more, beside=begun.last if begun.last.on is now else UNTRIED)
            if not any(one.effect in more and (wider.is_accepted(now, one) or wider.may_imitate(now, one))
                       for one in known.fits):
                return wider, replace(begun, first=first, last=known)
        return wider, wider.go_on(replace(begun, now=now, first=first), known)

    def _refined(self, now: M) -> M:
        """The model with refinements of the effects that were found, each where it explains most of what is left."""
        for one in now.effects[self.present:] if now.explanation else ():
            if one.effect.refinements and one.is_plain:
                now = self.likelihood.refined_beside(now, one.effect.name, self.effort.round_share * now.explanation)
        return now

    def _in_range(self, now: M, without: M) -> M | None:
        """The model with those effects in their plain form whose refinements an effect more has led too far; None where
        it is no better then than the model without that effect, which only imitated what is missing."""
        found = now
        for one in now.effects[self.present:]:
            if one.is_refined_too_far:
                found = self.likelihood.plain(found, one.effect.name) or found
        better = found is now or (found.score < without.score - INDISTINGUISHABLE
                                  and not found.hold_out.is_worse_than(without.hold_out))
        return found if better else None

    def _before_refinements(self, now: M, names: Sequence[str], untried: Sequence[Effect]
                            ) -> tuple[F | None, M | None, SearchRound[P, F]]:
        """As ``_with_refinements``, with the plain form of one of some effects, where the model leaves more than noise;
        and the round on that."""
        for name in names if self._leaves_more_than_noise(now) else ():
            if (plain := self.likelihood.plain(now, name)) is not None:
                tried = self.round(plain, untried)
                best, grown = self._with_refinements(now, plain, tried)
                if best is not None:
                    return best, grown, tried
        return None, None, UNTRIED

    def _with_refinements(self, now: M, plain: M, tried: SearchRound[P, F]) -> tuple[F | None, M | None]:
        """An effect more and the likeliest model with it, of those tried on a model without the refinements of an
        effect, which are sought beside it: without it they may imitate it. None where that is not likelier than the
        model with these alone, or the effect evident neither without them nor over that."""
        found: F | None = None
        grown: M | None = None
        least = now.score - INDISTINGUISHABLE
        for one in tried.fits:
            if self.is_accepted(plain, one) or self.may_imitate(plain, one):
                self.progress(f"is it {one.effect.name} beside refinements?")
                more = self._refined(self.likelihood.with_effect(one))
                added = more.effects[-1]
                if more.score < least and not added.at_bound and (
                        self.is_accepted(plain, one) or self._is_evident(now, added, now.score - more.score, more)):
                    found, grown, least = one, more, more.score
        return found, grown

    def _reconsidered(self, before: M, now: M, tried: SearchRound[P, F]) -> M:
        """The model with others in the place of its effects, where what is left is within sensors' calibration and an
        effect explains a part of it: it may be the right one, and what it would be added to its imitation."""
        if not self.likelihood.is_within_calibration(now) or not any(self.may_imitate(now, one) for one in tried.fits):
            return now
        rivals = dict(self._rivals)
        other = self._all_reconsidered(before, now, names_of(now)[self.present:])
        if other.score < now.score - INDISTINGUISHABLE:
            return other
        self._rivals = rivals
        return now

    def _underlaid(self, now: M, tried: SearchRound[P, F]) -> M | None:
        """The model with an effect that is nearly always there and may hide others; None where there is no such effect,
        or nothing to explain."""
        if now.explanation == 0:
            return None
        fits = [one for one in tried.fits if one.effect.underlies]
        fits += [one for each in tried.unfitted if each.effect.underlies
                 for one in self.likelihood.fitted_roughly(now.score, now, each, 0.0)]
        return self.likelihood.with_effect(fits[0]) if fits else None

    def without_effect(self, found: Selection[M, P, F], name: str) -> Selection[M, P, F]:
        """A result without one of its effects."""
        now, gains = self.eliminate_backward(found.before, self.without(found.now, name))
        return replace(found, now=now, gains=gains)

    def round(self, now: M, effects: Sequence[Effect], instead_of: Chosen | None = None, base: M | None = None,
              to_gain: float | None = None, beside: SearchRound[P, F] = UNTRIED) -> SearchRound[P, F]:
        """Every effect tried on a model. Where its distance errors are large, effects that shift runs are also tried
        with the recorded distances: what they do may have been taken for a start or scale error.

        Fits are dear. One is made as long as its effect may still gain what has to be gained: more than chance does, or
        the effect in whose place it is tried, and then what the best fit that may be taken has gained. On a model that
        has none yet the best fit so far may be of an imitation, and the right effect far from where it was screened:
        there all that gain more than chance are fitted, unless it is said what has to be gained.

        instead_of    the effect in whose place they are tried; None: in addition
        base          the model on which they are screened; None: this one
        to_gain       gain of that effect, or of what else is to be outdone; None: what chance may gain
        beside        a round of others on the same model, which is a part of this one
        """
        effort, base = self.effort, now if base is None else base
        may_prune = to_gain is not None or len(names_of(now)) > self.present
        to_gain = min_gain(len(self.effects)) if to_gain is None else to_gain
        lost = base.score - now.score
        with ThreadPoolExecutor(self.workers) as pool:
            unfitted = self._screen_all(pool, base, effects, instead_of)
            worth = self._may_win(base, unfitted, effort.fit_share * (lost + to_gain))
            self._promising |= {one.effect.name for _, one in worth}
            aligning = [one for one in effects if one.realigns]
            if aligning and (there := self.likelihood.laid_anew(now)) is not None:
                worth += self._may_win(there, self._screen_all(pool, there, aligning), effort.fit_share * to_gain)
            self.progress(f"fitting {len(worth)} of them")
            tries = self._fit_all_roughly(pool, now.score, worth[:1], 0.0)
            if may_prune:
                to_gain = max(to_gain, self._reached(now, [*tries, *beside.fits]))
            enough = effort.fit_share * to_gain
            tries += self._fit_all_roughly(pool, now.score, [
                pair for pair in worth[1:] if _gains_enough(pair[1], enough)], enough)
            rough = self._best_of_each(tries)
            enough = effort.refine_share * max([to_gain, *(one.gain for one in (*rough, *beside.fits))])
            by_gain = sorted(tries, key=lambda one: -one.gain)
            worthy = {one.effect.name for one in by_gain if _gains_enough(one, enough)}
            best = {(one.effect.name, one.chosen.is_plain): one.gain for one in reversed(by_gain)}
            good = [one for one in by_gain if one.effect.name in worthy
                    and one.gain > effort.tie_share * best[one.effect.name, one.chosen.is_plain]]
            if (len(good) == 1 and good[0] in rough and instead_of is None and beside is UNTRIED
                    and self.is_accepted(now, good[0])):
                good = []  # the only one: it is fitted in full when it is added
            self.progress(f"refining {len(good)} of them")
            refine = partial(self.likelihood.refined, now, least=effort.round_share * now.explanation)
            fine = list(map(refine, good[:1]))
            enough = effort.refine_share * self._reached(now, [*fine, *beside.fits])
            good = [*good[:1], *(one for one in good[1:] if one.gain > enough)]
            fine += pool.map(refine, good[1:])
        # A fit that is much worse than the model without the effect has diverged: its screening says more.
        fits = [one for one in self._best_of_each([*fine, *(one for one in rough if one not in good), *beside.fits])
                if one.gain > -min_gain(len(self.effects))]
        fitted = {one.effect.name for one in fits}
        rest = sorted((*unfitted, *beside.unfitted), key=lambda one: -one.gain)
        return SearchRound(tuple(fits), tuple(one for one in rest if one.effect.name not in fitted), now)

    def _best_of_each(self, fits: Sequence[F]) -> list[F]:
        """The best fit of each effect, best first: in both axles, where one of them alone cannot be distinguished; in
        its plain form, unless its refinements explain most of what that leaves."""
        found: dict[bool, dict[str, F]] = {True: {}, False: {}}
        for one in sorted(fits, key=lambda one: -one.gain - INDISTINGUISHABLE * (not one.chosen.where)):
            found[one.chosen.is_plain].setdefault(one.effect.name, one)
        plain, refined = found[True], found[False]
        best = {**refined, **plain, **{name: one for name, one in refined.items() if name in plain
                                       and not one.chosen.is_refined_too_far
                                       and self.likelihood.explains_most(plain[name], one)}}
        return sorted(best.values(), key=lambda one: -one.gain)

    def _may_win(self, base: M, screened: Sequence[P], enough: float) -> list[tuple[M, P]]:
        """The first of some screenings on a model that gain enough."""
        return [(base, one) for one in screened[: self.effort.fitted] if _gains_enough(one, enough)]

    def _screen_all(self, pool: ThreadPoolExecutor, base: M, effects: Sequence[Effect],
                    near: Chosen | None = None) -> list[P]:
        """Screenings of effects on a model, the largest gain first."""
        return self.likelihood.screened(base, effects, self.misalignment, near, pool, self.progress)

    def _fit_all_roughly(self, pool: ThreadPoolExecutor, score: float, worth: Sequence[tuple[M, P]],
                         least: float) -> list[F]:
        """Rough fits of screened effects, each on its model, from all their trials that gain more than this."""
        fits = pool.map(lambda pair: self.likelihood.fitted_roughly(
            score, pair[0], pair[1], least if pair[1].effect.reshapes else 0.0), worth)
        return [one for some in fits for one in some]

    def _reached(self, now: M, fits: Sequence[F]) -> float:
        """The largest gain of fits that may be taken; 0: there is none."""
        return max((one.gain for one in fits if one.gain > self._required_gain(now)
                    and not self.likelihood.is_doubtful(now, one)), default=0.0)

    def is_accepted(self, now: M, one: F) -> bool:
        """Whether an effect gains enough, and its values are within its range and within what the record shows."""
        return self._is_evident(now, one.chosen, one.gain, one) and not self.likelihood.is_doubtful(now, one)

    def may_imitate(self, now: M, one: F) -> bool:
        """Whether an effect would be accepted, did it not gain so little of what is to be explained that it may only
        imitate what is missing."""
        return (self._chance_of(now, one.chosen, one.gain) < FALSE_ALARM and not self.is_accepted(now, one)
                and not self.likelihood.is_doubtful(now, one))

    def _is_evident(self, without: M, one: Chosen, gain: float, there: M | F) -> bool:
        """Whether an effect's gain over a model is more than chance or imitation would give. Where nothing is left to
        explain, or what is left with it (``there``) is noise, nothing is imitated; nor by what explains most of the
        power, be it in so few lines of a spectrum that a likelihood, which counts lines, has hardly gained. Of what a
        sensor may be off by, whose form nobody knows, an effect may imitate a larger part; and of anything one that
        changes all of a record."""
        if not self._chance_of(without, one, gain) < FALSE_ALARM:
            return False
        may_imitate = self.likelihood.imitates_any(one.effect) or self.likelihood.is_within_calibration(without)
        if without.explanation == 0 or (gain > IMITATION * without.explanation and not may_imitate):
            return True
        return self.likelihood.leaves_noise(there) or self.likelihood.explains_most(without, there)

    def _chance_of(self, without: M, one: Chosen, gain: float) -> float:
        """Probability, at most, that noise alone gains so much over a model."""
        return self.likelihood.chance(one, gain, without, len(self.effects))

    def _required_gain(self, without: M) -> float:
        """Gain over a model from which on nothing is chance or imitation; what gains less than a share of it is not
        pursued."""
        return max(min_gain(len(self.effects)), IMITATION * without.explanation)

    def _simplest(self, now: M, tried: SearchRound[P, F]) -> F | None:
        """The simplest of the accepted effects that cannot be distinguished from the most likely one."""
        accepted = [one for one in tried.fits if self.is_accepted(now, one)]
        return min((one for one in accepted if one.gain > accepted[0].gain - INDISTINGUISHABLE),
                   key=lambda one: self._complexity(one.chosen), default=None)

    def _complexity(self, one: Chosen) -> tuple[bool, int]:
        """Order of simplicity: effects that the records show by themselves first, then by their free parameters."""
        return not one.effect.is_seen(one.values, self.misalignment), len(free_parameters_of([one]))

    def without(self, now: M, name: str) -> M:
        """A model without one of its effects, fitted; kept for the model that was asked for last."""
        if self._reduced is None or self._reduced[0] is not now:
            self._reduced = now, {}
        kept = self._reduced[1]
        if name not in kept:
            kept[name] = self.likelihood.without(now, name)
        return kept[name]

    def _is_preferred(self, other: F, one: Chosen, gain: float) -> bool:
        """Whether an effect in the place of one that gains so much explains more, or as much and is simpler."""
        simpler = self._complexity(other.chosen) < self._complexity(one)
        return other.gain > gain + (-INDISTINGUISHABLE if simpler else INDISTINGUISHABLE)

    def _reconsider(self, before: M, now: M, name: str, added_to: M | None = None) -> M:
        """The model, or one with another effect in the place of this one, if that is preferred: of all that any round
        fitted, and all with the same parameters. A sharp resonance gains nothing at another frequency, and screening
        tries few frequencies.

        before      the model without any effects that were found
        added_to    the model that it was just added to, on which the others were tried; None: it was added before
        """
        here = next(one for one in now.effects if one.effect.name == name)
        may_be = [one for one in self.effects if one.name not in names_of(now) and (
            shared_parameters(one, here.values) or (added_to is None and one.name in self._promising))]
        if (added_to is not None and not may_be) or self._stops_before(_OTHERS):
            return now
        self.progress(f"fitting {name} again" if added_to is None else
                      f"is it {name}, or {' or '.join(one.name for one in may_be)}?")
        without = added_to or self.without(now, name)
        gain = without.score - now.score
        base = self.likelihood.stripped(now, name)
        if base is not None and base.score > before.score:
            base = None  # the car's own numbers have moved too far to make room for it
        tried = self.round(without, may_be if added_to is not None else [*may_be, here.effect], here, base, gain)
        best = self._simplest(without, tried)
        alike: tuple[str, ...] = ()
        if best is not None and self._is_preferred(best, here, gain):
            alike = (name,) if abs(best.gain - gain) < INDISTINGUISHABLE else ()
            now, gain = self.likelihood.with_effect(best), best.gain
            self._rivals.pop(name, None)
            name = best.effect.name
        elif added_to is not None:
            return now
        self._rivals[name] = (*alike, *self._rivals_of(without, now, gain, name, tried))
        return now

    def _all_reconsidered(self, before: M, now: M, names: Sequence[str]) -> M:
        """The model, or one with others in the place of some of its effects; as ``_reconsider``, one after the other.
        """
        for name in names:
            now = self._reconsider(before, now, name)
        return now

    def _rivals_of(self, without: M, there: M | F, gain: float, name: str, tried: SearchRound[P, F]) -> tuple[str, ...]:
        """Names of other effects that cannot be distinguished from one (``there``) that gains so much."""
        return tuple(one.effect.name for one in tried.fits if one.effect.name != name
                     and abs(one.gain - gain) < max(INDISTINGUISHABLE, self.likelihood.gain_uncertainty(there, one))
                     and not self.likelihood.is_doubtful(without, one))

    def eliminate_backward(self, before: M, now: M) -> tuple[M, dict[str, float]]:
        """The model without effects that gain too little with the others present, and the gain of each of those that
        stay."""
        names = names_of(now)[self.present:]
        if len(names) == 1:
            return now, {names[0]: before.score - now.score}
        gains: dict[str, float] = {}
        while names:
            self.progress(f"are all of {', '.join(names)} needed?")
            with ThreadPoolExecutor(self.workers) as pool:
                without = dict(zip(names, pool.map(partial(self.without, now), names), strict=True))
            gains = {name: other.score - now.score for name, other in without.items()}
            by_name = {one.effect.name: one for one in now.effects}
            chances = {name: self._chance_of(without[name], by_name[name], gain) for name, gain in gains.items()}
            least = min(gains, key=lambda name: (-chances[name], gains[name]))
            if len(names) == 1 or self._is_evident(without[least], by_name[least], gains[least], now):
                break
            now = without[least]
            names.remove(least)
            gains.pop(least)
        return now, self._findings(now, dict(sorted(gains.items(), key=lambda pair: -pair[1])))

    def _findings(self, now: M, gains: dict[str, float]) -> dict[str, float]:
        """The gains without effects that only correct what is uncertain of a filter, where that is found as well."""
        by_name = {one.effect.name: one for one in now.effects}
        if not any(by_name[name].effect.is_seen(by_name[name].values, self.misalignment) for name in gains):
            return gains
        return {name: gain for name, gain in gains.items()
                if not by_name[name].effect.is_trifle(by_name[name].values, self.misalignment)}


def is_outside_data(posterior: Posterior, one: Chosen) -> bool:
    """Whether an effect is at an end of its range, or resonates above the pass band of all records. Such a resonance is
    seen by its flank below, unless a record was filtered, which looks the same."""
    runs = posterior.runs.runs
    filtered = any(run.facts.pass_band_hz is not None for run in runs)
    return one.at_bound or one.resonates_above(max(run.pass_band_hz[1] for run in runs), by_flank=not filtered)


def names_of(model: FittedModel) -> list[str]:
    """Names of a model's effects."""
    return [one.effect.name for one in model.effects]


def _gains_enough(one: Promise | Fitted, enough: float) -> bool:
    """Whether an effect gains so much. What only shifts a run gains next to nothing to first order where the distance
    errors have taken it."""
    return one.gain > (enough if one.effect.reshapes else 0.0)
