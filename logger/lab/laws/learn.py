"""A law learned from the data, where no known effect explains them.

Problem: something is missing that is none of the known effects, and a diagnosis can only describe the residual.
Solution: first the known effects are searched, as in a diagnosis. Where nothing is missing, nothing is learned. Else
families of laws are searched as effects are, by the same screening, fits and evidence, on the model without effects and
on top of the known ones: every number counts, so that a curve has to be worth its points. Known effects are sought on
top of the better of the two, where it leaves something. Where known effects explain everything, a law replaces them
only by decisive evidence. A law whose numbers mean nothing is refused, and the next one is tried; one in whose place a
known effect explains more is refused for that effect. Of a part on its bench known forces come before what changes any
force, as a sensor does: that imitates some of any law.

A law that was fitted may say nothing. Problem: what no known effect explains, some law always explains a little better
than others. The evidence counts its numbers; it does not ask whether they mean anything. Solution: a law that was
fitted in full is refused where its strengths are within two standard errors of doing nothing (A. Wald's test, of all of
them together: of two that cannot be distinguished the sum may be well known), where its frequency is outside of the
band that is compared or a number at an end of its range, where it is the straight line that is a number of the car
already, and where a known effect explains more in its place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from logger.bounds import SURE_SIGMA
from logger.lab.diagnosis import LabDiagnosis, assess, exceeds_noise, search_to_the_last
from logger.lab.laws.draft import LEARNED, Draft, Family, LawContext
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.standard_errors import deviations_from_null, standard_errors
from logger.lab.selection.evidence import INDISTINGUISHABLE, min_gain
from logger.lab.selection.screening import Baseline
from logger.lab.selection.stepwise import UNTRIED, Fitted, Search, Selection, is_outside_data
from logger.printable import Notify, silent
from logger.vehicle.effect import Chosen, Effect, ForceEffect
from logger.vehicle.uncertain import NumberErrors


@dataclass(frozen=True, eq=False)
class Nearest:
    """The known effect that gains most in the place of a law: its numbers, its gain and the law's, in minus twice the
    log of the evidence."""

    one: Chosen
    gain: float
    law_gain: float

    @property
    def share(self) -> float:
        """Share of the law's gain."""
        return max(self.gain, 0.0) / self.law_gain

    @property
    def better(self) -> bool:
        """Whether it explains more than the law does."""
        return self.gain > self.law_gain

    @property
    def as_good(self) -> bool:
        """Whether the two cannot be distinguished."""
        return self.gain > self.law_gain - INDISTINGUISHABLE


@dataclass(frozen=True, eq=False)
class Refusal:
    """A law that was fitted and is not learned.

    title    the law in a few words
    why      in words
    known    the known effect that explains more in its place; None: the law says nothing
    """

    title: str
    why: str
    known: Nearest | None = None


def refusal(draft: Draft, model: Baseline, without: Baseline) -> Refusal | None:
    """Why a law in a model that was fitted with it, and without it, says nothing; None where it says something."""
    errors = standard_errors(model.linear)
    one = next(each for each in errors.effects if each.effect.name == draft.name)
    if does_nothing(one, errors.numbers):
        return Refusal(draft.title, f"its strength is within {SURE_SIGMA:g} standard errors of zero")
    if why := _beyond(model.posterior, one):
        return Refusal(draft.title, why)
    if draft.family.is_straight(draft, one, SURE_SIGMA):
        return Refusal(draft.title, f"it is a straight line within {SURE_SIGMA:g} standard errors, which a parameter "
                                    "of the model already describes")
    if model.hold_out.is_worse_than(without.hold_out):
        return Refusal(draft.title, "it raises the error on held-out stretches")
    return None


def known_instead(draft: Draft, nearest: Nearest | None) -> Refusal | None:
    """The refusal of a law in whose place a known effect explains more; None where none does."""
    if nearest is None or not nearest.better:
        return None
    return Refusal(draft.title, f"the known effect {nearest.one.effect.name} explains more in its place (2 ln of the "
                                f"evidence {nearest.gain - nearest.law_gain:.0f} more)", nearest)


def does_nothing(one: Chosen, errors: NumberErrors) -> bool:
    """Whether the strengths of a fitted law are together no farther from doing nothing than chance takes one number by
    ``SURE_SIGMA`` standard errors; or none of them is known. A law without a strength (its number is a length, on a
    scale that has no zero) always does something."""
    from scipy.special import gammaincc

    strengths = [each for each in one.effect.parameters if each.is_free and each.null is not None]
    if not strengths:
        return False
    strengths = [each for each in strengths if np.isfinite(one.standard_errors.get(each.name, np.inf))]
    if not strengths:
        return True
    if len(strengths) == 1:
        return deviations_from_null(one) < SURE_SIGMA
    names = list(errors.standard_errors)
    places = [names.index(f"{one.effect.name}.{each.name}") for each in strengths]
    off = np.array([(one.values[each.name] - float(each.null or 0.0)) / one.standard_errors[each.name]
                    for each in strengths])
    squares = float(off @ np.linalg.pinv(errors.matrix()[np.ix_(places, places)], hermitian=True) @ off)
    return bool(gammaincc(len(off) / 2, squares / 2) > gammaincc(0.5, SURE_SIGMA**2 / 2))


