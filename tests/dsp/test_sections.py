"""Sections on a stream: the same bits for any split, the same values as scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from logger.dsp.filters import BLOCK, BlockFilter, butterworth_sos, frequency_response
from logger.dsp.weightings.wk import WEIGHTING

RATE_HZ = 100
WK = np.asarray(WEIGHTING.sections[RATE_HZ])
ELLIPTIC = signal.ellip(7, 0.5, 60, 20, fs=RATE_HZ, output="sos")
RECORD = np.random.default_rng(1).standard_normal(1000) + 9.8


@given(cuts=st.lists(st.integers(0, len(RECORD)), max_size=40))
@settings(max_examples=60)
def test_any_split_gives_the_same_bits(cuts: list[int]) -> None:
    whole = BlockFilter(WK).process(RECORD)
    stream = BlockFilter(WK)
    pieces = np.concatenate([stream.process(piece) for piece in np.split(RECORD, sorted(cuts))])
    assert pieces.tobytes() == whole.tobytes()


def test_one_sample_at_a_time_gives_the_same_bits_after_a_reset() -> None:
    stream, whole = BlockFilter(WK), BlockFilter(WK)
    stream.process(RECORD[:77])
    stream.reset(9.8)
    whole.reset(9.8)
    single = np.concatenate([stream.process(RECORD[k : k + 1]) for k in range(300)])
    assert single.tobytes() == whole.process(RECORD[:300]).tobytes()


@pytest.mark.parametrize("sos", [WK, ELLIPTIC, butterworth_sos("high", 0.2, RATE_HZ)], ids=["wk", "elliptic", "high"])
def test_scipy_says_the_same(sos: np.ndarray) -> None:
    np.testing.assert_allclose(BlockFilter(sos).process(RECORD), signal.sosfilt(sos, RECORD), atol=1e-11, rtol=0)


def test_a_hundred_thousand_samples_do_not_drift_from_scipy() -> None:
    long = np.random.default_rng(2).standard_normal(100_003)
    np.testing.assert_allclose(BlockFilter(WK).process(long), signal.sosfilt(WK, long), atol=1e-12, rtol=0)


@pytest.mark.parametrize("sos", [WK, ELLIPTIC], ids=["wk", "elliptic"])
def test_reset_starts_in_the_steady_state(sos: np.ndarray) -> None:
    steady = BlockFilter(sos)
    steady.reset(9.81)
    expected = 9.81 * frequency_response(sos, 0.0, RATE_HZ).real
    np.testing.assert_allclose(steady.process(np.full(3 * BLOCK, 9.81)), expected, atol=1e-10)


def test_nothing_in_nothing_out() -> None:
    assert BlockFilter(WK).process(np.empty(0)).shape == (0,)


def test_a_leading_coefficient_other_than_one_is_divided_out() -> None:
    np.testing.assert_allclose(BlockFilter(3.0 * WK).process(RECORD), BlockFilter(WK).process(RECORD), atol=1e-12)


def test_frequency_response_is_scipys() -> None:
    f_hz = np.linspace(0.1, 49, 50)
    expected = signal.sosfreqz(WK, f_hz, fs=RATE_HZ)[1]
    np.testing.assert_allclose(frequency_response(WK, f_hz, RATE_HZ), expected, rtol=1e-9)


@pytest.mark.parametrize("kind", ["low", "high"])
@pytest.mark.parametrize("cutoff_hz", [0.2, 15.0, 49.0])
def test_butterworth_is_scipys(kind: str, cutoff_hz: float) -> None:
    expected = signal.butter(2, cutoff_hz, kind, fs=RATE_HZ, output="sos")
    np.testing.assert_allclose(butterworth_sos(kind, cutoff_hz, RATE_HZ), expected, rtol=1e-9)  # type: ignore[arg-type]


def test_what_cannot_be_a_filter_is_refused() -> None:
    with pytest.raises(ValueError, match="rows of 6"):
        BlockFilter(np.ones((2, 5)))
    with pytest.raises(ValueError, match="cutoff"):
        butterworth_sos("low", 50.0, RATE_HZ)
    with pytest.raises(ValueError, match="band"):
        butterworth_sos("band", 10.0, RATE_HZ)  # type: ignore[arg-type]
