"""Models settled: fitted until little is gained any more, with slopes and weights that follow the fit."""

from __future__ import annotations

import numpy as np

from logger.lab.fitting import FIRST_DAMPING, LAST_DAMPING, Problem, Slopes, State, Weighed, improved, located
from logger.lab.noise import left_to_explain
from logger.vehicle.effect_parameters import moves_of

_STEPS, _SETTLED = 5, 2.0
_ALIGNING_ROUNDS = 60
WORTH_ALIGNING = 0.004
"""A round that gains a smaller share of what was gained is the last, where it is only to be told what is likelier."""


def aligned(problem: Problem, state: State, worth: float = 0.0) -> State:
    """The state with the wander of the distance alone fitted, until it lies as it can: that takes many rounds where it
    is far off, in which the car's numbers would be bent.

    worth    the share of what was gained so far that a round has to gain to be worth another one
    """
    numbers = len(state.logs)
    first = least = problem.deviance(state)
    for done in range(1, _ALIGNING_ROUNDS + 1):
        nothing = [np.zeros((numbers, len(prediction))) for prediction in state.predictions]
        slopes = Slopes(nothing, problem.wander_slopes(state), state.wander, state.names)
        weighed = Weighed(problem, slopes, problem.whiteners(state), still=True)
        # One step a round: slopes by the wander are cheaper than a simulation.
        trial = improved(weighed, state, [], 1, True, FIRST_DAMPING if done == 1 else LAST_DAMPING)
        gained = least - problem.deviance(trial)
        if gained > 0:
            least, state = least - gained, trial
        if gained < max(_SETTLED, worth * (first - least)):
            break
    return state


def settled(problem: Problem, state: State, rounds: int = 6, slopes: Slopes | None = None,
            worth: float = 0.0, beside: float | None = None) -> tuple[State, Slopes]:
    """A model fitted in full, its effects' numbers included: slopes and weights are taken anew until little is gained.

    slopes    taken near the state before; None: they are taken now
    worth     the share of what there is to explain that a round has to gain to be worth another one
    beside    deviance of a model without what is fitted: what was gained over it counts as to be explained too; None:
              only what is left does

    Returns the most likely state that was met, laid out, and slopes taken near it.
    """
    moves = moves_of(state.effects)
    state = problem.laid_out(state.effects, state.logs, state.wander)
    fresh, least = slopes is None or _serves(slopes, state), problem.deviance(state)
    slopes = slopes or problem.slopes(state)
    for done in range(1, rounds + 1):
        weighed = Weighed(problem, slopes, problem.whiteners(state))
        trial = improved(weighed, state, moves, _STEPS, True, FIRST_DAMPING if done == 1 else LAST_DAMPING)
        now = problem.deviance(trial)
        gained = least - now
        if gained > 0:  # else it was better by the weights of before
            least, state = now, trial
        if done == rounds or (fresh and gained < _enough(problem, state, slopes, worth, beside)):
            break
        fresh, slopes = True, problem.slopes(state, weighed.fine_steps)
    return state, slopes


def _serves(slopes: Slopes, state: State) -> bool:
    """Whether little is to be gained by others: not so where the model was another, or may have lain elsewhere."""
    return slopes.effects == state.names and not any(one.effect.realigns for one in state.effects)


def _enough(problem: Problem, state: State, slopes: Slopes, worth: float, beside: float | None) -> float:
    """What a round has to gain to be worth another one."""
    if worth == 0:
        return _SETTLED
    explained = 0.0 if beside is None else max(0.0, beside - problem.deviance(state))
    return max(_SETTLED, worth * (explained + left_to_explain(problem, located(problem, state, slopes))))
