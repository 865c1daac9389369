"""Samples of uneven recorders on an even grid: what a signal was between its samples is known."""

from __future__ import annotations

import numpy as np
import pytest

from logger.extraction.recorded_columns import clipped_samples, even_samples


def signal(time_s: np.ndarray) -> np.ndarray:
    """Three axes (n, 3) with nothing above 20 Hz."""
    waves = [(0.7, 1.3), (1.0, 7.1), (0.5, 13.0), (0.3, 19.0)]
    return np.stack([sum(a * np.sin(2 * np.pi * f * time_s + axis) for a, f in waves) for axis in range(3)], axis=1)


def uneven(rate_hz: float, jitter: float, seconds: float = 30.0) -> np.ndarray:
    time_s = np.arange(0.0, seconds, 1 / rate_hz)
    return time_s + jitter / rate_hz * np.random.default_rng(1).uniform(-1, 1, len(time_s))


@pytest.mark.parametrize(("rate_hz", "jitter"), [(104.3, 0.2), (51.0, 0.1), (417.0, 0.3), (200.0, 0.0), (100.0, 0.2)])
def test_any_rate_gives_what_the_signal_was(rate_hz: float, jitter: float) -> None:
    time_s = uneven(rate_hz, jitter)
    found = even_samples(time_s, signal(time_s), 100.0)
    assert np.allclose(np.diff(found.time_s), 0.01)
    inside = slice(50, -50)
    assert np.abs(found.samples - signal(found.time_s))[inside].max() < 0.02
    assert found.present.all()
    assert not found.clipped.any()
    assert found.own_hz == pytest.approx(rate_hz, rel=0.01)
    assert found.repeats == 0.0


def test_samples_on_the_grid_are_left_alone() -> None:
    time_s = 5.0 + np.arange(2000) * 0.01
    samples = signal(time_s)
    found = even_samples(np.round(time_s, 3), samples, 100.0)
    assert found.as_read
    assert (found.samples == samples).all()


def test_short_holes_are_marked_and_long_ones_end_a_piece() -> None:
    time_s = uneven(104.0, 0.1)
    kept = ~(((time_s > 10) & (time_s < 10.2)) | ((time_s > 20) & (time_s < 21)))
    found = even_samples(time_s[kept], signal(time_s[kept]), 100.0)
    assert not found.present[(found.time_s > 10.01) & (found.time_s < 10.19)].any()
    assert found.present.sum() > len(found.time_s) - 25
    assert not ((found.time_s > 20.01) & (found.time_s < 20.99)).any()


def test_repeats_are_dropped() -> None:
    rng = np.random.default_rng(3)
    taken_s = np.arange(0, 60, 1 / 51)
    taken = np.round(signal(taken_s) + 2 * rng.standard_normal((len(taken_s), 3)), 2)
    time_s = np.arange(0.02, 59, 1 / 200)
    last = np.searchsorted(taken_s, time_s, side="right") - 1
    found = even_samples(time_s, taken[last], 100.0)
    assert found.own_hz == pytest.approx(51, rel=0.01)
    assert found.repeats == pytest.approx(1 - 51 / 200, abs=0.01)


def test_bursts_are_spread() -> None:
    time_s = np.arange(0, 30, 1 / 200)
    burst_s = np.ceil(time_s / 0.05 - 1e-9) * 0.05
    found = even_samples(burst_s, signal(time_s), 100.0)
    apart = np.abs(found.samples - signal(found.time_s))[50:-50]
    assert np.median(apart) < 0.1  # times are those of the last sample of a burst, a row or so late


def test_a_plain_end_of_the_range_is_marked() -> None:
    time_s = np.arange(0, 30, 0.01)
    samples = np.round(40 * signal(time_s)) / 10
    cut = np.clip(samples, -5, 5)
    assert (clipped_samples(cut) == (np.abs(cut) >= 5).any(axis=1)).all()
    assert not clipped_samples(samples).any()


def test_slow_and_short_records_are_refused() -> None:
    time_s = np.arange(0, 30, 0.05)
    with pytest.raises(ValueError, match="samples a second"):
        even_samples(time_s, signal(time_s), 100.0)
    with pytest.raises(ValueError, match="without a pause"):
        even_samples(np.arange(30.0), signal(np.arange(30.0)), 100.0)
