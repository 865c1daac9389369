"""Which physical effects a model lacks: found one after the other, judged on what no fit saw.

Problem: something differs, and twenty effects, alone or together, might be why; or none of them; or nothing. Solution,
in rounds: the car's own numbers and the wander of the distance are refitted within what is granted; every effect is
screened; the promising ones are fitted; the best is taken when it passes four tests: its gain in likelihood would
hardly come by chance in so many trials, it explains stretches that no fit saw, what it explains is worth naming, and it
is no small part of what is left to explain. Then the next round begins, on the model with it. At the end those that
explained as much as one that was taken, or were passed over for a simpler one, are tried in its place, and every effect
must still be needed by the others. What is left then is compared with the noise that the sensor has
where no car moves it: what stays above it is unexplained, and so is what takes numbers of the car to explain that
nobody granted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from logger.lab.candidates import (
    TOLD_APART,
    Base,
    Screened,
    Tried,
    alike_within,
    as_screened,
    best_choice,
    every_choice,
    fitted,
    in_place_of,
    misalignment,
    screened,
    settled_further,
    simpler,
)
from logger.lab.fitting import Problem, Slopes, State, located
from logger.lab.noise import UNEXPLAINED, Noise, floor_error, left_to_explain, noise_of
from logger.lab.settling import settled
from logger.lab.wandering import ASTRAY, aligned_anew, lying, moved_m, relaid
from logger.vehicle.effect import Chosen, Effect, Misalignment
from logger.vehicle.effect_parameters import steps_apart

Progress = Callable[[str], None]

MOST_EFFECTS = 4
"""No more than so many are looked for."""
CHANCE = 0.001
"""How often, at most, noise alone may look like an effect, all candidates together."""
WORTH, DIFFER, DIFFER_IF_IT_RUBS = 0.0025, 0.001, 0.003
"""The least that an effect has to lower the mean logarithm of the power that is left; and what two right simulations of
a car may differ by, over what was measured, which is no effect either: dry friction comes late by part of a step."""
SHARE = 0.006
"""The least share that an effect has to add to what those before it explain: their laws are never quite the car's."""
EASED, SHARE_EASED = 16.0, 0.002
"""An effect of which these data tell only that the car's numbers would be off too far without it is worth naming as
well: from four standard deviations on, and from this share of what those before it explain, where little is left to
explain besides."""
HARM = 0.1
"""What share of its gain an effect may cost on stretches that no fit saw, which may hold nothing that would show it."""
LEAST_OF_LEFT = 0.1
"""An effect that gains a smaller share of what a full explanation would may only stand in for what is missing. One that
moves a model that is astray is spared that: where two such are wrong, either alone gains little."""
STRAINED = 4.0
"""A number of the car that has to be off by more deviations of what is granted than this explains nothing."""
_WORTH_SETTLING, _WORTH_SETTLING_AT_FIRST = 0.02, 0.1
"""A round of a fit that gains less than this share of what is left to explain is its last: little has to be settled
where much is still to be found."""
_WORTH_FITTING = 0.03
_LEAST_PROMISE, _SHARE_PROMISED = 6.0, 0.001
_HAS_A_SHAPE = 2  # numbers, so that an effect may explain much as what it is not
_MOST_FITTED, _MOST_FINALISTS, _FINALIST_SHARE, _FINAL_ROUNDS = 6, 3, 0.7, 3
_HALFWAY, _SHARE_OF_NEEDED = 0.5, 0.05  # of what an effect has to gain: when fitted, and when only screened
_THE_SAME_PLACE = 20.0  # steps
_THE_SAME_M = 0.001
_UNDECIDED = 0.05  # of what is left to explain


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that was tried on the model of its round.

    error              on what no fit saw
    p_value            how often noise alone would gain as much in any of the trials of all candidates
    gain, judged_gain  of minus twice the log-likelihood, of all stretches and of those that no fit saw
    confused_with      effects that explain the same as well
    """

    effect: Effect
    values: Mapping[str, float]
    error: float
    p_value: float
    gain: float
    judged_gain: float
    confused_with: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Step:
    """A model on the way: what was done, and the error on what no fit saw."""

    words: str
    error: float


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found.

    candidates     of the first round, with those of later rounds in place of theirs where they were taken; best first;
                   those of the verdict with the values that they end with
    obstacles      effects that could not be tried, and why
    verdict        effects that the model lacks, the most certain first
    excess         the share by which what is left is above the noise in the run where it is most
    strained       numbers of the car that have to be off too far, by which share
    slopes         taken near ``after``, maybe by the coarser simulation of the search
    judged         some stretches were kept from the fits
    moved_m        by how much a run was laid elsewhere than it was recorded, at most
    """

    baseline_error: float
    noise: Noise | None
    noise_floor_error: float | None
    candidates: tuple[Candidate, ...]
    obstacles: Mapping[str, str]
    verdict: tuple[str, ...]
    excess: float
    strained: Mapping[str, float]
    steps: tuple[Step, ...]
    before: State
    after: State
    slopes: Slopes
    problem: Problem
    judged: bool
    moved_m: float

    @property
    def left_over(self) -> bool:
        """Whether more is left than the sensor's noise."""
        return self.excess > UNEXPLAINED

    @property
    def unexplained(self) -> bool:
        """Whether the effects of the verdict, in a car as it was granted, do not explain all."""
        return self.left_over or bool(self.strained)

    @property
    def judged_on(self) -> str:
        """What the errors of steps and candidates are errors of."""
        return "stretches that no fit saw" if self.judged else "all samples (too short runs to keep any from the fits)"


