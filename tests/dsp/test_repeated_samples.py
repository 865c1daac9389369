"""Repeated samples, distinguished from coarse ones: how often falsely, and how often where there are some."""

from __future__ import annotations

import numpy as np
import pytest

from logger.dsp.repeated_samples import chernoff, find_holds, find_repeats, fresh_times, resolution

from ..support.drives.records import FINE_HZ, at, held, ride, rounded

STEPS = (0.0, 1e-3, 0.0383, 0.098, 0.613, 1.2)  # none, phones, 0.01 g, a BMA220 at 2 and at 4 g


@pytest.mark.slow
def test_no_clean_record_has_repeats() -> None:
    """Rides of any loudness, rate, step and noise, on one axis and three, with stands and jolts: none of 240."""
    false = []
    for seed in range(240):
        rng = np.random.default_rng(seed)
        rate_hz, seconds = rng.choice([80, 100, 200, 1000]), rng.choice([10, 40])
        step, noise = rng.choice(STEPS), rng.choice([0.0, 0.005, 0.02, 0.1, 0.3])
        axes = []
        for _ in range(rng.choice([1, 3])):
            axis = ride(seconds, rng, 10 ** rng.uniform(-1.5, 0.7), rate_hz)
            axis[: int(rng.uniform(0, 0.7) * len(axis))] *= rng.choice([0.0, 0.1, 1.0])
            jolts = rng.random(len(axis)) < 0.002
            axis += np.where(jolts, 5 * rng.standard_normal(len(axis)), 0) + noise * rng.standard_normal(len(axis))
            axes.append(rounded(axis + rng.choice([0, 9.81]), step))
        if find_repeats(np.stack(axes, axis=1)) is not None:
            false.append(seed)
    assert false == []


@pytest.mark.parametrize("step", STEPS)
def test_no_sine_has_repeats(step: float) -> None:
    for f_hz in np.arange(0.5, 49, 0.73):
        for size in (0.3, 1.2, 5):
            wave = size * np.sin(2 * np.pi * f_hz * np.arange(3000) / 100 + np.pi / 4)
            assert find_repeats(rounded(wave, step)[:, None]) is None, (f_hz, size)


@pytest.mark.parametrize(("taken_hz", "written_hz"), [(51, 200), (25, 100), (100, 200), (80, 100), (125, 200)])
@pytest.mark.parametrize("step", [0.0, 0.0024, 0.0383])
@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_held_samples_are_found(taken_hz: float, written_hz: float, step: float, jitter: float) -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        taken_s = np.arange(1, 30, 1 / taken_hz)
        taken_s += jitter / taken_hz * rng.uniform(-1, 1, len(taken_s))
        _, values = held(ride(31, rng, 0.8), taken_s, written_hz, step)
        found = find_repeats(values[:, None])
        assert found is not None
        assert found.share == pytest.approx(1 - taken_hz / written_hz, abs=0.08)
        assert found.chance < 1e-6


def test_a_quiet_half_minute_of_a_phone_is_found() -> None:
    rng = np.random.default_rng(4)
    _, values = held(ride(31, rng, 0.15), np.arange(0.5, 30.5, 1 / 51), 200, 0.0192)
    assert find_repeats(values[:, None]) is not None


def test_a_held_record_comes_back_on_the_grid_it_was_taken_at() -> None:
    fine = ride(31, np.random.default_rng(2), 0.5)
    for taken_hz in (51, 125):
        taken_s = np.arange(0.5, 30, 1 / taken_hz)
        t_s, values = held(fine, taken_s, 200, 0.0383)
        found = find_repeats(values[:, None])
        times_s = fresh_times(found, t_s)
        off_s = (times_s - taken_s[np.argmin(np.abs(taken_s[:, None] - times_s), axis=0)])
        assert off_s.std() < 2e-4  # written up to 5 ms late
        assert np.abs(rounded(at(times_s, fine), 0.0383) - values[found.fresh]).mean() < 0.06


def test_an_axis_that_hardly_moves_hides_nothing() -> None:
    """A dead axis, and one of a few codes, beside one that is held."""
    rng = np.random.default_rng(4)
    t_s, values = held(ride(31, rng, 0.5), np.arange(0.5, 30.5, 1 / 51), 200, 0.01)
    _, few = held(0.3 * rng.standard_normal(31_000), np.arange(0.5, 30.5, 1 / 51), 200, 0.613)
    assert find_repeats(np.stack([np.full(len(t_s), 0.1), few, values], axis=1)) is not None
    alive = rng.standard_normal(len(t_s))
    assert find_repeats(np.stack([alive, few, values], axis=1)) is None


def test_the_end_of_a_range_is_no_repeat() -> None:
    clipped = np.clip(rounded(ride(60, np.random.default_rng(1), 2.0)[:: FINE_HZ // 200], 0.01), -1.5, 1.5)
    assert find_repeats(clipped[:, None]) is None


def test_resolution() -> None:
    rng = np.random.default_rng(0)
    assert resolution(rounded(rng.standard_normal(5000), 0.0383)) == pytest.approx(0.0383)
    assert resolution(rng.standard_normal(10_000)) < 1e-3
    assert resolution(np.full(10, 3.0)) == 0.0


def test_the_bound_is_above_the_binomial_tail() -> None:
    from scipy.stats import binom

    for hits, tries in ((30, 40), (99, 100), (20, 20), (51, 100), (3, 10)):
        assert chernoff(hits, tries, 0.5) >= binom.sf(hits - 1, tries, 0.5) * (1 - 1e-9)


def noise(seconds: float = 60.0, step: float = 0.001, axes: int = 3) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(8)
    time_s = np.arange(0, seconds, 0.01)
    return time_s, step * np.round(0.3 / step * rng.standard_normal((len(time_s), axes)))


@pytest.mark.parametrize("axes", [1, 3])
@pytest.mark.parametrize(("begin_s", "end_s"), [(20.0, 40.0), (30.0, 30.3), (40.0, 60.0)])
def test_a_sensor_that_stands_still_for_long_is_found_once_is_enough(axes: int, begin_s: float, end_s: float) -> None:
    time_s, samples = noise(axes=axes)
    still = slice(round(100 * begin_s), round(100 * end_s))
    samples[still] = samples[still][0]
    assert np.flatnonzero(find_holds(time_s, samples)).tolist() == list(range(still.start + 1, still.stop))


def test_holds_of_a_second_are_no_record_of_100_hz() -> None:
    time_s, samples = noise(20.0)
    assert find_holds(time_s, samples[np.arange(2000) // 100 * 100]).sum() == 1980


def test_what_stands_still_for_a_reason_is_no_hold() -> None:
    """A car that comes to rest under a sensor without noise, a coarse sensor on a quiet road, the end of a range."""
    time_s, samples = noise()
    rest = 0.0024 * np.round(samples * np.exp(-np.maximum(0, 30 - np.abs(time_s - 30))[:, None] / 1.5) / 0.0024)
    assert (rest[2500:3500] == 0).mean() > 0.9
    coarse = 0.6 * np.round(samples / 0.6)
    clipped = np.clip(samples[:, :1], -0.3, 0.3)
    clipped[1000:1040] = 0.3
    for one in (samples, rest, coarse, clipped):
        assert not find_holds(time_s, one).any()
