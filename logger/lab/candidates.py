"""One effect tried on a model: would it explain what the model leaves, and with which numbers?

Problem: most effects do nothing at their null and something quite different at each of their values, so that a slope at
zero strength says little about them (a shape such as a knee or a frequency has no meaning there). Solution: each is
simulated at a few trial values; what the car's own numbers and the wander of the distance could do as well is taken
out, and the trial that explains most, at the strength at which it explains most, is where a full fit begins.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import numpy.typing as npt

from logger.lab.fitting import Problem, Slopes, State, Weighed, improved, located
from logger.lab.noise import left_to_explain
from logger.lab.settling import WORTH_ALIGNING, aligned, settled
from logger.lab.wandering import far
from logger.runs import Run
from logger.vehicle.effect import Chosen, Effect, Misalignment, Scale, chosen
from logger.vehicle.effect_parameters import Move, coordinates_of, moved, moves_of
from logger.vehicle.named_parameters import read

Array = npt.NDArray[np.float64]

# How much stronger or weaker than in a trial an effect is taken to be; what moves all waves alike may be tried with
# next to nothing.
_STRONGEST, _STRONGEST_IF_IT_REALIGNS, _WEAKEST = 10.0, 1000.0, 0.03
_STEPS, _ROUNDS = 5, 4
TOLD_APART = 10.0
"""Gains that differ by less do not tell two effects apart."""
_ALIKE_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class Base:
    """A model that effects are tried on: its state, its slopes, and what it leaves in minus twice log-likelihoods of
    the stretches that were fitted (with what is off) and of those that judge.

    judged_error   of the stretches that no fit saw
    left           weighed residuals that it leaves
    rough          predictions of a rough simulation, for comparing with others
    objective      squares of the weighed residuals that the whole model leaves, and the cost of what is off
    cost           the latter alone
    ahead          what that falls by when numbers that an effect sets go back to what was given (``without``)
    uncertainty    (count, count) covariance of the car's numbers and the wander
    pull           (count,) what is left of the way to where these fit best
    """

    state: State
    slopes: Slopes
    weighed: Weighed
    rough: list[Array]
    left: list[Array]
    objective: float
    cost: float
    ahead: float
    uncertainty: Array
    pull: Array
    fitted: float
    judged: float
    judged_error: float
    unexplained: float

    @staticmethod
    def of(problem: Problem, state: State, slopes: Slopes) -> Base:
        """From a state that was laid out, and slopes taken near it."""
        slopes = slopes.around(state)
        weighed = Weighed(problem, slopes, problem.whiteners(state))
        uncertainty = np.asarray(np.linalg.inv(weighed.information_at(state)), float)
        left = weighed.residual(state)
        seen = located(problem, state, slopes)
        return Base(state, slopes, weighed, _roughly(problem, state, slopes), left, weighed.objective(state),
                    problem.cost(state), 0.0, uncertainty, uncertainty @ weighed.gradient(state, left),
                    problem.deviance(state), problem.deviance(seen, fitted=False), problem.judged_error(seen),
                    left_to_explain(problem, seen))

    def without(self, problem: Problem, names: Sequence[str]) -> Base:
        """The same with some of the car's numbers as they were given, to stay there: for effects that set them. What it
        leaves is still what the whole model leaves."""
        away = [problem.nuisance.names.index(name) for name in names if name in problem.nuisance.names]
        if not away:
            return self
        logs = self.state.logs.copy()
        logs[away] = 0.0
        numbers = [one.copy() for one in self.slopes.numbers]
        for one in numbers:
            one[away] = 0.0
        slopes = replace(self.slopes, numbers=numbers)
        state = problem.predicted(self.state.effects, logs, self.state.wander, slopes)
        weighed = Weighed(problem, slopes, self.weighed.whiteners)
        uncertainty = np.asarray(np.linalg.inv(weighed.information_at(state)), float)
        left = weighed.residual(state)
        gradient = weighed.gradient(state, left)
        pull = uncertainty @ gradient
        within_reach = gradient @ pull - self.weighed.gradient(self.state, self.left) @ self.pull
        return replace(self, state=state, slopes=slopes, weighed=weighed, rough=_roughly(problem, state, slopes),
                       left=left, uncertainty=uncertainty, pull=pull,
                       ahead=self.objective - weighed.objective(state) + float(within_reach))

    def left_by(self, better: Base) -> float:
        """What it leaves more than a better model does, of all stretches."""
        return self.fitted + self.judged - better.fitted - better.judged


@dataclass(frozen=True, eq=False)
class Tried:
    """A model with one more effect, fitted.

    gain, judged_gain    how much smaller minus twice the log-likelihood is, of the fitted stretches and of the others
    judged_error         of the stretches that no fit saw
    numbers              how many numbers of the effect were fitted
    starts               at how many values it was tried
    eased                how much less the car's numbers and the wander are off by than without it, in cost
    slopes               taken near the state, or before the effect
    """

    effect: Effect
    state: State
    gain: float
    judged_gain: float
    judged_error: float
    numbers: int
    starts: int
    eased: float
    slopes: Slopes

    @property
    def whole_gain(self) -> float:
        """Of all stretches."""
        return self.gain + self.judged_gain


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect at one set of values, and what it would do.

    gain     how much of the weighed squares it would explain, with the car's numbers and the wander where they then are
    joined   (count,) these
    """

    one: Chosen
    gain: float
    joined: Array


