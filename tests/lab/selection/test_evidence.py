"""A ratio of evidences bounds how often noise alone looks like an effect, whatever was tried and however often."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.lab.selection.evidence import FALSE_ALARM, min_gain, probability_by_chance, probability_of_likelihood_gain

GAINS = st.floats(-1e4, 1e4)
COUNTS = st.integers(1, 500)


@pytest.mark.parametrize("deviation", [0.3, 3.0, 30.0])
@pytest.mark.parametrize("candidates", [1, 20])
def test_noise_looks_like_an_effect_no_more_often_than_is_said(candidates: int, deviation: float) -> None:
    """Candidates whose size has a normal prior, where there is nothing but noise: their evidence is known exactly."""
    z = np.random.default_rng(3).normal(size=(20_000, candidates))
    shrunk = deviation**2 / (1 + deviation**2)
    gains = (shrunk * z**2 - np.log1p(deviation**2)).max(axis=1)
    p_values = np.array([probability_by_chance(gain, candidates) for gain in gains])
    for often in (0.5, 0.1, 0.01, FALSE_ALARM):
        assert (p_values < often).mean() <= often


def test_the_best_of_fixed_alternatives_is_bounded_too() -> None:
    """A score of likelihoods that hides no number at all, and is as large by chance as one can be."""
    z = np.random.default_rng(4).normal(size=(20_000, 20))
    for size in (0.5, 2.0, 4.0):
        gains = (2 * size * z - size**2).max(axis=1)
        p_values = np.array([probability_by_chance(gain, 20) for gain in gains])
        assert all((p_values < often).mean() <= often for often in (0.1, 0.01, FALSE_ALARM))


@given(COUNTS)
def test_the_least_gain_is_just_what_makes_a_false_alarm(candidates: int) -> None:
    assert probability_by_chance(min_gain(candidates), candidates) == pytest.approx(FALSE_ALARM)
    assert probability_by_chance(min_gain(candidates) + 0.1, candidates) < FALSE_ALARM


@given(GAINS, GAINS, COUNTS, COUNTS)
def test_less_gain_and_more_candidates_make_it_more_probable(first: float, other: float, few: int, many: int) -> None:
    low, high = sorted((first, other))
    few, many = sorted((few, many))
    assert 0 <= probability_by_chance(high, few) <= probability_by_chance(low, few) <= 1
    assert probability_by_chance(low, few) <= probability_by_chance(low, many)


@given(st.floats(-1e9, 0.0), COUNTS)
def test_a_loss_is_certain_to_come_by_chance(loss: float, candidates: int) -> None:
    assert probability_by_chance(loss, candidates) == 1


@pytest.mark.parametrize("numbers", [1, 2, 3])
def test_fits_to_noise_gain_as_much_as_is_said(numbers: int) -> None:
    """Least squares on noise, the best of ten trials."""
    rng = np.random.default_rng(6)
    columns, _ = np.linalg.qr(rng.normal(size=(80, 10 * numbers)))
    explained = (rng.normal(size=(20_000, 80)) @ columns) ** 2
    gains = explained.reshape(20_000, 10, numbers).sum(axis=2).max(axis=1)
    p_values = np.array([probability_of_likelihood_gain(gain, numbers, 10) for gain in gains])
    for often in (0.1, 0.01, FALSE_ALARM):
        assert 0.4 * often < (p_values < often).mean() < 1.6 * often


def test_the_tails_are_those_of_tables() -> None:
    assert probability_of_likelihood_gain(16.45, 1, 20) == pytest.approx(0.001, rel=0.01)
    assert probability_of_likelihood_gain(19.81, 2, 20) == pytest.approx(0.001, rel=0.01)
    assert probability_of_likelihood_gain(-5.0, 2, 20) == 1
