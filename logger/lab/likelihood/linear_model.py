"""A posterior beside one of its states: normal equations, with the record's errors integrated out.

Problem: some hundred numbers of each run's distance error are unknown beside a dozen of the car and a few of the
effects. Solution: beside a state all of them act to first order, and those of one run's record touch that run alone.
They are eliminated run by run (Schur complement), so that fits and tests of effects see small matrices only; and the
sizes of the distance errors are those with the most evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.distance_error import USUAL, ErrorSize, RecordError
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.signals import JointWhitener
from logger.lab.likelihood.whittle import Whitener
from logger.vehicle.effect_parameters import moves_of

Array = npt.NDArray[np.float64]

_LOOSE = ErrorSize(start_m=1e3 * USUAL.start_m, scale=1e3 * USUAL.scale)
"""Starts and factors that are as good as free; what a run does not tell of them is not singular yet."""


@dataclass(frozen=True, eq=False)
class _Record:
    """The record error of one run beside a state: its whitened slopes (k, kept), their products (k, k), how they pull
    at its numbers (k,), and these."""

    error: RecordError
    white: Array
    gram: Array
    pull: Array
    here: Array

    def root(self, size: ErrorSize) -> Array:
        """Cholesky's factor of the information (k, k), lower."""
        return np.asarray(np.linalg.cholesky(self.gram + self.error.precision(size)), float)

    def lack(self, size: ErrorSize, walks: dict[float, _Walk]) -> float:
        """Minus twice the log of the evidence for a size, without its constant.

        walks    what is known of sizes of the walk already
        """
        if size.walk_m not in walks:
            walks[size.walk_m] = _Walk.of(self, size)
        walk, weights = walks[size.walk_m], self.error.trend_precisions(size) - self.error.trend_precisions(_LOOSE)
        there = self.error.trend.T @ self.here
        # M. Woodbury's identity: start and factor are two numbers among hundreds.
        small = np.eye(len(weights)) + weights[:, None] * (walk.trend.T @ walk.trend)
        grown = walk.grown - walk.trend @ (weights * there)
        by_trend = walk.trend.T @ grown
        return float(walk.log_determinant + np.linalg.slogdet(small)[1] - self.error.log_determinant(size)
                     + walk.cost + weights @ there**2
                     - grown @ grown + by_trend @ np.linalg.solve(small, weights * by_trend))


@dataclass(frozen=True, eq=False)
class _Walk:
    """The record error of one run whose start and factor may be nearly anything, beside a state: the logarithm of the
    information's determinant, the cost of the numbers as they are, and their pull (k,) and the trend (k, 2) through
    its Cholesky factor."""

    log_determinant: float
    cost: float
    grown: Array
    trend: Array

    @staticmethod
    def of(record: _Record, size: ErrorSize) -> _Walk:
        """Of a run, if the walk is of this size."""
        from scipy.linalg import solve_triangular

        precision, here = record.error.precision(replace(_LOOSE, walk_m=size.walk_m)), record.here
        root, owed = np.asarray(np.linalg.cholesky(record.gram + precision), float), precision @ here
        both = solve_triangular(root, np.column_stack([record.pull - owed, record.error.trend]), lower=True)
        return _Walk(_log_determinant(root), float(here @ owed), both[:, 0], both[:, 1:])


@dataclass(frozen=True, eq=False)
class Eliminated:
    """Predictions beside a state with the most likely record errors.

    record         numbers of the record errors (k,) per run
    squares        of the whitened residuals and of these numbers
    left, steps    whitened residuals (kept,) per run before the record errors took these steps (k,) ...
    slopes         ... along what they do (k, kept)
    """

    record: list[Array]
    squares: float
    left: list[Array]
    steps: list[Array]
    slopes: list[Array]

    @cached_property
    def residuals(self) -> list[Array]:
        """Whitened (kept,) per run."""
        return [white - step @ slopes for white, step, slopes in zip(self.left, self.steps, self.slopes, strict=True)]


