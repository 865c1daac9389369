"""Butterworth's low-pass beside scipy's, and a band cut out of a record beside its sines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, freqs, sosfreqz

from logger.dsp.filters import butterworth
from logger.dsp.whole_record import HALF_WIDTH_HZ, in_band

F_HZ = np.array([0.5, 3.0, 11.0, 24.0, 37.0, 49.0])
S = 2j * np.pi * F_HZ


@pytest.mark.parametrize("order", range(1, 9))
def test_a_sensors_is_scipys(order: int) -> None:
    numerator, denominator = butter(order, 2 * np.pi * 17.0, analog=True)
    assert butterworth(order, S, 17.0) == pytest.approx(freqs(numerator, denominator, 2 * np.pi * F_HZ)[1], rel=1e-9)


@pytest.mark.parametrize("order", range(1, 9))
def test_one_that_is_run_on_samples_is_scipys(order: int) -> None:
    _, expected = sosfreqz(butter(order, 17.0, fs=100.0, output="sos"), F_HZ, fs=100.0)
    assert butterworth(order, S, 17.0, 100.0) == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_a_cut_off_beyond_half_the_samples_passes_all() -> None:
    assert butterworth(4, S[:5], 500.0, 100.0) == pytest.approx(np.ones(5), abs=0.01)


@pytest.mark.parametrize(("low_hz", "high_hz"), [(0.0, 20.0), (2.0, 20.0), (2.0, 50.0)])
def test_a_band_passes_what_is_inside_without_delay_and_nothing_else(low_hz: float, high_hz: float) -> None:
    time_s = np.arange(3000) / 100.0
    for f_hz in (0.4, 5.0, 17.0, 25.0, 40.0):
        if min(abs(f_hz - low_hz), abs(f_hz - high_hz)) < HALF_WIDTH_HZ:
            continue
        sine = np.sin(2 * np.pi * f_hz * time_s)
        expected = sine if low_hz < f_hz < high_hz else 0.0 * sine
        middle = slice(500, -500)
        assert in_band(sine, 100.0, low_hz, high_hz)[middle] == pytest.approx(expected[middle], abs=3e-3)


def test_a_band_of_all_is_the_record() -> None:
    samples = np.random.default_rng(1).normal(size=500)
    assert (in_band(samples, 100.0, 0.0, 50.0) == samples).all()
