"""Diagnosis without a profile: which effects a model lacks, and what such drives cannot identify.

Problem: as in ``lab.diagnosis``, but the road is unknown and absorbs part of what an effect does. Solution: the same
search (``selection.stepwise``) on another likelihood, that with the road integrated out (``UnmeasuredRoad``): effects
are screened by score tests, fitted by Fisher scoring, and are to predict each drive by the others no worse than without
them. What cannot be identified is computed from the information of these drives, with the road and without it.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from logger.dsp.resample import PASS_OF_RATE
from logger.fitting.fisher_scoring import integrated_out, inverse
from logger.identification.identifiability import NOT_ONE_ROAD, Finding, structural
from logger.lab.diagnosis import CandidateEffect, candidates_of
from logger.lab.likelihood.standard_errors import with_standard_errors
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.selection.detectability import DETECTABLE_SIGMA
from logger.lab.selection.evidence import FALSE_ALARM, probability_by_chance
from logger.lab.selection.holdout import REFITTED, ErrorStep, HoldOut, as_filed
from logger.lab.selection.screening import shared_parameters
from logger.lab.selection.stepwise import Likelihood, Search, SearchEffort, names_of
from logger.lab.unknown_road.same_road import (
    NotOneRoad,
    RoadFitState,
    RoadModel,
    SameRoad,
    TrialOnRoad,
    certain_two_roads,
    fit,
    placed_by_road,
    possible_two_roads,
    road_agreements,
    screen,
)
from logger.printable import Notify, silent
from logger.vehicle.effect import Chosen, DriveEffect, Effect, ForceEffect, Misalignment, RoadEffect, chosen
from logger.vehicle.named_parameters import free_parameters_of

ABSORBED_BY_ROAD = 0.02
"""The road absorbs an effect of whose information it leaves a smaller share: over a measured road the same drives would
show it seven times as well (root of 1 / 0.02)."""


@dataclass(frozen=True, eq=False)
class UnknownRoadDiagnosis:
    """The result of a diagnosis without a profile.

    candidates    best first, those of the verdict before the others
    missing       effects that the model lacks, with standard errors, in the order they were found
    steps         models on the way, each with its leave-one-out error of all drives
    by_run        error of each run, before and after
    untried       effects that could not be tried, and why
    hidden        effects that would stand out by so many deviations at their usual strength, which are too few
    confounded    what these drives cannot identify of the car's numbers
    noise_mps2    what no road explains; ``excess``: by what share that is more than the sensor's noise
    doubtful      pairs of runs that may be over one road or two, by name
    undecided     effects that explain more than chance would, but so little of what no road explains that they may only
                  imitate what is missing
    exact_places  whether the distances of the drives are a recorder's, not a receiver's
    no_better     names of the other effects that were tried
    """

    candidates: tuple[CandidateEffect, ...]
    missing: tuple[Chosen, ...]
    steps: tuple[ErrorStep, ...]
    by_run: tuple[tuple[float, float], ...]
    noise_floor_error: float
    untried: Mapping[str, str]
    absorbed_by_road: Mapping[str, float]
    hidden: Mapping[str, float]
    confounded: tuple[Finding, ...]
    noise_mps2: float
    excess: float
    doubtful: tuple[tuple[str, str], ...] = ()
    undecided: tuple[Chosen, ...] = ()
    exact_places: bool = True
    no_better: tuple[str, ...] = ()

    @property
    def baseline_error(self) -> float:
        """Of the model as it stands."""
        return self.steps[0].error

    @property
    def verdict(self) -> tuple[str, ...]:
        """Names of the effects that the model lacks."""
        return tuple(one.effect.name for one in self.missing)

    @property
    def unexplained(self) -> bool:
        """Whether the residual is above the noise."""
        return self.excess > UNEXPLAINED


@dataclass(frozen=True)
class UnmeasuredRoad(Likelihood[RoadModel, TrialOnRoad, RoadModel]):
    """The likelihood of drives over one road that nobody measured, as a search asks for it. Places are numbers of the
    road, to which most of the power belongs, and a colour of the noise is not told from a road: what a search asks of
    these has the answers that a likelihood has by default.

    starts         so many trials of an effect at their own values are starts of fits, those whose gain is half of the
                   best one's or more; this also at its best strength, which holds for small changes only
    first_steps    from each start, of which the best goes on
    """

    progress: Notify
    starts: int = 2
    first_steps: int = 2

    def screened(self, base: RoadModel, effects: Sequence[Effect], seen: Misalignment, near: Chosen | None,
                 pool: ThreadPoolExecutor, progress: Notify) -> list[TrialOnRoad]:
        """Effects screened by score tests at their trial values, all at once."""
        known = {} if near is None else near.values
        trials = [chosen(one, values) for one in effects
                  for values in (*one.trials(), *([one.trials()[0] | shared_parameters(one, known)] if known else []))]
        progress(f"screening {len(effects)} effects")
        by_effect: dict[str, list[TrialOnRoad]] = {}
        for one in sorted(screen(base, trials), key=lambda one: -one.gain):
            by_effect.setdefault(one.effect.name, []).append(one)
        return [replace(first, others=tuple(others)) for first, *others in by_effect.values()]

    def without(self, now: RoadModel, name: str) -> RoadModel:
        """The model without an effect, fitted."""
        effects = tuple(one for one in now.effects if one.effect.name != name)
        there = fit(now.problem, self._state(now, effects))
        lost = there.problem.gain(there.state, now.state) - self._cost(now, next(
            one for one in now.effects if one.effect.name == name))
        return replace(there, problem=there.problem.preconditioned(there.state), score=now.score + lost)

    def fitted_roughly(self, score: float, base: RoadModel, one: TrialOnRoad, least: float) -> list[RoadModel]:
        """The best of fits of some steps."""
        begins = [one.best, *(start.chosen for start in (one, *one.others)[: self.starts]
                              if start.gain > 0.5 * one.gain)]
        tries = [fit(base.problem, self._state(base, (*base.effects, begin)), self.first_steps) for begin in begins]
        return [max((self._candidate(base, there, score, 2) for there in tries), key=lambda one: one.gain)]

    def refined(self, base: RoadModel, one: RoadModel, least: float) -> RoadModel:
        """The fit to its end; one that gains less by its first steps than its numbers cost is not fitted further."""
        if one.gain <= 0:
            return one
        further = self._candidate(base, fit(one.problem, one.state), base.score, 3)
        return max(further, one, key=lambda one: one.gain)  # steps may diverge

    def with_effect(self, one: RoadModel) -> RoadModel:
        """The model with the effect fitted to its end, its equations near it, and its drives laid on each other anew
        where their distances are a receiver's."""
        now = fit(one.problem, one.state)
        gain = now.problem.gain(one.state, now.state)
        now = replace(now, score=one.score - gain) if gain > 0 else one
        if now.problem.exact_places:
            return replace(now, problem=now.problem.preconditioned(now.state))
        return replace(_placed_anew(now, self.progress), score=now.score)

    def chance(self, one: Chosen, gain: float, base: RoadModel, candidates: int) -> float:
        """The bound of the evidence: a gain that is integrated from slopes of simulated drives is too rough for more.
        """
        return probability_by_chance(gain, candidates)

    def is_doubtful(self, base: RoadModel, one: RoadModel) -> bool:
        """Whether a fit is at an end of its range, or predicts drives by the others worse."""
        return one.chosen.at_bound or one.hold_out.error > base.hold_out.error

    def _state(self, base: RoadModel, effects: tuple[Chosen, ...]) -> RoadFitState:
        """The state of a model with other effects."""
        return replace(base.state, effects=effects, gains=base.problem.response(effects, base.state.logs))

    def _cost(self, base: RoadModel, one: Chosen) -> float:
        """What the numbers of an effect cost of its gain (G. Schwarz 1978)."""
        return len(free_parameters_of([one])) * float(np.log(base.problem.samples))

    def _candidate(self, base: RoadModel, there: RoadModel, score: float, nodes: int) -> RoadModel:
        """A fit with one more effect than a model."""
        gain = there.problem.gain(base.state, there.state, nodes=nodes) - self._cost(base, there.chosen)
        return replace(there, score=base.score - gain, gain=score - base.score + gain)


