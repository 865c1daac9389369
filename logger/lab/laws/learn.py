"""A law out of the data, where no known effect explains it.

Problem: something differs, none of the known effects is it, and the user is left with a shape. Solution: first the
known effects are searched, as a diagnosis does. Where they explain all, nothing is learned. Where something is left, or
a known effect may only imitate it, families of laws are screened beside the models on the way (without what was found,
without each of it, with all of it), the promising ones are fitted, and the same evidence that chooses among effects
chooses among laws: every number counts, so that a curve has to be worth its points. A law takes the place of known
effects only by decisive evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from logger.lab.diagnosis import Diagnosis, judged, searched
from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, Look
from logger.lab.laws.screening import count_of, screened_law
from logger.lab.likelihood.posterior import Posterior
from logger.lab.selection.candidate_fit import CandidateFit, refined, roughly_fitted
from logger.lab.selection.evidence import CONFUSED
from logger.lab.selection.screening import Baseline, Screened, screened
from logger.lab.selection.stepwise import Search, Selection
from logger.vehicle.effect import Chosen, Effect

Progress = Callable[[str], None]

DECISIVE = 2 * CONFUSED
"""What a law has to gain over known effects that explain all: they are told from each other, and that twice."""


@dataclass(frozen=True)
class Effort:
    """How much work the choice of a law takes.

    worth_narrowing    families of which one axle alone is tried
    fitted, refined    how many laws are fitted on a model, and how many of these with slopes of their own
    worth_fitting      of what the best one promises
    """

    worth_narrowing: int = 4
    fitted: int = 6
    refined: int = 3
    worth_fitting: float = 0.2


@dataclass(frozen=True, eq=False)
class LawFit:
    """A law that was fitted.

    base    the model beside which it was
    """

    family: Family
    draft: Draft
    base: Baseline
    fit: CandidateFit

    @property
    def score(self) -> float:
        """Minus twice the log of the model's evidence."""
        return self.fit.found.score


@dataclass(frozen=True, eq=False)
class Nearest:
    """A known effect in the place of a law: what it gains, and what the law gains, in minus twice the log of the
    evidence; its numbers."""

    one: Chosen
    gain: float
    law_gain: float

    @property
    def share(self) -> float:
        """Of what the law explains."""
        return max(self.gain, 0.0) / self.law_gain

    @property
    def as_good(self) -> bool:
        """Whether the data do not tell the two apart."""
        return self.gain > self.law_gain - CONFUSED


@dataclass(frozen=True, eq=False)
class Law:
    """A law that was chosen.

    one        with the numbers of the search
    beside     known effects that are missing beside it, with theirs
    gain       of minus twice the log of the evidence over the model without it
    listed     what the known effects alone gain over the car without any, and ``with_law`` what the law and those
               beside it gain
    rivals     laws of other families that explain as well
    nearest    the known effect that comes nearest in its place; None: none does anything
    """

    family: Family
    draft: Draft
    one: Chosen
    beside: tuple[Chosen, ...]
    gain: float
    listed: float
    with_law: float
    rivals: tuple[LawFit, ...]
    nearest: Nearest | None


@dataclass(frozen=True, eq=False)
class Learning:
    """What came of it.

    diagnosis    of the known effects alone
    law          None: none is learned
    look         at what the car does, which pictures of the law need
    """

    diagnosis: Diagnosis
    law: Law | None
    look: Look


def learn(posterior: Posterior, effects: Mapping[str, Effect], families: Mapping[str, Family],
          known: Mapping[str, Effect], present: Sequence[Chosen] = (), progress: Progress = lambda words: None,
          workers: int = 2, effort: Effort | None = None) -> Learning:
    """Learn a law, in so many threads.

    effects     the known effects that are searched first, by name
    known       all that there are, by name, with those that no search tries unasked: a law may nearly be one of them

    ValueError where the vehicle lacks what an effect needs.
    """
    search, selection = searched(posterior, effects, present, progress, workers)
    diagnosis = judged(posterior, effects, present, search, selection)
    look = Look(selection.before.posterior, selection.before.state)
    if not diagnosis.unexplained and not diagnosis.verdict:
        return Learning(diagnosis, None, look)
    chooser = _Chooser(search, selection, families, known, effort or Effort())
    return Learning(diagnosis, chooser.law(diagnosis.unexplained), look)


