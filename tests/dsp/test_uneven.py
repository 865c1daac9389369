"""Uneven samples on an even grid: sines against their formula, noise against scipy, and what has to be filtered out."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from scipy.signal import resample_poly

from logger.dsp.repeated_samples import burst_ends, spread
from logger.dsp.whole_record import mean_rate_hz, on_even_grid


def jittered(rate_hz: float, jitter: float, seconds: float = 40.0) -> np.ndarray:
    count = int(seconds * rate_hz)
    return (np.arange(count) + jitter * np.random.default_rng(3).uniform(-1, 1, count)) / rate_hz


@pytest.mark.parametrize(("taken_hz", "wanted_hz", "jitter"), [
    (104, 100, 0.1), (104, 104, 0.3), (51, 100, 0.2), (400, 100, 0.3), (104, 250, 0.2)])
def test_a_sine_comes_out_as_its_formula(taken_hz: float, wanted_hz: float, jitter: float) -> None:
    t_s = jittered(taken_hz, jitter)
    for f_hz in (0.5, 2, 5, 10, 20, 0.36 * min(taken_hz, wanted_hz)):
        laid = on_even_grid(t_s, np.sin(2 * np.pi * f_hz * t_s + 0.7)[:, None], mean_rate_hz(t_s), wanted_hz)[:, 0]
        grid_s = t_s[0] + np.arange(len(laid)) / wanted_hz
        error = laid - np.sin(2 * np.pi * f_hz * grid_s + 0.7)
        assert np.abs(error[100:-100]).max() < (0.015 if f_hz < 0.2 * taken_hz else 0.05), f_hz


@pytest.mark.parametrize("f_hz", [56.0, 75.0, 90.0, 150.0])
def test_what_would_fold_is_filtered_out(f_hz: float) -> None:
    t_s = jittered(400, 0.1)
    laid = on_even_grid(t_s, np.sin(2 * np.pi * f_hz * t_s + 0.7)[:, None], mean_rate_hz(t_s), 100)[:, 0]
    assert np.abs(laid[100:-100]).max() < 0.005
    assert np.sin(2 * np.pi * f_hz * t_s[::4] + 0.7).std() > 0.6  # counted away it would all be there


def test_a_fast_record_takes_no_more_memory_for_its_long_kernel() -> None:
    t_s = jittered(10_000, 0.2, 6.0)
    values = np.sin(2 * np.pi * 5 * t_s)[:, None] * np.ones(3)
    tracemalloc.start()
    try:
        laid = on_even_grid(t_s, values, mean_rate_hz(t_s), 100.0)
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak_bytes < 64e6  # 4,096 rows of the kernel at once were 600 MB
    grid_s = t_s[0] + np.arange(len(laid)) / 100
    assert np.abs(laid[100:-100, 0] - np.sin(2 * np.pi * 5 * grid_s)[100:-100]).max() < 0.001


def test_an_even_record_is_resampled_as_scipy_does_it() -> None:
    rng = np.random.default_rng(1)
    t_s = np.arange(8000) / 200
    values = np.stack([resample_poly(rng.standard_normal(4000), 2, 1) for _ in range(2)], axis=1)
    values = np.cumsum(values, axis=0) * 0.01  # most of it below 40 Hz
    ours, theirs = on_even_grid(t_s, values, 200, 100), resample_poly(values, 1, 2, axis=0, window=("kaiser", 8.0))
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs)[100:-100].max() < 0.03 * values.std()
    assert on_even_grid(t_s, values, 200, 200) == pytest.approx(values, abs=1e-9)


def test_a_hole_is_crossed_by_a_straight_line() -> None:
    t_s = np.arange(1000) / 100.0
    keep = (t_s < 4) | (t_s > 4.3)
    wave = np.sin(2 * np.pi * 0.2 * t_s)
    laid = on_even_grid(t_s[keep], wave[keep, None], mean_rate_hz(t_s[keep]), 100)[:, 0]
    assert np.abs(laid - wave).max() < 0.03


def test_bursts_are_spread_evenly() -> None:
    true_s = np.arange(3000) / 97
    arrived_s = np.ceil(true_s * 8) / 8
    ends = burst_ends(arrived_s)
    assert ends is not None
    assert np.abs(spread(arrived_s, ends) - true_s - 0.055).max() < 0.06  # the buffer's own delay is not known
    assert np.diff(spread(arrived_s, ends)) == pytest.approx(1 / 97, rel=2e-4)
    assert burst_ends(true_s) is None
    assert burst_ends(jittered(100, 0.4)) is None
    arrived_s[1500:] += 2.0
    with pytest.raises(ValueError, match="off an even rate"):
        spread(arrived_s, ends)


def test_a_record_that_ends_in_motion_is_right_up_to_its_end() -> None:
    """A ramp under a sine: neither end is at rest."""
    draw = np.random.default_rng(7)
    t_s = np.sort(np.arange(0, 6, 0.004) + draw.normal(0, 0.001, 1500) * (draw.random(1500) < 0.2))

    def wave(at_s: np.ndarray) -> np.ndarray:
        return 3.0 + at_s + np.sin(2 * np.pi * 1.3 * at_s)

    hz = mean_rate_hz(t_s)
    laid = on_even_grid(t_s, wave(t_s)[:, None], hz, hz)[:, 0]
    assert np.abs(laid - wave(t_s[0] + np.arange(len(laid)) / hz)).max() < 0.003