@dataclass(frozen=True, eq=False)
class Screened:
    """Trials of an effect where fits may begin, the most promising first: the best of each choice that no fit moves, of
    ``count`` that were made."""

    effect: Effect
    trials: tuple[Trial, ...]
    count: int

    @property
    def gain(self) -> float:
        """Of the most promising one."""
        return self.trials[0].gain


def _roughly(problem: Problem, state: State, slopes: Slopes) -> list[Array]:
    return problem.predicted(state.effects, state.logs, state.wander, slopes, rough=True).predictions


def screened(problem: Problem, base: Base, effect: Effect, seen: Misalignment) -> Screened:
    """Trials of an effect on a model."""
    trials = effect.trials(seen)
    known = [one for one in effect.parameters if one.name in effect.replaces and one.name in problem.nuisance.names]
    if known:  # where a fit has brought the car's own numbers is worth a trial
        car = problem.nuisance.vehicle(problem.vehicle, base.state.logs)
        trials.append(trials[0] | {one.name: min(max(read(car, one.name), one.low), one.high) for one in known})
    base = base.without(problem, effect.replaces)
    best: dict[tuple[float, ...], Trial] = {}
    astray = effect.realigns and far(problem, base.state)
    lying: State | None = None
    for values in trials:
        choice = tuple(values[parameter.name] for parameter in effect.parameters if parameter.choices)
        one = chosen(effect, values)
        found = [_trial(problem, base, one)]
        if effect.realigns:
            found.append(_of(base, _as_given(problem, base, one)))
        if astray and values is not trials[0]:
            lying = _aligned(problem, base, one, lying)
            found.append(_of(base, lying))
        trial = max(found, key=lambda one: one.gain)
        if choice not in best or trial.gain > best[choice].gain:
            best[choice] = trial
    return Screened(effect, tuple(sorted(best.values(), key=lambda trial: -trial.gain)), len(trials))


def as_screened(problem: Problem, base: Base, promise: Screened) -> list[Tried]:
    """The model of ``base`` with an effect at its most promising trial, not fitted further."""
    base = base.without(problem, promise.effect.replaces)
    trial = promise.trials[0]
    logs, wander = base.weighed.parted(trial.joined)
    state = problem.predicted((*base.state.effects, trial.one), logs, wander, base.slopes)
    return [_tried(problem, base, state, base.slopes, promise.count)]


def fitted(problem: Problem, base: Base, promise: Screened, worth: float = 0.0) -> list[Tried]:
    """The model of ``base`` with an effect, fitted with all the others, on the slopes of ``base``: one for each choice
    that no fit moves.

    worth    as ``settled`` has it, for an effect that takes slopes of its own
    """
    tries = []
    base = base.without(problem, promise.effect.replaces)
    for trial in promise.trials:
        effects = (*base.state.effects, trial.one)
        if trial.one.effect.realigns:  # the slopes of a model that lies elsewhere are worth nothing
            start = problem.laid_out(effects, *base.weighed.parted(trial.joined))
            found = settled(problem, start, _ROUNDS, worth=worth, beside=base.fitted)
            tries.append(_tried(problem, base, *found, promise.count))
            continue
        state = problem.predicted(effects, *base.weighed.parted(trial.joined), base.slopes)
        better = improved(base.weighed, state, moves_of(effects), _STEPS)
        tries.append(_tried(problem, base, better, base.slopes, promise.count))
    return tries


def alike_within(gain: float) -> float:
    """Gains that differ from this one by less do not tell another effect from that which has it."""
    return max(TOLD_APART, _ALIKE_SHARE * gain)


