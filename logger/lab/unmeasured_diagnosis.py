"""The rounds of a diagnosis without a profile: what is missing, and what such drives cannot tell.

Problem: as in ``diagnosis``, but the road is unknown, and part of what an effect does the road takes for itself.
Solution: in each round every effect that can be tried is tried by the slopes beside the model, the promising ones are
fitted in full, and the best is taken if its gain would hardly come by chance in so many trials and is worth naming.
What cannot be learned is not a list in a text: it is read off the information that these drives hold, with the road
and without it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.identification.identifiability import NOT_ONE_ROAD, structural
from logger.lab.blind import SEEN
from logger.lab.candidates import alike_within
from logger.lab.diagnosis import CHANCE, WORTH, p_value
from logger.lab.noise import UNEXPLAINED, Noise
from logger.lab.one_road import apart, in_doubt, likenesses
from logger.lab.quantities import chance, finite, numbers_of
from logger.lab.spread import with_errors
from logger.lab.unmeasured import Fitted, NotOneRoad, SameRoad, State, Trial, fitted, inverse, trials
from logger.vehicle.effect import Chosen, DriveEffect, Effect, chosen

Array = npt.NDArray[np.float64]
Progress = Callable[[str], None]

MOST_EFFECTS = 3
TAKEN_BY_ROAD = 0.02
"""The road takes an effect of whose information it leaves no more than this share."""
_FITTED, _STARTS, _FIRST_STEPS, _WORTH_FITTING, _LEAST_PROMISE = 3, 2, 4, 0.1, 6.0
_NOTHING = 1e-2
# Of a sample's freedom the recorder's filter leaves this share.
_FREEDOM = 0.74
_CERTAIN = 3.3  # deviations: less than one time in a thousand


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that was tried on the model of its round.

    error          of all drives, each with the road that the others tell
    p_value        how often noise alone would gain as much, times the number of candidates
    gain           of minus twice the log-likelihood; where it was not fitted, what its slopes promise
    confused_with  effects that explain about as much
    fitted         with the car's numbers and the road; else it was added at the strength that its slopes promise
    """

    one: Chosen
    error: float
    p_value: float
    gain: float
    confused_with: tuple[str, ...] = ()
    fitted: bool = True


@dataclass(frozen=True, eq=False)
class Found:
    """What was found.

    candidates    best first, those of the verdict before the others
    missing       effects that the model lacks, with standard errors, in the order they were found
    steps         models on the way: words, and the error of all drives
    by_run        error of each run, before and after
    untried       effects that could not be tried, and why
    hidden        effects that would stand out by so many deviations at their usual strength, which are too few
    together      of the car's numbers: what these drives cannot tell, in words
    noise_mps2    what no road explains; ``excess``: by what share that is more than the sensor's noise
    doubtful      pairs of runs of which these drives cannot tell whether they are over one road, by name
    """

    candidates: tuple[Candidate, ...]
    missing: tuple[Chosen, ...]
    steps: tuple[tuple[str, float], ...]
    by_run: tuple[tuple[float, float], ...]
    floor_error: float
    untried: Mapping[str, str]
    taken_by_road: Mapping[str, float]
    hidden: Mapping[str, float]
    together: tuple[str, ...]
    noise_mps2: float
    excess: float
    doubtful: tuple[tuple[str, str], ...] = ()

    @property
    def unexplained(self) -> bool:
        """Whether more is left than that noise."""
        return self.excess > UNEXPLAINED