class LinearModel:
    """A posterior beside a state.

    numbers      slopes by the car's numbers (p, n) per run, taken near the state; None: these stay where they are
    size         of the distance errors, by evidence
    whiteners    by the levels under the state's residuals
    expected     whiteners by levels that are expected; the size is the state's then: nothing was measured yet
    """

    def __init__(self, posterior: Posterior, state: State, numbers: Sequence[Array] | None = None,
                 expected: Sequence[Whitener | JointWhitener] | None = None) -> None:
        self.posterior, self.prior = posterior, posterior.prior
        residuals = posterior.residuals(state)
        self._predictions = state.predictions
        self.whiteners: list[Whitener | JointWhitener] = [
            one.whitener(residual) for one, residual in zip(posterior.bands, residuals, strict=True)
        ] if expected is None else list(expected)
        self._records = []
        for error, whitener, readings, prediction, residual, here in zip(
                posterior.record_errors, self.whiteners, posterior.readings, state.predictions, residuals, state.record,
                strict=True):
            white = whitener(readings.without_deaf(error.slopes(prediction), prediction))
            self._records.append(_Record(error, white, white @ white.T, white @ whitener(residual), here))
        self.size = self._likeliest_size(state.size) if expected is None else state.size
        self.state = State(state.effects, state.logs, state.record, self.size, state.predictions)
        self._precisions = [one.error.precision(self.size) for one in self._records]
        self._roots = [one.root(self.size) for one in self._records]
        self._take(numbers)

    def _take(self, numbers: Sequence[Array] | None) -> None:
        self.numbers = numbers
        self.count = 0 if numbers is None else len(self.prior.names)
        self.white = [np.empty((0, one.white.shape[1])) for one in self._records] if numbers is None else (
            self.whitened(numbers))
        self._taken = self.taken(self.white)

    def by(self, numbers: Sequence[Array] | None) -> LinearModel:
        """The same with other slopes by the car's numbers (p, n) per run."""
        found = copy(self)
        found._take(numbers)
        return found

    def holding(self, names: Sequence[str]) -> LinearModel:
        """The same with some of the car's numbers held where they are."""
        away = [self.prior.names.index(name) for name in names if name in self.prior.names]
        if not away or self.numbers is None:
            return self
        found = copy(self)
        found.numbers = [one.copy() for one in self.numbers]
        found.white = [one.copy() for one in self.white]
        found._taken = [one.copy() for one in self._taken]
        for number, white, taken in zip(found.numbers, found.white, found._taken, strict=True):
            number[away], white[away], taken[:, away] = 0.0, 0.0, 0.0
        return found

    def without_wall(self) -> LinearModel:
        """The same with a normal prior of the car's numbers, as far as they may go."""
        found = copy(self)
        found.prior = self.prior.without_wall()
        return found

    def _likeliest_size(self, size: ErrorSize) -> ErrorSize:
        """By evidence, from a size or from one whose start and factor are ten times as large as usual: what these
        explain, a walk explains as well, and there may be an optimum at either."""
        walks: list[dict[float, _Walk]] = [{} for _ in self._records]

        def lack(logs: Array) -> float:
            found = ErrorSize.of(logs)
            return sum(one.lack(found, known) for one, known in zip(self._records, walks, strict=True)) + found.cost

        here, least = _descended(lack, size.logs)
        trend = USUAL.logs + np.log([10.0, 1.0, 10.0])
        if lack(trend) < least:
            here, _ = _descended(lack, trend)
        return ErrorSize.of(here)

    @property
    def score(self) -> float:
        """Minus twice the log of the model's evidence at its state, without its constant: Laplace's approximation for
        the record's errors, G. Schwarz's (Annals of Statistics 6, 1978) for the numbers of effects."""
        posterior, state = self.posterior, self.state
        return (posterior.deviance(state) + posterior.cost(state) + self.occam
                + len(moves_of(state.effects)) * float(np.log(posterior.freedom)))

    @property
    def occam(self) -> float:
        """What the freedom of the record's errors costs in minus twice the log of the evidence."""
        return sum(_log_determinant(root) - one.error.log_determinant(self.size)
                   for root, one in zip(self._roots, self._records, strict=True))

    def of_size(self, size: ErrorSize) -> LinearModel:
        """The same with distance errors of another size."""
        found = copy(self)
        found.size, found.state = size, replace(self.state, size=size)
        found._precisions = [one.error.precision(size) for one in self._records]
        found._roots = [one.root(size) for one in self._records]
        found._taken = found.taken(found.white)
        return found

    def taken(self, white: Sequence[Array]) -> list[Array]:
        """What the record's errors take of whitened columns (m, kept) per run: (k, m), to be multiplied with each
        other."""
        from scipy.linalg import solve_triangular

        return [solve_triangular(root, one.white @ columns.T, lower=True)
                for root, one, columns in zip(self._roots, self._records, white, strict=True)]

    def whitened(self, columns: Sequence[Array]) -> list[Array]:
        """Slopes in each run, (n,) or (m, n) to (..., kept)."""
        return [whitener(one) for whitener, one in zip(self.whiteners, self.without_deaf(columns), strict=True)]

    def without_deaf(self, columns: Sequence[Array]) -> list[Array]:
        """Slopes in each run, (n,) or (m, n), zero where its readings would not change."""
        return [readings.without_deaf(one, prediction) for readings, one, prediction in zip(
            self.posterior.readings, columns, self._predictions, strict=True)]

    def eliminated(self, predictions: Sequence[Array], laid: Sequence[Array] | None = None) -> Eliminated:
        """Predictions (n,) per run, laid out with record errors (k,) per run; None: with those of the state."""
        return self.absorbed(self.posterior.left_by(predictions), self.state.record if laid is None else laid)

    def absorbed(self, residuals: Sequence[Array], laid: Sequence[Array]) -> Eliminated:
        """The same of what predictions leave (n,), per run, that were laid out with record errors (k,)."""
        from scipy.linalg import cho_solve

        record, squares, whites, steps = [], 0.0, [], []
        for left, whitener, root, precision, one, here in zip(
                residuals, self.whiteners, self._roots, self._precisions, self._records, laid, strict=True):
            white = whitener(left)
            owed = one.white @ white - precision @ here
            step = cho_solve((root, True), owed)
            whites.append(white)
            steps.append(step)
            record.append(here + step)
            squares += float(white @ white + here @ precision @ here - owed @ step)
        return Eliminated(record, squares, whites, steps, [one.white for one in self._records])

    def objective(self, predictions: Sequence[Array], logs: Array, laid: Sequence[Array] | None = None) -> float:
        """Squares of the whitened residuals and the cost of what is off, with the most likely record errors."""
        return self.eliminated(predictions, laid).squares + self.prior.cost(logs)

    def information(self, logs: Array, own: Sequence[Array] | None = None) -> Array:
        """On the car's numbers and those of whitened columns (m, kept) per run: (p + m, p + m)."""
        p = self.count
        found = sum(white @ white.T - taken.T @ taken for white, taken in zip(self.white, self._taken, strict=True))
        found = np.asarray(found) + (np.diag(self.prior.curvature(logs)) if p else 0.0)
        if own is None:
            return found
        taken_by_own = self.taken(own)
        mixed = sum((one @ white.T - mine.T @ taken for one, mine, white, taken in zip(
            own, taken_by_own, self.white, self._taken, strict=True)), np.zeros((len(own[0]), p)))
        alone = sum((one @ one.T - mine.T @ mine for one, mine in zip(own, taken_by_own, strict=True)),
                    np.zeros((len(own[0]), len(own[0]))))
        return np.block([[found, mixed.T], [mixed, alone]])

    def gradient(self, residuals: Sequence[Array], logs: Array, own: Sequence[Array] | None = None) -> Array:
        """Which way the same numbers fit better (p + m,), by whitened residuals (kept,) per run."""
        found = sum((white @ one for white, one in zip(self.white, residuals, strict=True)), np.zeros(self.count))
        found = found - (self.prior.gradient(logs) if self.count else 0.0)
        if own is None:
            return found
        pulled = sum((columns @ one for columns, one in zip(own, residuals, strict=True)), np.zeros(len(own[0])))
        return np.concatenate([found, pulled])

    def mixed(self, own: Sequence[Array]) -> tuple[Array, float]:
        """Products of one whitened column (kept,) per run with those of the car's numbers (p,), and with itself."""
        columns = [one[None] for one in own]
        taken = self.taken(columns)
        mixed = sum((white @ one[0] - known.T @ mine[:, 0] for white, known, one, mine in zip(
            self.white, self._taken, columns, taken, strict=True)), np.zeros(self.count))
        return mixed, sum(float(one @ one) - float((mine**2).sum()) for one, mine in zip(own, taken, strict=True))


def _descended(lack: Callable[[Array], float], here: Array, step: float = 0.8,
               least_step: float = 0.1) -> tuple[Array, float]:
    """The least of a function of logarithms of sizes (3,), coordinate by coordinate, in steps that become smaller."""
    least = lack(here)
    while step > least_step:
        before = least
        for index in (1, 0, 2):
            for way in (step, -step):
                there = here.copy()
                there[index] += way
                if (now := lack(there)) < least:
                    here, least = there, now
                    break
        if least > before - 1.0:
            step *= 0.4
    return here, least


def _log_determinant(root: Array) -> float:
    """Of a matrix with this factor."""
    return 2 * float(np.log(np.diag(root)).sum())
