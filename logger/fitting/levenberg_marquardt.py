"""Levenberg and Marquardt's steps on normal equations.

Problem: fits here have hundreds of numbers of which most are known by a prior, derivatives that take as long as a fit
may, and bounds. ``scipy.optimize.least_squares`` wants residuals and a Jacobian of them all, for each step.
Solution: a fit gives its cost and its normal equations, however it comes to them. Steps are damped by the diagonal
(D. W. Marquardt 1963); a number that would go beyond a bound stays there, and the others take that into account; and
derivatives serve on for as long as steps gain what was predicted, which is for the fit to make use of: a minimum is
believed only with fresh ones.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from logger.arrays import Array, Bools

_KEPT_SHARE = 0.7
_LEAST_THAT_DAMPS = 1e-4


class Evaluated(Protocol):
    """What a fit makes of a point. ``cost`` is half a sum of squares, or what is minimised in its place."""

    @property
    def cost(self) -> float: ...


E = TypeVar("E", bound=Evaluated)


@dataclass(frozen=True)
class Damping:
    """How far steps are damped: shares of the diagonal of the information.

    first      at the beginning, and when derivatives have been taken again
    least      that is left far into a fit; small, or nothing would move along with what makes up for it
    largest    beyond which no step is tried
    factor     less after a step that was taken, more after one that was not
    """

    first: float = 1e-3
    least: float = 1e-9
    largest: float = 100.0
    factor: float = 30.0


@dataclass(frozen=True, eq=False)
class Minimum(Generic[E]):
    """Where a minimisation ended.

    x              (k,)
    at             what was made of that point
    information    (k, k) of the normal equations that were solved last
    rounds         normal equations that were solved
    converged      whether no step was predicted to gain more
    """

    x: Array
    at: E
    information: Array
    rounds: int
    converged: bool


def minimise(
    start: Array, evaluate: Callable[[Array], E], normal_equations: Callable[[Array, E, bool], tuple[Array, Array]], *,
    small_gain: Callable[[E], float], most_rounds: int, keep_derivatives: bool = True,
    low: Array | float = -np.inf, high: Array | float = np.inf, longest_step: float = np.inf,
    damping: Damping = Damping(),
) -> Minimum[E]:
    """The point that a cost is least at, downhill from a start (k,).

    evaluate            of a point (k,); its cost may be infinite or NaN where there is none
    normal_equations    of a point, what was made of it, and whether derivatives are to be taken again: downhill
                        direction g (k,) and information H (k, k), so that a step s changes the cost by s H s / 2 - g s
    small_gain          in cost: what gains less or promises less is not worth a step
    keep_derivatives    ask for fresh ones only after a step that gained less than predicted; False: always
    low, high           bounds (k,), or of all
    longest_step        of any coordinate
    """
    x = np.clip(start, low, high)
    at, share, fresh = evaluate(x), damping.first, True
    rounds = 0
    information = np.empty((len(x), len(x)))
    for rounds in range(1, most_rounds + 1):
        downhill, information = normal_equations(x, at, fresh)
        free = ~(((x <= low) & (downhill < 0)) | ((x >= high) & (downhill > 0)))
        gained = predicted_gain = 0.0
        while share <= damping.largest:
            step = _step_within(low - x, high - x, downhill, information, free, share, longest_step)
            reached = np.clip(x + step, low, high)
            predicted_gain = float(downhill @ step - 0.5 * step @ information @ step)
            if not predicted_gain >= small_gain(at):
                break
            new = evaluate(reached)
            if at.cost - new.cost > 0:
                gained = at.cost - new.cost
                x, at, share = reached, new, max(share / damping.factor, damping.least)
                break
            share = max(share * damping.factor, _LEAST_THAT_DAMPS)
        was_fresh, fresh = fresh, not keep_derivatives or gained < _KEPT_SHARE * predicted_gain
        if gained < small_gain(at):
            if was_fresh:
                return Minimum(x, at, information, rounds, True)
            fresh, share = True, damping.first
    return Minimum(x, at, information, rounds, False)


def _step_within(low: Array, high: Array, downhill: Array, information: Array, free: Bools,
                 damping: float, longest: float) -> Array:
    """The damped step (k,) of the numbers that are free to move, within bounds on it (k,): where a number would go
    beyond one it goes up to there, and the others go where they are best then."""
    free, ended = free.copy(), np.zeros_like(downhill)
    while True:
        step = ended + _step(downhill - information @ ended, information, free, damping, longest)
        beyond = free & ((step < low) | (step > high))
        if not beyond.any():
            return step
        ended[beyond] = np.clip(step, low, high)[beyond]
        free &= ~beyond


def _step(downhill: Array, information: Array, free: Bools, damping: float, longest: float) -> Array:
    """The damped step (k,) of the numbers that are free to move."""
    step = np.zeros_like(downhill)
    size = np.diag(information)[free]
    damped = information[np.ix_(free, free)] + damping * np.diag(np.where(size > 0, size, 1.0))
    step[free] = np.linalg.solve(damped, downhill[free])
    return step * min(1.0, longest / max(float(np.abs(step).max(initial=0.0)), 1e-300))