def _beyond(posterior: Posterior, one: Chosen) -> str:
    """Why the numbers of a law are none that the records show; empty where they are."""
    frequency_hz = one.values.get("frequency_hz")
    bands = [each for run in posterior.bands for each in run.each]
    low_hz, high_hz = min(each.edges_hz[0] for each in bands), max(each.edges_hz[-1] for each in bands)
    if frequency_hz is not None and not low_hz < frequency_hz < high_hz:
        return (f"its frequency, {frequency_hz:.3g} Hz, is outside {low_hz:.2g} to {high_hz:.3g} Hz, in which the "
                "runs are compared")
    return "one of its parameters ended at a bound" if is_outside_data(posterior, one) else ""


DECISIVE = 2 * INDISTINGUISHABLE
"""What a law has to gain over known effects that explain all: twice what distinguishes two of them."""


@dataclass(frozen=True, eq=False)
class Law:
    """A law that was chosen.

    one         the law with the numbers of the search
    effects     known effects that are missing as well, with their numbers
    state       the fitted model with them
    gain        of minus twice the log of the evidence over the model without it
    listed      gain of the known effects alone over the car without any; ``with_law``: of the law and its effects
    rivals      families whose laws explain as well
    nearest     the known effect that gains most in its place; None: none gains anything
    """

    draft: Draft
    one: Chosen
    effects: tuple[Chosen, ...]
    state: State
    gain: float
    listed: float
    with_law: float
    rivals: tuple[Family, ...]
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
          known: Mapping[str, Effect], present: Sequence[Chosen] = (), progress: Notify = silent
          ) -> Learning:
    """Learn a law.

    effects     the known effects that are searched first, by name
    known       all that there are, by name, with those that are sought last and those that no search tries unasked: a
                law may nearly be one of them

    ValueError where the vehicle lacks what an effect needs.
    """
    last = {name: one for name, one in known.items() if one.sought_last and name not in effects}
    searched = search_to_the_last(posterior, effects, present, progress, last)
    laws = FamilySearch(searched.search, selection := searched.selection, families, known)
    law, diagnosis = laws.best(), searched.diagnosis
    if law is None and laws.better_known:
        search, selection = laws.with_better_known()
        diagnosis = assess(searched.posterior, {**effects, **{one.name: one for one in search.effects}}, present,
                           search, selection)
    context = LawContext(selection.before.posterior, selection.before.state)
    if law is not None:
        return Learning(law, context, tuple(selection.gains), selection.now.hold_out.error,
                        exceeds_noise(selection.now), None)
    return Learning(None, context, diagnosis.verdict, selection.now.hold_out.error, diagnosis.unexplained, diagnosis,
                    laws.refusal_to_report())


