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

import numpy as np
import numpy.typing as npt

from logger.identification.identifiability import NOT_ONE_ROAD, structural
from logger.lab.likelihood.noise_floor import UNEXPLAINED, Noise
from logger.lab.likelihood.standard_errors import with_errors
from logger.lab.selection.detectability import DETECTABLE_SIGMA
from logger.lab.selection.evidence import CONFUSED, FALSE_ALARM, probability_by_chance
from logger.lab.unknown_road.fisher_scoring import Fitted, fitted, inverse
from logger.lab.unknown_road.likelihood import NotOneRoad, SameRoad, State
from logger.lab.unknown_road.same_road_test import apart, in_doubt, likenesses
from logger.lab.unknown_road.screening import Trial, trials
from logger.vehicle.effect import Chosen, DriveEffect, Effect, chosen
from logger.vehicle.effect_parameters import moves_of

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
    gain           of minus twice the log of the evidence; where it was not fitted, what its slopes promise
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
        here = _Round(len(left), problem.samples, steps[-1][1])
        models = _fits(base, tried, progress)
        candidates = _judged(base, models, here)
        first, fits = first or tried, fits or candidates
        best = next((one for one in candidates if here.accepted(one)), None)
        if best is None:
            break
        taken.append(best)
        base = models[best.one.effect.name]
        base = replace(base, problem=base.problem.prepared(base.state))
        steps.append((f"with {best.one.effect.name}", base.problem.error(base.state)))
        del left[best.one.effect.name]
    listed = [*taken, *(one for one in fits if one.one.effect.name not in [own.one.effect.name for own in taken])]
    listed += _promises(before, first, {one.one.effect.name for one in listed},
                        _Round(len(effects) - len(untried), problem.samples, steps[1][1]))
    usual = trials(base.problem, base, [chosen(one, one.usual) for one in left.values()])
    road = {one.one.effect.name: one.beside_road for one in usual if one.beside_road < TAKEN_BY_ROAD}
    noise = base.problem.noise(base.state)
    return Found(
        tuple(listed), _with_spread(base, len(present)), tuple(steps),
        tuple(zip(base.problem.errors(before.state), base.problem.errors(base.state), strict=True)),
        noise.deviation_mps2 / problem.size_mps2, untried, road,
        {one.one.effect.name: one.deviations for one in usual
         if one.deviations < DETECTABLE_SIGMA and one.one.effect.name not in road},
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
class _Round:
    """A model that so many candidates are tried on, over so many samples, and its error."""

    candidates: int
    samples: int
    error: float

    def evidence_gain(self, one: Chosen, gain: float) -> float:
        """What an effect gains in minus twice the log of the evidence, by its gain in likelihood (G. Schwarz 1978)."""
        return gain - len(moves_of([one])) * float(np.log(self.samples))

    def accepted(self, one: Candidate) -> bool:
        """Whether an effect is there: not by chance, and of help in predicting each drive by the others."""
        return one.fitted and one.p_value < FALSE_ALARM and one.error <= self.error


def _judged(base: Fitted, models: Mapping[str, Fitted], here: _Round) -> list[Candidate]:
    """Fitted effects as candidates, best first."""
    found = []
    for model in models.values():
        one = model.state.effects[-1]
        gain = here.evidence_gain(one, model.problem.gain(base.state, model.state))
        found.append(Candidate(one, model.problem.error(model.state), probability_by_chance(gain, here.candidates),
                               gain))
    found.sort(key=lambda one: -one.gain)
    return [replace(one, confused_with=_rivals(one, found, here)) for one in found]


def _rivals(one: Candidate, found: Sequence[Candidate], here: _Round) -> tuple[str, ...]:
    return tuple(other.one.effect.name for other in found
                 if other is not one and here.accepted(one) and here.accepted(other)
                 and abs(other.gain - one.gain) < CONFUSED)


def _promises(base: Fitted, tried: Sequence[Trial], named: set[str], here: _Round) -> list[Candidate]:
    """What was tried beside a model by its slopes only, best first."""
    best: dict[str, Trial] = {}
    for one in sorted(tried, key=lambda one: -one.gain):
        best.setdefault(one.one.effect.name, one)
    found = []
    for name, one in best.items():
        if name not in named:
            gain = here.evidence_gain(one.at, one.gain)
            found.append(Candidate(one.at, base.problem.error(_beside(base, one.at)),
                                   probability_by_chance(gain, here.candidates), gain, fitted=False))
    return found


def _with_spread(model: Fitted, present: int) -> tuple[Chosen, ...]:
    """The effects that were found, with standard errors."""
    first = len(model.state.logs)
    deviations = np.sqrt(np.maximum(np.diag(inverse(model.information)), 0.0))[first : first + len(model.moves)]
    return with_errors(model.state.effects, model.moves, deviations)[present:]


def _together(model: Fitted) -> tuple[str, ...]:
    """What these drives cannot tell of masses, springs and dampers beside the road, whatever is granted."""
    names = model.problem.prior.names
    own = np.array([index for index, name in enumerate(names) if not name.endswith("_distance_m")])
    road = np.arange(len(names) + len(model.moves), len(model.data))
    mixed = model.data[np.ix_(own, road)]
    left = model.data[np.ix_(own, own)] - mixed @ inverse(model.data[np.ix_(road, road)]) @ mixed.T
    powers, directions = np.linalg.eigh(left)
    derivatives = np.sqrt(np.maximum(powers, 0.0))[:, None] * directions.T
    return tuple(one.words for one in structural([names[index] for index in own], derivatives, 1.0, _NOTHING))
