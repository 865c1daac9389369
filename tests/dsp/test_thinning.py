"""Records thinned as a whole: what lies below half of the lower rate stays, and nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.dsp.whole_record import thinned

RATE_HZ = 1000.0


def tone(f_hz: float, rate_hz: float, count: int) -> np.ndarray:
    return np.asarray(np.sin(2 * np.pi * f_hz * np.arange(count) / rate_hz + 0.3))


@pytest.mark.parametrize("f_hz", [0.7, 9.3, 31.0, 45.0])
def test_what_is_slow_stays_as_it_was(f_hz: float) -> None:
    found = thinned(tone(f_hz, RATE_HZ, 8003), 10)
    off = np.abs(found - tone(f_hz, RATE_HZ / 10, 801))
    assert off[50:-50].max() < 0.01 and off.max() < 0.5


@pytest.mark.parametrize("f_hz", [55.0, 99.5, 130.0, 480.0])
def test_what_is_fast_goes_and_comes_back_nowhere(f_hz: float) -> None:
    assert np.abs(thinned(tone(f_hz, RATE_HZ, 8003), 10)[200:-200]).max() < 0.01


def test_white_noise_stays_white() -> None:
    found = thinned(np.random.default_rng(3).standard_normal(400_000), 4)
    assert found.var() == pytest.approx(0.25, rel=0.02)
    power = np.abs(np.fft.rfft(found.reshape(100, 1000), axis=1)[:, 1:-1]) ** 2 / 1000
    tenths = [part.mean() for part in np.array_split(power, 10, axis=1)]
    assert tenths == pytest.approx([0.25] * 10, rel=0.06)


@given(st.integers(1, 300), st.integers(1, 12), st.floats(-5, 5))
def test_every_so_many_samples_and_a_steady_one_stays(count: int, factor: int, level: float) -> None:
    found = thinned(np.full(count, level), factor)
    assert len(found) == len(range(0, count, factor))
    assert found == pytest.approx(level, abs=1e-9)


def test_a_factor_below_1_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot thin by 0"):
        thinned(np.zeros(10), 0)
