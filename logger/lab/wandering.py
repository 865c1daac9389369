"""By how much the distances of some runs wander: no more than it takes to lay the runs where they were driven.

Problem: one recorder's distance is right to millimetres after a minute, another integrates a speed that is off by some
centimetres a second, now more and now less. A lab that grants only the little takes the much for missing physics, and
one that grants the much lets it swallow effects. Solution: the runs are followed along the road as a model goes there,
and laid out with a usual and with a larger wander. The one with more evidence is taken: the likelihood with the wander
integrated out, by Laplace's approximation (D. J. C. MacKay, Neural Computation 4, 1992). If that is the larger one, its
size is found anew from the wander itself, the runs get the distances that they then have, and what is left to wander is
as usual. Runs that each have a factor and a start of their own are laid by these. One wrong factor or one late clock of
all runs stays for the effects to explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.lab.alignment import followed_m
from logger.lab.fitting import Problem, State, wander_seen
from logger.lab.nuisance import Tolerance, Wander
from logger.lab.settling import WORTH_ALIGNING, aligned
from logger.runs import Run
from logger.simulation.simulated_runs import SimulatedRuns

Array = npt.NDArray[np.float64]

_SMALL, _LARGE = (0.012, 1.0), (0.03, 0.5)
"""Wanders after one second [m], and how far apart their knots are [s]."""
_CLOSE_S, _TIMES_SIZED = 0.25, 2
"""How close knots are in the end, and how often the size is found anew with them, at most."""
_MOST_KNOTS, _MOST_KNOTS_BY_SAMPLES = 3000, 1.5e7
"""Runs that have more, together, are too long for so close knots: they would take too much memory."""
_ANY_SCALE, _ANY_START_M = 0.05, 3.0
ASTRAY = 0.7
"""A model with a larger error, so that it explains less than half of the power, may lie elsewhere than the runs do."""
_SMOOTH_S = 1.0
_CLEARLY, _MUCH = 20.0, 500.0
"""What a larger wander, or a factor or delay for all runs, has to gain in minus twice the logarithm of likelihood; and
what such a one has to gain beside a larger wander, as a model that lacks something seems early or late as well."""
_PROMISING = 0.4
_TOO_FAR = 3.0
"""A factor or a start of a run that is off by more deviations of what is granted asks for a look."""
_FOLLOWED = 3  # times: windows that were lost are found once those around them lie right
_NEAR_M = 0.02
"""A model that lies no farther off than this, a quarter of the shortest wave at walking pace, is aligned to the same
places."""


@dataclass(frozen=True, eq=False)
class _Laid:
    """A problem on all stretches with a size of wander, the model where its runs lie then, and what is known of the
    wander of each (k, k)."""

    problem: Problem
    state: State
    information: list[Array]

    @staticmethod
    def of(problem: Problem, state: State) -> _Laid:
        """A model that is aligned with the runs."""
        return _Laid(problem, state, [one for _, one in wander_seen(problem, state, problem.wander_slopes(state))])

    @property
    def lost(self) -> float:
        """What evidence it lacks: minus twice its logarithm, but for a constant."""
        return self.problem.deviance(self.state) + sum(map(_price, self.problem.wander, self.information))

    @property
    def wander_m(self) -> float:
        """The size of the wander by what is known of it: what it does after one second [m] (a step of expectation and
        maximisation: A. P. Dempster, N. M. Laird, D. B. Rubin, Journal of the Royal Statistical Society B 39, 1977)."""
        squares = seconds = 0.0
        for wander, k, run, information in zip(self.problem.wander, self.state.wander, self.problem.runs.runs,
                                               self.information, strict=True):
            steps = np.diff(np.eye(wander.knots, wander.count), axis=0)
            squares += float(((steps @ k) ** 2).sum() + (steps @ np.linalg.inv(information) * steps).sum())
            seconds += (run.count - 1) / run.rate_hz
        return float(np.sqrt(squares / seconds))

    @property
    def places(self) -> list[Array]:
        """Where the model lies beside the runs (n,) [m]."""
        return _places(self.problem, self.state)


def lying(problem: Problem, state: State) -> tuple[Problem, State]:
    """The problem with its runs about where they lie beside a model as it was given, and the model there: near enough
    for it to be refitted there, and the runs laid anew beside that."""
    there = aligned_anew(problem, state)
    laid = relaid(problem, there, problem, roughly=True)
    return (problem, there) if laid is problem else (laid, aligned_anew(laid, state))


def aligned_anew(problem: Problem, state: State) -> State:
    """A model aligned with runs from where they have it, or where they are followed along the road from there."""
    return aligned(problem, _followed(problem, state, _places(problem)))


def relaid(problem: Problem, state: State, recorded: Problem, roughly: bool = False) -> Problem:
    """The problem with its runs where they lie beside a model, if their distances wander by more than is granted; else
    as they were recorded. The problem itself if it is good enough.

    state       laid out where it lies in the problem
    recorded    the problem with the runs where they were recorded
    roughly     where the larger of two wanders has them, however close its knots should be
    """
    # Runs that were laid beside a model that lacked more are looked at again in any case.
    may_wander = problem is not recorded or problem.judged_error(state) >= ASTRAY or _promises(problem, state)
    if not may_wander and not far(problem, state):
        return problem
    sizes = (_LARGE, _SMALL) if may_wander else ()
    own = _best_size(recorded, state, _places(problem, state), sizes, 0 if roughly else _TIMES_SIZED)
    if not _wanders(recorded, own) and not far(own.problem, own.state):
        return recorded
    places = _where_driven(recorded, state, own if roughly else _finished(own))
    return recorded if places is None else _at(recorded, places)


def _wanders(recorded: Problem, own: _Laid) -> bool:
    """Whether a larger wander than the usual one was found."""
    return own.problem.tolerance != recorded.tolerance


def _where_driven(recorded: Problem, state: State, own: _Laid) -> list[Array] | None:
    """Where the runs were driven (n,) [m], by a model laid out with the size of wander that they have; None: where they
    were recorded, for all that can be told.

    One factor or one delay of all runs may be what seems to wander, or be there besides; or each run has its own. A
    model that lacks something seems late in all runs as well, so that a delay beside a wander has to gain much.
    """
    wanders, usual = _wanders(recorded, own), recorded.tolerance
    each = _finished(_laid(own.problem.granting(_anywhere(own.problem.tolerance)), own.state, own.places))
    factor, delay = _common(usual, each)
    common = each.problem.moved_m([one + other for one, other in zip(factor, delay, strict=True)])
    unmoved = _over(recorded, common).granting(usual)
    if _finished(_laid(unmoved, state, _places(unmoved))).lost < (own if wanders else each).lost - _CLEARLY:
        return None
    if each.lost < own.lost - (_MUCH if wanders else _CLEARLY):
        return [place - one for place, one in zip(each.places, common, strict=True)]
    if not wanders:
        return None
    return [place - one for place, one in zip(own.places, own.problem.moved_m(factor), strict=True)]


def far(problem: Problem, state: State) -> bool:
    """Whether a model lies so that a run's factor or start is farther off than is likely by what is granted."""
    return any(abs(k[wander.knots]) > _TOO_FAR * problem.tolerance.scale or abs(k[0]) > _TOO_FAR *
               problem.tolerance.start_m for wander, k in zip(problem.wander, state.wander, strict=True))


