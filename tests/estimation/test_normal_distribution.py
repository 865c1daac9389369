"""Gaussian sums against scipy, quadrature and closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import foldnorm, norm

from logger.estimation.normal_distribution import (
    density,
    distribution,
    mean_absolute,
    probability_between,
    variance_of_mean_absolute,
    within,
)

NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)


def truncated(low: float, high: float) -> tuple[float, float]:
    """Mean and variance of a standard normal variable within bounds, by quadrature over where its density counts."""
    near = min(max(low, 0.0), high) if high > 0 else high
    reach = 12.0 / max(abs(near), 1.0) ** (abs(near) > 4)
    begin, end = max(low, near - reach), min(high, near + reach)
    x = 0.5 * (begin + end) + 0.5 * (end - begin) * NODES
    mass = WEIGHTS * np.exp(-0.5 * (x**2 - near**2))
    mean = (mass @ x) / mass.sum()
    return mean, (mass @ (x - mean) ** 2) / mass.sum()


def test_density_and_distribution_far_into_the_lower_tail() -> None:
    u = np.linspace(-37.0, 9.0, 2001)
    assert distribution(u) == pytest.approx(norm.cdf(u), rel=2e-7, abs=0)
    assert density(u) == pytest.approx(norm.pdf(u), rel=1e-12, abs=0)


def test_a_probability_between_bounds_keeps_its_digits_in_both_tails() -> None:
    low = np.array([-9.0, -2.0, -0.5, 0.3, 4.0, 8.5])
    exact = np.where(low > 0, norm.sf(low) - norm.sf(low + 0.5), norm.cdf(low + 0.5) - norm.cdf(low))
    assert probability_between(low, low + 0.5) == pytest.approx(exact, rel=1e-5)


def test_distribution_takes_infinities() -> None:
    assert distribution(np.array([-np.inf, np.inf])).tolist() == [0.0, 1.0]


@settings(max_examples=150)
@given(
    mean=st.floats(-20, 20), deviation=st.floats(0.05, 5), low=st.floats(-6, 6), width=st.floats(0.02, 12),
    open_side=st.sampled_from(("", "low", "high")),
)
def test_within_two_bounds_or_one(mean: float, deviation: float, low: float, width: float, open_side: str) -> None:
    """``low`` and ``width`` are counted in deviations."""
    bounds = (-np.inf if open_side == "low" else low, np.inf if open_side == "high" else low + width)
    exact_mean, exact_variance = truncated(*bounds)
    found_mean, found_variance = within(
        np.array([mean]), np.array([deviation**2]), *(np.array([mean + deviation * bound]) for bound in bounds)
    )
    assert found_mean[0] == pytest.approx(mean + deviation * exact_mean, abs=2e-5 * deviation)
    assert found_variance[0] == pytest.approx(deviation**2 * exact_variance, rel=2e-3, abs=2e-5 * deviation**2)


def test_within_everything_changes_nothing() -> None:
    mean, variance = np.array([3.0, -1.0]), np.array([0.5, 2.0])
    found = within(mean, variance, np.full(2, -np.inf), np.full(2, np.inf))
    assert found[0] == pytest.approx(mean, abs=1e-15) and found[1] == pytest.approx(variance)


@pytest.mark.parametrize("off", [12.0, 25.0, 36.0, 60.0, 1e4, 1e9])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("end", [1.0, np.inf])
def test_bounds_far_off_hold_the_variable_near_the_nearer_one(off: float, side: float, end: float) -> None:
    """Half-way in the tail is the density's scale, 1 / off; no warning, no NaN, no variance of zero."""
    bounds = np.sort([side * off, side * (off + end)])
    mean, variance = within(np.zeros(1), np.ones(1), bounds[:1], bounds[1:])
    assert off * (1 - 1e-12) <= side * mean[0] <= off + 1.2 / off
    assert 0 < variance[0] <= 2e-2


@settings(max_examples=100)
@given(
    mean=st.floats(-1e3, 1e3), variance=st.floats(1e-6, 1e4), low=st.floats(-1e4, 1e4), width=st.floats(1e-4, 1e4),
)
def test_within_is_between_its_bounds_and_no_wider_than_before(
    mean: float, variance: float, low: float, width: float
) -> None:
    found_mean, found_variance = within(
        np.array([mean]), np.array([variance]), np.array([low]), np.array([low + width])
    )
    slack = 1e-4 * np.sqrt(variance) + 1e-9 * max(abs(low), abs(mean))
    assert low - slack <= found_mean[0] <= low + width + slack
    assert 0 < found_variance[0] <= variance


