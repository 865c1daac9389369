"""A law learned from the data, where no known effect explains them.

Problem: something is missing that is none of the known effects, and a diagnosis can only describe the residual.
Solution: first the known effects are searched, as in a diagnosis. Where nothing is missing, nothing is learned. Else
families of laws are screened on top of the model without effects, the promising ones are fitted, and the same evidence
that chooses among effects chooses among laws: every number counts, so that a curve has to be worth its points. Where no
law alone explains what is missing, and known effects do not either, the two are tried together: laws on top of the
known effects, and known effects on top of the best law. Where known effects explain everything, a law replaces them
only by decisive evidence. A law whose numbers mean nothing is refused, and the next one is tried; one in whose place a
known effect explains more is refused for that effect.

Laws are screened by score tests. A law with one strength is tried as an effect of the list is
(``selection.screening``). A curve has many: the derivatives by all of them are taken at 0, and they are solved for
together with the car's numbers (one Gauss-Newton step).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from logger.fitting.information_matrix import inverse
from logger.lab.diagnosis import LabDiagnosis, assess, search_effects
from logger.lab.laws.draft import Draft, Family, LawContext
from logger.lab.laws.refusals import Nearest, Refusal, known_instead, refusal
from logger.lab.likelihood.map_fit import align, effect_slopes, fit_to_the_end
from logger.lab.likelihood.noise_floor import excess_over_noise
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.standard_errors import standard_errors
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.selection.candidate_fit import CandidateFit, fit_roughly, refine, refine_to_the_end
from logger.lab.selection.evidence import FALSE_ALARM, IMITATION, INDISTINGUISHABLE
from logger.lab.selection.screening import Baseline, Screened, Trial, screen
from logger.lab.selection.stepwise import Search, SearchEffort, Selection
from logger.vehicle.effect import Chosen, Effect, Misalignment, chosen
from logger.vehicle.named_parameters import FreeParameter, coordinates_of, with_coordinates


def screen_law(base: Baseline, draft: Draft, misalignment: Misalignment) -> Screened:
    """Trials of a law on top of a model, the largest gain first."""
    if len(draft.strengths) < 2:
        return screen(base, draft.effect, [misalignment])
    effect = draft.effect
    null = {one.name: float(one.null) for one in effect.parameters if one.name in draft.strengths
            and one.null is not None}
    trials = [_gauss_newton_trial(base, draft, {**values, **null}) for values in effect.trials(misalignment)[:1]]
    return Screened(effect, tuple(sorted(trials, key=lambda trial: -trial.gain)))


def _gauss_newton_trial(base: Baseline, draft: Draft, values: dict[str, float]) -> Trial:
    """The trial of a law with several strengths, after one Gauss-Newton step from these values."""
    linear, state = base.linear, base.state
    effects = (*state.effects, chosen(draft.effect, values))
    last = len(effects) - 1
    strengths = [FreeParameter(last, place) for place, one in enumerate(draft.effect.parameters)
                 if one.name in draft.strengths]
    slopes = effect_slopes(base.posterior, effects, state.logs, strengths, state.record, None)
    white, residuals = linear.whitened(slopes), linear.fit_record_errors(state.predictions).residuals
    gradient, information = linear.gradient(residuals, state.logs, white), linear.information(white)
    p = linear.count
    # A point of a curve beyond all motions has no derivative, and stays at 0.
    step = inverse(information) @ gradient
    without = np.linalg.solve(information[:p, :p], gradient[:p]) if p else np.empty(0)
    there = with_coordinates(effects, strengths, coordinates_of(effects, strengths) + step[p:])
    change = [step[p:] @ one for one in slopes]
    return Trial(there[-1], float(gradient @ step - gradient[:p] @ without), state.logs + step[:p], change)


Progress = Callable[[str], None]
_ScreenedLaw = tuple[Draft, Screened]

DECISIVE = 2 * INDISTINGUISHABLE
"""What a law has to gain over known effects that explain all: twice what distinguishes two of them."""


_LISTED = 2
"""Known effects that are sought first, unless a law outdoes them, and on top of a law; all as usual where no law alone
explains what is left."""
_WORTH_NARROWING, _FITTED, _OF_A_FAMILY, _REFINED, _IN_FULL = 3, 5, 3, 2, 3
"""Families of which one axle alone is tried; laws that are fitted on a model, of one family at most, and with
derivatives of their own; and that are tried in full, one after the other, where those before say nothing."""
_FIT_SHARE, _REFINE_SHARE = 0.2, 0.5  # of what the best one is predicted to gain, and gains


@dataclass(frozen=True, eq=False)
class LawFit:
    """A law that was fitted.

    base    the model that it was added to
    """

    draft: Draft
    base: Baseline
    fit: CandidateFit

    @property
    def name(self) -> str:
        """Name of its law among all that are drafted, on whatever model it was fitted."""
        return f"{self.draft.name} {self.draft.variant}"

    @property
    def score(self) -> float:
        """Minus twice the log of the model's evidence."""
        return self.fit.found.score