def _over(problem: Problem, farther_m: Sequence[Array]) -> Problem:
    """The problem with its runs farther than they were by these (n,) [m]."""
    return _at(problem, [run.distance_m + one for run, one in zip(problem.runs.runs, farther_m, strict=True)])


def _at(problem: Problem, distances_m: Sequence[Array]) -> Problem:
    """The problem with other distances (n,) of its runs [m]."""
    runs = [replace(run, distance_m=one) for run, one in zip(problem.runs.runs, distances_m, strict=True)]
    return problem.over(SimulatedRuns(runs, problem.runs.fine_hz))


def moved_m(recorded: Problem, problem: Problem) -> float:
    """By how much the runs of a problem lie elsewhere than they were recorded, at most [m]."""
    return max(float(np.abs(one.distance_m - other.distance_m).max())
               for one, other in zip(problem.runs.runs, recorded.runs.runs, strict=True))


def told(farther_m: float) -> list[str]:
    """What a person should know of runs that were laid elsewhere, by so much at most [m]."""
    if farther_m == 0:
        return []
    return ["The distances of these runs are off by more than usual: the runs were laid where the model finds them, up "
            f"to {farther_m:.2g} m from where they were recorded."]


def too_long(problem: Problem) -> list[str]:
    """What a person should know of runs that are too long to ask whether their distances wander."""
    if _in_reach(problem, _SMALL[1]):
        return []
    return ["These runs are too long, together, to ask whether their distances wander by more than usual: cut them, or "
            "take fewer, if the distance signal is no better than a car's speedometer."]


