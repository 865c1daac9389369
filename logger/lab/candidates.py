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

_STRONGEST, _WEAKEST = 10.0, 0.03
_STEPS = 5


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
class Trial:
    """An effect at one set of values, and what it would do.

    gain    how much of the weighed squares it would explain, with the car's numbers and the wander moved by ``step``
    step    (count,)
    """

    one: Chosen
    gain: float
    step: Array


@dataclass(frozen=True, eq=False)
class Screened:
    """Trials of an effect where fits may begin, the most promising first: the best of each choice that no fit moves."""

    effect: Effect
    trials: tuple[Trial, ...]

    @property
    def gain(self) -> float:
        """Of the most promising one."""
        return self.trials[0].gain


def screened(problem: Problem, base: Base, effect: Effect, seen: Misalignment) -> Screened:
    """Trials of an effect on a model."""
    best: dict[tuple[float, ...], Trial] = {}
    for values in effect.trials(seen):
        choice = tuple(values[parameter.name] for parameter in effect.parameters if parameter.choices)
        trial = _trial(problem, base, chosen(effect, values))
        if choice not in best or trial.gain > best[choice].gain:
            best[choice] = trial
    return Screened(effect, tuple(sorted(best.values(), key=lambda trial: -trial.gain)))


def as_screened(problem: Problem, base: Base, promise: Screened) -> Tried:
    """The model of ``base`` with an effect at its most promising trial, not fitted further."""
    trial = promise.trials[0]
    logs, wander = base.weighed.parted(base.weighed.joined(base.state) + trial.step)
    return _tried(problem, base, problem.predicted((*base.state.effects, trial.one), logs, wander, base.slopes))


def fitted(problem: Problem, base: Base, promise: Screened) -> Tried:
    """The model of ``base`` with an effect, fitted with all the others, on the slopes of ``base``."""
    tries = []
    for trial in promise.trials:
        effects = (*base.state.effects, trial.one)
        state = problem.predicted(effects, base.state.logs, base.state.wander, base.slopes)
        tries.append(_tried(problem, base, improved(base.weighed, state, moves_of(effects), _STEPS)))
    return max(tries, key=lambda one: one.gain)


def settled_further(problem: Problem, base: Base, one: Tried, rounds: int) -> Tried:
    """The same with slopes of its own."""
    return _tried(problem, base, settled(problem, one.state, rounds)[0])


def _tried(problem: Problem, base: Base, state: State) -> Tried:
    effect = state.effects[-1].effect
    numbers = sum(not parameter.choices for parameter in effect.parameters)
    seen = located(problem, state, base.slopes)
    return Tried(effect, state, base.fitted - problem.deviance(state),
                 base.judged - problem.deviance(seen, fitted=False), problem.judged_error(seen), numbers)


def _trial(problem: Problem, base: Base, one: Chosen) -> Trial:
    """A trial at the strength at which it explains most."""
    weighed, state = base.weighed, base.state
    there = problem.predicted((*state.effects, one), state.logs, state.wander, base.slopes)
    change = [whitener((new - old)[None]) for whitener, new, old in zip(
        weighed.whiteners, there.predictions, state.predictions, strict=True)]
    absorbed = base.uncertainty @ weighed.against(change)[:, 0]
    along = sum(float(c[0] @ r) for c, r in zip(change, base.left, strict=True))
    own = sum(float(c[0] @ c[0]) for c in change) - float(weighed.against(change)[:, 0] @ absorbed)
    if not own > 0:
        return Trial(one, 0.0, np.zeros_like(absorbed))
    strength = float(np.clip(along / own, _WEAKEST, _STRONGEST))
    scaled = _scaled(one, strength)
    if scaled is None:
        return Trial(one, 2 * along - own, -absorbed)
    return Trial(scaled, 2 * strength * along - strength**2 * own, -strength * absorbed)


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