def diagnose_same_road(problem: SameRoad, effects: Mapping[str, Effect], present: Sequence[Chosen] = (),
                       progress: Progress = lambda words: None) -> Found:
    """Find the effects that the model, with those that are ``present``, lacks.

    ValueError if one that is present leaves the car answering out of proportion to the road; NotOneRoad for drives that
    are plainly over two.
    """
    progress("are the drives over one road?")
    nominal = problem.start(present)
    untried = _obstacles(problem, effects, present)
    left = {name: one for name, one in effects.items() if name not in untried}
    alike = likenesses(problem, nominal, _trials(left))
    if found := apart(alike):
        raise NotOneRoad(_two_roads(*(problem.runs[run].name for run in found)))
    progress("refitting the car's own numbers and the road")
    base = fitted(problem.prepared(nominal), nominal)
    before = base
    first: list[Trial] = []
    fits: list[Candidate] = []
    taken: list[Candidate] = []
    steps = [("the vehicle as its file says", base.problem.error(replace(nominal, roads=base.state.roads))),
             ("its numbers refitted within what is granted", base.problem.error(base.state))]
    for number in range(1, MOST_EFFECTS + 1):
        progress(f"round {number}: trying {len(left)} effects")
        tried = trials(base.problem, base, _trials(left))
        bar = Bar(len(left), problem.samples, steps[-1][1])
        models = _fits(base, tried, progress)
        candidates = _judged(base, models, bar)
        first, fits = first or tried, fits or candidates
        best = next((one for one in candidates if bar.passed(one)), None)
        if best is None:
            break
        taken.append(best)
        base = models[best.one.effect.name]
        base = replace(base, problem=base.problem.prepared(base.state))
        steps.append((f"with {best.one.effect.name}", base.problem.error(base.state)))
        del left[best.one.effect.name]
    listed = [*taken, *(one for one in fits if one.one.effect.name not in [own.one.effect.name for own in taken])]
    listed += _promises(before, first, {one.one.effect.name for one in listed}, len(effects) - len(untried))
    usual = trials(base.problem, base, [chosen(one, one.usual) for one in left.values()])
    road = {one.one.effect.name: one.beside_road for one in usual if one.beside_road < TAKEN_BY_ROAD}
    noise = base.problem.noise(base.state)
    return Found(
        tuple(listed), _with_spread(base, len(present)), tuple(steps),
        tuple(zip(base.problem.errors(before.state), base.problem.errors(base.state), strict=True)),
        noise.deviation_mps2 / problem.size_mps2, untried, road,
        {one.one.effect.name: one.deviations for one in usual
         if one.deviations < SEEN and one.one.effect.name not in road},
        _together(base), base.state.noise_mps2, _excess(base, noise),
        tuple((problem.runs[one].name, problem.runs[other].name) for one, other in in_doubt(alike)),
    )


def _excess(model: Fitted, noise: Noise) -> float:
    """By what share what no road explains is above the noise; no more than that asks for no explanation where chance
    would make so much."""
    above = model.state.noise_mps2 / noise.deviation_mps2 - 1
    error = np.hypot(noise.standard_error_mps2 / noise.deviation_mps2, (2 * _FREEDOM * model.problem.samples) ** -0.5)
    return float(above if above > _CERTAIN * error else min(above, UNEXPLAINED))


def _two_roads(one: str, other: str) -> str:
    return (f"{one} and {other}: expected drives over the same road, found that neither tells what the other met. "
            f"{NOT_ONE_ROAD}; name drives over one road only")


def _obstacles(problem: SameRoad, effects: Mapping[str, Effect], present: Sequence[Chosen]) -> dict[str, str]:
    """Effects that cannot be tried, and why."""
    found = {}
    for name, effect in effects.items():
        why = effect.obstacle(problem.vehicle, True)
        if why is None and effect.obstacle(problem.vehicle, False) is not None:
            why = "the road has to be known under the right wheels too"
        if name in [one.effect.name for one in present]:
            why = "the model has it"
        elif why is None and isinstance(effect, DriveEffect):
            why = "it changes the way of every drive alike, and so would another road"
        elif why is None:
            try:
                problem.response((*present, chosen(effect, effect.usual)), problem.stands)
            except ValueError:
                why = "a car with it does not answer in proportion to the road, which takes a measured road"
        if why is not None:
            found[name] = why
    return found


def _trials(effects: Mapping[str, Effect]) -> list[Chosen]:
    return [chosen(effect, values) for effect in effects.values() for values in effect.trials()]