@dataclass(frozen=True, eq=False)
class Law:
    """A law that was chosen.

    one         the law with the numbers of the search
    effects     known effects that are missing as well, with their numbers
    state       the fitted model with them
    gain        of minus twice the log of the evidence over the model without it
    listed      gain of the known effects alone over the car without any; ``with_law``: of the law and its effects
    rivals      laws of other families that explain as well
    nearest     the known effect that gains most in its place; None: none gains anything
    """

    draft: Draft
    one: Chosen
    effects: tuple[Chosen, ...]
    state: State
    gain: float
    listed: float
    with_law: float
    rivals: tuple[LawFit, ...]
    nearest: Nearest | None


@dataclass(frozen=True, eq=False)
class Learning:
    """The result of learning a law.

    law             None: none is learned
    refused         the law that would have been, why it says nothing, or the known effect that explains more in its
                    place; None: there was none
    context         at what the car does, which pictures of the law need
    verdict         names of the known effects that are missing where no law is learned, the most certain first
    listed_error    of the model with these, on what its fit did not see
    unexplained     whether these leave something
    diagnosis       of the known effects alone, in full; None where a law is learned
    """

    law: Law | None
    context: LawContext
    verdict: tuple[str, ...]
    listed_error: float
    unexplained: bool
    diagnosis: LabDiagnosis | None
    refused: Refusal | None = None


def learn(posterior: Posterior, effects: Mapping[str, Effect], families: Mapping[str, Family],
          known: Mapping[str, Effect], present: Sequence[Chosen] = (), progress: Progress = lambda words: None
          ) -> Learning:
    """Learn a law.

    effects     the known effects that are searched first, by name
    known       all that there are, by name, with those that no search tries unasked: a law may nearly be one of them

    ValueError where the vehicle lacks what an effect needs.
    """
    one = replace(SearchEffort(), effects=1)
    search, selection = search_effects(posterior, effects, present, progress, one)
    choice = _LawChoice(search, selection, families, known)
    if not choice.outdoes_two():
        choice = choice.seeking(_LISTED)
    law = choice.explaining_all()
    if law is None:
        choice = choice.seeking(SearchEffort().effects)
        law = choice.with_effects()
    selection = choice.selection
    context = LawContext(selection.before.posterior, selection.before.state)
    diagnosis = assess(posterior, effects, present, search, selection) if law is None else None
    verdict = tuple(selection.gains) if diagnosis is None else diagnosis.verdict
    left = exceeds_noise(selection.now) if diagnosis is None else diagnosis.unexplained
    refused = choice.refusal_to_report() if law is None else None
    if refused is not None and refused.known is not None:
        better = refused.known.one.effect.name
        verdict = (better, *(name for name in verdict if name != better))
    return Learning(law, context, verdict, selection.now.hold_out.error, left, diagnosis, refused)


def is_above_noise(model: Baseline) -> bool:
    """Whether the residual of a model is above the sensor's noise."""
    return excess_over_noise(model.posterior, model.state, FALSE_ALARM) > UNEXPLAINED


def exceeds_noise(model: Baseline) -> bool:
    """Whether the residual of a model is above the sensor's noise, or a number of the car conflicts with its prior."""
    errors = standard_errors(model.linear).logs
    return is_above_noise(model) or model.posterior.prior.is_in_conflict(model.state.logs, errors)


