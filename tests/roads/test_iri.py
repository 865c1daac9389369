"""The exact IRI against the World Bank's published check, analytic gains and plain algebra."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.roads.iri import iri, rectified_slope, window_iri
from logger.vehicle.quarter_car import GOLDEN_CAR, structure
from logger.vehicle.state_space import held_step

# World Bank Technical Paper 46 (1986), pages 41-42: a triangular pulse of 20 mm height,
# and the running IRI at some distances.
RUNNING_IRI = {
    1.0: 0.0, 1.25: 0.44424, 1.5: 1.46822, 1.75: 2.70319, 2.0: 3.7738, 2.5: 4.80554, 3.0: 4.7518, 3.5: 4.93081,
    4.0: 6.6562, 4.75: 7.84294, 5.0: 7.82931, 6.0: 7.01181, 7.0: 6.3088, 30.0: 2.04955,
}


def pulse(spacing_m: float, length_m: float = 30.0) -> np.ndarray:
    distance = np.arange(round(length_m / spacing_m) + 1) * spacing_m
    return np.interp(distance, [0, 1, 3, 5, length_m], [0, 0, 0.02, 0, 0])


def test_world_bank_check_pulse() -> None:
    slope = rectified_slope(pulse(0.25), 0.25)
    running = 1000 * np.cumsum(slope) / np.arange(1, len(slope) + 1)
    assert len(running) == 120
    for distance_m, expected in RUNNING_IRI.items():
        assert running[round(distance_m / 0.25) - 1] == pytest.approx(expected, abs=7e-6)
    assert running.max() == pytest.approx(7.84294, abs=7e-6)
    assert iri(pulse(0.25), 0.25) == pytest.approx(2.04955, abs=7e-6)


def test_state_transition_has_the_printed_coefficients() -> None:
    """World Bank Technical Paper 46, table of coefficients at 0.25 m, for states (z_s', z_s'', z_u', z_u'')."""
    transition, gain = held_step(*structure(GOLDEN_CAR).state_space(), 0.25 / (80 / 3.6))
    order = [0, 2, 1, 3]
    printed = np.array([
        [0.9966071, 0.01091514, -0.002083274, 0.0003190145],
        [-0.5563044, 0.9438768, -0.8324718, 0.05064701],
        [0.02153176, 0.002126763, 0.7508714, 0.008221888],
        [3.335013, 0.3376467, -39.12762, 0.4347564],
    ])
    assert transition[np.ix_(order, order)] == pytest.approx(printed, rel=2e-6)
    # The first is printed 5.476107e-3, which would give a straight slope an IRI.
    assert gain[order, 0] == pytest.approx([5.476206e-3, 1.388776, 0.2275968, 35.79262], rel=2e-6)


@pytest.mark.parametrize("spacing_m", [0.025, 0.1, 0.25, 0.6])
def test_a_straight_slope_has_no_roughness(spacing_m: float) -> None:
    assert iri(7.0 + 0.03 * np.arange(0, 100, spacing_m), spacing_m) < 1e-8


def golden_gain(wave_number_cpm: float) -> float:
    """|z_s' - z_u'| of the Golden Car per slope of a sinusoidal road, by its transfer function at 80 km/h."""
    s = 2j * np.pi * wave_number_cpm * 80 / 3.6
    wheel_per_body = (s**2 + 6.0 * s + 63.3) / (6.0 * s + 63.3)
    body = 653.0 / ((0.15 * s**2 + 6.0 * s + 63.3 + 653.0) * wheel_per_body - (6.0 * s + 63.3))
    return abs(body - wheel_per_body * body)


@pytest.mark.parametrize("wave_number_cpm", [0.02, 0.065, 0.1, 0.42, 1.0])
@pytest.mark.parametrize("spacing_m", [0.01, 0.25])
def test_sinusoids_have_their_analytic_gain(wave_number_cpm: float, spacing_m: float) -> None:
    """Mean of a rectified sine: 2 / pi of its amplitude. The road's slope is amplitude times 2 pi n; the 250 mm slope
    average is a sinc; at 0.25 m the chord of each step is that same sinc, and what is held over a step another."""
    length_m, amplitude_m = 400 / wave_number_cpm, 0.001
    distance = np.arange(0, length_m, spacing_m)
    slope = rectified_slope(amplitude_m * np.sin(2 * np.pi * wave_number_cpm * distance), spacing_m)
    settled = slope[len(slope) // 4:]
    road_slope = amplitude_m * 2 * np.pi * wave_number_cpm * np.sinc(0.25 * wave_number_cpm)
    held = np.sinc(spacing_m * wave_number_cpm)  # first image of the held slope: the only one that matters here
    expected = 2 / np.pi * road_slope * held * golden_gain(wave_number_cpm)
    images = 0.03 if wave_number_cpm * spacing_m > 0.2 else 0.004
    assert settled.mean() == pytest.approx(expected, rel=images)


def test_gain_peaks_where_the_literature_says() -> None:
    n = np.linspace(0.02, 1.0, 2000)
    gains = np.array([golden_gain(x) for x in n])
    body, wheel = n[n < 0.2], n[n >= 0.2]
    assert body[gains[n < 0.2].argmax()] == pytest.approx(0.065, abs=0.005)
    assert wheel[gains[n >= 0.2].argmax()] == pytest.approx(0.42, abs=0.03)


def test_the_tire_average_is_used_below_167_mm_only() -> None:
    rough = np.cumsum(np.random.default_rng(1).standard_normal(4001)) * 1e-4
    assert len(rectified_slope(rough, 0.1)) == 4001 - 3
    assert len(rectified_slope(rough, 0.166)) == 4001 - 2
    assert len(rectified_slope(rough, 0.168)) == 4001 - 1
    assert len(rectified_slope(rough, 0.025)) == 4001 - 10


def test_windows_weigh_up_to_the_whole_and_share_steps() -> None:
    profile = np.cumsum(np.random.default_rng(2).standard_normal(2001)) * 1e-3
    slope = rectified_slope(profile, 0.25)
    edges = np.append(np.arange(0, 490, 7.62), 500.0)
    windows = window_iri(slope, 0.25, edges)
    assert windows @ np.diff(edges) / 500.0 == pytest.approx(iri(profile, 0.25), rel=1e-12)
    inside = window_iri(slope, 0.25, [10.0, 10.1, 10.25])
    assert inside == pytest.approx([1000 * slope[40]] * 2)
    for edges in ([0, 10, 10], [-1, 5], [0, 501.0]):
        with pytest.raises(ValueError, match="edges"):
            window_iri(slope, 0.25, edges)


@given(st.integers(30, 2000), st.floats(0.006, 0.9), st.floats(0.1, 50), st.integers(0, 99))
@settings(deadline=None, max_examples=40)
def test_iri_scales_with_height_and_forgets_slope(count: int, spacing_m: float, scale: float, seed: int) -> None:
    if (count - 1) * spacing_m < 11.0:
        count = int(11.0 / spacing_m) + 2
    profile = np.cumsum(np.random.default_rng(seed).standard_normal(count)) * 1e-3
    value = iri(profile, spacing_m)
    moved = scale * profile + 3.0 - 0.02 * spacing_m * np.arange(count)
    assert iri(moved, spacing_m) == pytest.approx(scale * value, rel=1e-6)


def test_what_is_no_profile_is_refused() -> None:
    with pytest.raises(ValueError, match="11 m"):
        iri(np.zeros(44), 0.25)
    with pytest.raises(ValueError, match="11 m"):
        iri(np.zeros(4400), 0.0)
    with pytest.raises(ValueError, match="finite"):
        iri([0.0, np.nan] * 100, 0.25)
    assert iri(np.zeros(45), 0.25) == 0.0