@dataclass(frozen=True, eq=False)
class _Taken:
    """An effect that was taken, as it was tried in its round, which had so many trials.

    rivals         those that explain as much
    passed_over    those that explain more, or have numbers of its own and more, which may yet matter
    """

    tried: Tried
    rivals: tuple[Tried, ...]
    passed_over: tuple[Tried, ...]
    count: int

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.tried.effect.name


@dataclass(frozen=True, eq=False)
class _Way:
    """How effects were taken: the problem with its runs where they lie at last, the model there without effects and
    with those that were taken, these, what the first round tried, and the steps."""

    problem: Problem
    before: Base
    now: Base
    taken: list[_Taken]
    first: list[Tried]
    steps: list[Step]


def diagnose(problem: Problem, effects: Mapping[str, Effect], present: Sequence[Chosen] = (),
             progress: Progress = lambda words: None, workers: int = 2) -> Diagnosis:
    """Find the effects of ``effects`` that the model, with those that are ``present``, lacks, in so many threads."""
    obstacles = _obstacles(problem, effects, present)
    left = [one for name, one in effects.items() if name not in obstacles]
    progress("refitting the car's own numbers")
    nominal = problem.start(present)
    seen = misalignment(problem, nominal)
    recorded = problem
    problem, before = refitted(recorded, nominal)
    steps = [Step("the vehicle as its file says", recorded.judged_error(nominal)),
             Step("its numbers refitted within what is granted", before.judged_error)]
    way = _way(problem, recorded, before, left, seen, progress, workers)
    problem, before, now = way.problem, way.before, way.now
    steps += way.steps
    if way.taken:  # on the way it was settled roughly
        now = Base.of(problem, *settled(problem, now.state, slopes=now.slopes))
        steps[-1] = Step(steps[-1].words, now.judged_error)
    on_the_way = now
    now, taken = _reconsidered(problem, now, way.taken, len(present), progress)
    now, needed = _needed(problem, before, now, taken, len(present), progress, workers)
    progress("fitting all stretches")
    whole = problem.entire()
    after, slopes = settled(whole, now.state, slopes=now.slopes, worth=_WORTH_SETTLING)
    while ended := [one.effect.name for one in after.effects[len(present):] if one.at_an_end]:
        now = _without(problem, now, ended[0])  # finely simulated, it is nothing, or something else
        needed.pop(ended[0])
        after, slopes = settled(whole, now.state, slopes=now.slopes, worth=_WORTH_SETTLING)
    if now is not on_the_way:
        steps.append(Step("as it ends", now.judged_error))
    noise = noise_of(whole, after)
    verdict = tuple(needed)
    return Diagnosis(
        baseline_error=recorded.error(nominal), noise=noise, noise_floor_error=floor_error(whole, noise),
        candidates=_listed(problem, after, way.first, taken, verdict), obstacles=obstacles, verdict=verdict,
        excess=_excess(whole, after, noise), strained=_strained(whole, after), steps=tuple(steps),
        before=before.state, after=after, slopes=slopes, problem=whole,
        judged=any(one.judges for one in problem.stretches), moved_m=moved_m(recorded, problem),
    )


