"""Minima against SciPy's, at bounds, over places where there is no cost, and with derivatives that are seldom taken."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import least_squares

from logger.fitting.levenberg_marquardt import Minimum, minimise

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Point:
    residuals: Array

    @property
    def cost(self) -> float:
        return 0.5 * float(self.residuals @ self.residuals)


class Fit:
    """Least squares of residuals with derivatives, which counts how often these are asked for."""

    def __init__(self, residuals: Callable[[Array], Array], jacobian: Callable[[Array], Array]) -> None:
        self._residuals, self._jacobian = residuals, jacobian
        self.taken = 0
        self._known = np.empty(0)

    def normal_equations(self, x: Array, point: Point, fresh: bool) -> tuple[Array, Array]:
        if fresh:
            self._known = self._jacobian(x)
            self.taken += 1
        return -self._known.T @ point.residuals, self._known.T @ self._known

    def minimum(self, start: Array, keep: bool = False, small_gain: float = 1e-20,
                low: Array | float = -np.inf, high: Array | float = np.inf, rounds: int = 200) -> Minimum[Point]:
        return minimise(start, lambda x: Point(self._residuals(x)), self.normal_equations, most_rounds=rounds,
                        small_gain=lambda _: small_gain, keep_derivatives=keep, low=low, high=high)


def valley(x: Array) -> Array:
    """The curved valley of H. H. Rosenbrock (1960)."""
    return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])


def down_the_valley(x: Array) -> Array:
    return np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])


def curves() -> tuple[Fit, Callable[[Array], Array]]:
    """Two decays, one after the other."""
    time = np.linspace(0, 4, 60)
    seen = 3 * np.exp(-1.7 * time) + 0.01 * np.cos(37 * time)

    def residuals(x: Array) -> Array:
        return np.asarray(x[0] * np.exp(-x[1] * time) - seen)

    def jacobian(x: Array) -> Array:
        return np.stack([np.exp(-x[1] * time), -time * x[0] * np.exp(-x[1] * time)], axis=1)

    return Fit(residuals, jacobian), residuals


def test_down_a_curved_valley() -> None:
    found = Fit(valley, down_the_valley).minimum(np.array([-1.2, 1.0]))
    assert found.converged
    assert found.x == pytest.approx([1, 1], abs=1e-8)
    assert found.at.cost < 1e-16


def test_scipy_ends_at_the_same_place() -> None:
    fit, residuals = curves()
    found = fit.minimum(np.array([1.0, 0.3]))
    theirs = least_squares(residuals, [1.0, 0.3], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert found.x == pytest.approx(theirs.x, rel=1e-7)
    assert found.at.cost == pytest.approx(theirs.cost)
    assert found.information == pytest.approx(theirs.jac.T @ theirs.jac, rel=1e-4)


def test_a_number_at_its_bound_stays_there_and_the_others_go_on() -> None:
    low, high = np.array([0.0, 0.0]), np.array([2.5, 5.0])
    fit, residuals = curves()
    found = fit.minimum(np.array([1.0, 0.3]), low=low, high=high)
    theirs = least_squares(residuals, [1.0, 0.3], bounds=(low, high), xtol=1e-12)
    assert found.converged
    assert found.x[0] == 2.5
    assert found.x == pytest.approx(theirs.x, rel=1e-5)


def test_kept_derivatives_end_at_the_same_place_and_are_taken_less_often() -> None:
    fresh, kept = curves()[0], curves()[0]
    start = np.array([2.5, 1.4])
    always, seldom = fresh.minimum(start, small_gain=1e-12), kept.minimum(start, True, 1e-12)
    assert seldom.converged
    assert seldom.x == pytest.approx(always.x, abs=1e-5)
    assert kept.taken < fresh.taken


def test_where_there_is_no_cost_no_step_ends() -> None:
    def residuals(x: Array) -> Array:
        with np.errstate(invalid="ignore"):
            return np.log(x) - np.log(3.0)

    found = Fit(residuals, lambda x: np.diag(1 / x)).minimum(np.array([40.0]))
    assert found.converged
    assert found.x == pytest.approx([3.0])


def test_a_number_that_does_nothing_stays_where_it_is() -> None:
    found = Fit(lambda x: np.array([x[0] - 2.0]), lambda _: np.array([[1.0, 0.0]])).minimum(np.array([0.0, 7.0]))
    assert found.converged
    assert found.x == pytest.approx([2.0, 7.0], abs=1e-9)


def test_too_few_rounds_are_said() -> None:
    found = Fit(valley, down_the_valley).minimum(np.array([-1.2, 1.0]), rounds=2)
    assert (found.rounds, found.converged) == (2, False)