def _promises(problem: Problem, state: State) -> bool:
    """Whether a larger wander may well be worth it, and more so than a factor and a start of each run, to first order:
    that takes no simulation."""
    usual = problem.tolerance
    likely, moved = False, _gain_and_price(problem, state, _anywhere(usual))
    for size in (_SMALL, _LARGE):
        if _in_reach(problem, size[1]):
            gain, price = _gain_and_price(problem, state, _sized(usual, size))
            likely = likely or (gain > _PROMISING * price and gain - price > moved[0] - moved[1])
    return likely


def _gain_and_price(problem: Problem, state: State, tolerance: Tolerance) -> tuple[float, float]:
    """What wander of this tolerance, from where a model lies, would gain in minus twice the logarithm of likelihood,
    and what its freedom costs in evidence; to first order."""
    other = problem.granting(tolerance)
    gain = price = 0.0
    for wander, (pull, information) in zip(other.wander, wander_seen(other, state, other.wander_slopes(state)),
                                           strict=True):
        gain += float(pull @ np.linalg.solve(information, pull))
        price += _price(wander, information)
    return gain, price


def _price(wander: Wander, information: Array) -> float:
    """What the freedom of a wander costs in evidence, by what is known of it at last (k, k) (Occam's factor)."""
    return float(np.linalg.slogdet(information)[1] - np.linalg.slogdet(wander.precision)[1])


def _anywhere(tolerance: Tolerance) -> Tolerance:
    """A tolerance with any factor and any start of each run."""
    return replace(tolerance, scale=_ANY_SCALE, start_m=_ANY_START_M)


def _best_size(recorded: Problem, state: State, places: list[Array], sizes: Sequence[tuple[float, float]],
               times: int) -> _Laid:
    """The size of wander with the most evidence: the usual one, of the runs as they were recorded, unless another, of
    smooth ones, is clearly better; then the one that the wander has, once it is known, with close knots.

    places    where the model lies beside the runs (n,) [m], or near it
    sizes     the larger ones that are tried until one is better
    times     how often the size is found anew, at most
    """
    smooth = _at(recorded, [_smooth(run) for run in recorded.runs.runs])
    best = usual = _laid(recorded.granting(recorded.tolerance), state, _places(recorded))
    for size in sizes:
        if best is usual and _in_reach(recorded, size[1]):
            found = _laid(smooth.granting(_sized(recorded.tolerance, size)), state, places)
            best = found if found.lost < usual.lost - _CLEARLY else usual
    for _ in range(0 if best is usual else times):
        knot_s = _CLOSE_S if _in_reach(recorded, _CLOSE_S) else best.problem.tolerance.knot_s
        size = best.wander_m, knot_s
        again = _laid(smooth.granting(_sized(recorded.tolerance, size)), state, best.places)
        if again.lost > best.lost - _CLEARLY:
            break
        best = again
    return best


def _places(problem: Problem, state: State | None = None) -> list[Array]:
    """Where a model lies beside the runs of a problem (n,) [m]; None: where they have it."""
    nowhere = [np.zeros(run.count) for run in problem.runs.runs]
    moved_m = nowhere if state is None else problem.moved_m(state.wander)
    return [run.distance_m + moved for run, moved in zip(problem.runs.runs, moved_m, strict=True)]


def _sized(tolerance: Tolerance, size: tuple[float, float]) -> Tolerance:
    """A tolerance with this size of wander."""
    return replace(tolerance, wander_m=size[0], knot_s=size[1])


def _in_reach(problem: Problem, knot_s: float) -> bool:
    """Whether the runs are not too long for knots so far apart."""
    knots = [run.count / run.rate_hz / knot_s for run in problem.runs.runs]
    by_samples = sum(number * run.count for number, run in zip(knots, problem.runs.runs, strict=True))
    return sum(knots) < _MOST_KNOTS and by_samples < _MOST_KNOTS_BY_SAMPLES


