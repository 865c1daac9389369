"""Jittered samples to a grid, and a fast grid to a slow one."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.dsp.resample import Decimator, GridResampler, GridRun, decimation_taps


def on_grid(
    t_us: np.ndarray,
    values: np.ndarray,
    clipped: np.ndarray | None = None,
    rate_hz: int = 100,
    cuts: list[int] | None = None,
) -> tuple[list[GridRun], GridResampler]:
    """Push samples split at ``cuts``; the pieces of each stretch joined."""
    resampler = GridResampler(rate_hz)
    clipped = np.zeros(len(t_us), dtype=bool) if clipped is None else clipped
    runs = []
    for part in np.split(np.arange(len(t_us)), sorted(cuts or [])):
        runs += resampler.push(t_us[part], values[part], clipped[part])
    return joined(runs + resampler.flush()), resampler


def joined(runs: list[GridRun]) -> list[GridRun]:
    """The pieces of each stretch as one run; checks that each follows the one before it."""
    stretches: list[list[GridRun]] = []
    for run in runs:
        if run.new_start:
            stretches.append([])
        else:
            begun = stretches[-1]
            count = sum(len(piece.values) for piece in begun)
            assert run.t0_us == begun[0].t0_us + count * 1_000_000 // run.rate_hz
        stretches[-1].append(run)
    return [
        GridRun(
            pieces[0].t0_us,
            pieces[0].rate_hz,
            np.concatenate([piece.values for piece in pieces]),
            np.concatenate([piece.nearest for piece in pieces]),
            np.concatenate([piece.clipped for piece in pieces]),
            np.concatenate([piece.bridged for piece in pieces]),
            True,
        )
        for pieces in stretches
    ]


def bits(runs: list[GridRun]) -> list[tuple[int, bytes, bytes, bytes]]:
    return [(run.t0_us, run.values.tobytes(), run.clipped.tobytes(), run.bridged.tobytes()) for run in runs]


def messy_record() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Jitter, lost samples, holes, a doubled time, a step back."""
    rng = np.random.default_rng(3)
    t_us = 5_000_000 + 10_000 * np.arange(400) + rng.integers(-1000, 1000, 400)
    keep = rng.random(400) > 0.05
    keep[120:150] = False
    keep[152:170] = False
    t_us = t_us[keep].astype(np.int64)
    t_us[40], t_us[60] = t_us[39], t_us[57]
    return t_us, rng.standard_normal(len(t_us)), rng.random(len(t_us)) > 0.9


MESSY = messy_record()
MESSY_RUNS = bits(on_grid(*MESSY)[0])


@given(cuts=st.lists(st.integers(0, len(MESSY[0])), max_size=30))
@settings(max_examples=60)
def test_any_split_gives_the_same_bits(cuts: list[int]) -> None:
    assert bits(on_grid(*MESSY, cuts=cuts)[0]) == MESSY_RUNS


def test_single_samples_give_the_same_bits() -> None:
    assert bits(on_grid(*MESSY, cuts=list(range(len(MESSY[0]))))[0]) == MESSY_RUNS


def test_samples_on_their_instants_come_through_unchanged() -> None:
    values = np.random.default_rng(4).standard_normal(50)
    [run], _ = on_grid(77 + 10_000 * np.arange(50), values)
    assert run.t0_us == 77
    assert run.values.tobytes() == values.tobytes()
    assert not run.bridged.any()


def test_a_polynomial_of_degree_seven_is_exact() -> None:
    rng = np.random.default_rng(5)
    t_us = (10_000 * np.arange(40) + rng.integers(-3000, 3000, 40)).astype(np.int64)
    polynomial = np.polynomial.Polynomial(rng.standard_normal(8), domain=[0, 4e5])
    [run], _ = on_grid(t_us, polynomial(t_us))
    grid_us = t_us[0] + 10_000 * np.arange(len(run.values))
    np.testing.assert_allclose(run.values, polynomial(grid_us), atol=1e-10)


