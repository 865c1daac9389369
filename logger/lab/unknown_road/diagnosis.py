"""Diagnosis without a profile: which effects a model lacks, and what such drives cannot identify.

Problem: as in ``lab.diagnosis``, but the road is unknown and absorbs part of what an effect does. Solution: in each
round every effect that can be tried is screened by a score test, the promising ones are fitted in full, and the best is
added if noise would hardly gain as much in so many trials and it helps to predict each drive by the others. What cannot
be identified is computed from the information of these drives, with the road and without it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.fitting.information_matrix import integrated_out, inverse
from logger.identification.identifiability import NOT_ONE_ROAD, Finding, structural
from logger.lab.likelihood.noise_floor import UNEXPLAINED, Noise
from logger.lab.likelihood.standard_errors import with_standard_errors
from logger.lab.selection.detectability import DETECTABLE_SIGMA
from logger.lab.selection.evidence import FALSE_ALARM, IMITATION, INDISTINGUISHABLE, probability_by_chance
from logger.lab.unknown_road.fit import SameRoadFit, Trial, fit, screen
from logger.lab.unknown_road.likelihood import NotOneRoad, RoadFitState, SameRoad
from logger.lab.unknown_road.one_road import certain_two_roads, placed_by_road, possible_two_roads, road_agreements
from logger.vehicle.effect import Chosen, DriveEffect, Effect, ForceEffect, RoadEffect, chosen
from logger.vehicle.named_parameters import free_parameters_of
from logger.vehicle.simulate import PASS_OF_RATE

Progress = Callable[[str], None]

ABSORBED_BY_ROAD = 0.02
"""The road absorbs an effect of whose information it leaves a smaller share: over a measured road the same drives would
show it seven times as well (root of 1 / 0.02)."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that was tried on the model of its round.

    error            leave-one-out error of all drives
    p_value          bound on the probability that noise alone gains as much with any of the candidates
    gain             of minus twice the log of the evidence; where it was not fitted, by its score test
    confused_with    effects that explain about as much
    fitted           with the car's numbers and the road; else it was added at the best strength of its score test
    imitation        gain up to which an effect may only imitate what is missing
    stands_in        whether it bends the laws of the car, so that linear ones stood in for it
    """

    one: Chosen
    error: float
    p_value: float
    gain: float
    confused_with: tuple[str, ...] = ()
    fitted: bool = True
    imitation: float = 0.0
    stands_in: bool = False

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.one.effect.name

    def helps(self, error: float) -> bool:
        """Whether it explains more than chance would, without a larger leave-one-out error than the model without
        it."""
        return self.fitted and self.p_value < FALSE_ALARM and self.error <= error

    @property
    def may_imitate(self) -> bool:
        """Whether it gains so little of what is to be explained that it may only imitate what is missing."""
        return self.gain < self.imitation


@dataclass(frozen=True, eq=False)
class UnknownRoadDiagnosis:
    """The result of a diagnosis without a profile.

    candidates    best first, those of the verdict before the others
    missing       effects that the model lacks, with standard errors, in the order they were found
    errors        of all drives: as the vehicle's file says, with its numbers refitted, with each effect that was found
    by_run        error of each run, before and after
    untried       effects that could not be tried, and why
    hidden        effects that would stand out by so many deviations at their usual strength, which are too few
    confounded    what these drives cannot identify of the car's numbers
    noise_mps2    what no road explains; ``excess``: by what share that is more than the sensor's noise
    doubtful      pairs of runs that may be over one road or two, by name
    undecided     effects that explain more than chance would, but so little of what no road explains that they may only
                  imitate what is missing
    exact_places  whether the distances of the drives are a recorder's, not a receiver's
    """

    candidates: tuple[Candidate, ...]
    missing: tuple[Chosen, ...]
    errors: tuple[float, ...]
    by_run: tuple[tuple[float, float], ...]
    floor_error: float
    untried: Mapping[str, str]
    absorbed_by_road: Mapping[str, float]
    hidden: Mapping[str, float]
    confounded: tuple[Finding, ...]
    noise_mps2: float
    excess: float
    doubtful: tuple[tuple[str, str], ...] = ()
    undecided: tuple[Candidate, ...] = ()
    exact_places: bool = True

    @property
    def unexplained(self) -> bool:
        """Whether the residual is above the noise."""
        return self.excess > UNEXPLAINED


def diagnose_same_road(problem: SameRoad, effects: Mapping[str, Effect], present: Sequence[Chosen] = (),
                       progress: Progress = lambda words: None, most_effects: int = 3) -> UnknownRoadDiagnosis:
    """Find the effects that the model, with those that are ``present``, lacks; at most so many.

    ValueError if the car is not linear with one that is present; NotOneRoad for drives that are certainly over two.
    """
    progress("are the drives over one road?")
    nominal = problem.start(present)
    untried = _obstacles(problem, effects, present)
    remaining = {name: one for name, one in effects.items() if name not in untried}
    agreements = road_agreements(problem, nominal, _trials(remaining))
    if found := certain_two_roads(agreements):
        one, other = (problem.runs[run].name for run in found)
        raise NotOneRoad(f"{one} and {other}: expected drives over the same road, found that neither predicts what the "
                         f"other met. {NOT_ONE_ROAD}; name drives over one road only")
    progress("refitting the car's own numbers and the road")
    before = now = fit(problem.preconditioned(nominal), nominal)
    now = replace(now, problem=now.problem.moved_as(now.state))
    errors = [before.problem.error(replace(nominal, roads=before.state.roads)), before.problem.error(before.state)]
    first: list[Candidate] = []
    taken: list[Candidate] = []
    undecided: list[Candidate] = []
    while len(taken) < most_effects:
        progress(f"round {len(taken) + 1}: trying {len(remaining)} effects")
        ranked = _by_effect(screen(now.problem, now, _trials(remaining)))
        models = _fits(now, ranked, progress)
        candidates = _candidates(now, models, len(remaining), errors[-1])
        first = first or [*candidates, *(
            _candidate(now.problem, _with_effect(now, ones[0].best), ones[0].gain, len(remaining), fitted=False)
            for name, ones in ranked.items() if name not in models)]
        best = next((one for one in candidates if one.helps(errors[-1])), None)
        if best is None or best.may_imitate:
            undecided = [one for one in candidates if one.helps(errors[-1])]
            break
        taken.append(best)
        now = models[best.name]
        now = (replace(now, problem=now.problem.preconditioned(now.state)) if problem.exact_places else
               _placed_anew(now, progress))
        errors.append(now.problem.error(now.state))
        del remaining[best.name]
    usual = {one.chosen.effect.name: one for one in screen(
        now.problem, now, [chosen(one, one.usual) for one in remaining.values()])}
    road = {name: one.share_beyond_road for name, one in usual.items() if one.share_beyond_road < ABSORBED_BY_ROAD}
    noise = now.problem.noise(now.state)
    return UnknownRoadDiagnosis(
        (*taken, *(one for one in first if one.name not in [own.name for own in taken])),
        _with_errors(now)[len(present):], tuple(errors),
        tuple(zip(before.problem.errors(before.state), now.problem.errors(now.state), strict=True)),
        noise.deviation_mps2 / now.problem.size_mps2, untried, road,
        {name: one.deviations for name, one in usual.items() if one.deviations < DETECTABLE_SIGMA and name not in road},
        _confounded_numbers(now), now.state.noise_mps2, _excess(now, noise),
        tuple((problem.runs[one].name, problem.runs[other].name) for one, other in possible_two_roads(agreements)),
        tuple(undecided), problem.exact_places,
    )


def _obstacles(problem: SameRoad, effects: Mapping[str, Effect], present: Sequence[Chosen],
               no_change: float = 1e-3) -> dict[str, str]:
    """Effects that cannot be tried, and why.

    no_change    of a response, as a share: no more than its table is right to
    """
    found, nominal = {}, problem.response(present, problem.start_vehicle)
    for name, effect in effects.items():
        why = effect.obstacle(problem.vehicle, True)
        if why is None and effect.obstacle(problem.vehicle, False) is not None:
            why = "the road has to be known under the right wheels too"
        if name in [one.effect.name for one in present]:
            why = "the model has it"
        elif why is None and isinstance(effect, RoadEffect):
            why = "it is about a profile, and there is none"
        elif why is None and isinstance(effect, DriveEffect):
            why = "it changes the way of every drive alike, and so would another road"
        elif why is None and not (effect.reshapes or problem.exact_places):
            why = "it only shifts the record, and the distances of these drives, by a receiver, shift as well"
        elif why is None:
            try:
                there = problem.response((*present, chosen(effect, effect.usual)), problem.start_vehicle)
                off = np.abs(there - nominal).max() / np.abs(nominal).max()
                if isinstance(effect, ForceEffect) and off <= no_change:
                    why = "it only adds what is not in proportion to the road, which takes a measured road"
            except ValueError:
                why = "no linear car stands in for one that has it, which takes a measured road"
        if why is not None:
            found[name] = why
    return found


# --- one round ---


def _trials(effects: Mapping[str, Effect]) -> list[Chosen]:
    return [chosen(effect, values) for effect in effects.values() for values in effect.trials()]


def _by_effect(tried: Sequence[Trial]) -> dict[str, list[Trial]]:
    """Trials by the names of their effects, the largest gain first."""
    found: dict[str, list[Trial]] = {}
    for one in sorted(tried, key=lambda one: -one.gain):
        found.setdefault(one.chosen.effect.name, []).append(one)
    return found


def _fits(base: SameRoadFit, ranked: Mapping[str, Sequence[Trial]], progress: Progress, most: int = 3,
          share: float = 0.1, least: float = 6.0, starts: int = 2, first_steps: int = 2) -> dict[str, SameRoadFit]:
    """Fit the effects with the largest gains on top of the model, by name; the best of so many ``first_steps`` from
    each start goes on.

    most, share, least    so many at most, of those whose gain is this share of the largest, and so much
    starts                so many trials at their own values, those whose gain is half of the best one's or more; this
                          also at its best strength, which holds for small changes only

    What gains less by its first steps than its numbers cost is not fitted further.
    """
    enough = max([least, *(share * ones[0].gain for ones in ranked.values())])
    found = {}
    for name in [name for name, ones in ranked.items() if ones[0].gain > enough][:most]:
        progress(f"fitting {name}")
        first = ranked[name][0]
        begins = [first.best, *(one.chosen for one in ranked[name][:starts] if one.gain > 0.5 * first.gain)]
        tries = [fit(base.problem, _with_effect(base, one), first_steps) for one in begins]
        gains = [one.problem.gain(base.state, one.state, nodes=2) for one in tries]
        best = tries[int(np.argmax(gains))]
        found[name] = fit(best.problem, best.state) if max(gains) > _cost(best.problem, best.state) else best
    return found


def _placed_anew(now: SameRoadFit, progress: Progress) -> SameRoadFit:
    """The fit with its drives laid on each other by what its car feels: by a car without its effects they lie wrong,
    and the next effect would imitate that. Laid anew they may no longer have enough of a road in common: then they stay
    where they are."""
    progress("laying the drives on one distance anew")
    old, state = now.problem, now.state
    car = old.prior.vehicle(old.vehicle, state.logs)
    try:
        runs = placed_by_road(old.runs, old.vehicle, old.tolerance, state.effects, car)
        problem = SameRoad(runs, old.vehicle, old.tolerance, car, exact_places=False)
    except NotOneRoad:
        return replace(now, problem=old.preconditioned(state))
    begin = problem.start(state.effects)
    return fit(problem.preconditioned(begin), begin)


def _with_effect(base: SameRoadFit, one: Chosen) -> RoadFitState:
    """The state of a model with one more effect."""
    effects = (*base.state.effects, one)
    return replace(base.state, effects=effects, gains=base.problem.response(effects, base.state.logs))


def _candidates(base: SameRoadFit, models: Mapping[str, SameRoadFit], count: int, error: float) -> list[Candidate]:
    """Fitted effects as candidates of so many, best first, each with those that cannot be distinguished from it."""
    imitation = IMITATION * _full_explanation(base)
    found = [replace(_candidate(one.problem, one.state, one.problem.gain(base.state, one.state), count),
                     imitation=imitation) for one in models.values()]
    found.sort(key=lambda one: -one.gain)
    there = [one for one in found if one.helps(error)]
    return [replace(one, confused_with=tuple(other.name for other in there if other is not one and one in there
                                             and abs(other.gain - one.gain) < INDISTINGUISHABLE)) for one in found]


def _cost(problem: SameRoad, state: RoadFitState) -> float:
    """What the numbers of the last effect of a state cost of its gain."""
    return len(free_parameters_of([state.effects[-1]])) * float(np.log(problem.samples))


def _candidate(problem: SameRoad, state: RoadFitState, gain: float, count: int, fitted: bool = True) -> Candidate:
    """The last effect of a state as one of so many candidates. Its gain in minus twice the log of the likelihood, less
    what its numbers cost (G. Schwarz 1978), is that in the evidence."""
    one = state.effects[-1]
    gain -= _cost(problem, state)
    return Candidate(one, problem.error(state), probability_by_chance(gain, count), gain, fitted=fitted,
                     stands_in=not problem.is_linear([one], state.logs))


# --- the residual ---


def _with_errors(model: SameRoadFit) -> tuple[Chosen, ...]:
    """The effects of a model with standard errors."""
    first, count = len(model.state.logs), len(model.free_parameters)
    deviations = np.sqrt(np.maximum(np.diag(inverse(model.information)), 0.0))[first : first + count]
    return with_standard_errors(model.state.effects, model.free_parameters, deviations)


def _confounded_numbers(model: SameRoadFit) -> tuple[Finding, ...]:
    """Masses, springs and dampers that these drives cannot identify while the road is unknown, whatever their prior."""
    names = model.problem.prior.names
    own = np.array([index for index, name in enumerate(names) if not name.endswith("_distance_m")])
    road = np.arange(len(names) + len(model.free_parameters), len(model.data))
    both = np.append(own, road)
    marginal = integrated_out(model.data[np.ix_(both, both)], np.arange(len(own), len(both)))
    powers, directions = np.linalg.eigh(marginal)
    derivatives = np.sqrt(np.maximum(powers, 0.0))[:, None] * directions.T
    return tuple(structural([names[index] for index in own], derivatives, size=1.0, nothing=0.01))


def _full_explanation(model: SameRoadFit) -> float:
    """Decrease of minus twice the log-likelihood if what no road explains were just small enough to count as explained;
    at least 0."""
    noise = model.problem.noise(model.state)
    over = model.state.noise_mps2 / ((1 + UNEXPLAINED) * noise.deviation_mps2)
    return max(0.0, 2 * PASS_OF_RATE * model.problem.samples * 2 * float(np.log(over)))


def _excess(model: SameRoadFit, noise: Noise) -> float:
    """Share by which what no road explains is above the noise; where chance may give as much, no more than
    ``UNEXPLAINED``. Degrees of freedom of a sample are reduced by the recorder's filter."""
    from scipy.stats import norm

    above = model.state.noise_mps2 / noise.deviation_mps2 - 1
    freedom = 2 * PASS_OF_RATE * model.problem.samples
    error = np.hypot(noise.standard_error_mps2 / noise.deviation_mps2, (2 * freedom) ** -0.5)
    return float(above if above > norm.isf(FALSE_ALARM / 2) * error else min(above, UNEXPLAINED))
