"""Where a recording is cut."""

from __future__ import annotations

import numpy as np

from logger.extraction.recorded_columns import stretches

TIME_S = np.arange(0, 200, 0.01)
FIX_S = np.arange(0.5, 200, 1.0)


def cut(present: np.ndarray, fix_s: np.ndarray, speed: np.ndarray) -> list[tuple[float, float]]:
    return [(round(begin, 2), round(end, 2)) for begin, end in
            stretches(TIME_S, present, fix_s, speed, 5.0, 30.0, 0.5)]


def test_a_drive_without_a_break_is_one_stretch() -> None:
    assert cut(np.ones(len(TIME_S), bool), FIX_S, np.full(len(FIX_S), 9.0)) == [(0.5, 199.5)]


def test_lost_fixes_and_lost_readings_end_a_stretch() -> None:
    present = (TIME_S < 100) | (TIME_S >= 101)
    fixes = FIX_S[(FIX_S < 40) | (FIX_S > 60)]
    found = cut(present, fixes, np.full(len(fixes), 9.0))
    assert found == [(0.5, 39.5), (60.5, 99.99), (101.0, 199.5)]


def test_a_short_hole_stays_inside() -> None:
    present = (TIME_S < 100) | (TIME_S >= 100.3)
    assert cut(present, FIX_S, np.full(len(FIX_S), 9.0)) == [(0.5, 199.5)]


def test_long_standing_is_left_out_but_for_its_ends() -> None:
    speed = np.where((FIX_S > 50) & (FIX_S < 120), 0.0, 9.0)
    assert cut(np.ones(len(TIME_S), bool), FIX_S, speed) == [(0.5, 55.5), (114.5, 199.5)]


def test_nothing_to_cut() -> None:
    assert cut(np.zeros(len(TIME_S), bool), FIX_S, np.full(len(FIX_S), 9.0)) == []
    assert cut(np.ones(len(TIME_S), bool), FIX_S[:1], np.full(1, 9.0)) == []