@pytest.mark.parametrize(
    ("f_hz", "amplitude_error", "rms_error"), [(10, 0.001, 0.005), (20, 0.01, 0.01), (30, 0.06, 0.07)]
)
def test_a_sine_from_a_slow_and_jittered_clock(f_hz: float, amplitude_error: float, rms_error: float) -> None:
    rng = np.random.default_rng(6)
    t_us = np.round(np.arange(6000) * 1e6 / 99.97 + rng.uniform(-1000, 1000, 6000)).astype(np.int64)
    [run], _ = on_grid(t_us, np.sin(2e-6 * np.pi * f_hz * t_us))
    phase = 2e-6 * np.pi * f_hz * (t_us[0] + 10_000 * np.arange(len(run.values)))
    inner = slice(8, -8)
    basis = np.stack([np.sin(phase), np.cos(phase)], axis=1)[inner]
    amplitude = np.hypot(*np.linalg.lstsq(basis, run.values[inner])[0])
    rms = np.sqrt(2 * np.mean((run.values - np.sin(phase))[inner] ** 2))
    print(f"{f_hz} Hz: amplitude {100 * (amplitude - 1):+.3f} %, r.m.s. error {100 * rms:.3f} %")
    assert abs(amplitude - 1) < amplitude_error
    assert rms < rms_error


def test_a_short_hole_is_bridged_and_marked() -> None:
    t_us = 10_000 * np.arange(60)
    wave = np.sin(2e-6 * np.pi * 5 * t_us)
    keep = np.ones(60, dtype=bool)
    keep[[20, 40, 41]] = False
    [run], _ = on_grid(t_us[keep], wave[keep])
    np.testing.assert_array_equal(np.flatnonzero(run.bridged), [20, 40, 41])
    np.testing.assert_allclose(run.values, wave, atol=1e-3)


def test_a_long_hole_starts_a_new_grid_at_the_next_sample() -> None:
    t_us = np.concatenate([10_000 * np.arange(20), 226_003 + 10_000 * np.arange(20)])
    runs, _ = on_grid(t_us, np.arange(40.0))
    assert [run.t0_us for run in runs] == [0, 226_003]
    assert [len(run.values) for run in runs] == [20, 20]
    np.testing.assert_array_equal(np.concatenate([run.values for run in runs]), np.arange(40.0))


def test_a_hole_in_a_fast_grid_is_crossed_on_a_straight_line() -> None:
    t_us = 1_250 * np.arange(200)
    keep = np.ones(200, dtype=bool)
    keep[80:100] = False
    noise = np.random.default_rng(7).standard_normal(200)
    [run], _ = on_grid(t_us[keep], noise[keep], rate_hz=800)
    np.testing.assert_allclose(run.values[80:100], np.linspace(noise[79], noise[100], 22)[1:-1])
    np.testing.assert_array_equal(run.values[keep], noise[keep])
    np.testing.assert_array_equal(run.bridged, ~keep)


def test_samples_too_close_or_going_back_are_dropped_and_counted() -> None:
    t_us = np.array([0, 10_000, 10_000, 9_000, 20_000, 22_000, 30_000, 40_000])
    [run], resampler = on_grid(t_us, np.array([0.0, 1, 9, 9, 2, 9, 3, 4]))
    np.testing.assert_array_equal(run.values, [0, 1, 2, 3, 4])
    assert resampler.dropped == 3


def test_a_clipped_sample_marks_the_grid_sample_nearest_to_it() -> None:
    t_us = 10_000 * np.arange(30) + np.where(np.arange(30) == 11, 900, 0)
    [run], _ = on_grid(t_us, np.zeros(30), np.arange(30) == 11)
    np.testing.assert_array_equal(np.flatnonzero(run.clipped), [11])


def test_few_samples_are_still_a_run() -> None:
    runs, resampler = on_grid(np.array([123]), np.array([4.5]))
    assert [(run.t0_us, run.values.tolist()) for run in runs] == [(123, [4.5])]
    assert resampler.flush() == []


def test_a_rate_whose_step_is_no_whole_microsecond_does_not_drift() -> None:
    t_us = np.arange(3001, dtype=np.int64) * 1_000_000 // 300
    values = np.random.default_rng(8).standard_normal(3001)
    [run], _ = on_grid(t_us, values, rate_hz=300)
    np.testing.assert_array_equal(run.values, values)


# Decimation


def fast_run(values: np.ndarray, factor: int, t0_us: int = 1000) -> GridRun:
    nowhere = np.zeros(len(values), dtype=bool)
    return GridRun(t0_us, 100 * factor, values, values, nowhere, nowhere, True)


def split(run: GridRun, cuts: list[int]) -> list[GridRun]:
    edges = [0, *sorted({cut for cut in cuts if 0 < cut < len(run.values)}), len(run.values)]
    return [
        GridRun(
            run.t0_us + low * 1_000_000 // run.rate_hz,
            run.rate_hz,
            run.values[low:high],
            run.nearest[low:high],
            run.clipped[low:high],
            run.bridged[low:high],
            run.new_start and low == 0,
        )
        for low, high in pairwise(edges)
    ]


