"""A posterior beside a state: what is eliminated run by run is what the whole dense system says, the gradient is that
of the objective, and the sizes of distance errors are those with the most evidence."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest
from scipy.linalg import block_diag, solve_triangular
from scipy.optimize import minimize

from logger.lab.likelihood.distance_error import USUAL, ErrorSize
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import effect_slopes
from logger.lab.likelihood.posterior import Posterior, State
from logger.vehicle.effect import chosen
from logger.vehicle.named_parameters import free_parameters_of

from ...support.lab.noisy_runs import drawn, noisy_runs, posterior_of, tire_damping
from ...support.lab.secret_runs import EFFECTS

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Case:
    """A state off the best one in every respect, and slopes of two effects' numbers."""

    posterior: Posterior
    state: State
    linear: LinearModel
    own: list[Array]


@cache
def case() -> Case:
    posterior = posterior_of(noisy_runs([tire_damping(300.0)], lasts_s=10.0))
    rng = np.random.default_rng(1)
    logs = 0.5 * posterior.prior.deviations * rng.normal(size=len(posterior.prior.names))
    record = [1e-3 * rng.normal(size=one.count) for one in posterior.record_errors]
    effects = (tire_damping(150.0), chosen(EFFECTS["sensor_gain"], {"gain": 1.02}))
    state = posterior.state_at(effects, logs, record)
    linear = LinearModel(posterior, state, posterior.number_slopes(state, posterior.prior.steps))
    own = effect_slopes(posterior, effects, logs, free_parameters_of(effects), linear.state.record, None)
    return Case(posterior, state, linear, linear.whitened(own))


@dataclass(frozen=True, eq=False)
class Dense:
    """The whole system of one model: whitened slopes (numbers of the car, of effects and of all records; samples) and
    the prior's precision."""

    columns: Array
    precision: Array
    outer: int


def dense(one: Case) -> Dense:
    linear, parts = one.linear, []
    assert linear.numbers is not None
    record = [whitener(error.slopes(prediction).toarray()) for whitener, error, prediction in zip(
        linear.whiteners, one.posterior.record_errors, one.state.predictions, strict=True)]
    for index, (whitener, numbers, own) in enumerate(zip(linear.whiteners, linear.numbers, one.own, strict=True)):
        of_records = [block if index == other else np.zeros((len(block), record[index].shape[1]))
                      for other, block in enumerate(record)]
        parts.append(np.concatenate([whitener(numbers), own, *of_records]))
    precision = block_diag(np.diag(one.posterior.prior.precision), np.zeros((len(one.own[0]),) * 2),
                           *(error.precision(linear.size) for error in one.posterior.record_errors))
    return Dense(np.concatenate(parts, axis=1), precision, linear.count + len(one.own[0]))


def scaled(information: Array) -> tuple[Array, Array]:
    """With a diagonal of ones, and the roots of what it was."""
    size = np.sqrt(np.diag(information))
    return information / np.outer(size, size), size


def test_the_information_is_the_dense_one_with_the_records_integrated_out() -> None:
    one, whole = case(), dense(case())
    full, size = scaled(whole.columns @ whole.columns.T + whole.precision)
    expected = np.linalg.inv(np.linalg.inv(full)[: whole.outer, : whole.outer])
    found = one.linear.information(one.own) / np.outer(size[: whole.outer], size[: whole.outer])
    assert found == pytest.approx(expected, abs=1e-8)
    alone = one.linear.information()
    assert alone == pytest.approx(one.linear.information(one.own)[: len(alone), : len(alone)])


def test_the_most_likely_records_are_those_of_least_squares() -> None:
    one, whole = case(), dense(case())
    rng = np.random.default_rng(2)
    predictions = [each + rng.normal(0, 0.02, len(each)) for each in one.state.predictions]
    found = one.linear.fit_record_errors(predictions)
    white = np.concatenate(one.linear.whitened(one.posterior.residuals_of(predictions)))
    columns, precision = whole.columns[whole.outer:], whole.precision[whole.outer:, whole.outer:]
    here = np.concatenate(one.state.record)
    root = np.linalg.cholesky(precision).T
    step, *_ = np.linalg.lstsq(np.vstack([columns.T, root]), np.concatenate([white, -root @ here]), rcond=None)
    left = white - step @ columns
    assert np.concatenate(found.record) == pytest.approx(here + step, abs=1e-7)
    assert np.concatenate(found.residuals) == pytest.approx(left, abs=1e-6)
    assert found.squares == pytest.approx(left @ left + (here + step) @ precision @ (here + step), rel=1e-9)