def best_choice(tries: Sequence[Tried]) -> Tried:
    """Of one effect with other choices, the likeliest; that which promised most unless another is clearly so."""
    return max(tries, key=lambda one: one.whole_gain + (TOLD_APART if one is tries[0] else 0.0))


def every_choice(one: Chosen) -> list[Chosen]:
    """An effect at its values, with each of the choices that no fit moves, its own first."""
    choices = {parameter.name: parameter.choices for parameter in one.effect.parameters if parameter.choices}
    own = tuple(one.values[name] for name in choices)
    picked = sorted(product(*choices.values()), key=lambda values: values != own)
    return [replace(one, values={**one.values, **dict(zip(choices, values, strict=True))}) for values in picked]


def settled_further(problem: Problem, base: Base, one: Tried, rounds: int, worth: float = 0.0) -> Tried:
    """The same with slopes of its own; until it gains by them, those that it was fitted with serve."""
    return _tried(problem, base, *settled(problem, one.state, rounds, one.slopes, worth, base.fitted), one.starts)


def simpler(one: Tried, effects: Sequence[Effect]) -> list[Effect]:
    """Effects that have some of the numbers of the one that was tried, by their names, and no others: each may explain
    the same where that one does, and be missed elsewhere."""
    own = {parameter.name for parameter in one.effect.parameters}
    return [effect for effect in effects
            if effect.parameters and {parameter.name for parameter in effect.parameters} < own
            and not any(parameter.choices for parameter in effect.parameters)]


def in_place_of(problem: Problem, base: Base, one: Tried, counts: Mapping[str, int], worth: float,
                effect: Effect) -> Tried:
    """The model with a simpler effect, begun at the numbers of the one that was tried.

    counts    at how many values each effect was tried before, by name
    worth     as ``settled`` has it
    """
    values = one.state.effects[-1].values
    there = chosen(effect, {each.name: min(max(values[each.name], each.low), each.high) for each in effect.parameters})
    start = problem.laid_out((*one.state.effects[:-1], there), one.state.logs, one.state.wander)
    found = settled(problem, start, _ROUNDS, worth=worth, beside=base.fitted)
    return _tried(problem, base, *found, counts[effect.name] + 1)


def _tried(problem: Problem, base: Base, state: State, slopes: Slopes, starts: int) -> Tried:
    effect = state.effects[-1].effect
    numbers = sum(parameter.moves for parameter in effect.parameters)
    seen = located(problem, state, slopes)
    return Tried(
        effect, state, base.fitted - problem.deviance(state), base.judged - problem.deviance(seen, fitted=False),
        problem.judged_error(seen), numbers, starts, base.cost - problem.cost(state), slopes,
    )


def _trial(problem: Problem, base: Base, one: Chosen) -> Trial:
    """A trial at the strength at which it explains most."""
    weighed, state = base.weighed, base.state
    here = weighed.joined(state) + base.pull
    there = problem.predicted((*state.effects, one), state.logs, state.wander, base.slopes, rough=True)
    change = [whitener((new - old)[None]) for whitener, new, old in zip(
        weighed.whiteners, there.predictions, base.rough, strict=True)]
    mixed = weighed.against(change)[:, 0]
    absorbed = base.uncertainty @ mixed
    along = sum(float(c[0] @ r) for c, r in zip(change, base.left, strict=True)) - float(mixed @ base.pull)
    own = sum(float(c[0] @ c[0]) for c in change) - float(mixed @ absorbed)
    if not own > 0:
        return Trial(one, base.ahead, here)
    strongest = _STRONGEST_IF_IT_REALIGNS if one.effect.realigns else _STRONGEST
    strength = float(np.clip(along / own, -strongest if one.effect.realigns else _WEAKEST, strongest))
    scaled = scaled_by(one, strength)
    whole = Trial(one, base.ahead + 2 * along - own, here - absorbed)
    if scaled is None:
        return whole
    shared = Trial(scaled, base.ahead + 2 * strength * along - strength**2 * own, here - strength * absorbed)
    if not any(parameter.scale is Scale.RECIPROCAL for parameter in one.effect.parameters):
        return shared
    # A resonance that is half as strong lies elsewhere, and may do something else altogether.
    return max((_as_predicted(problem, base, trial) for trial in (shared, whole)), key=lambda trial: trial.gain)