def diagnose_same_road(problem: SameRoad, effects: Mapping[str, Effect], present: Sequence[Chosen] = (),
                       progress: Notify = silent) -> UnknownRoadDiagnosis:
    """Find the effects that the model, with those that are ``present``, lacks.

    ValueError if the car is not linear with one that is present; NotOneRoad for drives that are certainly over two.
    """
    progress("are the drives over one road?")
    nominal = problem.start(present)
    untried = _obstacles(problem, effects, present)
    tried = [one for name, one in effects.items() if name not in untried]
    agreements = road_agreements(problem, nominal, [chosen(one, values) for one in tried for values in one.trials()])
    if found := certain_two_roads(agreements):
        one, other = (problem.runs[run].name for run in found)
        raise NotOneRoad(f"{one} and {other}: expected drives over the same road, found that neither explains the "
                         f"other's record. {NOT_ONE_ROAD}; name only drives over one road")
    progress("refitting the model's parameters and the road")
    before = fit(problem.preconditioned(nominal), nominal)
    unfitted = before.problem.error(replace(nominal, roads=before.state.roads))
    base = replace(before, problem=before.problem.moved_as(before.state))
    search: Search[RoadModel, TrialOnRoad, RoadModel] = Search(
        tried, len(present), Misalignment(1.0, 0.0), progress, likelihood=UnmeasuredRoad(progress),
        # A fit takes as long as ten over a measured road: what gains less than one number costs is not worth it.
        effort=SearchEffort(effects=3, fitted=3, fit_share=0.3))
    selection = search.run(base)
    now, steps = selection.now, dict(selection.steps)
    names = sorted(selection.gains, key=lambda name: [*steps, name].index(name))
    remaining = [one for one in tried if one.name not in names_of(now)]
    usual = {one.effect.name: one for one in screen(now, [chosen(one, one.usual) for one in remaining])}
    road = {name: one.share_beyond_road for name, one in usual.items() if one.share_beyond_road < ABSORBED_BY_ROAD}
    by_name = {one.effect.name: one for one in _with_errors(now)}
    way = [ErrorStep(as_filed(problem.tolerance), unfitted), ErrorStep(REFITTED, base.hold_out.error),
           *(ErrorStep(f"with {name}", steps.get(name, now.hold_out).error) for name in names)]
    way[-1] = way[-1]._replace(error=now.hold_out.error)
    undecided = tuple(one.chosen for one in selection.last.fits if search.may_imitate(now, one))
    candidates, no_better = candidates_of(search, selection, now.effects, partial(_best_of_screened, base))
    return UnknownRoadDiagnosis(
        tuple(replace(one, stands_in=not now.problem.is_linear([one.one], now.state.logs)) for one in candidates),
        tuple(by_name[name] for name in names), tuple(way),
        tuple(zip(before.problem.errors(before.state), now.problem.errors(now.state), strict=True)),
        now.noise.deviation_mps2 / now.problem.size_mps2, untried, road,
        {name: one.deviations for name, one in usual.items() if one.deviations < DETECTABLE_SIGMA and name not in road},
        _confounded_numbers(now), now.state.noise_mps2, _excess(now),
        tuple((problem.runs[one].name, problem.runs[other].name) for one, other in possible_two_roads(agreements)),
        undecided, problem.exact_places, no_better,
    )