@dataclass(frozen=True, eq=False)
class _Chooser:
    """The choice of a law, after the search among the known effects."""

    search: Search
    selection: Selection
    families: Mapping[str, Family]
    known: Mapping[str, Effect]
    effort: Effort

    def law(self, unexplained: bool) -> Law | None:
        """That with the most evidence; None where none is there."""
        now = self.selection.now
        fits = sorted((one for base in self._bases() for one in self._fitted_beside(base)), key=lambda one: one.score)
        least = 0.0 if unexplained else DECISIVE
        there = [one for one in fits if one.score < now.score - least and self._is_there(one)]
        if not there:
            return None
        best = self._simplest(there)
        self.search.progress(f"{best.family.title}: fitting the car with it")
        model, gains = self.search.needed(self.selection.before, self.search.refit(best.fit))
        if best.draft.name not in gains or model.score > now.score - least:
            return None
        one, *_ = (one for one in model.state.effects if one.effect.name == best.draft.name)
        beside = tuple(other for other in model.state.effects[self.search.present:] if other is not one)
        rivals = tuple(_best_of_each(other for other in there if other.family is not best.family
                                     and other.score < best.score + CONFUSED))
        before = self.selection.before.score
        return Law(best.family, best.draft, one, beside, gains[best.draft.name], before - now.score,
                   before - model.score, rivals, self._nearest(model, best, gains[best.draft.name]))

    def _bases(self) -> list[Baseline]:
        """Models that a law is tried beside: with all that was found, without each of it, and without any."""
        now, before = self.selection.now, self.selection.before
        names = now.state.names[self.search.present:]
        if not names:
            return [now]
        others = [self.search.without(now, name) for name in names] if len(names) > 1 else []
        return [now, *others, before]

    def _fitted_beside(self, base: Baseline) -> list[LawFit]:
        """Laws fitted beside a model."""
        search, effort = self.search, self.effort
        look = Look(base.posterior, base.state)
        drafted = [(family, draft) for family in self.families.values() for draft in family.drafts(look)]
        with ThreadPoolExecutor(search.workers) as pool:
            promised = self._screened(pool, base, drafted)
            # A family is narrowed by whichever of its laws promises most.
            best = list(_firsts(promised))[: effort.worth_narrowing]
            narrower = [(family, more) for family, draft, _ in best for more in family.narrower(draft, look)]
            promised = sorted([*promised, *self._screened(pool, base, narrower)],
                              key=lambda each: -self._promise(base, each[2]))
            enough = effort.worth_fitting * max(self._promise(base, promised[0][2]), 0.0) if promised else 0.0
            worth = [each for each in promised[: effort.fitted] if self._promise(base, each[2]) > enough]
            search.progress(f"fitting {len(worth)} laws")
            rough = list(pool.map(lambda each: roughly_fitted(base.score, base, each[2])[0], worth))
            found = sorted(zip(worth, rough, strict=True), key=lambda pair: -pair[1].gain)
            search.progress(f"refining {min(len(found), effort.refined)} laws")
            fine = list(pool.map(lambda pair: refined(
                base.score, pair[1], search.effort.worth_a_round * base.explanation), found[: effort.refined]))
        fits = [*fine, *(fit for _, fit in found[effort.refined:])]
        return [LawFit(family, draft, base, fit)
                for ((family, draft, _), _), fit in zip(found, fits, strict=True)]

    def _screened(self, pool: ThreadPoolExecutor, base: Baseline, drafted: Sequence[tuple[Family, Draft]]
                  ) -> list[tuple[Family, Draft, Screened]]:
        """Laws with what they promise beside a model, the most promising first."""
        found = []
        for done, ((family, draft), one) in enumerate(zip(drafted, pool.map(
                lambda pair: screened_law(base, pair[1], self.search.seen), drafted), strict=True), 1):
            self.search.progress(f"screened {done} of {len(drafted)} laws")
            found.append((family, draft, one))
        return sorted(found, key=lambda each: -self._promise(base, each[2]))

    def _promise(self, base: Baseline, one: Screened) -> float:
        """What a law may gain in evidence, its numbers counted."""
        return one.gain - count_of(one) * float(np.log(base.posterior.freedom))

    def _is_there(self, one: LawFit) -> bool:
        """As an effect is there; and the error on what no fit saw does not rise with it."""
        return (self.search.accepted(one.base, one.fit)
                and not one.fit.hold_out.raises(one.base.hold_out))

    def _simplest(self, there: Sequence[LawFit]) -> LawFit:
        """Of laws that cannot be told from the likeliest, the one with the fewest other effects beside it, and then the
        fewest numbers."""
        near = [one for one in there if one.score < there[0].score + CONFUSED]
        return min(near, key=lambda one: (len(one.base.state.effects), len(one.draft.parameters), one.score))

    def _nearest(self, model: Baseline, best: LawFit, law_gain: float) -> Nearest | None:
        """The known effect that gains most in the place of the law, of those that its family may nearly be."""
        without = self.search.without(model, best.draft.name)
        names = [name for name in best.family.akin if name in self.known and name not in without.state.names]
        self.search.progress(f"what known effect comes near {best.family.title}")
        with ThreadPoolExecutor(self.search.workers) as pool:
            tries = list(pool.map(lambda name: roughly_fitted(
                without.score, without, screened(without, self.known[name], [self.search.seen]))[0], names))
            fits = list(pool.map(lambda one: refined(without.score, one), tries))
        nearest = max(fits, key=lambda one: one.gain, default=None)
        if nearest is None or nearest.gain <= 0:
            return None
        return Nearest(nearest.chosen, nearest.gain, law_gain)


def _firsts(promised: Sequence[tuple[Family, Draft, Screened]]) -> list[tuple[Family, Draft, Screened]]:
    """The most promising law of each family."""
    found: dict[str, tuple[Family, Draft, Screened]] = {}
    for each in promised:
        found.setdefault(each[0].name, each)
    return list(found.values())


def _best_of_each(fits: Iterable[LawFit]) -> list[LawFit]:
    """Of every family the law that is best, best first."""
    found: dict[str, LawFit] = {}
    for one in fits:
        found.setdefault(one.family.name, one)
    return list(found.values())
