"""Figures of a whole axis, the rule for which to use, and every weighting's sections on roads with bumps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.comfort.iso2631 import (
    COMFORT_FACTORS,
    HEALTH_FACTORS,
    AxisFigures,
    ExponentialRms,
    axis_figures,
    motion_sickness_dose,
    total,
)
from logger.dsp.design import design_error, design_sections
from logger.dsp.filters import BlockFilter
from logger.dsp.weightings.weighting import DELAY_SAMPLES
from logger.plugins import catalogue

RATE_HZ = 100
WEIGHTINGS = catalogue("logger.dsp.weightings", "WEIGHTING")
RECORD = np.random.default_rng(4).standard_normal(2345)


def test_figures_of_a_sine() -> None:
    rate_hz, seconds = 500.0, 40
    wave = 3.0 * np.sin(2 * np.pi * 5 * np.arange(int(rate_hz * seconds)) / rate_hz + 0.1)
    figures = axis_figures(wave, rate_hz)
    assert figures.duration_s == seconds
    assert figures.a_w_mps2 == pytest.approx(3 / np.sqrt(2))
    assert figures.mtvv_mps2 == pytest.approx(3 / np.sqrt(2))
    # the mean square swings by half about itself at 10 Hz; one pole of 1 s leaves 1 / |1 + 20 pi i| of it
    assert figures.mtvv_exponential_mps2 == pytest.approx(3 * np.sqrt(0.5 + 0.5 / abs(1 + 20j * np.pi)), rel=1e-4)
    assert figures.vdv_mps175 == pytest.approx(3 * (3 / 8 * seconds) ** 0.25)
    assert figures.vdv_ratio == pytest.approx((3 / 8) ** 0.25 * np.sqrt(2))
    assert figures.mtvv_ratio == pytest.approx(1.0)
    assert figures.beside_a_w() == ()


def test_nothing_moves() -> None:
    figures = axis_figures(np.zeros(300), 100.0)
    assert figures.a_w_mps2 == figures.mtvv_mps2 == figures.mtvv_exponential_mps2 == figures.vdv_mps175 == 0.0
    assert np.isnan([figures.crest_factor, figures.mtvv_ratio, figures.vdv_ratio]).all()
    assert figures.beside_a_w() == ()


CALM = AxisFigures(duration_s=16.0, a_w_mps2=1.0, mtvv_mps2=1.5, mtvv_exponential_mps2=1.4, vdv_mps175=3.5,
                   crest_factor=9.0)


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        ({}, ()),
        ({"mtvv_mps2": 1.51}, ("mtvv",)),
        ({"vdv_mps175": 3.51}, ("vdv",)),
        ({"crest_factor": 9.01}, ("mtvv", "vdv")),
        ({"mtvv_exponential_mps2": 9.0}, ()),
        ({"mtvv_mps2": 1.51, "vdv_mps175": 3.51}, ("mtvv", "vdv")),
    ],
)
def test_which_figures_to_use(change: dict[str, float], wanted: tuple[str, ...]) -> None:
    assert replace(CALM, **change).beside_a_w() == wanted


def test_exponential_average_of_a_blow_and_of_a_steady_shake() -> None:
    rate_hz = 1000.0
    steady = ExponentialRms(rate_hz).process(np.full(3000, 2.0))
    np.testing.assert_allclose(steady**2, 4.0 * (1 - np.exp(-np.arange(1, 3001) / rate_hz)), rtol=1e-9)
    blow = np.zeros(2000)
    blow[0] = 1.0
    after = ExponentialRms(rate_hz, tau_s=0.5).process(blow)
    np.testing.assert_allclose(after[1:] / after[:-1], np.exp(-0.5 / (0.5 * rate_hz)), rtol=1e-9)


@given(cuts=st.lists(st.integers(0, len(RECORD)), max_size=20))
@settings(max_examples=30)
def test_exponential_average_has_the_same_bits_for_any_split(cuts: list[int]) -> None:
    stream = ExponentialRms(RATE_HZ)
    pieces = np.concatenate([stream.process(piece) for piece in np.split(RECORD, sorted(cuts))])
    assert pieces.tobytes() == ExponentialRms(RATE_HZ).process(RECORD).tobytes()


def test_axes_combined_and_motion_sickness() -> None:
    assert total((3.0, 4.0, 12.0), COMFORT_FACTORS) == pytest.approx(13.0)
    assert total((1.0, 2.0, 3.0), HEALTH_FACTORS) == pytest.approx(np.sqrt(1.96 * 5 + 9))
    assert motion_sickness_dose(0.5, 3600.0) == pytest.approx(30.0)


def as_recorded(accel: np.ndarray) -> np.ndarray:
    """Through the recorder's anti-alias filter: flat to 38 Hz, nothing from 50 Hz on, no mean."""
    f_hz = np.fft.rfftfreq(len(accel), 1 / RATE_HZ)
    gain = np.interp(f_hz, [38.0, 50.0], [1.0, 0.0]) * (f_hz > 0.0)
    return np.fft.irfft(np.fft.rfft(accel) * gain, len(accel))


@pytest.mark.slow
@pytest.mark.parametrize("name", WEIGHTINGS)
def test_sections_at_100_hz_keep_magnitude_and_phase(
    name: str, body_acceleration: Callable[[float, int], np.ndarray]
) -> None:
    weighting = WEIGHTINGS[name]
    sections = weighting.sections.get(RATE_HZ) or design_sections(weighting, RATE_HZ)
    band_hz = np.geomspace(*((0.02, 5.0) if name == "wf" else (0.1, 40.0)), 2000)
    error = design_error(weighting, sections, RATE_HZ, band_hz)
    worst = np.zeros(5)
    for seed, speed_mps in enumerate((6.0, 14.0, 27.0)):
        accel = as_recorded(body_acceleration(speed_mps, seed))
        ours = BlockFilter(sections).process(accel)[DELAY_SAMPLES:]
        exact = weighting.weigh(accel, RATE_HZ)[: len(ours)]
        pair = [axis_figures(weighted, RATE_HZ) for weighted in (ours, exact)]
        values = [(f.a_w_mps2, f.mtvv_mps2, f.mtvv_exponential_mps2, f.vdv_mps175, f.crest_factor) for f in pair]
        worst = np.maximum(worst, np.abs(np.divide(*values) - 1))
    print(f"{name}: {error.magnitude_db:.5f} dB; a_w {worst[0]:.4%}, MTVV {worst[1:3].max():.4%}, VDV {worst[3]:.4%}, "
          f"crest {worst[4]:.4%}")
    assert error.magnitude_db < 0.02
    assert (worst < 0.01).all()