def _best_of_screened(base: RoadModel, one: TrialOnRoad) -> tuple[Chosen, float, HoldOut]:
    """As ``candidates_of`` asks for it."""
    best, problem = one.best, base.problem
    gain = one.gain - len(free_parameters_of([best])) * float(np.log(problem.samples))
    return best, gain, HoldOut(problem.error(replace(base.state, effects=(*base.effects, best), gains=problem.response(
        (*base.effects, best), base.state.logs))), float("nan"))


def _obstacles(problem: SameRoad, effects: Mapping[str, Effect], present: Sequence[Chosen]) -> dict[str, str]:
    """Effects that cannot be tried, and why."""
    found, nominal = {}, problem.response(present, problem.start_vehicle)
    for name, effect in effects.items():
        why = effect.obstacle(problem.vehicle, True)
        if why is None and effect.obstacle(problem.vehicle, False) is not None:
            why = "the profile under the right wheels is needed too"
        if name in [one.effect.name for one in present]:
            why = "the model has it"
        elif why is None and isinstance(effect, RoadEffect):
            why = "it acts on a profile, and there is none"
        elif why is None and isinstance(effect, DriveEffect):
            why = "a common scale of all distances looks like another road"
        elif why is None and not (effect.reshapes or problem.exact_places):
            why = "a shift of the record looks like an error of the GPS distances"
        elif why is None:
            try:
                there = problem.response((*present, chosen(effect, effect.usual)), problem.start_vehicle)
                off = np.abs(there - nominal).max() / np.abs(nominal).max()
                if isinstance(effect, ForceEffect) and off <= 1e-3:  # a table of a response is right to that
                    why = "only a measured road shows motion that is not proportional to the road"
            except ValueError:
                why = "it cannot be linearised, so it needs a measured road"
        if why is not None:
            found[name] = why
    return found