def test_the_gradient_is_that_of_the_objective() -> None:
    one = case()
    assert one.linear.numbers is not None
    numbers, logs = one.linear.numbers, one.state.logs
    own = effect_slopes(one.posterior, one.state.effects, logs, free_parameters_of(one.state.effects), one.state.record,
                        None)

    def objective(x: Array) -> float:
        there = [each + x[: len(logs)] @ of_car + x[len(logs):] @ of_effects for each, of_car, of_effects in zip(
            one.state.predictions, numbers, own, strict=True)]
        return one.linear.objective(there, logs + x[: len(logs)])

    residuals = one.linear.fit_record_errors(one.state.predictions).residuals
    found = one.linear.gradient(residuals, logs, one.own)
    steps = np.diag(1e-3 / np.sqrt(np.diag(one.linear.information(one.own))))
    expected = [-(objective(step) - objective(-step)) / (4 * step.sum()) for step in steps]
    size = np.sqrt(np.diag(one.linear.information(one.own)))
    assert found / size == pytest.approx(expected / size, abs=1e-4)


def test_the_score_is_the_cost_and_what_records_and_effects_are_charged() -> None:
    one, whole = case(), dense(case())
    columns, precision = whole.columns[whole.outer:], whole.precision[whole.outer:, whole.outer:]
    occam_factor = np.linalg.slogdet(columns @ columns.T + precision)[1] - np.linalg.slogdet(precision)[1]
    state = one.linear.state
    expected = (one.posterior.deviance(state) + one.posterior.cost(state) + occam_factor
                + 2 * np.log(one.posterior.freedom))
    assert one.linear.score == pytest.approx(expected, abs=1e-6)


def test_the_sizes_are_those_with_the_most_evidence() -> None:
    """Against the density of the whitened residual with all distance errors integrated out, as a matrix."""
    posterior = drawn([], 3, ErrorSize(0.01, 0.04, 0.0003), lasts_s=6.0).posterior
    linear = LinearModel(posterior, posterior.start())
    white = linear.whitened(posterior.residuals(linear.state))
    slopes = [whitener(error.slopes(each).toarray()) for whitener, error, each in zip(
        linear.whiteners, posterior.record_errors, linear.state.predictions, strict=True)]

    def minus_twice_log_density(residual: Array, slope: Array, precision: Array) -> float:
        root = np.linalg.cholesky(np.eye(len(residual)) + slope.T @ np.linalg.solve(precision, slope))
        return float(2 * np.log(np.diag(root)).sum() + (solve_triangular(root, residual, lower=True) ** 2).sum())

    def minus_twice_log_evidence(logs: Array) -> float:
        size = ErrorSize.of(logs)
        return size.cost + sum(minus_twice_log_density(residual, slope, error.precision(size))
                               for residual, slope, error in zip(white, slopes, posterior.record_errors, strict=True))

    best = minimize(minus_twice_log_evidence, linear.size.logs, method="Nelder-Mead", options={"maxfev": 60}).fun
    assert minus_twice_log_evidence(linear.size.logs) < best + 1.0
    assert minus_twice_log_evidence(USUAL.logs) > best + 2.0


def test_numbers_that_are_held_do_nothing_and_leave_the_model_as_it_was() -> None:
    one = case()
    before = one.linear.information()
    held = one.linear.hold_fixed(["sprung_mass_kg"])
    information = held.information()
    others = np.arange(1, len(information))
    assert information[np.ix_(others, others)] == pytest.approx(before[np.ix_(others, others)])
    assert information[0, 0] == pytest.approx(one.posterior.prior.precision[0])
    assert not information[0, 1:].any()
    assert one.linear.information() == pytest.approx(before)
    assert one.linear.hold_fixed(["no_number_of_the_car"]) is one.linear


def test_a_model_without_slopes_of_the_car_holds_all_of_its_numbers() -> None:
    one = case()
    still = LinearModel(one.posterior, one.state)
    assert still.count == 0 and still.information().size == 0
    assert still.score == pytest.approx(one.linear.score)
    found = still.information(one.own)
    assert found == pytest.approx(one.linear.information(one.own)[-len(one.own[0]):, -len(one.own[0]):])
