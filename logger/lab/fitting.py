"""Cars with effects fitted to runs: the effects' numbers, with the car's own and the distance's within what is granted.

Problem: twenty candidates are to be fitted in full, each together with a dozen numbers of the car and some hundred of
the wander of the distance, in seconds. Solution: what the numbers of the car and the wander do to a prediction hardly
depends on the candidate, so it is computed once for a model (``Slopes``) and kept while candidates are tried; only the
effect's own slopes are taken anew in each of Levenberg and Marquardt's steps, and every step is judged by a true
prediction. Residuals are weighed by what is left in each band, and the weights follow the fit: the level of the noise
is part of what is fitted (``stretches``).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from logger.lab.nuisance import Nuisance, Tolerance, Wander, WanderSlopes, nuisance_of, wander_of
from logger.lab.stretches import Cells, Stretches, Whitener, deviance, unseen_in
from logger.runs import normalised_rms_error
from logger.simulation.simulated_runs import SimulatedRuns
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.effect_parameters import Move, coordinates_of, moved, steps_of
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

# Slopes by the car's numbers are taken over so many of their deviations at most, once these are known.
_STEP_IN_DEVIATIONS = 5.0
# Far off, steps are damped; near the end they are hardly, or nothing would move along with what makes up for it.
FIRST_DAMPING, LAST_DAMPING, _LARGEST_DAMPING, _MORE_DAMPING = 1e-3, 1e-9, 100.0, 30.0
_LEAST_THAT_DAMPS = 1e-4
# A step that gains or promises less than this in minus twice a log-likelihood ends a fit.
_SMALL_GAIN = 0.3
_KEPT_PROMISE = 0.7
_RIDGE = 1e-12
LEAST_SHARE = 0.002
"""Two right simulations of a car differ by so much of what was measured: what a model leaves counts as no less."""


@dataclass(frozen=True, eq=False)
class State:
    """A model with all its numbers, and what it predicts.

    effects       with their values
    logs          (p,) logarithms of the car's numbers over the nominal ones
    wander        (k,) per run
    predictions   (n,) per run, whole, wander included [m/s2]
    """

    effects: tuple[Chosen, ...]
    logs: Array
    wander: list[Array]
    predictions: list[Array]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects, in order."""
        return tuple(one.effect.name for one in self.effects)


@dataclass(frozen=True, eq=False)
class Slopes:
    """What the car's numbers and the wander do to the predictions of a model.

    numbers    by the car's numbers: (p, n) per run
    wander     by the wander, per run
    anchor     the wander over which runs are laid out, (k,) per run
    effects    names of the effects that the model had
    """

    numbers: list[Array]
    wander: list[WanderSlopes]
    anchor: list[Array]
    effects: tuple[str, ...]

    def around(self, state: State) -> Slopes:
        """The same for a state nearby that was laid out, which is then predicted as it was laid out."""
        return replace(self, anchor=state.wander)


