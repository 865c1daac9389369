"""One effect tried on a model: would it explain what the model leaves, and with which numbers?

Problem: most effects do nothing at their null and something quite different at each of their values, so that a slope at
zero strength says little about them (a shape such as a knee or a frequency has no meaning there). Solution: each is
simulated at a few trial values; what the car's own numbers and the wander of the distance could do as well is taken
out, and the trial that explains most, at the strength at which it explains most, is where a full fit begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.fitting import (
    Move,
    Problem,
    Slopes,
    State,
    Weighed,
    coordinates_of,
    improved,
    located,
    moved,
    moves_of,
    settled,
)
from logger.vehicle.effect import Chosen, Effect, Misalignment, chosen

Array = npt.NDArray[np.float64]

_STRONGEST, _WEAKEST = 3.0, 0.03
_FIRST_STEPS, _LAST_STEPS = 5, 4
_STARTS = 2
# A second start is followed too when its trial explains at least this share of what the best one does.
_SECOND_SHARE = 0.6


@dataclass(frozen=True, eq=False)
class Base:
    """A model that effects are tried on: its state, its slopes, and what it leaves in minus twice log-likelihoods of
    the stretches that were fitted (with what is off) and of those that judge.

    judged_error   of the stretches that no fit saw
    left           its weighed residuals
    uncertainty    (count, count) covariance of the car's numbers and the wander
    """

    state: State
    slopes: Slopes
    weighed: Weighed
    left: list[Array]
    uncertainty: Array
    fitted: float
    judged: float
    judged_error: float

    @staticmethod
    def of(problem: Problem, state: State, slopes: Slopes) -> Base:
        """From a state that was laid out, and slopes taken near it."""
        slopes = Slopes(slopes.columns, state.wander)  # so that the state is predicted as it was laid out
        weighed = Weighed(problem, slopes, problem.whiteners(state))
        uncertainty = np.asarray(np.linalg.inv(weighed.information), float)
        seen = located(problem, state, slopes)
        return Base(state, slopes, weighed, weighed.residual(state), uncertainty, problem.deviance(state),
                    problem.deviance(seen, fitted=False), problem.judged_error(seen))


@dataclass(frozen=True, eq=False)
class Tried:
    """A model with one more effect, fitted.

    gain, judged_gain    how much smaller minus twice the log-likelihood is, of the fitted stretches and of the others
    judged_error         of the stretches that no fit saw
    numbers              how many numbers of the effect were fitted
    """

    effect: Effect
    state: State
    gain: float
    judged_gain: float
    judged_error: float
    numbers: int

    @property
    def whole_gain(self) -> float:
        """Of all stretches."""
        return self.gain + self.judged_gain


@dataclass(frozen=True, eq=False)
class Screened:
    """What trials of an effect promise.

    starts    where fits begin, the most promising first
    gain      how much of the weighed squares the best would explain
    """

    effect: Effect
    starts: tuple[Chosen, ...]
    gain: float


def screened(problem: Problem, base: Base, effect: Effect, seen: Misalignment) -> Screened:
    """Trials of an effect on a model."""
    ranked: dict[tuple[float, ...], list[tuple[float, Chosen]]] = {}
    for values in effect.trials(seen):
        one = chosen(effect, values)
        choice = tuple(values[parameter.name] for parameter in effect.parameters if parameter.choices)
        ranked.setdefault(choice, []).append(_promised(problem, base, one))
    starts, best = [], -np.inf
    for group in ranked.values():
        group.sort(key=lambda pair: -pair[0])
        best = max(best, group[0][0])
        starts += [one for gain, one in group[:_STARTS] if gain >= _SECOND_SHARE * group[0][0]] or [group[0][1]]
    return Screened(effect, tuple(starts), best)


def fitted(problem: Problem, base: Base, promise: Screened, thoroughly: bool) -> Tried:
    """The model of ``base`` with an effect, fitted with all the others; else one step from its best start."""
    starts = promise.starts if thoroughly else promise.starts[:1]
    tries = [_fitted(problem, base, (*base.state.effects, start), thoroughly) for start in starts]
    return max(tries, key=lambda one: one.gain)


def settled_further(problem: Problem, base: Base, one: Tried, rounds: int) -> Tried:
    """The same with slopes of its own."""
    return _tried(problem, base, settled(problem, one.state, rounds)[0])


def _fitted(problem: Problem, base: Base, effects: tuple[Chosen, ...], thoroughly: bool) -> Tried:
    moves = moves_of(effects, None if thoroughly else [len(effects) - 1])
    state = problem.predicted(effects, base.state.logs, base.state.wander, base.slopes)
    state = improved(base.weighed, state, moves, _FIRST_STEPS if thoroughly else 1)
    if thoroughly:
        state = improved(Weighed(problem, base.slopes, problem.whiteners(state)), state, moves, _LAST_STEPS)
    return _tried(problem, base, state)


def _tried(problem: Problem, base: Base, state: State) -> Tried:
    effect = state.effects[-1].effect
    numbers = sum(not parameter.choices for parameter in effect.parameters)
    seen = located(problem, state, base.slopes)
    return Tried(effect, state, base.fitted - problem.deviance(state),
                 base.judged - problem.deviance(seen, fitted=False), problem.judged_error(seen), numbers)


def _promised(problem: Problem, base: Base, one: Chosen) -> tuple[float, Chosen]:
    """How much of the weighed squares a trial would explain, and the trial at the strength at which it does."""
    weighed, state = base.weighed, base.state
    there = problem.predicted((*state.effects, one), state.logs, state.wander, base.slopes)
    change = [whitener((new - old)[None]) for whitener, new, old in zip(
        weighed.whiteners, there.predictions, state.predictions, strict=True)]
    mixed = weighed.against(change)[:, 0]
    along = sum(float(c[0] @ r) for c, r in zip(change, base.left, strict=True))
    own = sum(float(c[0] @ c[0]) for c in change) - float(mixed @ base.uncertainty @ mixed)
    if not own > 0:
        return 0.0, one
    strength = float(np.clip(along / own, _WEAKEST, _STRONGEST))
    scaled = _scaled(one, strength)
    if scaled is None:
        return 2 * along - own, one
    return 2 * strength * along - strength**2 * own, scaled


def _scaled(one: Chosen, strength: float) -> Chosen | None:
    """The effect at a share of its strength: of the way from its null to where it stands; None if it has no null."""
    for place, parameter in enumerate(one.effect.parameters):
        if parameter.null is None or parameter.choices:
            continue
        move = Move(0, place)
        null = 0.0 if np.isinf(parameter.null) else parameter.coordinate(parameter.null)
        here = float(coordinates_of([one], [move])[0])
        return moved([one], [move], np.array([null + strength * (here - null)]))[0]
    return None


def misalignment(problem: Problem, state: State) -> Misalignment:
    """By how much windows of the measurement have to be moved against the model to fit it best."""
    shifts: list[tuple[float, float, float]] = []
    for run, predicted in zip(problem.runs.runs, state.predictions, strict=True):
        shifts += _window_shifts(run.measured_mps2, predicted, run.distance_m, run.speed_mps, run.rate_hz, run.first)
    if len(shifts) < _FEWEST_WINDOWS:
        return Misalignment(1.0, 0.0)
    shift_m, distance_m, speed_mps = np.array(shifts).T
    far = distance_m > 0.25 * distance_m.max()
    per_metre = float(np.median(shift_m[far] / distance_m[far])) if far.any() else 0.0
    return Misalignment(1 / (1 + per_metre), float(np.median(-shift_m / speed_mps)))


_WINDOW_S, _LONGEST_LAG_S, _ALIKE, _FEWEST_WINDOWS = 5.0, 4.0, 0.5, 3


def _window_shifts(measured: Array, predicted: Array, distance_m: Array, speed_mps: Array, rate_hz: float,
                   first: int) -> list[tuple[float, float, float]]:
    """Of each window that resembles the model somewhere: how much farther the car was [m], its distance and speed."""
    size, lag = round(_WINDOW_S * rate_hz), round(_LONGEST_LAG_S * rate_hz)
    found = []
    for start in range(first, len(measured) - size + 1, size):
        window = measured[start : start + size]
        low, high = max(0, start - lag), min(len(predicted), start + size + lag)
        around = predicted[low:high]
        products = np.correlate(around, window, "valid")
        sums = np.concatenate([[0.0], np.cumsum(around**2)])
        norms = np.sqrt(np.maximum(sums[size:] - sums[:-size], 1e-300) * (window @ window + 1e-300))
        alike = products / norms
        top = int(np.argmax(alike))
        middle = start + size // 2
        if alike[top] < _ALIKE or speed_mps[middle] < 1.0 or not 0 < top < len(alike) - 1:
            continue
        bend = alike[top - 1] - 2 * alike[top] + alike[top + 1]
        fine = 0.5 * (alike[top - 1] - alike[top + 1]) / bend if bend < 0 else 0.0
        ahead_s = (low + top + fine - start) / rate_hz
        found.append((float(ahead_s * speed_mps[middle]), float(distance_m[middle]), float(speed_mps[middle])))
    return found

