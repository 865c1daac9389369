"""Fixes on the recorder's clock."""

from __future__ import annotations

import numpy as np

from drivers.readings import Fix
from logger.extraction.recorded_columns import fix_times_s
from logger.service.timebase import Timebase


def arrived(count: int = 600, drift: float = 20e-6, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """When fixes were true by the recorder's clock, when they came, and what time of day they name, over midnight."""
    rng = np.random.default_rng(seed)
    gps_s = 86_400 - 300.0 + np.arange(count)
    true_s = (gps_s - gps_s[0]) * (1 + drift) + 50
    return true_s, true_s + 0.2 + np.abs(rng.normal(0, 0.03, count)), gps_s % 86_400


def placed(arrival_s: np.ndarray, named_s: np.ndarray) -> np.ndarray:
    """As on board, by arrivals 0.2 s late."""
    timebase = Timebase(0.2)
    fixes = [Fix(round(at * 1e6), True, None, round(named * 1e6), 1.0, 2.0, 3.0, None, None, None, None)
             for at, named in zip(arrival_s, named_s, strict=True)]
    return np.array([timebase.place(fix).t_us / 1e6 for fix in fixes])


def test_waits_are_taken_out_and_a_clock_that_drifts_is_followed() -> None:
    for drift in (20e-6, -20e-6):
        true_s, arrival_s, named_s = arrived(drift=drift)
        on_board_s = placed(arrival_s, named_s)
        assert np.abs(on_board_s - true_s).max() > 0.01
        assert np.abs(fix_times_s(on_board_s, named_s) - true_s).max() < 0.01


def test_neither_a_wrong_time_nor_a_jump_of_the_receiver_is_a_step_of_the_car() -> None:
    true_s, arrival_s, named_s = arrived()
    named_s[300] += 7.0
    named_s[400:] -= 2.0
    found = fix_times_s(placed(arrival_s, named_s), named_s)
    assert np.abs(found - true_s).max() < 0.12


def test_without_times_fixes_stay_where_they_were_placed() -> None:
    _, arrival_s, _ = arrived(5)
    assert np.array_equal(fix_times_s(arrival_s, np.full(5, np.nan)), arrival_s)
