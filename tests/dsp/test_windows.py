"""Cutting into windows: every sample lands in exactly one, whatever the portions it came in."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.dsp.windows import GridSamples, Window, WindowCutter

STEP_US = 10_000
WINDOW_M = 7.62


def samples(count: int, seed: int = 0, present: np.ndarray | None = None) -> GridSamples:
    rng = np.random.default_rng(seed)
    yes = np.ones(count, dtype=bool)
    no = np.zeros(count, dtype=bool)
    accel = rng.normal(size=count)
    there = yes if present is None else present
    t_us = STEP_US * np.arange(count, dtype=np.int64)
    return GridSamples(t_us, accel, accel, 0.5 * accel, np.abs(accel), there, no, yes, no, accel[:, None],
                       yes[:, None], np.zeros((count, 1)))


def push(cutter: WindowCutter, part: GridSamples, distance_m: np.ndarray, speed_mps: np.ndarray) -> list[Window]:
    return cutter.push_known(part, distance_m, speed_mps, np.zeros(len(part), dtype=bool), leg=0)


def test_sums_are_those_of_the_samples_between_the_multiples() -> None:
    count, speed_mps = 1000, 11.0
    part = samples(count)
    distance_m = speed_mps * np.arange(count) * 0.01
    windows = push(WindowCutter(WINDOW_M, 5.0, STEP_US), part, distance_m, np.full(count, speed_mps))
    assert len(windows) == int(distance_m[-1] // WINDOW_M)
    for number, window in enumerate(windows):
        inside = (distance_m >= number * WINDOW_M) & (distance_m < (number + 1) * WINDOW_M)
        weighted = part.weighted_mps2[inside]
        assert window.start_m == number * WINDOW_M
        assert window.end_m == (number + 1) * WINDOW_M
        assert window.samples == inside.sum()
        assert window.t_us == part.t_us[inside][0]
        assert not window.flags
        np.testing.assert_allclose(window.a_w_mps2, np.sqrt(np.mean(weighted**2)))
        np.testing.assert_allclose(window.vdv_mps175, (np.sum(weighted**4) * 0.01) ** 0.25)
        np.testing.assert_allclose(window.mtvv_mps2, part.running_rms_mps2[inside].max())
        np.testing.assert_allclose(window.peak_mps2, np.abs(weighted).max())
        np.testing.assert_allclose(window.speed_mps, speed_mps)


@settings(max_examples=50)
@given(cuts=st.lists(st.integers(0, 600), max_size=12), seed=st.integers(0, 10))
def test_portions_do_not_matter(cuts: list[int], seed: int) -> None:
    count = 600
    rng = np.random.default_rng(seed)
    speed_mps = np.clip(np.cumsum(rng.normal(0, 0.8, count)), 0, 30)
    distance_m = np.cumsum(speed_mps) * 0.01
    part = samples(count, seed)

    def cut(edges: list[int]) -> list[Window]:
        cutter = WindowCutter(WINDOW_M, 5.0, STEP_US)
        windows = []
        for low, high in pairwise([0, *edges, count]):
            windows += push(cutter, part.of(slice(low, high)), distance_m[low:high], speed_mps[low:high])
        return windows + cutter.break_off()

    whole, portions = cut([]), cut(sorted(cuts))
    assert [(w.t_us, w.start_m, w.end_m, w.samples, w.flags) for w in whole] == [
        (w.t_us, w.start_m, w.end_m, w.samples, w.flags) for w in portions
    ]
    np.testing.assert_allclose([w.a_w_mps2 for w in whole], [w.a_w_mps2 for w in portions])
    assert sum(w.samples for w in whole) == np.count_nonzero(speed_mps > 0)


def test_standing_time_is_in_no_average_and_the_window_says_so() -> None:
    count = 900
    speed_mps = np.full(count, 10.0)
    speed_mps[305:600] = 0.0
    distance_m = np.concatenate([[0.0], np.cumsum(speed_mps[:-1]) * 0.01])
    windows = push(WindowCutter(WINDOW_M, 5.0, STEP_US), samples(count), distance_m, speed_mps)
    stood = [window for window in windows if "stationary" in window.flags]
    assert [window.start_m for window in stood] == [4 * WINDOW_M]
    assert abs(stood[0].duration_s - WINDOW_M / 10.0) < 0.02


def test_missing_samples_are_flagged_and_a_window_of_them_has_no_figures() -> None:
    count = 800
    present = np.ones(count, dtype=bool)
    present[100:103] = False
    present[400:480] = False
    distance_m = 10.0 * np.arange(count) * 0.01
    part = samples(count, present=present)
    windows = push(WindowCutter(WINDOW_M, 5.0, STEP_US), part, distance_m, np.full(count, 10.0))
    assert "gap" in windows[1].flags
    assert np.isfinite(windows[1].a_w_mps2)
    assert "gap" in windows[5].flags
    assert np.isnan(windows[5].a_w_mps2)
    assert "gap" not in windows[3].flags


def test_blind_stretches_are_cut_by_time_and_have_no_distance() -> None:
    cutter = WindowCutter(WINDOW_M, 5.0, STEP_US)
    windows = cutter.push_blind(samples(1200)) + cutter.break_off()
    assert [window.samples for window in windows] == [500, 500, 200]
    assert all(window.start_m is None and {"blind", "gps_lost"} <= window.flags for window in windows)
    assert "partial" in windows[-1].flags
    assert "partial" not in windows[0].flags
