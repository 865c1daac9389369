"""Monotonic time to UTC: the floor of the delays, dates that must agree, jumps that are outvoted."""

from __future__ import annotations

import random
from datetime import UTC, datetime

import pytest

from drivers.readings import Fix
from logger.service.timebase import Timebase
from logger.units import DAY_US

NOON_US = int(datetime(2026, 7, 4, 12, 0, 0, tzinfo=UTC).timestamp()) * 1_000_000
BOOT_US = 500_000_000


def fix_at(second: float, late_us: int, dated: bool = True, shift_us: int = 0, may_wait: bool = False) -> Fix:
    """A fix of the instant BOOT + second that arrived ``late_us`` later."""
    utc_us = NOON_US + round(second * 1e6) + shift_us
    return Fix(
        t_us=BOOT_US + round(second * 1e6) + late_us,
        valid=True,
        utc_us=utc_us if dated else None,
        time_of_day_us=utc_us % DAY_US,
        lat_deg=39.0,
        lon_deg=-76.9,
        speed_mps=10.0,
        course_deg=None,
        altitude_m=None,
        satellites=None,
        hdop=None,
        may_wait=may_wait,
    )


def test_wobbling_latency_is_taken_out() -> None:
    rng = random.Random(1)
    timebase = Timebase(latency_s=0.15)
    errors_us = []
    for second in range(200):
        placed = timebase.place(fix_at(second, 150_000 + int(rng.expovariate(1 / 40_000))))
        errors_us.append(abs(placed.t_us - (BOOT_US + second * 1_000_000)))
    assert max(errors_us[20:]) < 10_000
    offset_us = timebase.utc_offset_us()
    assert offset_us is not None
    assert abs(offset_us - (NOON_US - BOOT_US)) < 10_000


def test_utc_waits_for_three_fixes_that_agree() -> None:
    timebase = Timebase(0.1)
    for second in range(2):
        timebase.place(fix_at(second, 100_000))
        assert timebase.utc_offset_us() is None
    timebase.place(fix_at(2, 100_000))
    assert timebase.utc_offset_us() is not None


def test_undated_fixes_are_placed_but_give_no_utc() -> None:
    timebase = Timebase(0.1)
    for second in range(10):
        placed = timebase.place(fix_at(second, 100_000, dated=False))
        assert placed.t_us == BOOT_US + second * 1_000_000
    assert timebase.utc_offset_us() is None


def test_midnight_makes_no_jump() -> None:
    timebase = Timebase(0.1)
    for second in range(12 * 3600 - 5, 12 * 3600 + 5):
        assert timebase.place(fix_at(second, 100_000)).t_us == BOOT_US + second * 1_000_000
    assert timebase.time_jumps == 0
    assert timebase.utc_offset_us() == NOON_US - BOOT_US


def test_one_wild_date_is_outvoted_and_a_lasting_one_is_taken_over() -> None:
    timebase = Timebase(0.1)
    for second in range(10):
        timebase.place(fix_at(second, 100_000))
    timebase.place(fix_at(10, 100_000, shift_us=7 * DAY_US))
    assert timebase.utc_offset_us() == NOON_US - BOOT_US
    for second in range(11, 45):
        timebase.place(fix_at(second, 100_000, shift_us=7 * DAY_US))
    assert timebase.utc_offset_us() == NOON_US - BOOT_US + 7 * DAY_US
    assert timebase.time_jumps == 1


def test_one_stray_time_is_placed_by_its_arrival() -> None:
    timebase = Timebase(0.1)
    for second in range(10):
        timebase.place(fix_at(second, 100_000))
    stray = timebase.place(fix_at(10, 100_000, shift_us=5_000_000))
    assert stray.t_us == BOOT_US + 10_000_000
    assert timebase.utc_offset_us() == NOON_US - BOOT_US


def test_a_second_more_or_less_is_taken_over_after_three_fixes() -> None:
    """A receiver learns the leap seconds late: UTC steps, the car does not."""
    for leap_us in (-2_000_000, -1_000_000, 1_000_000, 2_000_000):
        timebase = Timebase(0.1)
        for second in range(10):
            timebase.place(fix_at(second, 100_000))
        for second in range(10, 20):
            placed = timebase.place(fix_at(second, 100_000, shift_us=leap_us))
            assert abs(placed.t_us - (BOOT_US + second * 1_000_000)) <= 1
        assert timebase.utc_offset_us() == NOON_US - BOOT_US + leap_us


@pytest.mark.parametrize("may_wait", [True, False], ids=["a full line", "a queue that nobody sees"])
def test_fixes_that_come_later_and_later_are_placed_by_their_own_times(may_wait: bool) -> None:
    """Growing by a quarter of a second each to 3.2 s; then some are dropped for a while; at last all catch up."""
    timebase = Timebase(0.1)
    timebase.place(fix_at(0, 100_000))
    for second in range(1, 120):
        late_us = 100_000 + min(250_000 * second, 3_200_000) if second < 100 else 100_000
        if 20 < second < 50 and second % 4 == 0:
            continue
        late_us -= 900_000 if 20 < second < 50 and second % 4 == 1 else 0
        placed = timebase.place(fix_at(second, late_us, may_wait=may_wait))
        assert abs(placed.t_us - (BOOT_US + second * 1_000_000)) < 20_000
    assert timebase.time_jumps == 0


def test_after_a_standstill_of_the_reader_fixes_are_placed_by_their_own_times() -> None:
    """Five a second; what came in 3 s is read at once."""
    timebase = Timebase(0.1)
    for index in range(100):
        second = index / 5
        late_us = 100_000 + max(0, round(1e6 * (13 - second))) if 10 <= second < 13 else 100_000
        assert abs(timebase.place(fix_at(second, late_us)).t_us - (BOOT_US + round(second * 1e6))) < 1000
    assert timebase.time_jumps == 0


def test_a_lone_early_time_does_not_move_those_after_it() -> None:
    timebase = Timebase(0.1)
    for second in range(20):
        placed = timebase.place(fix_at(second, 100_000, shift_us=500_000 if second == 9 else 0))
        assert abs(placed.t_us - (BOOT_US + second * 1_000_000)) < 1000