def _fits(base: Fitted, tried: Sequence[Trial], progress: Progress) -> dict[str, Fitted]:
    """The most promising effects fitted beside the model, by name."""
    ranked: dict[str, list[Trial]] = {}
    for one in sorted(tried, key=lambda one: -one.gain):
        ranked.setdefault(one.one.effect.name, []).append(one)
    least = max(_LEAST_PROMISE, _WORTH_FITTING * max((one.gain for one in tried), default=0.0))
    worth = [name for name, ones in ranked.items() if ones[0].gain > least]
    found = {}
    for name in worth[:_FITTED]:
        progress(f"fitting {name}")
        tries = [fitted(base.problem, start, _FIRST_STEPS) for start in _starts(base, ranked[name])]
        best = max(tries, key=lambda one: one.problem.gain(base.state, one.state))
        found[name] = fitted(best.problem, best.state)
    return found


def _starts(base: Fitted, ranked: Sequence[Trial]) -> list[State]:
    """Where fits of an effect begin: its best trials as they are, and the best at the strength that it promises, which
    holds for small changes only."""
    ones = [ranked[0].at, *(trial.one for trial in ranked[:_STARTS])]
    return [_beside(base, one) for one in ones]


def _beside(base: Fitted, one: Chosen) -> State:
    """The model with an effect."""
    effects = (*base.state.effects, one)
    return replace(base.state, effects=effects, gains=base.problem.response(effects, base.state.logs))


@dataclass(frozen=True)
class Bar:
    """What an effect has to pass: among ``count`` candidates, over so many samples, on a model of this error."""

    count: int
    samples: int
    error: float

    def passed(self, one: Candidate) -> bool:
        """Whether it is there: not by chance, worth naming, and of help in telling each drive by the others."""
        return (one.p_value < CHANCE and one.gain > WORTH * _FREEDOM * self.samples and one.fitted
                and one.error <= self.error)


def _judged(base: Fitted, models: Mapping[str, Fitted], bar: Bar) -> list[Candidate]:
    """Fitted effects as candidates, best first."""
    found = []
    for model in models.values():
        one = model.state.effects[-1]
        gain = model.problem.gain(base.state, model.state)
        found.append(Candidate(one, model.problem.error(model.state), p_value(gain, _numbers(one), bar.count), gain))
    found.sort(key=lambda one: _numbers(one.one) * float(np.log(bar.samples)) - one.gain)  # G. Schwarz 1978
    return [replace(one, confused_with=_rivals(one, found, bar)) for one in found]


def _numbers(one: Chosen) -> int:
    return sum(parameter.moves for parameter in one.effect.parameters)


def _rivals(one: Candidate, found: Sequence[Candidate], bar: Bar) -> tuple[str, ...]:
    worthy = [other for other in found if bar.passed(other)]
    near = alike_within(one.gain)
    return tuple(other.one.effect.name for other in worthy
                 if one in worthy and other is not one and abs(other.gain - one.gain) < near)


def _promises(base: Fitted, tried: Sequence[Trial], told: set[str], count: int) -> list[Candidate]:
    """What was tried beside a model by its slopes only, best first."""
    best: dict[str, Trial] = {}
    for one in sorted(tried, key=lambda one: -one.gain):
        best.setdefault(one.one.effect.name, one)
    return [Candidate(one.at, base.problem.error(_beside(base, one.at)), p_value(one.gain, _numbers(one.at), count),
                      one.gain, fitted=False)
            for name, one in best.items() if name not in told]


def _with_spread(model: Fitted, present: int) -> tuple[Chosen, ...]:
    """The effects that were found, with standard errors."""
    first = len(model.state.logs)
    deviations = np.sqrt(np.maximum(np.diag(inverse(model.information)), 0.0))[first : first + len(model.moves)]
    return with_errors(model.state.effects, model.moves, deviations)[present:]