class Problem:
    """Runs, a nominal vehicle, and what may be a little off.

    whole     fit all of the runs, and leave no stretch to judge
    stands    the vehicle as it stands, where fits begin, if that is another than was given
    firm      hold on to the car's numbers: a car that may bend as it likes makes up for effects that it lacks

    size_mps2 is the r.m.s. of what was measured, by which errors are divided; least_mps2 what a model leaves at least.
    """

    def __init__(self, runs: SimulatedRuns, vehicle: Vehicle, tolerance: Tolerance, whole: bool = False,
                 stands: Vehicle | None = None, firm: bool = False) -> None:
        self.runs, self.vehicle, self.tolerance, self.whole = runs, vehicle, tolerance, whole
        self.nuisance: Nuisance = nuisance_of(vehicle, tolerance, firm)
        self._stands = stands or vehicle
        self.wander: list[Wander] = [wander_of(run, tolerance) for run in runs.runs]
        counted = np.concatenate([run.measured_mps2[run.first:] for run in runs.runs])
        self.size_mps2 = float(np.sqrt((counted**2).mean()))
        self.least_mps2 = LEAST_SHARE * self.size_mps2
        self.measured = [run.measured_mps2 for run in runs.runs]
        self.stretches = [Stretches(run, whole, self.least_mps2) for run in runs.runs]
        if self._unseen_square(self.measured) <= self.least_mps2**2:  # nothing was measured there that could judge
            self.stretches = [Stretches(run, True, self.least_mps2) for run in runs.runs]

    def entire(self) -> Problem:
        """All of the runs, finely simulated, by a car that is not held, so that it shows when it has to bend too far.
        """
        return Problem(SimulatedRuns(self.runs.runs), self.vehicle, self.tolerance, True, self._stands)

    def granting(self, tolerance: Tolerance) -> Problem:
        """All of the runs, with another tolerance."""
        return Problem(self.runs, self.vehicle, tolerance, True, self._stands, self.nuisance.firm)

    def over(self, runs: SimulatedRuns) -> Problem:
        """The same over other runs."""
        return Problem(runs, self.vehicle, self.tolerance, self.whole, self._stands, self.nuisance.firm)

    def car(self, effects: Sequence[Chosen], logs: Array) -> Car:
        """The car with these numbers and effects."""
        return compose(self.nuisance.vehicle(self.vehicle, logs), effects)

    def moved_m(self, wander: Sequence[Array]) -> list[Array]:
        """By how much the car was farther than its distance signal said (n,), per run."""
        return [one.moved_m(k) for one, k in zip(self.wander, wander, strict=True)]

    def laid_out(self, effects: tuple[Chosen, ...], logs: Array, wander: list[Array]) -> State:
        """A state whose predictions are made anew, over the road as the wander has it."""
        return State(effects, logs, wander, self._recorded(effects, logs, wander))

    def unmoved(self, effects: Sequence[Chosen], logs: Array) -> State:
        """The same over the road as the runs have it."""
        return self.laid_out(tuple(effects), logs, [np.zeros(one.count) for one in self.wander])

    def _recorded(self, effects: tuple[Chosen, ...], logs: Array, wander: Sequence[Array],
                  rough: bool = False) -> list[Array]:
        predictions = self.runs.predict(self.car(effects, logs), self.moved_m(wander), rough)
        return [one.recorded(prediction, k, run) for one, prediction, k, run in zip(
            self.wander, predictions, wander, self.runs.runs, strict=True)]

    def start(self, effects: Sequence[Chosen] = ()) -> State:
        """The car as it stands."""
        return self.unmoved(effects, self.nuisance.logs(self.vehicle, self._stands))

    def residuals(self, state: State) -> list[Array]:
        """Measured minus predicted (n,), per run."""
        return [y - one for y, one in zip(self.measured, state.predictions, strict=True)]

    def cells(self, state: State, fitted: bool | None = True) -> list[Cells]:
        """What the state leaves, per run."""
        return [one.cells(left, fitted) for one, left in zip(self.stretches, self.residuals(state), strict=True)]

    def cost(self, state: State) -> float:
        """What the state's car and wander cost: squares of their deviations, and what firmness adds."""
        return self.cost_of(state.logs, state.wander)

    def cost_of(self, logs: Array, wander: Sequence[Array]) -> float:
        """The same of numbers and wander."""
        return self.nuisance.cost(logs) + sum(
            float(k @ one.precision @ k) for one, k in zip(self.wander, wander, strict=True))

    def deviance(self, state: State, fitted: bool | None = True) -> float:
        """Minus twice the log-likelihood: of the fitted stretches (or all) with the cost of what is off, or of those
        that judge."""
        cost = self.cost(state) if fitted is not False else 0.0
        return deviance(self.cells(state, fitted)) + cost

    def error(self, state: State) -> float:
        """Of all samples."""
        return normalised_rms_error(self.runs.runs, state.predictions)

    def judged_error(self, state: State) -> float:
        """Of the samples that no fit saw; of all, where nothing was kept from the fits."""
        return float(np.sqrt(self._unseen_square(self.residuals(state)) / self._unseen_square(self.measured)))

    def _unseen_square(self, samples: Sequence[Array]) -> float:
        """Mean square of samples (n,), per run, that no fit saw; of all, where nothing was kept from the fits."""
        unseen = np.concatenate([one[stretches.first:][which] for one, stretches, which in zip(
            samples, self.stretches, unseen_in(self.stretches), strict=True)])
        return float((unseen**2).mean())

    def whiteners(self, state: State) -> list[Whitener]:
        """Weights by what the state leaves in the fitted stretches."""
        return [Whitener(one, cells) for one, cells in zip(self.stretches, self.cells(state), strict=True)]

    def slopes(self, state: State, steps: Array | None = None) -> Slopes:
        """Of a state that was laid out; ``steps`` (p,) of the car's numbers. Those are told well enough by a rough
        simulation."""
        steps = self.nuisance.steps if steps is None else steps
        count = len(self.nuisance.names)
        by_number = [np.empty((count, len(one))) for one in self.measured]
        moved = self.moved_m(state.wander)
        unmoved = self.runs.predict(self.car(state.effects, state.logs), moved, rough=True)
        for index in range(count):
            step = np.zeros(count)
            step[index] = steps[index]
            shifted = self.runs.predict(self.car(state.effects, state.logs + step), moved, rough=True)
            for column, there, here in zip(by_number, shifted, unmoved, strict=True):
                column[index] = (there - here) / step[index]
        return Slopes(by_number, self.wander_slopes(state), [k.copy() for k in state.wander], state.names)

    def wander_slopes(self, state: State) -> list[WanderSlopes]:
        """Beside a state."""
        return [one.slopes(prediction, run)
                for one, prediction, run in zip(self.wander, state.predictions, self.runs.runs, strict=True)]

    def predicted(self, effects: tuple[Chosen, ...], logs: Array, wander: list[Array], slopes: Slopes,
                  rough: bool = False) -> State:
        """A state whose wander is counted to first order from the anchor of the slopes; or one that is only good for
        being compared with another such (``rough``)."""
        predictions = [
            prediction + one.times(k - anchor) for prediction, one, k, anchor in zip(
                self._recorded(effects, logs, slopes.anchor, rough), slopes.wander, wander, slopes.anchor, strict=True)
        ]
        return State(effects, logs, wander, predictions)

    def effect_slopes(self, state: State, moves: Sequence[Move], anchor: Sequence[Array]) -> list[Array]:
        """What the effects' numbers do to the predictions, on the scales of the parameters: (m, n) per run.

        anchor    the wander over which runs are laid out
        """
        over = self.moved_m(anchor)
        here = coordinates_of(state.effects, moves)
        unmoved = self.runs.predict(self.car(state.effects, state.logs), over)
        result = [np.empty((len(moves), len(one))) for one in self.measured]
        for index, step in enumerate(steps_of(state.effects, moves)):
            there = here.copy()
            there[index] += step
            shifted = self.runs.predict(self.car(moved(state.effects, moves, there), state.logs), over)
            for column, high, low in zip(result, shifted, unmoved, strict=True):
                column[index] = (high - low) / step
        return result


