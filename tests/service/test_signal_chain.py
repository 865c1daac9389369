"""The signal chain: what comes out is on the grid, at the right instant, and says what was missing."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.readings import AccelerationBlock
from logger.dsp.weightings.wk import WEIGHTING
from logger.dsp.windows import GridSamples
from logger.service.signal_chain import Axis, SignalChain

G = 9.80665
COLUMNS = ("t_us", "accel_mps2", "weighted_mps2", "running_rms_mps2", "present", "interpolated", "settled", "clipped")


def block(t_us: np.ndarray, vertical: np.ndarray) -> AccelerationBlock:
    accel = np.zeros((len(t_us), 3))
    accel[:, 2] = vertical
    return AccelerationBlock(t_us, accel, np.zeros(len(t_us), dtype=bool))


def road(count: int, rate_hz: int = 100, seed: int = 2) -> AccelerationBlock:
    rng = np.random.default_rng(seed)
    t_us = 7_000_003 + np.arange(count, dtype=np.int64) * 1_000_000 // rate_hz
    time_s = np.arange(count) / rate_hz
    return block(t_us, G + np.sin(2 * np.pi * 2.3 * time_s) + 0.1 * rng.normal(size=count))


def through(chain: SignalChain, samples: AccelerationBlock, cuts: list[int]) -> GridSamples:
    out = []
    edges = [0, *sorted(min(cut, len(samples)) for cut in cuts), len(samples)]
    for low, high in pairwise(edges):
        part = AccelerationBlock(samples.t_us[low:high], samples.accel_mps2[low:high], samples.clipped[low:high])
        out += chain.push(part)
    return GridSamples.joined(out + chain.flush())


def chain_for(oversample: int = 1, axis: str = "+z") -> SignalChain:
    return SignalChain(Axis.from_word(axis), WEIGHTING, oversample, None, coarse=False)


@settings(max_examples=25)
@given(cuts=st.lists(st.integers(80, 400), max_size=8), oversample=st.sampled_from([1, 4]))
def test_portions_change_no_bit(cuts: list[int], oversample: int) -> None:
    """Once the first half second, whose mean the filters start from, has come at once."""
    samples = road(400 * oversample, 100 * oversample)
    whole = through(chain_for(oversample), samples, [])
    parts = through(chain_for(oversample), samples, [oversample * cut for cut in cuts])
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))


@pytest.mark.parametrize("first", [1, 2, 3, 4, 5, 6, 13])
def test_a_short_first_portion_keeps_every_sample_in_its_place(first: int) -> None:
    samples = road(600)
    out = through(chain_for(), samples, [first + 8])
    assert len(out) == 600
    np.testing.assert_array_equal(np.diff(out.t_us), 10_000)
    later = slice(500, 590)
    expected = through(chain_for(), samples, [])
    np.testing.assert_allclose(out.weighted_mps2[later], expected.weighted_mps2[later], atol=0.01)


def test_the_weighted_sample_stands_at_its_instant() -> None:
    """A slow sine: gain and phase of the analog formula, measured by projection."""
    f_hz, count = 3.1, 3000
    t_us = np.arange(count, dtype=np.int64) * 10_000
    wave = np.exp(2j * np.pi * f_hz * np.arange(count) * 0.01)
    out = through(chain_for(), block(t_us, G + wave.real), [])
    late = slice(1000, 2900)
    basis = np.column_stack([wave.real[late], wave.imag[late]])
    (real, imag), *_ = np.linalg.lstsq(basis, out.weighted_mps2[late], rcond=None)
    response = WEIGHTING.response(np.array([f_hz]))[0]
    assert abs((real - 1j * imag) / response - 1) < 0.002


def test_gravity_goes_and_an_inverted_sensor_is_turned() -> None:
    samples = road(2000)
    upright = through(chain_for(), samples, [])
    turned = through(chain_for(axis="-z"), block(samples.t_us, -samples.accel_mps2[:, 2]), [])
    np.testing.assert_array_equal(upright.accel_mps2, turned.accel_mps2)
    assert abs(upright.accel_mps2[upright.settled].mean()) < 0.01


def test_a_short_hole_is_missing_but_the_filters_run_on() -> None:
    samples = road(2000)
    keep = np.ones(2000, dtype=bool)
    keep[1000:1020] = False
    holed = AccelerationBlock(samples.t_us[keep], samples.accel_mps2[keep], samples.clipped[keep])
    out = through(chain_for(), holed, [])
    np.testing.assert_array_equal(np.diff(out.t_us), 10_000)
    assert np.count_nonzero(~out.present) == 20
    assert out.settled[400:].all()
    whole = through(chain_for(), samples, [])
    np.testing.assert_allclose(out.weighted_mps2[1300:], whole.weighted_mps2[1300:], atol=0.02)


def test_after_a_long_hole_the_figures_wait_until_the_filters_have_settled() -> None:
    samples = road(3000)
    keep = np.ones(3000, dtype=bool)
    keep[1000:1300] = False
    holed = AccelerationBlock(samples.t_us[keep], samples.accel_mps2[keep], samples.clipped[keep])
    out = through(chain_for(), holed, [])
    assert np.count_nonzero(~out.present) == 300
    begin = int(np.flatnonzero(~out.present)[-1]) + 1
    assert not out.settled[begin : begin + 399].any()
    assert out.settled[begin + 401 :].all()


def test_one_missing_sample_is_rebuilt_and_said() -> None:
    samples = road(1000)
    keep = np.ones(1000, dtype=bool)
    keep[500] = False
    holed = AccelerationBlock(samples.t_us[keep], samples.accel_mps2[keep], samples.clipped[keep])
    out = through(chain_for(), holed, [])
    assert out.present.all()
    assert np.flatnonzero(out.interpolated).tolist() == [500]


def test_a_silent_sensor_is_missing_from_the_grid_and_what_comes_too_late_is_counted() -> None:
    chain = chain_for()
    absent = GridSamples.joined(chain.advance(1_000_000, 10_000_000))
    assert not absent.present.any()
    assert absent.t_us[0] == 1_000_000
    late = block(np.array([5_000_000, 5_010_000, 9_000_000, 9_010_000], dtype=np.int64), np.full(4, G))
    chain.push(late)
    assert chain.late_samples == 2


def test_each_coarse_reading_is_passed_on_with_its_own_bound() -> None:
    """Four reads per sample: what reaches the estimator is each of them as it was read; late ones are none."""
    rng = np.random.default_rng(4)
    count, step = 800, 1.25
    t_us = 7_000_000 + 2500 * np.arange(count, dtype=np.int64)
    vertical = step * np.rint((G + rng.normal(size=count)) / step)
    samples = block(t_us, vertical)
    samples.clipped[402] = True
    missing = np.array([101, 102, 301])
    kept = np.delete(np.arange(count), missing)
    holed = AccelerationBlock(t_us[kept], samples.accel_mps2[kept], samples.clipped[kept])
    coarse = SignalChain(Axis.from_word("+z"), WEIGHTING, 4, None, coarse=True)
    out = through(coarse, holed, [150, 400, 401])
    assert out.each_mps2.shape == (200, 4) and len(out) == 200
    np.testing.assert_array_equal(np.flatnonzero(~out.each_usable), missing)
    np.testing.assert_array_equal(out.each_mps2[out.each_usable], vertical[kept])
    np.testing.assert_array_equal(np.flatnonzero(out.each_at_end), [402])
    np.testing.assert_array_equal(through(chain_for(4), samples, []).each_mps2[:, 0],
                                  through(chain_for(4), samples, []).reading_mps2)