@dataclass(frozen=True, eq=False)
class FamilySearch:
    """A search among laws, after one among the known effects.

    refused         laws that say nothing, or less than a known effect, in the order in which they were tried
    drafts          of the effects that were tried
    better_known    fits of the known effects for which laws were refused, in that order
    """

    search: Search
    selection: Selection
    families: Mapping[str, Family]
    known: Mapping[str, Effect]
    refused: dict[tuple[str, str], Refusal] = field(default_factory=dict)
    drafts: dict[Effect, Draft] = field(default_factory=dict)
    better_known: list[Fitted] = field(default_factory=list)

    def with_better_known(self) -> tuple[Search, Selection]:
        """The first known effect that explains more than a law, in its place, and what else is missing then."""
        fit = self.better_known[0]
        search = replace(self.search, effects=[one for one in self.search.effects if one.name != fit.effect.name]
                         + [fit.effect], _promising=set(), _rivals={})
        now = self.search.likelihood.with_effect(fit)
        return search, search.go_on(replace(self.selection, now=now, last=UNTRIED,
                                            steps=((fit.effect.name, now.hold_out),)))

    def refusal_to_report(self) -> Refusal | None:
        """The first refusal for a known effect, which is the better answer, else the first one."""
        return next((one for one in self.refused.values() if one.known), next(iter(self.refused.values()), None))

    @property
    def _known_forces(self) -> list[Effect]:
        """Of a part the effects that are forces; of a car all of them."""
        is_part = self.selection.before.posterior.vehicle.is_part
        return [one for one in self.search.effects if isinstance(one, ForceEffect) or not is_part]

    def best(self) -> Law | None:
        """The law with the most evidence, alone or with known effects; None where known effects without one have more,
        or one of them explains more in its place. Where the residual is no louder than the noise nothing is missing,
        but what is loud at one frequency alone: only laws of that kind are tried."""
        now, before = self.selection.now, self.selection.before
        unexplained = exceeds_noise(now)
        found = [alone := self._found_on(before, unexplained or now is not before)]
        forces = now
        for one in now.effects[self.search.present:]:
            if one.effect not in self._known_forces:
                forces = self.search.without(forces, one.effect.name)
        if (unexplained or forces is not now) and forces is not before and (alone is None or exceeds_noise(alone.now)):
            found.append(self._found_on(forces, True))
        least = now.score - (0.0 if unexplained else DECISIVE)
        wholes: list[Selection] = []
        for one in sorted((one for one in found if one is not None), key=lambda one: one.now.score):
            if (not wholes or exceeds_noise(wholes[-1].now)) and (whole := self._with_known(one)) is not None:
                wholes.append(whole)
        for whole in sorted(wholes, key=lambda one: one.now.score):
            if whole.now.score < least and (law := self._law(whole)) is not None:
                return law
        return None

    def _found_on(self, base: Baseline, any_family: bool) -> Selection | None:
        """A model with a law more; None where none says anything."""
        context, of_part = LawContext(base.posterior, base.state), base.posterior.vehicle.is_part
        drafts = {draft.effect: draft for family in self.families.values() if any_family or family.stands_out
                  for draft in family.drafts(context) if draft.key not in self.refused
                  and (family.stands_out or isinstance(draft.effect, ForceEffect) or not of_part)}
        self.drafts.update(drafts)
        search = replace(self.search, effects=[*drafts], present=len(base.effects), _promising=set(), _rivals={},
                         effort=replace(self.search.effort, effects=1))
        none = Selection(base, base, {}, {}, UNTRIED, ())
        found = search.go_on(none, search.round(base, [*drafts], to_gain=min_gain(len(drafts)))) if drafts else none
        while found.gains:
            law = found.now.effects[-1].effect
            before = found.before if base is self.selection.before else self.selection.before
            now, gains = self.search.eliminate_backward(before, found.now)
            if law.name in gains:
                why = refusal(drafts[law], now, self.search.without(now, law.name))
                if why is None:
                    return replace(found, before=before, now=now, gains=gains)
                self.refused[drafts[law].key] = why
            search.effects = [one for one in search.effects if one is not law]
            rest = replace(found.first, fits=tuple(one for one in found.first.fits if one.effect is not law))
            if more := [one for one in search.effects if one.name == law.name]:  # other forms of the refused one's
                rest = search.round(base, more, to_gain=min_gain(len(drafts)), beside=rest)
            found = search.go_on(none, rest)
        return None

    def _with_known(self, found: Selection) -> Selection | None:
        """A model with a law, and known effects sought on top of it where it leaves something that known effects alone
        leave too; None where the law is not needed beside these."""
        law = next(one.effect for one in found.now.effects if one.effect in self.drafts)
        held = self.drafts[law].family.holds
        leaves_something = exceeds_noise if held else self._leaves_something
        if not leaves_something(found.now) or not self._leaves_something(self.selection.now):
            return found
        known = self._known_forces
        forces = [one for one in known if one.name not in held]
        search = replace(self.search, effects=[*forces, law], _promising=set(), _rivals=dict(found.rivals))
        whole = search.go_on(found)
        others = [one for one in self.search.effects if one not in known]
        if others and exceeds_noise(whole.now):
            search = replace(search, effects=[*search.effects, *others], _rivals=dict(whole.rivals))
            tried = search.round(whole.now, others, beside=whole.last) if whole.last.on is whole.now else None
            whole = search.go_on(whole, tried)
        return whole if law.name in whole.gains else None

    def _leaves_something(self, model: Baseline) -> bool:
        """Whether a model leaves more than noise, and than calibration errors. Of a part these leave nothing: a gain of
        its force is a factor of all forces in it, whose sizes are fitted."""
        return model.explanation > 0 if model.posterior.vehicle.is_part else exceeds_noise(model)

    def _law(self, found: Selection) -> Law | None:
        """The law of a model; None where a known effect explains more in its place."""
        one = next(each for each in found.now.effects if each.effect in self.drafts)
        draft, name = self.drafts[one.effect], one.effect.name
        fit = self._nearest_fit(found, one, draft)
        nearest = None if fit is None else Nearest(fit.chosen, fit.gain, found.gains[name])
        if fit is not None and (why := known_instead(draft, nearest)):
            self.refused[draft.key] = why
            self.better_known.append(fit)
            return None
        others = tuple(each for each in found.now.effects[self.search.present:] if each is not one)
        rivals = tuple(self.families[each.removeprefix(LEARNED)] for each in found.rivals.get(name, ())
                       if each.startswith(LEARNED))
        before, now = self.selection.before.score, self.selection.now.score
        return Law(draft, one, others, found.now.state, found.gains[name], before - now, before - found.now.score,
                   rivals, nearest)

    def _nearest_fit(self, found: Selection, one: Chosen, draft: Draft) -> Fitted | None:
        """Of the known effect that gains most in the place of the law, of those related to its family."""
        without = self.search.without(found.now, draft.name)
        related = [self.known[name] for name in draft.family.related_effects
                   if name in self.known and name not in without.state.names]
        self.search.progress(f"which known effect comes close to {draft.family.title}")
        fits = replace(self.search, effects=related).round(without, related, one).fits if related else ()
        return fits[0] if fits and fits[0].gain > 0 else None