def _as_predicted(problem: Problem, base: Base, trial: Trial) -> Trial:
    """The same with the gain that it truly has, the car's numbers and the wander counted to first order: sensors are
    tried on one body then."""
    weighed, state = base.weighed, base.state
    there = problem.predicted((*state.effects, trial.one), state.logs, state.wander, base.slopes)
    moved_by = trial.joined - weighed.joined(state)
    left = [one - moved_by[place] @ white
            for one, white, place in zip(weighed.residual(there), weighed.white, weighed.places, strict=True)]
    squares = sum(float(one @ one) for one in left) + problem.cost_of(*weighed.parted(trial.joined))
    return Trial(trial.one, base.objective - squares, trial.joined)


def _as_given(problem: Problem, base: Base, one: Chosen) -> State:
    """A trial of the car as it was given: where positions are wrong, what was fitted before is worth nothing."""
    return problem.laid_out((*base.state.effects, one), *base.weighed.parted(np.zeros(base.weighed.count)))


def _aligned(problem: Problem, base: Base, one: Chosen, nearby: State | None) -> State:
    """A trial of the car as it is, aligned anew from the runs as they are or from where another trial lies: where a
    wander that is hardly granted puts positions right, others do with the effect."""
    effects = (*base.state.effects, one)
    starts = [problem.unmoved(effects, base.state.logs)]
    if nearby is not None:
        starts.append(problem.laid_out(effects, base.state.logs, nearby.wander))
    return aligned(problem, min(starts, key=problem.deviance), WORTH_ALIGNING)


def _of(base: Base, state: State) -> Trial:
    """A state, whose last effect is tried, as a trial."""
    return Trial(state.effects[-1], base.objective - base.weighed.objective(state), base.weighed.joined(state))


def scaled_by(one: Chosen, strength: float) -> Chosen | None:
    """The effect at a share of its strength: of the way from its null to where it stands; None if it has no null."""
    for place, parameter in enumerate(one.effect.parameters):
        if parameter.null is None or not parameter.moves:
            continue
        move = Move(0, place)
        null = 0.0 if np.isinf(parameter.null) else parameter.coordinate(parameter.null)
        here = float(coordinates_of([one], [move])[0])
        return moved([one], [move], np.array([null + strength * (here - null)]))[0]
    return None


def misalignment(problem: Problem, state: State) -> Misalignment:
    """How the runs would have to be moved against the model to fit it best: all of them by one factor of their
    distance, or by one time. Both are looked for in the slow part of the motion, whose waves are long."""
    pairs: list[tuple[Run, Array, Array]] = []
    for run, predicted in zip(problem.runs.runs, state.predictions, strict=True):
        size = max(1, round(_SMOOTH_S * run.rate_hz))
        hat = np.hanning(size + 2)[1:-1]
        slow = [np.convolve(one, hat / hat.sum(), "same") for one in (run.measured_mps2, predicted)]
        pairs.append((run, slow[0], slow[1]))

    def alike(scale: float, delay_s: float) -> float:
        """Products of the measurement and the model, moved, over what they are at most."""
        both = of = 0.0
        for run, measured, predicted in pairs:
            time_s = np.arange(run.count) / run.rate_hz
            rising = np.maximum.accumulate(run.distance_m) + 1e-9 * time_s
            at_s = np.interp(run.distance_m / scale, rising, time_s) - delay_s
            moved_mps2 = np.interp(at_s, time_s, predicted)[run.first:]
            kept = measured[run.first:]
            both += float(kept @ moved_mps2)
            of += float(np.sqrt((kept @ kept) * (moved_mps2 @ moved_mps2)))
        return both / of if of > 0 else 0.0

    still = alike(1.0, 0.0)
    scales = 1 + _scanned(lambda off: alike(1 + off, 0.0), _WIDEST, _SCALE_STEP)
    delay_s = _scanned(lambda off: alike(1.0, off), _LATEST_S, _DELAY_STEP_S)
    return Misalignment(scales if alike(scales, 0.0) > still else 1.0, delay_s if alike(1.0, delay_s) > still else 0.0)


_SMOOTH_S = 0.2
_WIDEST, _SCALE_STEP, _LATEST_S, _DELAY_STEP_S = 0.08, 5e-4, 1.5, 0.02


def _scanned(alike: Callable[[float], float], reach: float, step: float) -> float:
    """Where something is largest between -reach and reach, looked for in steps and then in tenths of a step."""
    count = round(reach / step)
    middle = max((step * k for k in range(-count, count + 1)), key=alike)
    return max((middle + 0.1 * step * k for k in range(-10, 11)), key=alike)