def refitted(problem: Problem, nominal: State) -> tuple[Problem, Base]:
    """The car's own numbers refitted, with the runs where they lie: beside the car as it stands, and once more beside
    the one that was refitted."""
    laid, start = lying(problem, nominal)
    return _where_it_lies(problem, laid, Base.of(laid, *settled(laid, start)))


def _where_it_lies(recorded: Problem, problem: Problem, now: Base) -> tuple[Problem, Base]:
    """The problem and a model with the runs where they lie beside it, if it leaves anything where they lie now, or they
    do so only beside a model that lacked more; and if it explains enough to tell."""
    tells = (now.unexplained > 0 or problem is not recorded) and now.judged_error < ASTRAY
    laid = relaid(problem, now.state, recorded) if tells else problem
    same = laid is problem or moved_m(problem, laid) < _THE_SAME_M
    return (problem, now) if same else (laid, _on(laid, now))


def _on(problem: Problem, now: Base) -> Base:
    """A model refitted over runs that lie elsewhere."""
    return Base.of(problem, *settled(problem, aligned_anew(problem, now.state)))


def _way(problem: Problem, recorded: Problem, before: Base, effects: Sequence[Effect], seen: Misalignment,
         progress: Progress, workers: int) -> _Way:
    """Effects taken one after the other, until none is there any more.

    recorded    the problem with the runs where they were recorded
    """
    now, left = before, list(effects)
    first: list[Tried] = []
    taken: list[_Taken] = []
    steps: list[Step] = []
    explained = 0.0
    for number in range(1, MOST_EFFECTS + 1):
        if not left:
            break
        progress(f"round {number}")
        least = max(_LEAST_PROMISE, _SHARE_PROMISED * explained)
        tried = _round(problem, now, left, seen, progress, 0.0 if number == 1 else least, workers)
        first = first or tried
        accepted = [one for one in tried if _accepted(problem, one, _starts(tried), explained, now)]
        if not accepted:
            break
        seen_best = located(problem, accepted[0].state, accepted[0].slopes)
        best = _simplest_of_the_best(accepted, left_to_explain(problem, seen_best))
        rivals = _rivals(best, tried, problem)
        taken.append(_Taken(best, rivals, _passed_over(best, accepted), _starts(tried)))
        progress(f"round {number}: {best.effect.name} is missing; fitting the car with it")
        earlier, now = now, Base.of(problem, *settled(problem, best.state, slopes=best.slopes, worth=_WORTH_SETTLING))
        laid, now = _where_it_lies(recorded, problem, now)
        if laid is not problem:
            problem, before, earlier = laid, _on(laid, before), _on(laid, earlier)
        for earlier_one in taken[:-1]:
            now = _sought_again(problem, now, earlier_one.tried, seen, progress)
        if best.effect.reshapes:  # what was only moved to its place was explained by nothing
            explained += earlier.left_by(now)
        steps.append(Step(f"with {best.effect.name}", now.judged_error))
        left = [one for one in left if one.name != best.effect.name]
    return _Way(problem, before, now, taken, first, steps)


def _obstacles(problem: Problem, effects: Mapping[str, Effect], present: Sequence[Chosen]) -> dict[str, str]:
    """Effects that cannot be tried, and why."""
    two_tracks = all(run.two_tracks for run in problem.runs.runs)
    there = {one.effect.name for one in present}
    found = {}
    for name, effect in effects.items():
        why = "the model has it" if name in there else effect.obstacle(problem.vehicle, two_tracks)
        if why is not None:
            found[name] = why
    return found


