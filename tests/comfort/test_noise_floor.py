"""Noise and rounding taken off comfort figures by their power alone, on signals of known ride."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import sosfilt

from logger.comfort.iso2631 import RunningRms, a_w, vdv
from logger.comfort.uncertain_ride import NoiseFloor, RawFigures
from logger.dsp.weightings.wk import WEIGHTING

from ..support.slow import slow

RATE_HZ = 100
GAIN = np.abs(WEIGHTING.response(np.linspace(0.0, RATE_HZ / 2, 1025)))
WINDOWS, COUNT = 1500, 60


def ride(rms_mps2: float, rng: np.random.Generator) -> np.ndarray:
    """A Gaussian acceleration about 1.5 and 11 Hz."""
    noise = rng.standard_normal(WINDOWS * COUNT)
    f_hz = np.fft.rfftfreq(len(noise), 1 / RATE_HZ)
    shape = np.exp(-0.5 * ((f_hz - 1.5) / 0.5)**2) + 0.5 * np.exp(-0.5 * ((f_hz - 11.0) / 3.0)**2)
    accel = np.fft.irfft(np.fft.rfft(noise) * shape, len(noise))
    return rms_mps2 * accel / accel.std()


def figures_of(accel: np.ndarray, count: int = COUNT) -> list[RawFigures]:
    weighted = sosfilt(WEIGHTING.sections[RATE_HZ], accel - accel.mean())
    running = RunningRms(RATE_HZ).process(weighted)
    return [RawFigures(count, float(np.sqrt(np.mean((accel[part] - accel.mean())**2))), a_w(weighted[part]),
                       float(running[part].max()), vdv(weighted[part], 1 / RATE_HZ))
            for low in range(600, len(accel) - count, count) for part in [slice(low, low + count)]]


@pytest.mark.slow
@pytest.mark.parametrize(("rms_mps2", "noise_mps2", "step_mps2"), [(0.4, 0.1, 0.0), (0.6, 0.3, 0.6), (1.0, 0.1, 0.6)])
def test_ride_is_found_under_noise_within_its_errors(rms_mps2: float, noise_mps2: float, step_mps2: float) -> None:
    rng = np.random.default_rng(2)
    true = ride(rms_mps2, rng)
    read = true + 0.2 * step_mps2 + noise_mps2 * rng.standard_normal(len(true))
    if step_mps2:
        read = step_mps2 * np.rint(read / step_mps2)
    floor = NoiseFloor(GAIN, RATE_HZ, step_mps2)
    truth, raw = figures_of(true), figures_of(read)
    found = [floor.without(one, noise_mps2, 0.0) for one in raw]
    known = np.array([np.isfinite(one.a_w.value) for one in found])
    assert known.mean() > 0.9
    for name, tolerance in (("a_w", 0.03), ("vdv", 0.03)):
        column = {"a_w": "a_w_mps2", "vdv": "vdv_mps175"}[name]
        exact = np.array([getattr(one, column) for one in truth])[known]
        value = np.array([getattr(one, name).value for one in found])[known]
        std = np.array([getattr(one, name).std for one in found])[known]
        assert abs(value.mean() / exact.mean() - 1) < tolerance, name
        off = np.abs(value - exact) / std
        # VDV's error is given somewhat too large: the ride's sixth moment is taken for a Gaussian's.
        assert 0.58 < np.mean(off <= 1) < 0.85, name
        assert 0.90 < np.mean(off <= 2) < 0.99, name


@pytest.mark.parametrize("count", [200, *slow(60, 500)])
@pytest.mark.parametrize("rms_mps2", [0.1, *slow(0.4)])
@pytest.mark.parametrize("is_even", [True, False])
def test_the_largest_running_mean_is_of_the_ride(count: int, rms_mps2: float, is_even: bool) -> None:
    """A ride of one level, and one whose level swings within some seconds, below a noise of 0.15 m/s2."""
    rng = np.random.default_rng(8)
    true = ride(rms_mps2, rng)
    if not is_even:
        true *= np.exp(0.8 * np.convolve(rng.standard_normal(len(true)), np.full(150, 150**-0.5), "same"))
    floor, noise_mps2 = NoiseFloor(GAIN, RATE_HZ, 0.0), 0.15
    read = figures_of(true + noise_mps2 * rng.standard_normal(len(true)), count)
    exact = np.array([one.mtvv_mps2 for one in figures_of(true, count)])
    found = [floor.without(one, noise_mps2, 0.0).mtvv for one in read]
    value, std = np.array([(one.value, one.std) for one in found]).T
    assert abs(value.mean() / exact.mean() - 1) < 0.05
    assert 0.58 < np.mean(np.abs(value - exact) <= std) < 0.80
    assert np.mean(np.abs(value - exact) <= 2 * std) > 0.9


@pytest.mark.parametrize("seconds", [0.3, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0])
def test_how_large_the_largest_of_moving_means_is(seconds: float) -> None:
    """MTVV and a_w of a weak ride, as far apart as the noise alone would have them, leave one mean."""
    rng = np.random.default_rng(9)
    sums = np.cumsum(rng.standard_normal((1500, round((seconds + 1) * RATE_HZ))), axis=1)
    largest = ((sums[:, RATE_HZ:] - sums[:, :-RATE_HZ]) / np.sqrt(RATE_HZ)).max(axis=1).mean()
    floor, noise_mps2 = NoiseFloor(np.ones(65), RATE_HZ, 0.0), 0.5
    a_w_mps2 = 0.55
    ride_power = a_w_mps2**2 - noise_mps2**2
    alone = largest * np.sqrt((4 * ride_power * noise_mps2**2 + 2 * noise_mps2**4) / RATE_HZ)
    for share, left in ((0.9, 0.0), (2.0, np.sqrt(3))):
        raw = RawFigures(round(seconds * RATE_HZ), a_w_mps2, a_w_mps2, np.sqrt(a_w_mps2**2 + share * alone), 1.0)
        found = floor.without(raw, noise_mps2, 0.0).mtvv.value
        assert found**2 == pytest.approx(ride_power + left * alone, abs=0.08 * alone)


def test_without_noise_the_figures_are_the_raw_ones() -> None:
    raw = RawFigures(60, 0.5, 0.4, 0.6, 0.45)
    found = NoiseFloor(GAIN, RATE_HZ, 0.0).without(raw, 0.0, 0.0)
    assert (found.a_w.value, found.mtvv.value, found.vdv.value) == pytest.approx((0.4, 0.6, 0.45))
    assert found.a_w.std == found.mtvv.std == found.vdv.std == 0.0


def test_pure_noise_leaves_next_to_nothing_with_a_bound() -> None:
    noise_mps2 = 0.1
    rng = np.random.default_rng(3)
    raw = figures_of(noise_mps2 * rng.standard_normal(WINDOWS * COUNT))
    floor = NoiseFloor(GAIN, RATE_HZ, 0.0)
    found = [floor.without(one, noise_mps2, 0.0).a_w for one in raw]
    assert np.mean([one.value for one in found]) < 0.4 * np.mean([one.a_w_mps2 for one in raw])
    assert all(0.0 < one.std < noise_mps2 for one in found)


def test_a_noise_that_may_be_another_widens_the_error_only() -> None:
    raw = RawFigures(60, 0.5, 0.3, 0.4, 0.4)
    floor = NoiseFloor(GAIN, RATE_HZ, 0.0)
    sure, unsure = floor.without(raw, 0.2, 0.0), floor.without(raw, 0.2, 0.4)
    assert unsure.a_w.value == sure.a_w.value
    assert unsure.a_w.std > sure.a_w.std


def test_between_two_steps_nothing_is_known_but_a_bound() -> None:
    step_mps2 = 0.613
    floor = NoiseFloor(GAIN, RATE_HZ, step_mps2)
    toggling = RawFigures(60, 0.5 * step_mps2, 0.2, 0.2, 0.2)
    assert np.isnan(floor.without(toggling, 0.1, 0.0).a_w.value)
    assert 0.25 < floor.most_hidden_mps2(0.1) < 0.315 < NoiseFloor(GAIN, RATE_HZ, 2 * step_mps2).most_hidden_mps2(0.1)
