"""Maximum a posteriori fits: the car's numbers, the effects' numbers and the distance errors together.

Problem: twenty candidates are to be fitted in full, each together with a dozen numbers of the car and some hundred of
the distance errors, in seconds. Solution: what the numbers of the car and the distance errors do to a prediction hardly
depends on the candidate, so it is computed once for a model and kept while candidates are tried (``LinearModel``). Only
the effect's own slopes are taken anew in each of Levenberg and Marquardt's steps, and every step is judged by a true
prediction. Then the road is laid out anew where the distances are now, and weights and slopes follow the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.lag import followed_m
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.posterior import Posterior, State
from logger.vehicle.effect import Chosen
from logger.vehicle.effect_parameters import Move, coordinates_of, moved, moves_of, steps_of

Array = npt.NDArray[np.float64]

CONVERGED = 2.0
"""A round of a fit that gains less than this in minus twice a log-likelihood is its last."""
_ROUNDS, _STEPS, _ALIGNING_ROUNDS = 6, 5, 40
_WORTH_ALIGNING = 0.02
_SMALL_GAIN = 0.3
_KEPT_PROMISE = 0.7
_DAMPING, _MORE_DAMPING, _LARGEST_DAMPING, _RIDGE = 1e-4, 30.0, 100.0, 1e-12
# Slopes by the car's numbers are taken over so many of their deviations at most, once these are known.
_STEP_IN_DEVIATIONS = 5.0
_NEAR_M = 0.02
"""A model that lies no farther off than this, a quarter of the shortest wave at walking pace, is aligned to the same
places."""


@dataclass(frozen=True, eq=False)
class MapFit:
    """A fitted model, beside which it is linear.

    numbers    slopes by the car's numbers (p, n) per run, taken near it
    """

    linear: LinearModel
    numbers: list[Array]

    @property
    def posterior(self) -> Posterior:
        """Of which it is the most likely state."""
        return self.linear.posterior

    @property
    def state(self) -> State:
        """The model, laid out."""
        return self.linear.state


def fit(posterior: Posterior, state: State, numbers: list[Array] | None = None, rounds: int = _ROUNDS,
        worth: float = 0.0) -> MapFit:
    """A model fitted in full from a state, which is laid out.

    numbers    slopes by the car's numbers taken near the state; None: they are taken now
    worth      what a round has to gain to be worth another one, if that is more than ``CONVERGED``
    """
    fresh = numbers is None
    numbers = posterior.number_slopes(state, posterior.prior.steps) if numbers is None else numbers
    moves = moves_of(state.effects)
    best = now = LinearModel(posterior, state, numbers)
    least = best.score
    enough = max(CONVERGED, worth)
    for done in range(1, rounds + 1):
        trial = minimised(now, now.state, moves, _STEPS)
        now = laid_out(posterior, trial, numbers, least)
        gained = least - now.score
        if gained > 0:
            best, least = now, now.score
        if done == rounds or (gained < enough and fresh):
            break
        if gained < enough or done == 1:
            fresh, numbers = True, posterior.number_slopes(best.state, _fine_steps(best))
            now = best = LinearModel(posterior, best.state, numbers)
    return MapFit(best, numbers)


def laid_out(posterior: Posterior, state: State, numbers: list[Array] | None, least: float) -> LinearModel:
    """A state that was fitted to first order, laid out where its distances are; aligned anew where that is not as good
    as the least score so far, because they are far from where they were."""
    found = LinearModel(posterior, posterior.at(state.effects, state.logs, state.record, state.size), numbers)
    if found.score < least:
        return found
    there, _ = _aligned_from(posterior, found.state, _WORTH_ALIGNING)
    return LinearModel(posterior, there, numbers)


def aligned(posterior: Posterior, state: State, worth: float = 0.0) -> State:
    """A state with the distance errors alone fitted: from where it has them, or where the runs are followed along the
    road from there, whichever is likelier."""
    best, least = _aligned_from(posterior, state, worth)
    for _ in range(2):
        farther_m = [followed_m(run, one) for run, one in zip(posterior.runs.runs, best.predictions, strict=True)]
        if max(float(np.abs(one).max()) for one in farther_m) < _NEAR_M:
            break
        record = [error.through(error.moved_m(k) + more) for error, k, more in zip(
            posterior.record_errors, best.record, farther_m, strict=True)]
        there, score = _aligned_from(posterior, posterior.at(state.effects, state.logs, record, best.size), worth)
        if score > least - CONVERGED:
            break
        best, least = there, score
    return best


def _aligned_from(posterior: Posterior, state: State, worth: float) -> tuple[State, float]:
    now = LinearModel(posterior, state)
    best, least = now.state, now.score
    first = least
    for _ in range(_ALIGNING_ROUNDS):
        found = now.eliminated(now.state.predictions)
        now = LinearModel(posterior, posterior.at(state.effects, state.logs, found.record, now.size))
        gained = least - now.score
        if gained > 0:
            best, least = now.state, now.score
        if gained < max(CONVERGED, worth * (first - least)):
            break
    return best, least


def minimised(linear: LinearModel, state: State, moves: Sequence[Move], most: int) -> State:
    """Levenberg and Marquardt's steps on the effects' numbers that move and the car's, with the most likely distance
    errors to first order at each; at most so many."""
    predictions = _predicted(linear, state.effects, state.logs)
    effects, logs = state.effects, state.logs
    now = linear.objective(predictions, logs)
    damping, own = _DAMPING, None
    for _ in range(most):
        kept = own is not None
        if moves and own is None:
            own = linear.whitened(effect_slopes(linear, effects, logs, moves, predictions))
        information = linear.information(logs, own)
        information = information + _RIDGE * np.diag(np.maximum(np.diag(information), 1.0))
        gradient = linear.gradient(linear.eliminated(predictions).residuals, logs, own)
        gained = promised = 0.0
        while damping < _LARGEST_DAMPING:
            step = np.linalg.solve(information + damping * np.diag(np.diag(information)), gradient)
            promised = float(2 * gradient @ step - step @ information @ step)
            if promised < _SMALL_GAIN:
                break
            trial_logs = logs + step[: linear.count] if linear.count else logs
            trial = moved(effects, moves, coordinates_of(effects, moves) + step[linear.count:])
            there = _predicted(linear, trial, trial_logs)
            after = linear.objective(there, trial_logs)
            if after < now:
                gained, now = now - after, after
                effects, logs, predictions = trial, trial_logs, there
                damping = damping / _MORE_DAMPING
                break
            damping = max(damping * _MORE_DAMPING, _DAMPING)
        # Slopes that keep what they promise serve for the next step too; those that do not are taken anew.
        if gained < _KEPT_PROMISE * promised or gained < _SMALL_GAIN:
            own = None
        if gained < _SMALL_GAIN:
            if not kept:
                break
            damping = _DAMPING
    return State(effects, logs, linear.eliminated(predictions).record, linear.size, predictions)


def _predicted(linear: LinearModel, effects: Sequence[Chosen], logs: Array) -> list[Array]:
    return linear.posterior.predict(effects, logs, linear.state.record)


def effect_slopes(linear: LinearModel, effects: Sequence[Chosen], logs: Array, moves: Sequence[Move],
                  predictions: Sequence[Array]) -> list[Array]:
    """What the effects' numbers do to predictions, on the scales of the parameters: (m, n) per run."""
    here = coordinates_of(effects, moves)
    found = [np.empty((len(moves), len(one))) for one in predictions]
    for index, step in enumerate(steps_of(effects, moves)):
        there = here.copy()
        there[index] += step
        shifted = _predicted(linear, moved(effects, moves, there), logs)
        for column, high, low in zip(found, shifted, predictions, strict=True):
            column[index] = (high - low) / step
    return found


def _fine_steps(linear: LinearModel) -> Array:
    """Of the logarithms of the car's numbers (p,), by how well they are known."""
    sizes = np.sqrt(np.diag(linear.information(linear.state.logs)))
    return np.minimum(linear.posterior.prior.steps, _STEP_IN_DEVIATIONS / sizes)