def located(problem: Problem, state: State, slopes: Slopes) -> State:
    """The state with the wander of all stretches, also of those that judge: where the car was is no part of what is
    judged. One step, to first order."""
    wander, predictions = [], []
    for one, k, prediction, (pull, information) in zip(slopes.wander, state.wander, state.predictions,
                                                       wander_seen(problem, state, slopes.wander), strict=True):
        step = np.asarray(np.linalg.solve(information, pull - one.wander.precision @ k), float)
        wander.append(k + step)
        predictions.append(prediction + one.times(step))
    return State(state.effects, state.logs, wander, predictions)


def wander_seen(problem: Problem, state: State, slopes: Sequence[WanderSlopes]) -> Iterator[tuple[Array, Array]]:
    """What all stretches tell of the wander beside a state, run by run: which way what is left pulls it (k,), and the
    information with that of the prior (k, k)."""
    for stretches, left, one in zip(problem.stretches, problem.residuals(state), slopes, strict=True):
        whitener = Whitener(stretches, stretches.cells(left, None), whole=True)
        white = whitener(one.columns())
        yield white @ whitener(left), white @ white.T + one.wander.precision


class Weighed:
    """Slopes, weighed; and the normal equations of what they hold.

    still    the car's numbers stay where they are
    """

    def __init__(self, problem: Problem, slopes: Slopes, whiteners: Sequence[Whitener], still: bool = False) -> None:
        self.problem, self.slopes, self.whiteners, self._still = problem, slopes, list(whiteners), still
        self.white = [whitener(np.vstack([numbers, wander.columns()])) for whitener, numbers, wander in zip(
            whiteners, slopes.numbers, slopes.wander, strict=True)]
        p = len(problem.nuisance.names)
        sizes = [one.count for one in problem.wander]
        ends = p + np.cumsum([0, *sizes])
        self.places = [np.concatenate([np.arange(p), np.arange(low, high)])
                       for low, high in pairwise(ends)]
        self.count = int(ends[-1])
        self.prior = np.zeros((self.count, self.count))
        self.prior[:p, :p] = np.diag(problem.nuisance.deviations**-2.0)
        for one, (low, high) in zip(problem.wander, pairwise(ends), strict=True):
            self.prior[low:high, low:high] = one.precision
        self.information = self.prior.copy()
        for white, place in zip(self.white, self.places, strict=True):
            self.information[np.ix_(place, place)] += white @ white.T

    @property
    def fine_steps(self) -> Array:
        """Of the logarithms of the car's numbers (p,), by how well they are known."""
        sizes = np.sqrt(np.diag(self.information)[: len(self.problem.nuisance.names)])
        return np.minimum(self.problem.nuisance.steps, _STEP_IN_DEVIATIONS / sizes)

    def joined(self, state: State) -> Array:
        """The car's numbers and the wander of all runs as one vector."""
        return np.concatenate([state.logs, *state.wander])

    def parted(self, joined: Array) -> tuple[Array, list[Array]]:
        """The reverse."""
        p = len(self.problem.nuisance.names)
        return joined[:p], [joined[place[p:]] for place in self.places]

    def residual(self, state: State) -> list[Array]:
        """Weighed."""
        return [whitener(left) for whitener, left in zip(self.whiteners, self.problem.residuals(state), strict=True)]

    def objective(self, state: State) -> float:
        """Squares of the weighed residuals, and the cost of what is off."""
        return sum(float(one @ one) for one in self.residual(state)) + self.problem.cost(state)

    def against(self, columns: Sequence[Array]) -> Array:
        """Products of weighed columns (m, kept) per run with the slopes: (count, m)."""
        result = np.zeros((self.count, len(columns[0])))
        for white, place, one in zip(self.white, self.places, columns, strict=True):
            result[place] += white @ one.T
        return result

    def gradient(self, state: State, left: Sequence[Array]) -> Array:
        """Which way the car's numbers and the wander fit better (count,), by weighed residuals (kept,) per run; nothing
        where they fit best."""
        gradient = self.against([one[None] for one in left])[:, 0] - self.prior @ self.joined(state)
        gradient[: len(state.logs)] -= self.problem.nuisance.firmness(state.logs)[0]
        if self._still:
            gradient[: len(state.logs)] = 0.0
        return gradient

    def effect_slopes(self, state: State, moves: Sequence[Move]) -> list[Array]:
        """What the effects' numbers do, weighed: (m, kept) per run."""
        return [whitener(columns) for whitener, columns in zip(
            self.whiteners, self.problem.effect_slopes(state, moves, self.slopes.anchor), strict=True)]

    def bordered(self, information: Array, own: Sequence[Array]) -> Array:
        """The normal equations' matrix (count + m, count + m) with weighed slopes by the effects' numbers as well."""
        mixed = self.against(own)
        alone = np.sum([one @ one.T for one in own], axis=0)
        return np.block([[information, mixed], [mixed.T, alone]])

    def information_at(self, state: State) -> Array:
        """The normal equations' matrix (count, count) where the car's numbers are those of a state."""
        information = self.information.copy()
        diagonal = np.arange(len(state.logs))
        information[diagonal, diagonal] += self.problem.nuisance.firmness(state.logs)[1]
        return information