def _smooth(run: Run) -> Array:
    """The distance (n,) of a run without what no car's speed does within a second, which is the signal's own [m]."""
    from scipy.signal import savgol_filter

    size = min(round(_SMOOTH_S * run.rate_hz), run.count - 1) // 2 * 2 + 1
    return np.asarray(savgol_filter(run.distance_m, size, 3)) if size > 3 else run.distance_m


def _laid(problem: Problem, state: State, places: list[Array]) -> _Laid:
    """A model laid out where the runs lie, beginning at places (n,) [m]."""
    return _Laid.of(problem, _followed(problem, state, places))


def _followed(problem: Problem, state: State, places: list[Array]) -> State:
    """A model aligned from places (n,) of the runs [m] or from where they are followed along the road from there,
    whichever is likelier; well enough to tell that."""
    best = _aligned_from(problem, state, places)
    for _ in range(_FOLLOWED):
        farther_m = [followed_m(run, prediction) for run, prediction in zip(
            problem.runs.runs, best.predictions, strict=True)]
        if max(float(np.abs(one).max()) for one in farther_m) < _NEAR_M:
            break
        there = _aligned_from(problem, state, [
            place + one for place, one in zip(_places(problem, best), farther_m, strict=True)])
        if problem.deviance(there) > problem.deviance(best) - _CLEARLY:
            break
        best = there
    return best


def _aligned_from(problem: Problem, state: State, places: list[Array]) -> State:
    """A model aligned from places (n,) of the runs [m]."""
    wander = [one.through(place - run.distance_m, run)
              for one, place, run in zip(problem.wander, places, problem.runs.runs, strict=True)]
    return aligned(problem, problem.laid_out(state.effects, state.logs, wander), WORTH_ALIGNING)


def _finished(laid: _Laid) -> _Laid:
    """The same aligned as well as it can be."""
    return _Laid.of(laid.problem, aligned(laid.problem, laid.state))


def _common(usual: Tolerance, found: _Laid) -> tuple[list[Array], list[Array]]:
    """What of the wander (k,) of each run is one factor and what one delay that all runs have: generalised least
    squares, with factors and starts of their own as is usual, or as far apart as they are; nothing where there is none.
    """
    runs, k = found.problem.runs.runs, found.state.wander
    wanders = found.problem.granting(replace(found.problem.tolerance, scale=usual.scale, start_m=usual.start_m)).wander
    along = [np.stack([one.by_factor, one.through(run.speed_mps, run)]) for one, run in zip(wanders, runs, strict=True)]
    _, left = _explained(wanders, along, k)
    scale = max(usual.scale, _deviation([own[one.knots] for one, own in zip(wanders, left, strict=True)]))
    start_m = max(usual.start_m, _deviation([own[0] for own in left]))
    wanders = found.problem.granting(replace(found.problem.tolerance, scale=scale, start_m=start_m)).wander
    least, best = np.inf, np.zeros(2)
    for parts in ([0, 1], [0], [1], []):
        sizes, left = _explained(wanders, [one[parts] for one in along], k)
        cost = sum(float(own @ one.precision @ own) for one, own in zip(wanders, left, strict=True))
        if cost + _CLEARLY * len(parts) < least:
            least, best = cost + _CLEARLY * len(parts), np.zeros(2)
            best[parts] = sizes
    return [best[0] * one[0] for one in along], [best[1] * one[1] for one in along]


def _explained(wanders: Sequence[Wander], along: Sequence[Array], k: Sequence[Array]) -> tuple[Array, list[Array]]:
    """How much of each of some common ways of being off (m, k), per run, there is (m,), and what of the wander (k,) is
    left then."""
    sizes = np.sum([one @ prior.precision @ one.T for one, prior in zip(along, wanders, strict=True)], axis=0)
    pulls = np.sum([one @ prior.precision @ own for one, prior, own in zip(along, wanders, k, strict=True)], axis=0)
    much = np.linalg.lstsq(sizes, pulls, rcond=None)[0] if len(pulls) else pulls
    return much, [own - much @ one for one, own in zip(along, k, strict=True)]


def _deviation(left: Sequence[float]) -> float:
    """Of numbers of runs from which one of all was taken away."""
    return float(np.sqrt(np.sum(np.square(left)) / max(1, len(left) - 1)))