def _round(problem: Problem, now: Base, effects: Sequence[Effect], seen: Misalignment,
           progress: Progress, promise: float, workers: int) -> list[Tried]:
    """Every effect tried on the model, best first; nothing if none promises that gain."""
    with ThreadPoolExecutor(workers) as pool:
        promises: list[Screened] = []
        for done, one in enumerate(pool.map(lambda effect: screened(problem, now, effect, seen), effects), 1):
            progress(f"screened {done} of {len(effects)} effects")
            promises.append(one)
        promises.sort(key=lambda one: -one.gain)
        if promises[0].gain < promise:
            return []
        least = max(_LEAST_PROMISE, _WORTH_FITTING * promises[0].gain)
        deep = {one.effect.name for one in promises[:_MOST_FITTED]
                if one.gain >= max(least, _SHARE_OF_NEEDED * _least_of_left(now, one.effect))}
        progress(f"fitting {len(deep)} of them")
        tried = [one for some in pool.map(
            lambda one: fitted(problem, now, one, _WORTH_SETTLING_AT_FIRST) if one.effect.name in deep
            else as_screened(problem, now, one), promises,
        ) for one in some]
        best = _best_of_each(tried)
        names = {one.effect.name for one in best[:_MOST_FINALISTS]} & deep
        least = _FINALIST_SHARE * best[0].whole_gain
        finalists = [one for one in tried if one.effect.name in names
                     and one.whole_gain > max(least, _HALFWAY * _least_of_left(now, one.effect))]
        progress(f"settling {len({one.effect.name for one in finalists})} of them")
        further = list(pool.map(lambda one: settled_further(problem, now, one, _FINAL_ROUNDS, _WORTH_SETTLING),
                                finalists))
        tried = _best_of_each([*further, *(one for one in tried if one not in finalists)])
        if finalists and tried[0].whole_gain > _least_of_left(now, tried[0].effect):
            counts = {one.effect.name: one.count for one in promises}
            tried += pool.map(partial(in_place_of, problem, now, tried[0], counts, _WORTH_SETTLING),
                              simpler(tried[0], effects))
    return _best_of_each(tried)


def _least_of_left(now: Base, effect: Effect) -> float:
    """What an effect has to gain of what is left to explain."""
    if not effect.reshapes and now.judged_error > ASTRAY:
        return 0.0
    return LEAST_OF_LEFT * now.unexplained


def _best_of_each(tried: Sequence[Tried]) -> list[Tried]:
    """Of every effect the model that is best, best first."""
    found: dict[str, Tried] = {}
    for one in sorted(tried, key=_merit):
        found.setdefault(one.effect.name, one)
    return list(found.values())


def _simplest_of_the_best(accepted: Sequence[Tried], left: float) -> Tried:
    """Of those that explain about as much as the best one, the one with the fewest numbers.

    left    what the best one leaves to explain: where that is much, it may make all the difference between the best one
            and one that has some of its numbers
    """
    best = accepted[0]
    near = alike_within(best.whole_gain)
    part = max(near, _UNDECIDED * left)
    parts = simpler(best, [one.effect for one in accepted])
    return min((one for one in accepted if one.whole_gain > best.whole_gain - (part if one.effect in parts else near)),
               key=lambda one: one.numbers)


def _merit(one: Tried) -> float:
    """For sorting, best first: the gain; each number that was fitted has to gain what tells two effects apart, so that
    the simpler of two that cannot be told apart comes first."""
    return TOLD_APART * one.numbers - one.whole_gain


def p_value(gain: float, numbers: int, count: int) -> float:
    """How often noise alone gains as much in one of ``count`` trials (Wilks's theorem, Bonferroni's correction). Shapes
    that have no meaning without a strength (a knee, a frequency) count by the values that they were tried at."""
    from scipy.special import gammaincc

    return float(min(1.0, count * gammaincc(max(numbers, 1) / 2, max(gain, 0.0) / 2)))


def _starts(tried: Sequence[Tried]) -> int:
    """How many trials a round had."""
    return sum(one.starts for one in tried)


def _accepted(problem: Problem, one: Tried, count: int, before: float, now: Base | None = None) -> bool:
    """Whether an effect is there: not by chance, worth naming beside what was explained before, no harm to what no fit
    saw, and no small part of what is left to explain by ``now``, if that is asked."""
    return ((now is None or one.whole_gain > _least_of_left(now, one.effect))
            and not one.state.effects[-1].at_an_end
            and p_value(one.gain, one.numbers, count) < CHANCE
            and _worthy(problem, one.state, one.whole_gain, one.eased, before)
            and one.judged_gain > -HARM * one.gain)


def _worthy(problem: Problem, state: State, gain: float, eased: float, before: float) -> bool:
    """Whether what an effect of a model explains, or what it saves the car's numbers from, is worth naming beside what
    was explained before."""
    freedom = sum(float(cells.freedom.sum()) for cells in problem.cells(state, None))
    differ = DIFFER_IF_IT_RUBS if problem.car(state.effects, state.logs).rubs else DIFFER
    least = max(WORTH, float(np.log1p((differ / problem.error(state)) ** 2)))
    return gain > max(least * freedom, SHARE * before) or eased > max(EASED, SHARE_EASED * before)