def _together(model: Fitted) -> tuple[str, ...]:
    """What these drives cannot tell of masses, springs and dampers beside the road, whatever is granted."""
    names = model.problem.nuisance.names
    own = np.array([index for index, name in enumerate(names) if not name.endswith("_distance_m")])
    road = np.arange(len(names) + len(model.moves), len(model.data))
    mixed = model.data[np.ix_(own, road)]
    left = model.data[np.ix_(own, own)] - mixed @ inverse(model.data[np.ix_(road, road)]) @ mixed.T
    powers, directions = np.linalg.eigh(left)
    derivatives = np.sqrt(np.maximum(powers, 0.0))[:, None] * directions.T
    return tuple(one.words for one in structural([names[index] for index in own], derivatives, 1.0, _NOTHING))


# --- as it is told ---


def summary(found: Found) -> list[str]:
    """What is missing, how certain that is, and what it could be instead: paragraphs."""
    lines = []
    for one in found.missing:
        candidate = next(other for other in found.candidates if other.one.effect.name == one.effect.name)
        numbers = f": {numbers_of(one)}" if one.values else ""
        lines.append(f"{one.effect.name} is missing ({one.effect.title}){numbers}. The probability that noise alone "
                     f"looks like this, all candidates together: {chance(candidate.p_value)}.")
        if candidate.confused_with:
            lines.append(f"These drives cannot tell {one.effect.name} from {' or '.join(candidate.confused_with)}.")
    if not lines:
        lines.append("None of the effects that can be tried without a profile is missing.")
    by_step = [f"{error:.3f} {'with' if index else 'as'} {words.removeprefix('with ')}"
               for index, (words, error) in enumerate(found.steps)]
    lines.append(f"Error of each drive over the road as estimated from the others: {', '.join(by_step)}. The sensor's "
                 f"noise alone makes {found.floor_error:.3f}.")
    if found.unexplained:
        lines.append(f"What no road explains is {1 + found.excess:.2f} times the sensor's noise: something else is "
                     "missing, maybe one of the effects that only a measured road can show.")
    return lines


def cannot_tell(found: Found) -> list[str]:
    """What these drives cannot tell, in sentences."""
    lines = [f"Whether {one} and {other} are over one road: too little of what they recorded there stands out of the "
             "noise." for one, other in found.doubtful]
    if found.taken_by_road:
        lines.append(f"{', '.join(found.taken_by_road)}: the road takes what this does; another road that nobody "
                     "measured would do the same.")
    lines += [f"{', '.join(name for name, one in found.untried.items() if one == why)}: could not be tried; {why}."
              for why in dict.fromkeys(found.untried.values())]
    lines += [f"{name}: these drives could miss it; at its usual strength it stands out by {deviations:.1f} standard "
              "deviations."
              for name, deviations in found.hidden.items()]
    return [*lines, *(f"The car's numbers: {words}" for words in found.together)]


def as_json(found: Found) -> dict[str, Any]:
    """The diagnosis as one JSON object."""
    errors = {one.effect.name: finite(one.standard_errors) for one in found.missing}
    values = {one.effect.name: dict(one.values) for one in found.missing}
    return {
        "baseline_error": found.steps[0][1], "noise_floor_error": found.floor_error,
        "candidates": [
            {"effect": one.one.effect.name, "parameters": values.get(one.one.effect.name, dict(one.one.values)),
             "error": one.error, "p_value": one.p_value,
             "confused_with": list(one.confused_with), "fitted": one.fitted,
             "standard_errors": errors.get(one.one.effect.name, {}), "log_likelihood_gain": one.gain / 2}
            for one in found.candidates],
        "verdict": [one.effect.name for one in found.missing], "unexplained": found.unexplained,
        "left_over_noise": 1 + found.excess,
        "steps": [{"step": words, "error": error} for words, error in found.steps],
        "runs": [{"error_before": before, "error_after": after} for before, after in found.by_run],
        "maybe_over_two_roads": [list(pair) for pair in found.doubtful],
        "not_tried": dict(found.untried), "taken_by_road": dict(found.taken_by_road), "hidden": dict(found.hidden),
        "sentences": [*summary(found), *cannot_tell(found)],
    }