def _placed_anew(now: RoadModel, progress: Notify) -> RoadModel:
    """The fit with its drives laid on each other by what its car feels: by a car without its effects they lie wrong,
    and the next effect would imitate that. Laid anew they may no longer have enough of a road in common: then they stay
    where they are."""
    progress("aligning the drives again")
    old, state = now.problem, now.state
    car = old.prior.vehicle(old.vehicle, state.logs)
    try:
        runs = placed_by_road(old.runs, old.vehicle, old.tolerance, state.effects, car)
        problem = SameRoad(runs, old.vehicle, old.tolerance, car, exact_places=False)
    except NotOneRoad:
        return replace(now, problem=old.preconditioned(state))
    begin = problem.start(state.effects)
    return fit(problem.preconditioned(begin), begin)


# --- the residual ---


def _with_errors(model: RoadModel) -> tuple[Chosen, ...]:
    """The effects of a model with standard errors."""
    first, count = len(model.state.logs), len(model.free_parameters)
    deviations = np.sqrt(np.maximum(np.diag(inverse(model.information)), 0.0))[first : first + count]
    return with_standard_errors(model.state.effects, model.free_parameters, deviations)


def _confounded_numbers(model: RoadModel) -> tuple[Finding, ...]:
    """Masses, springs and dampers that these drives cannot identify while the road is unknown, whatever their prior."""
    names = model.problem.prior.names
    own = np.array([index for index, name in enumerate(names) if not name.endswith("_distance_m")])
    road = np.arange(len(names) + len(model.free_parameters), len(model.data))
    both = np.append(own, road)
    marginal = integrated_out(model.data[np.ix_(both, both)], np.arange(len(own), len(both)))
    powers, directions = np.linalg.eigh(marginal)
    derivatives = np.sqrt(np.maximum(powers, 0.0))[:, None] * directions.T
    return tuple(structural([names[index] for index in own], derivatives, size=1.0, nothing=0.01))


def _excess(model: RoadModel) -> float:
    """Share by which what no road explains is above the noise; where chance may give as much, no more than
    ``UNEXPLAINED``. Degrees of freedom of a sample are reduced by the recorder's filter."""
    from scipy.special import ndtri

    noise = model.noise
    above = model.state.noise_mps2 / noise.deviation_mps2 - 1
    freedom = 2 * PASS_OF_RATE * model.problem.samples
    error = np.hypot(noise.standard_error_mps2 / noise.deviation_mps2, (2 * freedom) ** -0.5)
    return float(above if above > -ndtri(FALSE_ALARM / 2) * error else min(above, UNEXPLAINED))