def _rivals(one: Tried, tried: Sequence[Tried], problem: Problem) -> tuple[Tried, ...]:
    """Effects that explain as well what this one explains; none for one that explains nothing."""
    worthy = [other for other in tried if _accepted(problem, other, _starts(tried), 0.0)]
    if one not in worthy:
        return ()
    near = alike_within(one.whole_gain)
    return tuple(other for other in worthy if other is not one and abs(other.whole_gain - one.whole_gain) < near)


def _passed_over(best: Tried, accepted: Sequence[Tried]) -> tuple[Tried, ...]:
    """Effects for which a simpler one was taken, or that have its numbers and more: what only they could explain may
    show when the others are known."""
    return tuple(one for one in accepted if one is not best and (one is accepted[0] or simpler(one, [best.effect])))


def _needed(problem: Problem, before: Base, now: Base, taken: Sequence[_Taken], present: int,
            progress: Progress, workers: int) -> tuple[Base, dict[str, float]]:
    """The model without those that were taken and are not needed by the side of the others, and what each of the
    others is worth."""
    worth = {taken[0].name: taken[0].tried.whole_gain} if len(taken) == 1 else {}

    while len(now.state.effects) - present > 1:
        names = [one.effect.name for one in now.state.effects[present:]]
        progress(f"are all of {', '.join(names)} still needed?")
        with ThreadPoolExecutor(workers) as pool:
            others = dict(zip(names, pool.map(partial(_without, problem, now), names), strict=True))
        worth = {name: other.left_by(now) for name, other in others.items()}
        least = min(worth, key=lambda name: worth[name])
        moved = sum(worth[one.effect.name] for one in now.state.effects[present:]
                    if not one.effect.reshapes and one.effect.name != least)
        explained = before.left_by(others[least]) - moved
        if _worthy(problem, now.state, worth[least], others[least].cost - now.cost, explained):
            break
        now = others[least]
        worth.pop(least)
    return now, dict(sorted(worth.items(), key=lambda pair: -pair[1]))


def _sought_again(problem: Problem, now: Base, one: Tried, seen: Misalignment, progress: Progress) -> Base:
    """The model with an effect where it explains most beside those that were found after it, which may be elsewhere."""
    if one.numbers < _HAS_A_SHAPE:
        return now
    name = one.effect.name
    progress(f"is {name} still what it was?")
    without = _without(problem, now, name)
    promise = screened(problem, without, one.effect, seen)
    again = best_choice(fitted(problem, without, promise, _WORTH_SETTLING_AT_FIRST))
    there = next(other for other in now.state.effects if other.effect.name == name)
    if steps_apart(there, again.state.effects[-1]) < _THE_SAME_PLACE:
        return now
    other = Base.of(problem, *settled(problem, again.state, _FINAL_ROUNDS, again.slopes, _WORTH_SETTLING))
    at_an_end = any(one.at_an_end for one in other.state.effects)
    return other if now.left_by(other) > TOLD_APART and not at_an_end else now


def _without(problem: Problem, now: Base, name: str) -> Base:
    """The model without one of its effects, refitted."""
    rest = tuple(one for one in now.state.effects if one.effect.name != name)
    away = next(one for one in now.state.effects if one.effect.name == name)
    start = problem.laid_out(rest, now.state.logs, now.state.wander)
    slopes = None if away.effect.realigns else now.slopes
    return Base.of(problem, *settled(problem, start, _FINAL_ROUNDS, slopes, _WORTH_SETTLING))


def _reconsidered(problem: Problem, now: Base, taken: Sequence[_Taken], present: int,
                  progress: Progress) -> tuple[Base, list[_Taken]]:
    """The model with simpler effects in place of those that explain no more, and with those that were passed over for
    simpler ones if they explain clearly more, now that the others are known too."""
    found = list(taken)
    for place in range(present, len(now.state.effects)):
        number = next(i for i, one in enumerate(found) if one.name == now.state.effects[place].effect.name)
        there = {one.effect.name for one in now.state.effects}
        for rival in dict.fromkeys((*found[number].rivals, *found[number].passed_over)):
            here = found[number]
            more = rival.numbers - here.tried.numbers
            if (more >= 0 and rival not in here.passed_over) or rival.effect.name in there:
                continue
            progress(f"would {rival.effect.name} do for {here.name}?")
            other = _with_other(problem, now, place, rival)
            near = alike_within(here.tried.whole_gain)
            gained, at_an_end = now.left_by(other), other.state.effects[place].at_an_end
            if gained > (TOLD_APART * more if more < 0 else max(TOLD_APART * more, near)) and not at_an_end:
                now, found[number] = other, _taken_instead(here, rival)
            elif abs(gained) < near and not at_an_end and rival not in here.rivals:
                found[number] = replace(here, rivals=(*here.rivals, rival))
    return now, found


