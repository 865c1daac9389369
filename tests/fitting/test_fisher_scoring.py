"""Fisher scoring and information matrices, against solutions that are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest

from logger.fitting.fisher_scoring import integrated_out, inverse, maximise, whitening

Array = npt.NDArray[np.float64]
COUNTS = np.array([3.0, 11.0, 40.0])


@dataclass(frozen=True, eq=False)
class Poisson:
    """Slopes and information of Poisson counts by the logarithms of their means; the slopes as steep as ``steepness``
    times what the information says."""

    slopes: Array
    information: Array


def score(x: Array, information: bool, steepness: float = 1.0) -> Poisson:
    return Poisson(steepness * (COUNTS - np.exp(x)), np.diag(np.exp(x)))


@pytest.mark.parametrize("steepness", [1.0, 0.7, 1.6])
def test_the_largest_likelihood_is_found_though_the_information_is_rough(steepness: float) -> None:
    found = maximise(lambda x, information: score(x, information, steepness), np.zeros(3), np.full(3, -9.0),
                     np.full(3, 9.0), np.full(3, 1.5), close=1e-6, most_steps=30)
    assert found.converged and found.steps < 15
    assert np.exp(found.x) == pytest.approx(COUNTS, rel=1e-5)


def test_a_number_stays_within_its_bounds_and_steps_are_not_too_long() -> None:
    tried: list[Array] = []

    def watched(x: Array, information: bool) -> Poisson:
        tried.append(x)
        return score(x, information)

    found = maximise(watched, np.zeros(3), np.full(3, -9.0), np.array([9.0, 9.0, 2.0]), np.full(3, 0.4), close=1e-3,
                     most_steps=30)
    assert found.converged and found.x[2] == 2.0
    assert np.exp(found.x[:2]) == pytest.approx(COUNTS[:2], rel=1e-2)
    assert max(np.abs(np.diff(tried, axis=0)).max(axis=1)) <= 0.4 + 1e-12


def test_the_information_is_taken_rarely() -> None:
    asked = []
    maximise(lambda x, information: asked.append(information) or score(x, information), np.log(COUNTS) + 0.1,
             np.full(3, -9.0), np.full(3, 9.0), np.full(3, 1.0), close=1e-6, most_steps=30)
    assert asked[0] and sum(asked) == 1 and len(asked) > 2


def test_steps_end_where_they_were_to_end() -> None:
    found = maximise(score, np.zeros(3), np.full(3, -9.0), np.full(3, 9.0), np.full(3, 0.1), close=1e-6, most_steps=2)
    assert not found.converged and found.steps == 2


def test_numbers_that_are_integrated_out() -> None:
    """The block of the covariance, in units that differ by powers of ten."""
    root = np.random.default_rng(1).standard_normal((9, 5)) * np.array([1e5, 1.0, 1e-4, 1e2, 1e-3])
    information = root.T @ root
    out = np.array([1, 4])
    own = np.array([0, 2, 3])
    block = np.linalg.inv(information)[np.ix_(own, own)]
    unit = np.sqrt(np.diag(block))
    assert inverse(integrated_out(information, out)) / np.outer(unit, unit) == pytest.approx(
        block / np.outer(unit, unit), rel=1e-6, abs=1e-9)


def test_what_nothing_is_known_of_is_left_where_it_is() -> None:
    information = np.diag([4.0, 0.0, 9.0])
    assert inverse(information) == pytest.approx(np.diag([0.25, 0.0, 1 / 9]))
    together = np.array([[1.0, 1.0], [1.0, 1.0]])
    assert len(whitening(together)) == 1
