"""The road under a tire, against integrals taken piece by piece."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

from logger.lab.likelihood.posterior import NotSimulated
from logger.profiles.track import TirePath, Track

START_M = 3.0
ROADS = st.tuples(
    st.integers(0, 2**32 - 1), st.integers(1, 60), st.sampled_from([0.01, 0.05, 0.07, 0.25, 1.0, 30.0]),
    st.sampled_from([0.0, 0.01, 0.1, 0.25, 0.26, 0.3, 1.0]),
)


def road(seed: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(count) + 150.0


def by_hand(x: np.ndarray, z: np.ndarray, low: float, high: float) -> float:
    """Mean of the straight lines from low to high: trapezoids between all corners."""
    if high == low:
        return float(np.interp(low, x, z))
    corners = np.unique(np.concatenate([[low, high], x[(x > low) & (x < high)]]))
    return float(np.trapezoid(np.interp(corners, x, z), corners) / (high - low))


@given(ROADS)
@settings(max_examples=60)
def test_the_average_over_the_patch_is_exact(numbers: tuple[int, int, float, float]) -> None:
    seed, count, spacing_m, patch_m = numbers
    z, x = road(seed, count), START_M + spacing_m * np.arange(count)
    at = np.concatenate([np.linspace(x[0] - 2, x[-1] + 2, 97), x, x + patch_m / 2, x - patch_m / 2])
    expected = [by_hand(x, z, centre - patch_m / 2, centre + patch_m / 2) for centre in at]
    assert Track(spacing_m, z, START_M).averaged(at, patch_m) == pytest.approx(expected, abs=1e-9)


@given(ROADS)
@settings(max_examples=40)
def test_the_mean_over_a_step_is_exact_forward_back_and_standing(numbers: tuple[int, int, float, float]) -> None:
    seed, count, spacing_m, patch_m = numbers
    path = TirePath(START_M, spacing_m, road(seed, count), patch_m)
    rng = np.random.default_rng(seed)
    at = START_M - 1 + np.cumsum(rng.choice([0.0, 0.003, 0.02, 0.4, -0.1], 60))
    elevation, mean = path.step_means(at)
    assert elevation == pytest.approx(path.elevation(at), abs=1e-12)
    knots = (START_M + spacing_m * np.arange(count)[:, None] + [patch_m / 2, -patch_m / 2]).ravel()
    for low, high, found in zip(at[:-1], at[1:], mean, strict=True):
        inside = knots[(knots > min(low, high)) & (knots < max(low, high))]
        corners = np.unique(np.concatenate([[low, high], inside]))
        middle = (corners[1:] + corners[:-1]) / 2  # Simpson's rule is exact for a parabola
        pieces = (path.elevation(corners[:-1]) + 4 * path.elevation(middle) + path.elevation(corners[1:])) / 6
        expected = pieces @ np.diff(corners) / np.ptp(corners) if low != high else path.elevation(np.array([low]))[0]
        assert found == pytest.approx(expected, abs=1e-8)


def test_ten_kilometres_in_the_mountains_keep_their_digits() -> None:
    x = 0.05 * np.arange(200_001)
    hills = 100 * np.sin(2 * np.pi * x / 10_000) + 1500
    path = TirePath(0.0, 0.05, hills, 0.25)
    at = np.linspace(9000, 9001, 2001)  # 0.5 mm per step
    area = make_interp_spline(at, path.elevation(at), k=1).antiderivative()
    assert path.step_means(at)[1] == pytest.approx(np.diff(area(at)) / np.diff(at), abs=1e-6)


def test_two_tracks_side_by_side() -> None:
    both = np.stack([road(1, 30), road(2, 30)], axis=1)
    at = np.linspace(0, 10, 50)
    found = Track(0.1, both).averaged(at, 0.25)
    assert found.shape == (50, 2)
    for column in (0, 1):
        assert found[:, column] == pytest.approx(Track(0.1, both[:, column]).averaged(at, 0.25), abs=1e-12)
    assert Track(0.1, both, 5.0).end_m == pytest.approx(7.9)


@pytest.mark.parametrize(("spacing_m", "elevation_m", "start_m", "complaint"), [
    (0.0, np.zeros(3), 0.0, "spacing above 0"),
    (np.nan, np.zeros(3), 0.0, "spacing above 0"),
    (0.1, np.zeros(3), np.inf, "a start"),
    (0.1, np.zeros(0), 0.0, "shape"),
    (0.1, np.zeros((3, 3)), 0.0, "shape"),
    (0.1, np.zeros((2, 3, 2)), 0.0, "shape"),
    (0.1, np.array([0.0, np.nan]), 0.0, "finite elevations"),
])
def test_what_is_no_track_is_refused(spacing_m: float, elevation_m: np.ndarray, start_m: float, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        Track(spacing_m, elevation_m, start_m)


def test_a_patch_below_nothing_is_refused() -> None:
    for patch_m in (-0.1, np.nan):
        with pytest.raises(ValueError, match="contact patch"):
            Track(0.1, np.zeros(3)).averaged([0.0], patch_m)


def test_a_patch_that_no_memory_holds_is_no_car() -> None:
    """A step of a fit that goes too far is taken back, as of a car that moves without bound."""
    for patch_m in (1e12, np.inf):
        with pytest.raises(NotSimulated, match="contact patch"):
            Track(0.1, np.zeros(3)).averaged([0.0], patch_m)