@dataclass(frozen=True, eq=False)
class _LawChoice:
    """The choice of a law, after the search among the known effects.

    kept     models, with the laws that were fitted on top of each
    ended    laws that were fitted to the end, with their models and gains
    refused  laws that say nothing, or less than a known effect, in the order in which they were tried
    """

    search: Search
    selection: Selection
    families: Mapping[str, Family]
    known: Mapping[str, Effect]
    kept: list[tuple[Baseline, list[LawFit]]] = field(default_factory=list)
    ended: dict[LawFit, tuple[Baseline, dict[str, float]]] = field(default_factory=dict)
    refused: dict[str, Refusal] = field(default_factory=dict)

    def outdoes_two(self) -> bool:
        """Whether a law gains more than twice what the first known effect does. Two of them that explained as much
        would be no worse than the law; were their gains to add up, the first to be found would have half of it."""
        now, before = self.selection.now, self.selection.before
        if not exceeds_noise(now):
            return False
        gained = [before.score - one.score for one in self._fits_to(before) if self._is_accepted(one)]
        return max(gained, default=0.0) > 2 * (before.score - now.score)

    def seeking(self, most: int) -> _LawChoice:
        """The choice after a search for up to so many known effects; itself where those that were found explain all, or
        no more were found than were sought."""
        search, selection = self.search, self.selection
        if not exceeds_noise(selection.now) or len(selection.gains) < search.effort.effects:
            return self
        search.effort = replace(search.effort, effects=most)
        return replace(self, selection=search.go_on(selection))

    def refusal_to_report(self) -> Refusal | None:
        """The first refusal for a known effect, which is the better answer, else the first one."""
        return next((one for one in self.refused.values() if one.known), next(iter(self.refused.values()), None))

    def explaining_all(self) -> Law | None:
        """The law that by itself leaves no more than noise, better than the known effects; None where none does. Where
        the residual is no louder than the noise nothing is missing, but what is loud at one frequency alone: only laws
        of that kind are tried."""
        now, before = self.selection.now, self.selection.before
        choice = self
        if now is before and not exceeds_noise(now):
            lines = {name: one for name, one in self.families.items() if one.stands_out}
            choice = replace(self, families=lines, kept=[])
        least = 0.0 if exceeds_noise(now) else DECISIVE
        return choice._best(choice._fits_to(before), now.score - least, explains_all=True)

    def with_effects(self) -> Law | None:
        """The best law together with known effects, or alone if it explains more than they do; None where these leave
        nothing."""
        now, before = self.selection.now, self.selection.before
        if not exceeds_noise(now):
            return None
        alone = self._fits_to(before)
        if (first := self._first(alone, np.inf)) is not None:
            self._add_known(first)
        return self._best(alone if now is before else [*alone, *self._fits_to(now)], now.score)

    def _best(self, fits: Sequence[LawFit], least: float, explains_all: bool = False) -> Law | None:
        """The law with the most evidence, of those that say something; None where none scores less than ``least``, the
        best one is above the noise though it is to explain all, or a known effect explains more in its place."""
        best = self._first(fits, least)
        if best is None:
            return None
        model, gains = self.ended[best]
        if explains_all and is_above_noise(model):
            return None
        gain = gains[best.draft.name]
        nearest = self._nearest(model, best, gain)
        if why := known_instead(best.draft, nearest):
            self.refused[best.name] = why
            return None
        return self._law(best, model, gain, nearest, self._accepted(fits, least))

    def _first(self, fits: Sequence[LawFit], least: float) -> LawFit | None:
        """The first law that says something once it is fitted to the end, of those that score less than ``least``, as
        many as are tried; it is in ``ended`` then."""
        tried: list[LawFit] = []
        while len(tried) < _IN_FULL:
            accepted = [one for one in self._accepted(fits, least) if one not in tried]
            if not accepted:
                break
            best = self._simplest(accepted)
            tried.append(best)
            if best not in self.ended:
                self.ended[best] = self._fit_in_full(best)
            model, gains = self.ended[best]
            if best.draft.name not in gains or model.score > least:
                continue
            if why := refusal(best.draft, model):
                self.refused[best.name] = why
                continue
            return best
        return None

    def _accepted(self, fits: Sequence[LawFit], least: float) -> list[LawFit]:
        """Laws that are accepted, were not refused, and score less than ``least``, best first."""
        return sorted((one for one in fits
                       if self._score(one) < least and one.name not in self.refused and self._is_accepted(one)),
                      key=self._score)

    def _score(self, one: LawFit) -> float:
        """Minus twice the log of the evidence of a law's model, as far as it was fitted."""
        return self.ended[one][0].score if one in self.ended else one.score

    def _add_known(self, one: LawFit) -> None:
        """Seek known effects on top of a law that was fitted to the end; kept where they help and it is still needed
        beside them."""
        model, _ = self.ended[one]
        on_top = self.search.with_more_given(1, _LISTED).run(model).now
        found, gains = self.search.eliminate_backward(self.selection.before, on_top)
        if one.draft.name in gains and found.score < model.score:
            self.ended[one] = found, gains

    def _law(self, best: LawFit, model: Baseline, gain: float, nearest: Nearest | None, others: Sequence[LawFit]
             ) -> Law:
        """The law that was chosen, in the model that was fitted to the end."""
        one, *_ = (one for one in model.state.effects if one.effect.name == best.draft.name)
        effects = tuple(other for other in model.state.effects[self.search.present:] if other is not one)
        rivals = tuple(_best_of_each(other for other in others if other.draft.family is not best.draft.family
                                     and other.score < best.score + INDISTINGUISHABLE))
        before, now = self.selection.before.score, self.selection.now.score
        return Law(best.draft, one, effects, model.state, gain, before - now, before - model.score, rivals, nearest)

    def _fit_in_full(self, best: LawFit) -> tuple[Baseline, dict[str, float]]:
        """The model with a law fitted to the end, without known effects that it needs no more, and the gains of what is
        left of both."""
        self.search.progress(f"{best.draft.family.title}: fitting the model with it")
        found = best.fit.found
        fitted = Baseline.of(fit_to_the_end(align(found.posterior, found.state), found.numbers))
        return self.search.eliminate_backward(self.selection.before, fitted)

    def _fits_to(self, base: Baseline) -> list[LawFit]:
        """Laws fitted on top of a model, kept from earlier calls."""
        for known, fits in self.kept:
            if known is base:
                return fits
        fits = self._fit_laws(base)
        self.kept.append((base, fits))
        return fits

    def _fit_laws(self, base: Baseline) -> list[LawFit]:
        """Screen and fit the laws of all families on top of a model, best first. Where the best one leaves much, up to
        ``_OF_A_FAMILY`` laws of its family are fitted to the end: a rough fit says little of which of them is right."""
        round_gain = self.search.effort.round_share * base.explanation
        with ThreadPoolExecutor(self.search.workers) as pool:
            screened = self._screen_families(pool, base)
            enough = _FIT_SHARE * max(self._screened_gain(base, screened[0][1]), 0.0) if screened else 0.0
            worth = [each for each in screened if self._screened_gain(base, each[1]) > enough]
            fits = self._fit_roughly(pool, base, _most_of_each(worth, _OF_A_FAMILY)[: _FITTED])
            least = _REFINE_SHARE * fits[0].fit.gain if fits else 0.0
            near = [one for one in fits[: _REFINED] if one.fit.gain > least]
            fits[: len(near)] = self._refine(pool, near, lambda fit: refine(base.score, fit, round_gain))
            best = min(fits, key=lambda one: one.score, default=None)
            if best is not None and 0 < best.fit.gain < (1 - IMITATION) * base.explanation:
                family = best.draft.family
                alike = [one for one in fits if one.draft.family is family]
                more = [each for each in worth if each[0].family is family
                        and all(each[0] is not one.draft for one in alike)]
                alike += self._fit_roughly(pool, base, more[: _OF_A_FAMILY - len(alike)])
                fits = [one for one in fits if one.draft.family is not family] + self._refine(
                    pool, alike, lambda fit: refine_to_the_end(base.score, fit))
        return sorted(fits, key=lambda one: one.score)

    def _screen_families(self, pool: ThreadPoolExecutor, base: Baseline) -> list[_ScreenedLaw]:
        """Screenings of the laws of all families on top of a model, the largest gain first. The law with the largest
        gain of a family is varied."""
        context = LawContext(base.posterior, base.state)
        drafted = [draft for family in self.families.values() for draft in family.drafts(context)]
        screened = self._screen_all(pool, base, drafted)
        best = _most_of_each(screened, 1)[:_WORTH_NARROWING]
        narrower = [more for draft, _ in best for more in draft.family.narrower(draft, context)]
        return sorted([*screened, *self._screen_all(pool, base, narrower)],
                      key=lambda each: -self._screened_gain(base, each[1]))

    def _fit_roughly(self, pool: ThreadPoolExecutor, base: Baseline, screened: Sequence[_ScreenedLaw]) -> list[LawFit]:
        """Rough fits of screened laws, best first."""
        self.search.progress(f"fitting {len(screened)} laws")
        fits = pool.map(lambda each: fit_roughly(base.score, base, each[1])[0], screened)
        laws = [LawFit(draft, base, fit) for (draft, _), fit in zip(screened, fits, strict=True)]
        return sorted(laws, key=lambda one: one.score)

    def _refine(self, pool: ThreadPoolExecutor, fits: Sequence[LawFit], how: Callable[[CandidateFit], CandidateFit]
                ) -> list[LawFit]:
        """Fits of laws, refined."""
        self.search.progress(f"refining {len(fits)} laws")
        return [replace(one, fit=fit) for one, fit in zip(fits, pool.map(lambda one: how(one.fit), fits), strict=True)]

    def _screen_all(self, pool: ThreadPoolExecutor, base: Baseline, drafted: Sequence[Draft]
                  ) -> list[_ScreenedLaw]:
        """Screenings of laws on top of a model, the largest gain first."""
        found = []
        for done, (draft, one) in enumerate(zip(drafted, pool.map(
                lambda each: screen_law(base, each, self.search.misalignment), drafted), strict=True), 1):
            self.search.progress(f"screened {done} of {len(drafted)} laws")
            found.append((draft, one))
        return sorted(found, key=lambda each: -self._screened_gain(base, each[1]))

    def _screened_gain(self, base: Baseline, one: Screened) -> float:
        """Gain in evidence by screening, less the cost of a law's numbers."""
        return one.gain - sum(each.is_free for each in one.effect.parameters) * float(np.log(base.posterior.freedom))

    def _is_accepted(self, one: LawFit) -> bool:
        """Whether a law is accepted as an effect is, and does not raise the hold-out error."""
        return (self.search.is_accepted(one.base, one.fit)
                and not one.fit.hold_out.is_worse_than(one.base.hold_out))

    def _simplest(self, fits: Sequence[LawFit]) -> LawFit:
        """The law with the fewest effects besides it, and then the fewest numbers, of those that cannot be
        distinguished from the first."""
        near = [one for one in fits if self._score(one) < self._score(fits[0]) + INDISTINGUISHABLE]
        return min(near, key=lambda one: (len(one.base.state.effects), len(one.draft.parameters), self._score(one)))

    def _nearest(self, model: Baseline, best: LawFit, law_gain: float) -> Nearest | None:
        """The known effect that gains most in the place of the law, of those related to its family."""
        without = self.search.without(model, best.draft.name)
        names = [name for name in best.draft.family.related_effects
                 if name in self.known and name not in without.state.names]
        self.search.progress(f"which known effect comes close to {best.draft.family.title}")
        with ThreadPoolExecutor(self.search.workers) as pool:
            tries = list(pool.map(lambda name: fit_roughly(
                without.score, without, screen(without, self.known[name], [self.search.misalignment]))[0], names))
        if not tries:
            return None
        nearest = refine(without.score, max(tries, key=lambda one: one.gain))
        if nearest.gain <= 0:
            return None
        return Nearest(nearest.chosen, nearest.gain, law_gain)


def _most_of_each(screened: Sequence[_ScreenedLaw], most: int) -> list[_ScreenedLaw]:
    """The first laws of each family, at most so many."""
    counts: Counter[str] = Counter()
    found = []
    for each in screened:
        counts[each[0].family.name] += 1
        if counts[each[0].family.name] <= most:
            found.append(each)
    return found


def _best_of_each(fits: Iterable[LawFit]) -> list[LawFit]:
    """The best law of each family, best first."""
    found: dict[str, LawFit] = {}
    for one in fits:
        found.setdefault(one.draft.family.name, one)
    return list(found.values())
