"""The equations of the most probable road against a dense solution, with preconditioners that are right and wrong."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from logger.identification.unknown_road.road_operator import factored, solve

COUNT, SAMPLES, VARIANCE = 40, 60, 1e-4
RNG = np.random.default_rng(4)
TO_READING = RNG.standard_normal((COUNT, SAMPLES)) * np.geomspace(1, 1e-3, COUNT)[:, None]


def model(to_reading: np.ndarray = TO_READING) -> Any:
    """Drives whose operator is a matrix (count, n)."""
    crossing = SimpleNamespace(unit_readings=lambda waves, response, first, end: to_reading[first:end])
    return SimpleNamespace(
        variance=VARIANCE, crossings=[crossing], waves=[None], responses=[None],
        readings=lambda white: [white @ to_reading], back=lambda one, count: one[0] @ to_reading.T / VARIANCE)


def dense(readings: np.ndarray) -> np.ndarray:
    return np.linalg.solve(np.eye(COUNT) + TO_READING @ TO_READING.T / VARIANCE, TO_READING @ readings.T / VARIANCE).T


def test_the_equations_are_solved() -> None:
    readings = RNG.standard_normal((3, SAMPLES))
    white, unexplained, rounds = solve(model(), [readings], COUNT, 1e-9, preconditioner=factored(model(), COUNT))
    assert rounds < 20
    assert white == pytest.approx(dense(readings), rel=1e-6, abs=1e-6)
    assert unexplained[0] * VARIANCE == pytest.approx(readings - white @ TO_READING, abs=1e-9)


@pytest.mark.parametrize("size", [1e-60, 1.0, 1e60])
def test_readings_of_any_size_are_solved_alike(size: float) -> None:
    """In single precision 1e39 is infinite and 1e-46 is 0."""
    readings = RNG.standard_normal((2, SAMPLES))
    white, *_ = solve(model(), [size * readings], COUNT, 1e-9, 60, factored(model(), COUNT))
    assert white / size == pytest.approx(dense(readings), rel=1e-5, abs=1e-5)


def test_a_preconditioner_that_points_uphill_costs_rounds_and_nothing_else() -> None:
    """As one does that was taken at another place, of a car whose stops are hit, and has only a float's digits."""
    readings, asked = RNG.standard_normal((3, SAMPLES)), []
    good = factored(model(), COUNT)

    def bad(residual: np.ndarray) -> np.ndarray:
        asked.append(len(asked))
        return -good(residual) if len(asked) in (2, 5) else good(residual)

    white, *_ = solve(model(), [readings], COUNT, 1e-9, 80, bad)
    assert len(asked) == 80
    assert white == pytest.approx(dense(readings), rel=1e-5, abs=1e-5)
