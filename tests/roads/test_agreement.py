"""Figures of agreement against cases whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from logger.roads.repeated_drives import agreement, best_shift_m, factor_to, matching_cells, mean_between

RNG = np.random.default_rng(3)
TRUE = np.exp(0.5 * RNG.standard_normal(20_000))


def test_errors_of_known_size() -> None:
    std = np.full(TRUE.shape, 0.1)
    found = agreement(TRUE + 0.1 * RNG.standard_normal(TRUE.shape), std, TRUE)
    assert found is not None
    assert found.r2 == pytest.approx(1 - 0.01 / TRUE.var(), abs=1e-3)
    assert found.mae_m_per_km == pytest.approx(0.1 * np.sqrt(2 / np.pi), rel=0.02)
    assert (found.within_one, found.within_two) == pytest.approx((0.683, 0.954), abs=0.01)
    assert abs(found.bias) < 0.005


def test_a_factor_is_a_bias_and_an_offset_of_the_logarithm() -> None:
    found = agreement(1.5 * TRUE, None, TRUE)
    assert found is not None
    assert found.bias == pytest.approx(0.5)
    assert found.r2_log == pytest.approx(1 - np.log(1.5) ** 2 / np.var(np.log(TRUE)))
    assert np.isnan(found.within_one)
    assert factor_to(1.5 * TRUE, TRUE) == pytest.approx(1 / 1.5)


def test_what_is_not_known_does_not_count() -> None:
    mine, theirs = np.array([1.0, np.nan, 3.0, 4.0]), np.array([1.0, 2.0, np.nan, 5.0])
    found = agreement(mine, None, theirs)
    assert found is not None
    assert (found.windows, found.mae_m_per_km) == (2, 0.5)
    assert agreement(mine[:2], None, theirs[:2]) is None
    assert agreement(np.array([1.0, 2.0]), None, np.array([3.0, 3.0])) is None
    assert np.isnan(factor_to(np.array([np.nan]), np.array([1.0])))


def test_means_between_places() -> None:
    edges, values = np.array([0.0, 10.0, 20.0, 30.0]), np.array([1.0, 3.0, np.nan])
    begin, end = np.array([0.0, 5.0, 15.0, -1.0, 12.0, 8.0]), np.array([20.0, 15.0, 25.0, 5.0, 13.0, 8.0])
    assert mean_between(edges, values, begin, end) == pytest.approx([2, 2, np.nan, np.nan, 3, np.nan], nan_ok=True)


@pytest.mark.parametrize("shift_m", [-7.0, 0.0, 4.0])
def test_a_shift_is_found(shift_m: float) -> None:
    edges = np.arange(0.0, 2001.0, 10.0)
    values = np.exp(0.3 * RNG.standard_normal(200))
    begin = np.arange(100.0, 1900.0, 10.0)
    mine = mean_between(edges, values, begin + shift_m, begin + shift_m + 10)
    assert best_shift_m(edges, values, begin, begin + 10, mine, 10.0) == shift_m
    assert best_shift_m(edges, values, begin[:2], begin[:2] + 10, mine[:2], 10.0) == 0


def test_cells_are_matched_whole() -> None:
    begin, other = np.arange(0.0, 1000.0, 10.0), np.arange(3.0, 990.0, 10.0)
    mine = np.exp(0.3 * RNG.standard_normal(100))
    for cells in (-1, 0, 2):
        theirs = np.roll(mine, cells)[:99]
        found, moved = matching_cells(begin, mine, other, theirs, 2)
        assert moved == cells
        known = np.isfinite(found)
        assert known.sum() >= 96
        assert found[known] == pytest.approx(mine[known])
