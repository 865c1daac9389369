"""The posterior linearised at a state: normal equations, with the record's errors integrated out.

Problem: some hundred numbers of each run's distance error are nuisance parameters of a dozen numbers of the car and a
few of the effects. Solution: near a state all of them act to first order, and those of one run's record change that run
alone. They are eliminated run by run (Schur complement), so that fits and tests of effects see small matrices only; and
the sizes of the distance errors are those with the most evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.distance_error import USUAL, ErrorSize, RecordError, RigRecordError
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.signals import JointWhitener
from logger.vehicle.named_parameters import free_parameters_of

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_UNINFORMATIVE = ErrorSize(start_m=1e3 * USUAL.start_m, scale=1e3 * USUAL.scale)
"""Start and scale error as good as free: their precisions are a millionth of a good recorder's, above what would make
the information of a run without either singular."""


@dataclass(frozen=True, eq=False)
class _Record:
    """The record error of one run at a state: its derivatives (k, n), the products of these whitened (k, k), the
    gradient of its numbers (k,), and these. The derivatives are sparse; whitened they are not, and are not kept: what
    they are multiplied with is whitened once more instead (``projected``)."""

    error: RecordError
    slopes: csr_array
    whitener: JointWhitener
    gram: Array
    gradient: Array
    here: Array

    @staticmethod
    def of(error: RecordError, slopes: csr_array, whitener: JointWhitener, residual: Array, here: Array) -> _Record:
        """With derivatives (k, n), at a residual (n,) and the numbers (k,)."""
        gradient = slopes @ whitener.adjoint(whitener(residual))
        return _Record(error, slopes, whitener, whitener.products(slopes), gradient, here)

    def projected(self, white: Array) -> Array:
        """Products (k,) or (k, m) of the whitened derivatives with whitened samples (kept,) or (m, kept)."""
        return np.asarray(self.slopes @ self.whitener.adjoint(white).T)

    def change(self, step: Array) -> Array:
        """Whitened change (kept,) of the prediction by steps of the numbers (k,), to first order."""
        return self.whitener(self.slopes.T @ step)

    def root(self, size: ErrorSize) -> Array:
        """Lower Cholesky factor of the information (k, k)."""
        return np.asarray(np.linalg.cholesky(self.gram + self.error.precision(size)), float)

    def minus_twice_log_evidence(self, size: ErrorSize, walks: dict[float, _Walk]) -> float:
        """Minus twice the log of the evidence for a size, without its constant.

        walks    results for sizes of the walk, kept from earlier calls
        """
        if size.walk_m not in walks:
            walks[size.walk_m] = _Walk.of(self, size)
        walk = walks[size.walk_m]
        weights = self.error.trend_precisions(size) - self.error.trend_precisions(_UNINFORMATIVE)
        there = self.error.trend.T @ self.here
        # M. Woodbury's identity: start and scale error are two numbers among hundreds.
        small = np.eye(len(weights)) + weights[:, None] * (walk.trend.T @ walk.trend)
        whitened_gradient = walk.whitened_gradient - walk.trend @ (weights * there)
        by_trend = walk.trend.T @ whitened_gradient
        return float(walk.log_determinant + np.linalg.slogdet(small)[1] - self.error.log_determinant(size)
                     + walk.cost + weights @ there**2
                     - whitened_gradient @ whitened_gradient + by_trend @ np.linalg.solve(small, weights * by_trend))


@dataclass(frozen=True, eq=False)
class _Walk:
    """The record error of one run at a state, with start and scale error nearly free: the log-determinant of the
    information, the cost of the numbers, and their gradient (k,) and the trend (k, 2) whitened by its Cholesky
    factor."""

    log_determinant: float
    cost: float
    whitened_gradient: Array
    trend: Array

    @staticmethod
    def of(record: _Record, size: ErrorSize) -> _Walk:
        """For a run with a walk of this size."""
        from scipy.linalg import solve_triangular

        precision, here = record.error.precision(replace(_UNINFORMATIVE, walk_m=size.walk_m)), record.here
        root, owed = np.asarray(np.linalg.cholesky(record.gram + precision), float), precision @ here
        both = solve_triangular(root, np.column_stack([record.gradient - owed, record.error.trend]), lower=True)
        return _Walk(_log_determinant(root), float(here @ owed), both[:, 0], both[:, 1:])


@dataclass(frozen=True, eq=False)
class RecordErrorFit:
    """Predictions near a state with the most likely record errors, to first order.

    record           numbers of the record errors (k,) per run
    squares          sum of squares of the whitened residuals and of these numbers
    gain             by how much these numbers lower it
    before, steps    whitened residuals (kept,) per run before the record errors took these steps (k,)
    """

    record: list[Array]
    squares: float
    gain: float
    before: list[Array]
    steps: list[Array]
    _records: list[_Record]

    @cached_property
    def residuals(self) -> list[Array]:
        """Whitened residuals (kept,) per run, with these record errors."""
        return [white - one.change(step) for white, step, one in zip(
            self.before, self.steps, self._records, strict=True)]


class LinearModel:
    """A posterior linearised at a state.

    numbers      derivatives by the car's numbers (p, n) per run, taken near the state; None: these are held fixed
    size         of the distance errors, by evidence
    whiteners    by the noise levels under the state's residuals
    expected     whiteners by expected noise levels; the size is the state's then, as nothing was measured yet
    """

    def __init__(self, posterior: Posterior, state: State, numbers: Sequence[Array] | None = None,
                 expected: Sequence[JointWhitener] | None = None) -> None:
        self.posterior, self.prior = posterior, posterior.prior
        residuals = posterior.residuals(state)
        self._predictions = state.predictions
        self.whiteners = [
            one.whitener(residual) for one, residual in zip(posterior.bands, residuals, strict=True)
        ] if expected is None else list(expected)
        self._records = [
            _Record.of(error, (error.slopes(prediction) * readings.sensitive(prediction)).tocsr(), whitener, residual,
                       here)
            for error, whitener, readings, prediction, residual, here in zip(
                posterior.record_errors, self.whiteners, posterior.readings, state.predictions, residuals, state.record,
                strict=True)]
        self.size = self._most_likely_size(state.size) if expected is None else state.size
        self.state = State(state.effects, state.logs, state.record, self.size, state.predictions)
        self._precisions = [one.error.precision(self.size) for one in self._records]
        self._roots = [one.root(self.size) for one in self._records]
        self._set_number_slopes(numbers)

    def _set_number_slopes(self, numbers: Sequence[Array] | None) -> None:
        self.numbers = numbers
        self.count = 0 if numbers is None else len(self.prior.names)
        self.white = [np.empty((0, one.kept)) for one in self.whiteners] if numbers is None else (
            self.whitened(numbers))
        self._record_projections = self.record_projections(self.white)

    def with_number_slopes(self, numbers: Sequence[Array] | None) -> LinearModel:
        """The model with other derivatives by the car's numbers (p, n) per run; itself where it has these."""
        if numbers is self.numbers:
            return self
        found = copy(self)
        found._set_number_slopes(numbers)
        return found

    def hold_fixed(self, names: Sequence[str]) -> LinearModel:
        """The model with some of the car's numbers held fixed."""
        kept = ~np.isin(self.prior.names, list(names))
        if kept.all() or self.numbers is None:
            return self
        found = copy(self)
        found.numbers, found.white = ([one * kept[:, None] for one in some] for some in (self.numbers, self.white))
        found._record_projections = [one * kept for one in self._record_projections]
        return found

    def _most_likely_size(self, size: ErrorSize) -> ErrorSize:
        """The size with the most evidence, searched for from a size and from one whose start and scale error are ten
        times as large as usual: what these explain, a walk explains as well, and there may be an optimum at either."""
        walks: list[dict[float, _Walk]] = [{} for _ in self._records]

        def minus_twice_log_evidence(logs: Array) -> float:
            found = ErrorSize.of(logs)
            return sum(one.minus_twice_log_evidence(found, known)
                       for one, known in zip(self._records, walks, strict=True)) + found.cost

        here, least = _coordinate_descent(minus_twice_log_evidence, size.logs)
        trend = USUAL.logs + np.log([10.0, 1.0, 10.0])
        if minus_twice_log_evidence(trend) < least:
            here, _ = _coordinate_descent(minus_twice_log_evidence, trend)
        return ErrorSize.of(here)

    @property
    def score(self) -> float:
        """Minus twice the log of the model's evidence at its state, without its constant: Laplace's approximation for
        the record's errors, G. Schwarz's (Annals of Statistics 6, 1978) for the numbers of effects."""
        posterior, state = self.posterior, self.state
        return (posterior.deviance(state) + posterior.cost(state) + self.occam_factor
                + len(free_parameters_of(state.effects)) * float(np.log(posterior.freedom)))

    @property
    def occam_factor(self) -> float:
        """Occam factor of the record's errors, in minus twice the log of the evidence."""
        return sum(_log_determinant(root) - one.error.log_determinant(self.size)
                   for root, one in zip(self._roots, self._records, strict=True))

    def with_size(self, size: ErrorSize) -> LinearModel:
        """The model with distance errors of another size."""
        found = copy(self)
        found.size, found.state = size, replace(self.state, size=size)
        found._precisions = [one.error.precision(size) for one in self._records]
        found._roots = [one.root(size) for one in self._records]
        found._record_projections = found.record_projections(found.white)
        return found

    def record_projections(self, white: Sequence[Array]) -> list[Array]:
        """Whitened columns (m, kept) per run projected on the record's errors: (k, m), whose products are what these
        absorb of the products of the columns."""
        from scipy.linalg import solve_triangular

        return [solve_triangular(root, one.projected(columns), lower=True)
                for root, one, columns in zip(self._roots, self._records, white, strict=True)]

    def whitened(self, columns: Sequence[Array]) -> list[Array]:
        """Derivatives in each run, (n,) or (m, n) to (..., kept)."""
        return whitened(self.posterior, self.whiteners, columns, self._predictions)

    def fit_record_errors(self, predictions: Sequence[Array], record: Sequence[Array] | None = None) -> RecordErrorFit:
        """The most likely record errors for predictions (n,) per run that were made with the record errors ``record``
        (k,) per run; None: with the state's."""
        return self.fit_record_errors_to(self.posterior.residuals_of(predictions),
                                         self.state.record if record is None else record)

    def fit_record_errors_to(self, residuals: Sequence[Array], record: Sequence[Array]) -> RecordErrorFit:
        """The most likely record errors for residuals (n,) per run of such predictions."""
        from scipy.linalg import cho_solve

        found, squares, gain, whites, steps = [], 0.0, 0.0, [], []
        for residual, whitener, root, precision, one, here in zip(
                residuals, self.whiteners, self._roots, self._precisions, self._records, record, strict=True):
            white = whitener(residual)
            owed = one.projected(white) - precision @ here
            step = cho_solve((root, True), owed)
            whites.append(white)
            steps.append(step)
            found.append(here + step)
            gain += float(owed @ step)
            squares += float(white @ white + here @ precision @ here - owed @ step)
        return RecordErrorFit(found, squares, gain, whites, steps, self._records)

    def without_record_errors(self, columns: Sequence[Array]) -> list[Array]:
        """Derivatives (m, n) per run less what the record's errors absorb of them, as far as the readings show."""
        from scipy.linalg import cho_solve

        seen = self.posterior.without_insensitive_samples(columns, self._predictions)
        return [one - (record.slopes.T @ cho_solve((root, True), record.projected(whitener(one)))).T
                for one, record, root, whitener in zip(seen, self._records, self._roots, self.whiteners, strict=True)]

    def pulls_of_instruments(self, columns: Sequence[Array]) -> list[dict[tuple[object, ...], Array]]:
        """By how much one standard deviation of each number of an instrument, by that, changes the gradient by such
        derivatives (m, n) in each run of a rig: (m,)."""
        return [dict(zip(record.error.instruments, record.error.deviations[:, None] * record.projected(whitener(one)),
                         strict=True))
                for record, whitener, one in zip(self._records, self.whiteners, columns, strict=True)
                if isinstance(record.error, RigRecordError)]

    def objective(self, predictions: Sequence[Array], logs: Array) -> float:
        """Sum of squares of the whitened residuals and cost of the priors, with the most likely record errors."""
        return self.fit_record_errors(predictions).squares + self.prior.cost(logs)

    def information(self, own: Sequence[Array] | None = None) -> Array:
        """Information on the car's numbers and on those of whitened columns (m, kept) per run: (p + m, p + m)."""
        found = np.asarray(sum(white @ white.T - absorbed.T @ absorbed
                               for white, absorbed in zip(self.white, self._record_projections, strict=True)))
        found += np.diag(self.prior.precision) if self.count else 0.0
        if own is None:
            return found
        mixed, alone = self.cross_products(own)
        return np.block([[found, mixed.T], [mixed, alone]])

    def cross_products(self, own: Sequence[Array]) -> tuple[Array, Array]:
        """Products of whitened columns (m, kept) per run with those of the car's numbers (m, p), and with each other
        (m, m)."""
        parts = list(zip(own, self.record_projections(own), self.white, self._record_projections, strict=True))
        return (np.asarray(sum(one @ white.T - mine.T @ absorbed for one, mine, white, absorbed in parts)),
                np.asarray(sum(one @ one.T - mine.T @ mine for one, mine, *_ in parts)))

    def gradient(self, residuals: Sequence[Array], logs: Array, own: Sequence[Array] | None = None) -> Array:
        """Half of the negative gradient of the objective by the same numbers (p + m,), by whitened residuals (kept,)
        per run."""
        found = sum((white @ one for white, one in zip(self.white, residuals, strict=True)), np.zeros(self.count))
        found = found - (self.prior.gradient(logs) if self.count else 0.0)
        if own is None:
            return found
        by_own = sum((columns @ one for columns, one in zip(own, residuals, strict=True)), np.zeros(len(own[0])))
        return np.concatenate([found, by_own])


def whitened(posterior: Posterior, whiteners: Sequence[JointWhitener], columns: Sequence[Array],
             predictions: Sequence[Array]) -> list[Array]:
    """Derivatives of such predictions in each run, (n,) or (m, n) to (..., kept)."""
    sensitive = posterior.without_insensitive_samples(columns, predictions)
    return [whitener(one) for whitener, one in zip(whiteners, sensitive, strict=True)]


def _coordinate_descent(minus_twice_log_evidence: Callable[[Array], float], here: Array) -> tuple[Array, float]:
    """Minimum of a function of logarithms of sizes (3,), coordinate by coordinate, in steps that become smaller."""
    least, step = minus_twice_log_evidence(here), 0.8
    while step > 0.1:
        before = least
        for index in (1, 0, 2):
            for way in (step, -step):
                there = here.copy()
                there[index] += way
                if (now := minus_twice_log_evidence(there)) < least:
                    here, least = there, now
                    break
        if least > before - 1.0:
            step *= 0.4
    return here, least


def _log_determinant(root: Array) -> float:
    """Log-determinant of a matrix with this Cholesky factor."""
    return 2 * float(np.log(np.diag(root)).sum())