def decimated(factor: int, runs: list[GridRun]) -> list[GridRun]:
    decimator = Decimator(factor)
    ready = [slow for run in runs for slow in decimator.push(run)]
    return joined(ready + decimator.flush())


@pytest.mark.parametrize("factor", [2, 3, 8, 10])
def test_the_decimating_filter_passes_and_stops(factor: int) -> None:
    taps = decimation_taps(factor)
    f_hz = np.linspace(0, 50 * factor, 4000)
    k = np.arange(len(taps)) - len(taps) // 2
    gain = np.exp(-2j * np.pi * f_hz[:, None] / (100 * factor) * k) @ taps
    flat_db = np.abs(20 * np.log10(np.abs(gain[f_hz <= 38]))).max()
    stop_db = -20 * np.log10(np.abs(gain[f_hz >= 62]).max())
    print(f"factor {factor}: {len(taps)} taps, flat within {flat_db:.4f} dB, stops {stop_db:.1f} dB")
    assert flat_db < 0.05
    assert stop_db > 60
    assert np.abs(gain.imag).max() < 1e-12


@given(cuts=st.lists(st.integers(1, 1500), max_size=20), factor=st.sampled_from([1, 2, 3, 8]))
@settings(max_examples=40)
def test_any_split_decimates_to_the_same_bits(cuts: list[int], factor: int) -> None:
    rng = np.random.default_rng(9)
    values = rng.standard_normal(1500)
    run = GridRun(0, 100 * factor, values, values, rng.random(1500) > 0.98, rng.random(1500) > 0.98, True)
    assert bits(decimated(factor, split(run, cuts))) == bits(decimated(factor, [run]))


@pytest.mark.parametrize("factor", [2, 8])
def test_a_slow_sine_keeps_its_size_and_its_time(factor: int) -> None:
    t_s = np.arange(400 * factor) / (100 * factor)
    [run] = decimated(factor, [fast_run(np.sin(2 * np.pi * 7 * t_s), factor)])
    assert run.t0_us == 1000
    assert len(run.values) == 400
    expected = np.sin(2 * np.pi * 7 * np.arange(400) / 100)
    np.testing.assert_allclose(run.values[15:-15], expected[15:-15], atol=1e-3)


def test_a_constant_stays_itself_from_end_to_end() -> None:
    [run] = decimated(4, [fast_run(np.full(401, 9.81), 4)])
    assert len(run.values) == 101
    np.testing.assert_allclose(run.values, 9.81, rtol=1e-12)


def test_each_stretch_is_decimated_on_its_own() -> None:
    runs = [fast_run(np.full(81, 1.0), 8, t0_us=0), fast_run(np.full(85, -5.0), 8, t0_us=200_000)]
    slow = decimated(8, runs)
    assert [run.t0_us for run in slow] == [0, 200_000]
    assert [len(run.values) for run in slow] == [11, 11]
    np.testing.assert_allclose(slow[1].values, -5.0, rtol=1e-12)


def test_marks_go_to_the_sample_around_which_they_stood() -> None:
    run = fast_run(np.zeros(800), 8)
    run.clipped[[3, 4, 400]] = True
    [slow] = decimated(8, [run])
    np.testing.assert_array_equal(np.flatnonzero(slow.clipped), [0, 1, 50])


def test_the_readings_that_were_thinned_out_come_along() -> None:
    """From each sample up to the next, in pieces too; one that was missing, and what no reading came for, is none."""
    values = np.arange(29.0)
    run = replace(fast_run(values, 4), bridged=values == 5, clipped=values == 9)
    decimator = Decimator(4)
    runs = [*split(run, [3, 10, 11]), fast_run(-values, 4, t0_us=700_000)]
    ready = [slow for one in runs for slow in decimator.push(one)] + decimator.flush()
    begins = [number for number, slow in enumerate(ready) if slow.new_start]
    each, clipped = (np.concatenate([getattr(slow, name) for slow in ready]) for name in ("each", "each_clipped"))
    assert len(begins) == 2 and len(each) == len(clipped) == 16
    expected = np.append(np.where(values == 5, np.nan, values), [np.nan] * 3).reshape(8, 4)
    np.testing.assert_array_equal(each[:8], expected)
    np.testing.assert_array_equal(np.flatnonzero(clipped), [9])
    np.testing.assert_array_equal(each[8:15], -values[:28].reshape(7, 4))


def test_factor_one_changes_nothing_and_zero_is_refused() -> None:
    run = fast_run(np.arange(5.0), 1)
    assert Decimator(1).push(run) == [run]
    with pytest.raises(ValueError, match="decimate by 0"):
        Decimator(0)
