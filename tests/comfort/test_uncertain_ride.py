"""Figures of a ride that is known as a Gaussian path, against the mean and scatter of many drawn ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import gamma

from logger.comfort.iso2631 import a_w, vdv
from logger.comfort.uncertain_ride import PowerSum, RideSums, fourth_power_sum, gamma_root, larger, square_sum

STEP_S = 0.01
COUNT = 60


def path(scale: float) -> np.ndarray:
    time_s = STEP_S * np.arange(COUNT)
    return scale * (np.sin(2 * np.pi * 5.0 * time_s) + 0.5 * np.sin(2 * np.pi * 11.0 * time_s + 1.0))


def correlation() -> np.ndarray:
    lag_s = STEP_S * np.arange(COUNT)
    return np.exp(-lag_s / 0.04) * np.cos(2 * np.pi * 8.0 * lag_s)


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "level"), [(0.3, 0.1), (0.1, 0.3), (0.0, 0.2)])
def test_sums_are_those_of_drawn_paths(scale: float, level: float) -> None:
    std = level * np.linspace(0.7, 1.3, COUNT)
    lag = np.abs(np.subtract.outer(np.arange(COUNT), np.arange(COUNT)))
    covariance = np.outer(std, std) * correlation()[lag]
    rng = np.random.default_rng(1)
    drawn = path(scale) + rng.multivariate_normal(np.zeros(COUNT), covariance, 50_000)
    for power, sum_of in ((2, square_sum), (4, fourth_power_sum)):
        found = sum_of(path(scale), std, correlation())
        sums = (drawn**power).sum(axis=1)
        assert found.mean == pytest.approx(sums.mean(), rel=0.01)
        assert found.variance == pytest.approx(sums.var(), rel=0.04)


def test_a_ride_known_exactly_has_the_plain_figures_and_no_error() -> None:
    ride = path(0.4)
    squares, fourths = (one(ride, np.zeros(COUNT), correlation()) for one in (square_sum, fourth_power_sum))
    found = RideSums(COUNT, squares, fourths, squares, COUNT).figures(STEP_S)
    assert found.a_w.value == pytest.approx(a_w(ride))
    assert found.vdv.value == pytest.approx(vdv(ride, STEP_S))
    assert found.a_w.std == found.vdv.std == found.mtvv.std == 0.0


@pytest.mark.slow
@given(mean=st.floats(1e-4, 10.0), relative=st.floats(0.01, 3.0), degree=st.sampled_from([2, 4]))
@settings(max_examples=60)
def test_root_of_a_gamma_variable(mean: float, relative: float, degree: int) -> None:
    found = gamma_root(mean, (relative * mean)**2, degree)
    drawn = gamma(a=relative**-2, scale=mean * relative**2).ppf((np.arange(20_000) + 0.5) / 20_000)
    roots = drawn ** (1 / degree)
    assert found.value == pytest.approx(roots.mean(), rel=5e-3)
    assert found.std == pytest.approx(roots.std(), rel=2e-2)


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_the_larger_of_two_is_more_than_either(correlation: float) -> None:
    rng = np.random.default_rng(4)
    drawn = rng.multivariate_normal([1.0, 1.2], [[0.09, 0.06 * correlation], [0.06 * correlation, 0.04]], 400_000)
    found = larger(PowerSum(1.0, 0.09), PowerSum(1.2, 0.04), correlation)
    assert found.mean == pytest.approx(drawn.max(axis=1).mean(), rel=3e-3)
    assert found.variance == pytest.approx(drawn.max(axis=1).var(), rel=2e-2)
    assert larger(PowerSum(1.2, 0.04), PowerSum(1.0, 0.09), correlation) == found
    assert larger(PowerSum(1.0, 0.0), PowerSum(1.2, 0.0), correlation).mean == 1.2


def test_a_sum_of_nothing_or_less_is_zero_with_an_error() -> None:
    found = PowerSum(-0.2, 0.04).root(1.0, 2)
    assert found.value == 0.0
    assert found.std == pytest.approx(0.2**0.5)


def test_stretches_add_up_and_what_they_share_adds_in_full() -> None:
    one = PowerSum(1.0, 0.04, 0.1)
    both = one.plus(one)
    assert (both.mean, both.variance, both.shared) == (2.0, 0.08, 0.2)
    loud, quiet = (RideSums(10, one, one, PowerSum(mean, 0.0), 100) for mean in (3.0, 2.0))
    assert quiet.plus(loud).running.mean == loud.plus(quiet).running.mean == 3.0
    assert quiet.plus(loud).count == 20
