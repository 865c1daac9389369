"""Noise models against processes whose covariance is known, and whitening against Cholesky's factor."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.linalg import cholesky, solve_triangular, toeplitz
from scipy.signal import lfilter

from logger.dsp.filters import DecimatingLowPass
from logger.identification.noise_models import Autoregressive, RoadNoise, White, Whitening

Array = npt.NDArray[np.float64]

ALL = DecimatingLowPass(100.0)
NOTHING = np.empty(0)


def hump(f_hz: Array) -> Array:
    """A spectrum like that of a car on a road."""
    return np.asarray(f_hz**2 / ((1.2**2 - f_hz**2) ** 2 + (0.6 * f_hz) ** 2) / (1 + (f_hz / 12) ** 4))


def covariance(f_spectrum: Array) -> Array:
    return np.asarray(np.fft.irfft(f_spectrum, 8192) * 50)


def drawn(road: float, sensor: float, count: int, seed: int) -> Array:
    """Noise with the spectrum road * hump + 2 sensor^2 / rate."""
    f_hz = np.arange(4097) * 100 / 8192
    whole = toeplitz(covariance(road * hump(f_hz) + 2 * sensor**2 / 100)[:count])
    return np.asarray(cholesky(whole, lower=True) @ np.random.default_rng(seed).standard_normal(count))


ROAD = RoadNoise(lambda _values, f_hz: [hump(f_hz)])


def test_road_noise_finds_both_levels() -> None:
    found = [ROAD.fitted([drawn(0.04, 0.05, 900, seed)], NOTHING, ALL, 1e-9).levels for seed in range(8)]
    assert np.mean([one["gd_n0_cm3"] for one in found]) == pytest.approx(0.04, rel=0.1)
    assert np.mean([one["deviation_mps2"] for one in found]) == pytest.approx(0.05, rel=0.05)


def test_whitening_is_exact_from_the_first_sample_on() -> None:
    residual = drawn(0.04, 0.05, 300, 1)
    noise = ROAD.fitted([residual], NOTHING, ALL, 1e-9)
    f_hz = np.arange(4097) * 100 / 8192
    spectrum = noise.levels["gd_n0_cm3"] * hump(f_hz) + noise.levels["deviation_mps2"] ** 2 / 50
    factor = cholesky(toeplitz(covariance(spectrum)[:300]), lower=True)
    assert noise([residual]) == pytest.approx(solve_triangular(factor, residual, lower=True), abs=1e-8)
    assert noise.deviance == pytest.approx(
        float((solve_triangular(factor, residual, lower=True) ** 2).sum() + 2 * np.log(np.diag(factor)).sum()))
    two = np.stack([residual, residual[::-1]], axis=1)
    assert noise([two])[:, 1] == pytest.approx(solve_triangular(factor, residual[::-1], lower=True), abs=1e-8)


def autoregressive(seed: int, count: int = 3000) -> Array:
    draws = 0.1 * np.random.default_rng(seed).standard_normal(count + 500)
    return np.asarray(lfilter([1.0], [1.0, -1.6, 0.8], draws)[500:])


def test_an_autoregression_is_found_over_several_records() -> None:
    parts = [autoregressive(1), autoregressive(2, 2000)]
    noise = Autoregressive().fitted(parts, NOTHING, ALL, 1e-9)
    assert noise.levels["order"] == 2
    taps = noise.whiteners[0].taps / noise.whiteners[0].taps[0]
    assert taps == pytest.approx([1, -1.6, 0.8], abs=0.03)
    assert noise.levels["deviation_mps2"] == pytest.approx(0.1, rel=0.03)
    white = noise(parts)
    assert abs(float(white[1:] @ white[:-1]) / len(white)) < 0.05
    assert white[:50].std() == pytest.approx(1.0, abs=0.3)


def test_white_noise_needs_no_order() -> None:
    parts = [0.2 * np.random.default_rng(3).standard_normal(2000)]
    noise = Autoregressive().fitted(parts, NOTHING, ALL, 1e-9)
    plain = White().fitted(parts, NOTHING, ALL, 1e-9)
    assert noise.levels["order"] == 0
    assert plain([parts[0]]).std() == pytest.approx(1.0, rel=1e-3)
    assert noise.deviance == pytest.approx(plain.deviance)
    road = ROAD.fitted(parts, NOTHING, ALL, 1e-9)
    assert plain.criterion(2000) < road.criterion(2000)


def test_the_criterion_prefers_what_the_noise_is() -> None:
    def best(residual: Array) -> str:
        found: list[Whitening] = [kind.fitted([residual], NOTHING, ALL, 1e-9)
                                  for kind in (White(), Autoregressive(), ROAD)]
        return min(found, key=lambda one: one.criterion(len(residual))).name

    assert best(drawn(0.04, 0.05, 900, 5)) == "road"
    assert best(autoregressive(6)) == "ar"


def test_behind_a_low_pass_white_noise_and_roads_stay_what_they_are() -> None:
    low = DecimatingLowPass(100.0, 20.0)
    white = low.apply(0.2 * np.random.default_rng(3).standard_normal(6000))
    plain = White().fitted([white], NOTHING, low, 1e-9)
    samples = plain([white])
    assert abs(float(samples[1:] @ samples[:-1]) / len(samples)) < 0.05
    road = ROAD.fitted([low.apply(drawn(0.04, 0.05, 1500, 2))], NOTHING, low, 1e-9)
    assert road.levels["gd_n0_cm3"] == pytest.approx(0.04, rel=0.25)
    assert road.levels["deviation_mps2"] == pytest.approx(0.05, rel=0.15)


def test_noise_is_never_nothing() -> None:
    zeros = [np.zeros(200)]
    for kind in (White(), Autoregressive(), ROAD):
        assert np.isfinite(kind.fitted(zeros, NOTHING, ALL, 1e-3)(zeros)).all()
