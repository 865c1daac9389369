"""Ticks of an adapter's timer, distinguished from the teeth of the samples themselves."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.sample_clock import NO_TIME, SampleClock, is_ticked

from ..support.slow import slow


@pytest.mark.parametrize("timer_us", [16_003.0, 8_010.0, 15_950.0])
def test_a_timer_near_a_multiple_of_the_period_is_seen(timer_us: float) -> None:
    rng = np.random.default_rng(1)
    ticks_us = np.arange(128) * 5 * timer_us + rng.uniform(0, 300, 128)
    assert is_ticked(ticks_us, 4_001.3, 20_000)


def test_the_teeth_of_the_samples_are_no_timer() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        teeth_us = 4_001.3 * np.cumsum(rng.integers(12, 28, 128)) + rng.uniform(0, 300, 128)
        assert not is_ticked(teeth_us, 4_001.3, 20_000)
    assert not is_ticked(teeth_us, 12_000.0, 20_000)  # no multiple is short enough


@pytest.mark.parametrize("timer_us", [0.0, 16_003.0])
def test_a_timer_makes_no_losses_and_a_single_one_is_seen_without(timer_us: float) -> None:
    """250 Hz for a minute; the timer drifts against four samples by a sample in half a minute."""
    rng = np.random.default_rng(2)
    numbers = np.arange(15_000)
    if not timer_us:
        numbers = numbers[numbers != 9000]
    there_us = numbers * 4_001.3
    read_us = np.ceil(there_us / timer_us) * timer_us if timer_us else there_us
    arrivals_us = np.maximum.accumulate(read_us + rng.exponential(80, len(read_us))).astype(np.int64)
    clock = SampleClock(100, 0.02)
    clock.feed(arrivals_us)
    clock.restart()
    assert (clock.lost, clock.resyncs) == (0 if timer_us else 1, 0)


def as_read(taken_us: np.ndarray, timer_us: float = 0.0) -> np.ndarray:
    """Arrivals [us] of samples that leave an adapter at the ticks of its timer, if it has one, and are read by who
    waits for one, sleeps for 50 to 60 ms, and takes what is there."""
    rng = np.random.default_rng(3)
    there_us = np.maximum.accumulate(taken_us + 600 + rng.normal(0, 60, len(taken_us)))
    if timer_us:
        there_us = np.ceil(there_us / timer_us) * timer_us
    arrivals_us, k = np.empty(len(taken_us), dtype=np.int64), 0
    while k < len(taken_us):
        for woken_us in (there_us[k], there_us[k] + 50_100 + rng.uniform(0, 10_000)):
            end = int(np.searchsorted(there_us, woken_us, "right"))
            arrivals_us[k:end] = woken_us + rng.exponential(80)
            k = max(k, end)
            if k == len(taken_us):
                break
    return np.maximum.accumulate(arrivals_us)


@pytest.mark.parametrize("rate_hz", [100, 110, 250, *slow(120, 150, 175, 200, 400)])
@pytest.mark.parametrize("timer_us", [0.0, 16_003.0])
def test_no_loss_is_seen_where_there_is_none(rate_hz: int, timer_us: float) -> None:
    taken_us = np.arange(rate_hz * 40) * (1e6 / rate_hz)
    clock = SampleClock(100, 0.02)
    for some in np.array_split(as_read(taken_us, timer_us), 400):
        clock.feed(some)
    assert clock.lost + clock.resyncs <= 1
    assert not clock.too_many_lost


def undated_share(rate_hz: int, kept: np.ndarray) -> float:
    """Of the samples of a sensor of this rate that are kept (n,), after the first ten seconds."""
    taken_us = np.flatnonzero(kept) * (1e6 / rate_hz)
    clock = SampleClock(100, 0.02)
    times_us = np.concatenate([clock.feed(some) for some in np.array_split(as_read(taken_us), 400)])
    return float(np.mean(times_us[10 * rate_hz:] == NO_TIME))


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [110, 125, 150, 200, 250, 400])
@pytest.mark.parametrize(("every", "count"), [(50, 1), (100, 2), (25, 1)])
def test_even_losses_of_a_faster_sensor_are_no_slower_clock(rate_hz: int, every: int, count: int) -> None:
    assert undated_share(rate_hz, np.arange(rate_hz * 60) % every >= count) > 0.95


@pytest.mark.slow
@pytest.mark.parametrize(("rate_hz", "lost"), [(110, 0.0), (150, 0.0), (200, 0.0), (400, 0.0), (200, 0.003),
                                               (250, 0.003), (400, 0.003)])
def test_few_losses_by_chance_leave_a_faster_sensor_dated(rate_hz: int, lost: float) -> None:
    kept = np.random.default_rng(4).random(rate_hz * 60) >= lost
    assert undated_share(rate_hz, kept) < 0.1