def improved(weighed: Weighed, state: State, moves: Sequence[Move], most: int, laid_out: bool = False,
             first_damping: float = FIRST_DAMPING) -> State:
    """Levenberg and Marquardt's steps on the effects' numbers that move, the car's numbers and the wander.

    laid_out    lay the road out anew for every trial, instead of counting the wander to first order
    """
    problem, damping = weighed.problem, first_damping
    make = problem.laid_out if laid_out else partial(problem.predicted, slopes=weighed.slopes)
    state = make(state.effects, state.logs, state.wander)
    now = weighed.objective(state)
    own: list[Array] | None = None
    for _ in range(most):
        kept = own is not None
        if moves and own is None:
            own = weighed.effect_slopes(state, moves)
        information, gradient = _normal(weighed, state, own)
        gained = promised = 0.0
        while damping < _LARGEST_DAMPING:
            damped = information + damping * np.diag(np.diag(information))
            step = np.asarray(np.linalg.solve(damped, gradient), float)
            promised = float(2 * gradient @ step - step @ information @ step)
            if promised < _SMALL_GAIN:
                break
            trial = make(*_stepped(weighed, state, moves, step))
            there = weighed.objective(trial)
            if there < now:
                gained, now, state = now - there, there, trial
                damping = max(damping / _MORE_DAMPING, LAST_DAMPING)
                break
            damping = max(damping * _MORE_DAMPING, _LEAST_THAT_DAMPS)
        # Slopes that keep what they promise serve for the next step too; those that do not are taken anew.
        if gained < _KEPT_PROMISE * promised or gained < _SMALL_GAIN:
            own = None
        if gained < _SMALL_GAIN:
            if not kept:
                break
            damping = first_damping
    return state


def _normal(weighed: Weighed, state: State, own: Sequence[Array] | None) -> tuple[Array, Array]:
    """The normal equations: information (count + m, count + m) and gradient (count + m,)."""
    left = weighed.residual(state)
    gradient = weighed.gradient(state, left)
    information = weighed.information_at(state)
    if own is None:
        return information, gradient
    information = weighed.bordered(information, own)
    pulled = np.sum([one @ rest for one, rest in zip(own, left, strict=True)], axis=0)
    sizes = np.diag(information)
    ridge = _RIDGE * np.where(sizes > 0, sizes, 1.0)  # a number that does nothing stays where it is
    return information + np.diag(ridge), np.concatenate([gradient, pulled])


def _stepped(weighed: Weighed, state: State, moves: Sequence[Move],
             step: Array) -> tuple[tuple[Chosen, ...], Array, list[Array]]:
    logs, wander = weighed.parted(weighed.joined(state) + step[: weighed.count])
    effects = moved(state.effects, moves, coordinates_of(state.effects, moves) + step[weighed.count:])
    return effects, logs, wander