def test_within_of_the_mirror_image_is_the_mirror_image() -> None:
    mean, variance = np.linspace(-3, 3, 41), np.full(41, 0.7)
    low, high = np.full(41, 0.4), np.full(41, 1.0)
    one, other = within(mean, variance, low, high), within(-mean, variance, -high, -low)
    assert one[0] == pytest.approx(-other[0], rel=1e-9) and one[1] == pytest.approx(other[1], rel=1e-6)


@settings(max_examples=60)
@given(mean=st.floats(-30, 30), deviation=st.floats(0.1, 10))
def test_mean_absolute_is_that_of_the_folded_normal(mean: float, deviation: float) -> None:
    expected = foldnorm.mean(abs(mean) / deviation, scale=deviation)
    assert mean_absolute(np.array([mean]), np.array([deviation]))[0] == pytest.approx(expected, rel=1e-6)


def covariance_of_absolutes(means: np.ndarray, deviations: np.ndarray, correlation: float) -> float:
    """Of two jointly normal variables: of the second given the first |x| has a closed mean, the rest is quadrature."""
    u = np.linspace(-9, 9, 6001)
    first = means[0] + deviations[0] * u
    rest = deviations[1] * np.sqrt(1 - correlation**2)
    second = means[1] + deviations[1] * correlation * u
    mean_second = foldnorm.mean(np.abs(second) / rest, scale=rest)
    both = np.sum(np.abs(first) * mean_second * norm.pdf(u)) * (u[1] - u[0])
    alone = [foldnorm.mean(abs(m) / s, scale=s) for m, s in zip(means, deviations, strict=True)]
    return both - alone[0] * alone[1]


@pytest.mark.parametrize("correlation", [-0.6, -0.2, 0.0, 0.3, 0.7, 0.95])
@pytest.mark.parametrize("means", [(0.0, 0.0), (1.0, 1.2), (0.5, -0.8), (3.0, 0.2), (4.0, 5.0)])
def test_variance_of_a_weighted_pair(correlation: float, means: tuple[float, float]) -> None:
    """Orders above the second are not distinguished: a few per cent, or more where means of unlike sign go together."""
    mean, deviation, weight = np.array(means), np.array([1.0, 1.4]), np.array([0.6, 0.4])
    variances = mean**2 + deviation**2 - mean_absolute(mean, deviation) ** 2
    exact = weight**2 @ variances + 2 * weight.prod() * covariance_of_absolutes(mean, deviation, correlation)
    found = variance_of_mean_absolute(mean, deviation, np.array([1.0, correlation]), weight)
    assert found == pytest.approx(exact, abs=(0.16 if min(means) < 0 else 0.05) * weight**2 @ variances)


def test_variance_without_and_with_full_correlation_is_exact() -> None:
    mean, deviation = np.linspace(-2, 2, 9), np.linspace(0.3, 1.1, 9)
    weight = np.linspace(1, 2, 9)
    variance = foldnorm.var(np.abs(mean) / deviation, scale=deviation)
    alone = variance_of_mean_absolute(mean, deviation, np.eye(9)[0], weight)
    assert alone == pytest.approx(weight**2 @ variance, rel=1e-6)
    same = variance_of_mean_absolute(np.full(9, 0.4), np.full(9, 0.7), np.ones(9), weight)
    assert same == pytest.approx(weight.sum() ** 2 * foldnorm.var(0.4 / 0.7, scale=0.7), rel=1e-6)


def test_variance_of_a_window_of_correlated_slopes() -> None:
    """Fifty slopes with a decaying, swinging correlation, by drawing them."""
    lag = np.arange(50)
    correlation = np.exp(-lag / 15.0) * np.cos(lag / 6.0)
    rng = np.random.default_rng(1)
    mean = 1.2 * np.sin(lag / 4.0)
    deviation = 0.5 + 0.3 * np.cos(lag / 20.0)
    matrix = correlation[np.abs(lag[:, None] - lag)] * np.outer(deviation, deviation)
    drawn = mean + rng.standard_normal((40_000, 50)) @ np.linalg.cholesky(matrix + 1e-10 * np.eye(50)).T
    found = variance_of_mean_absolute(mean, deviation, correlation, np.full(50, 0.02))
    assert found == pytest.approx(np.abs(drawn).mean(axis=1).var(), rel=0.03)
