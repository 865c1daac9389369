"""Figures of ISO 2631-1, alone and at the end of the streaming chain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.comfort.iso2631 import RunningRms, a_w, comfort_word, crest_factor, vdv
from logger.dsp.filters import BlockFilter
from logger.dsp.weightings.weighting import DELAY_SAMPLES
from logger.dsp.weightings.wk import WEIGHTING

RATE_HZ = 100
WINDOW_M = 7.62
RECORD = np.random.default_rng(1).standard_normal(1234)


def test_figures_of_a_sine() -> None:
    wave = 2.0 * np.sin(2 * np.pi * 5 * np.arange(1000) / RATE_HZ + 0.3)
    assert a_w(wave) == pytest.approx(2.0 / np.sqrt(2))
    assert vdv(wave, 0.01) == pytest.approx((16 * 3 / 8 * 10.0) ** 0.25)  # mean of sin^4 is 3/8
    assert crest_factor(np.array([1.0, -1.0, 1.0, -3.0])) == pytest.approx(3 / np.sqrt(3))
    assert np.isnan(crest_factor(np.zeros(4)))


@pytest.mark.parametrize(
    ("a_w_mps2", "word"),
    [
        (0.0, "not_uncomfortable"),
        (0.3149, "not_uncomfortable"),
        (0.315, "a_little_uncomfortable"),
        (0.5, "fairly_uncomfortable"),
        (0.63, "fairly_uncomfortable"),
        (0.8, "uncomfortable"),
        (1.25, "very_uncomfortable"),
        (1.999, "very_uncomfortable"),
        (2.0, "extremely_uncomfortable"),
        (90.0, "extremely_uncomfortable"),
    ],
)
def test_words_of_table_2_5(a_w_mps2: float, word: str) -> None:
    assert comfort_word(a_w_mps2) == word


@pytest.mark.parametrize("impossible", [-0.1, float("nan")])
def test_no_word_for_what_cannot_be(impossible: float) -> None:
    with pytest.raises(ValueError, match="cannot be"):
        comfort_word(impossible)


def running_by_hand(weighted: np.ndarray, length: int) -> np.ndarray:
    padded = np.concatenate([np.zeros(length - 1), weighted**2])
    return np.sqrt(np.lib.stride_tricks.sliding_window_view(padded, length).mean(axis=1))


@pytest.mark.parametrize("tau_s", [1.0, 0.25, 0.01])
def test_running_rms_is_the_mean_over_the_last_second(tau_s: float) -> None:
    ours = RunningRms(RATE_HZ, tau_s).process(RECORD)
    np.testing.assert_allclose(ours, running_by_hand(RECORD, round(RATE_HZ * tau_s)), rtol=1e-12)


@given(cuts=st.lists(st.integers(0, len(RECORD)), max_size=30))
@settings(max_examples=50)
def test_running_rms_has_the_same_bits_for_any_split(cuts: list[int]) -> None:
    stream = RunningRms(RATE_HZ)
    pieces = np.concatenate([stream.process(piece) for piece in np.split(RECORD, sorted(cuts))])
    assert pieces.tobytes() == RunningRms(RATE_HZ).process(RECORD).tobytes()


def test_running_rms_forgets_a_blow_completely() -> None:
    stream = RunningRms(RATE_HZ)
    stream.process(np.full(250, 1e9))
    stream.process(np.zeros(150))
    np.testing.assert_allclose(stream.process(np.full(300, 1e-6))[100:], 1e-6, rtol=1e-12)


def test_running_rms_starts_from_nothing_after_a_reset() -> None:
    stream = RunningRms(RATE_HZ)
    stream.process(RECORD)
    stream.reset()
    assert stream.process(RECORD[:50]).tobytes() == RunningRms(RATE_HZ).process(RECORD[:50]).tobytes()


def per_window(weighted: np.ndarray, running: np.ndarray, speed_mps: float) -> np.ndarray:
    """a_w, VDV, MTVV and crest factor of each 7.62 m window, (windows, 4)."""
    index = np.floor(np.arange(len(weighted)) * speed_mps / RATE_HZ / WINDOW_M)
    edges = np.flatnonzero(np.diff(index)) + 1
    return np.array(
        [
            (a_w(part), vdv(part, 1 / RATE_HZ), run.max(), crest_factor(part))
            for part, run in zip(np.split(weighted, edges)[1:-1], np.split(running, edges)[1:-1], strict=True)
        ]
    )


@pytest.mark.slow
def test_the_stream_agrees_with_the_exact_weighting_window_by_window(
    body_acceleration: Callable[[float, int], np.ndarray]
) -> None:
    errors = []
    for seed, speed_mps in enumerate((5.0, 8.0, 11.0, 15.0, 20.0, 25.0, 31.0)):
        accel = body_acceleration(speed_mps, seed)
        weighting, running = BlockFilter(WEIGHTING.sections[RATE_HZ]), RunningRms(RATE_HZ)
        pieces = [weighting.process(piece) for piece in np.array_split(accel - accel.mean(), 37)]
        ours = np.concatenate(pieces)[DELAY_SAMPLES:]
        exact = WEIGHTING.weigh(accel, RATE_HZ)[: len(ours)]
        streamed = per_window(ours, running.process(ours), speed_mps)
        errors.append(streamed / per_window(exact, running_by_hand(exact, RATE_HZ), speed_mps) - 1)
    worst = 100 * np.abs(np.concatenate(errors)).max(axis=0)
    typical = 100 * np.sqrt(np.mean(np.square(np.concatenate(errors)), axis=0))
    for name, most, usual in zip(("a_w", "VDV", "MTVV", "crest factor"), worst, typical, strict=True):
        print(f"{name}: worst {most:.2f} %, r.m.s. {usual:.2f} % of {sum(map(len, errors))} windows")
    assert (worst[:3] < 1.0).all()
    assert worst[3] < 2.0
