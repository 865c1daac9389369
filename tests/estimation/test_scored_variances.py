"""Variances that are learned block by block, on draws of which they are known."""

import numpy as np
import pytest

from logger.estimation.scored_variances import ScoredVariances


@pytest.mark.parametrize("true", [0.02, 1.0, 30.0])
def test_a_variance_is_found_from_its_draws(true: float) -> None:
    rng, found = np.random.default_rng(3), ScoredVariances(np.array([1.0]), 2.0)
    for _ in range(300):
        squares = true * rng.standard_normal(40) ** 2
        found.learn(np.array([0.5 * np.sum(squares / found.values - 1)]), np.array([20.0]))
    assert np.log(found.values[0] / true) == pytest.approx(0.0, abs=0.2)


def test_what_is_told_no_more_goes_back_to_what_is_common() -> None:
    found = ScoredVariances(np.array([1.0]), 2.0)
    for _ in range(40):
        found.learn(np.array([20.0]), np.array([20.0]))
    assert found.values[0] > 5
    for _ in range(1000):
        found.learn(np.zeros(1), np.zeros(1))
    assert found.values[0] == pytest.approx(1.0, rel=0.1)
