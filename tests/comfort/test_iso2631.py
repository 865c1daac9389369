"""Figures of ISO 2631-1, alone and at the end of the streaming chain."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from logger.comfort.iso2631 import RunningRms, a_w, comfort_word, crest_factor, vdv
from logger.dsp.sections import BlockFilter
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
@settings(deadline=None, max_examples=50)
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


def body_acceleration(speed_mps: float, seed: int, seconds: float = 30.0, finer: int = 20) -> np.ndarray:
    """A quarter car over a random road with 30 mm bumps of 0.4 m, sampled at 100 Hz, some noise added [m/s2]."""
    rng = np.random.default_rng(seed)
    step_s = 1.0 / (RATE_HZ * finer)
    step_m = speed_mps * step_s
    count = round(seconds / step_s)
    # slope spectrum of an ISO 8608 road with 128e-6 m3 at 0.1 cycle/m
    slope = rng.standard_normal(count) * np.sqrt((2 * np.pi * 0.1) ** 2 * 128e-6 / (2 * step_m))
    road = np.cumsum(slope) * step_m
    from_bump = np.arange(count) * step_m % 97.3 - 50.0
    road += np.where(np.abs(from_bump) < 0.2, 0.03 * np.cos(np.pi * from_bump / 0.4), 0.0)
    contact = max(1, round(0.25 / step_m))
    road = signal.lfilter(np.ones(contact) / contact, 1, road - road[0])
    body, wheel, spring, damper, tire = 400.0, 45.0, 22e3, 1800.0, 200e3
    A = [
        [0, 1, 0, 0],
        [-spring / body, -damper / body, spring / body, damper / body],
        [0, 0, 0, 1],
        [spring / wheel, damper / wheel, -(spring + tire) / wheel, -damper / wheel],
    ]
    car = signal.StateSpace(A, [[0], [0], [0], [tire / wheel]], [A[1]], [[0]])
    _, response, _ = signal.lsim(car, road, np.arange(count) * step_s)
    return response[::finer] + 0.05 * rng.standard_normal(len(response[::finer]))


def exactly_weighted(accel: np.ndarray) -> np.ndarray:
    """The analog weighting in the frequency domain, with a minute of silence behind the record."""
    size = len(accel) + 60 * RATE_HZ
    response = WEIGHTING.response(np.fft.rfftfreq(size, 1 / RATE_HZ))
    return np.fft.irfft(np.fft.rfft(accel, size) * response, size)[: len(accel)]


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


def test_the_stream_agrees_with_the_exact_weighting_window_by_window() -> None:
    errors = []
    for seed, speed_mps in enumerate((5.0, 8.0, 11.0, 15.0, 20.0, 25.0, 31.0)):
        accel = body_acceleration(speed_mps, seed)
        weighting, running = BlockFilter(WEIGHTING.sections[RATE_HZ]), RunningRms(RATE_HZ)
        pieces = [weighting.process(piece) for piece in np.array_split(accel, 37)]
        ours = np.concatenate(pieces)[DELAY_SAMPLES:]
        exact = exactly_weighted(accel)[: len(ours)]
        streamed = per_window(ours, running.process(ours), speed_mps)
        errors.append(streamed / per_window(exact, running_by_hand(exact, RATE_HZ), speed_mps) - 1)
    worst = 100 * np.abs(np.concatenate(errors)).max(axis=0)
    typical = 100 * np.sqrt(np.mean(np.square(np.concatenate(errors)), axis=0))
    for name, most, usual in zip(("a_w", "VDV", "MTVV", "crest factor"), worst, typical, strict=True):
        print(f"{name}: worst {most:.2f} %, r.m.s. {usual:.2f} % of {sum(map(len, errors))} windows")
    assert (worst[:3] < 1.0).all()
    assert worst[3] < 2.0
