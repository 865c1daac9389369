"""When an accelerometer counts as frozen, and what its windows then say."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.readings import AccelerationBlock, Fix
from logger.service.doubted_spans import FROZEN_S, Stillness

US = 1_000_000


def block(second: int, reading: float = 9.8, until_s: float | None = None) -> AccelerationBlock:
    """A second of one and the same reading; all readings from ``until_s`` on are another."""
    t_us = second * US + np.arange(100) * 10_000
    accel = np.full((100, 3), reading)
    if until_s is not None:
        accel[t_us >= until_s * US] += 0.6
    return AccelerationBlock(t_us, accel, np.zeros(100, np.bool_))


def fix(second: int, speed_mps: float | None = 15.0) -> Fix:
    """A second's fix; without a speed the receiver had none."""
    valid = speed_mps is not None
    return Fix(second * US, valid, None, None, 46.0 if valid else None, 6.0 if valid else None, speed_mps, None, None,
               None, None)


def frozen_for(seconds: int) -> Stillness:
    stillness = Stillness()
    for second in range(1, seconds + 1):
        stillness.take(block(second), [fix(second)])
    return stillness


def test_nothing_is_said_before_half_a_minute_and_from_then_on_all_since_the_first_reading() -> None:
    stillness = frozen_for(round(FROZEN_S))
    assert not stillness.spans.covers(0, 100 * US)
    stillness.take(block(31), [fix(31)])
    assert stillness.spans.covers(1 * US, 2 * US)
    assert not stillness.spans.covers(0, 1 * US)


def test_it_lasts_to_the_very_reading_that_changes() -> None:
    stillness = frozen_for(40)
    stillness.take(block(41, until_s=41.75), [])
    assert stillness.spans.covers(41 * US + 740_000, 41 * US + 745_000)
    assert not stillness.spans.covers(41 * US + 750_000, 60 * US)
    instants = 41 * US + np.array([0, 740_000, 750_000, 990_000])
    assert stillness.spans.during(instants).tolist() == [True, True, False, False]


@pytest.mark.parametrize("fixes", [[], [fix(41, 0.0)], [fix(41, None)]])
def test_a_frozen_sensor_stays_frozen_without_a_fix_and_at_a_halt(fixes: list[Fix]) -> None:
    stillness = frozen_for(40)
    stillness.take(block(41), fixes)
    assert stillness.spans.covers(41 * US + 500_000, 42 * US)


def test_the_same_reading_after_a_silence_is_no_news_and_another_is() -> None:
    stillness = frozen_for(40)
    stillness.take(block(50), [])
    assert stillness.spans.covers(50 * US, 51 * US)
    stillness.take(block(60, 9.2), [])
    assert not stillness.spans.covers(60 * US, 61 * US)


def test_it_can_freeze_again() -> None:
    stillness = frozen_for(40)
    for second in range(41, 80):
        stillness.take(block(second, 9.2), [fix(second)])
    assert stillness.spans.covers(45 * US, 46 * US)
    assert stillness.spans.covers(78 * US, 79 * US)