def _taken_instead(here: _Taken, rival: Tried) -> _Taken:
    """Another effect in the place of one that was taken; which of those around explain as much as it does."""
    near = alike_within(rival.whole_gain)
    others = [here.tried] if rival.numbers < here.tried.numbers else []
    others += [one for one in dict.fromkeys((*here.rivals, *here.passed_over))
               if one is not rival and abs(one.whole_gain - rival.whole_gain) < near]
    return replace(here, tried=rival, rivals=tuple(others))


def _with_other(problem: Problem, now: Base, place: int, rival: Tried) -> Base:
    """The model with another effect at a place in the order of its effects, refitted; with another of the choices that
    no fit moves where that explains clearly more."""
    old, new = now.state.effects[place], rival.state.effects[-1]
    slopes = None if old.effect.realigns or new.effect.realigns else now.slopes
    logs = np.where(np.isin(problem.nuisance.names, new.effect.replaces), 0.0, now.state.logs)
    found = []
    for one in every_choice(new):
        effects = (*now.state.effects[:place], one, *now.state.effects[place + 1 :])
        start = problem.laid_out(effects, logs, now.state.wander)
        found.append(Base.of(problem, *settled(problem, start, _FINAL_ROUNDS, slopes, _WORTH_SETTLING)))
    return max(found, key=lambda base: now.left_by(base) + (TOLD_APART if base is found[0] else 0.0)
               - (np.inf if base.state.effects[place].at_an_end else 0.0))


def _strained(problem: Problem, state: State) -> dict[str, float]:
    """Numbers of the car that are off by more than anybody granted, by which share."""
    nuisance = problem.nuisance
    return {name: float(np.expm1(log)) for name, log, deviation in zip(
        nuisance.names, state.logs, nuisance.deviations, strict=True) if abs(log) > STRAINED * deviation}


def _excess(problem: Problem, state: State, noise: Noise) -> float:
    """By what share the residual is above the noise in the run where it is most. A run so short that noise alone may do
    the same counts only as far as asks for no explanation."""
    from scipy.special import gammainccinv

    cells = problem.cells(state, None)
    freedom = np.array([one.freedom.sum() for one in cells])
    power = np.array([one.freedom @ one.power for one in cells]) / freedom
    above = np.sqrt(power) / noise.deviation_mps2 - 1
    by_chance = np.sqrt(gammainccinv(freedom / 2, CHANCE / len(cells)) / (freedom / 2)) - 1
    return float(np.where(above > by_chance, above, np.minimum(above, UNEXPLAINED)).max())


def _listed(problem: Problem, after: State, first: Sequence[Tried], taken: Sequence[_Taken],
            verdict: Sequence[str]) -> tuple[Candidate, ...]:
    """The candidates, those of the verdict before the others, of which the least probable by chance come first."""
    values = {one.effect.name: one.values for one in after.effects}
    own = {one.name: one for one in taken}
    found = []
    for name in verdict:
        one = own[name]
        rivals = tuple(rival for rival in one.rivals if rival.effect.name not in verdict)
        found.append(_candidate(one.tried, one.count, rivals, values[name]))
    others = [(_candidate(tried, _starts(first), _rivals(tried, first, problem), None), _merit(tried))
              for tried in first if tried.effect.name not in verdict]
    return (*found, *(one for one, _ in sorted(others, key=lambda pair: (pair[0].p_value, pair[1]))))


def _candidate(tried: Tried, count: int, rivals: tuple[Tried, ...],
               values: Mapping[str, float] | None) -> Candidate:
    return Candidate(
        tried.effect, tried.state.effects[-1].values if values is None else values, tried.judged_error,
        p_value(tried.gain, tried.numbers, count), tried.whole_gain, tried.judged_gain,
        tuple(one.effect.name for one in rivals),
    )
