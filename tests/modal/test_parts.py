"""Moments, spectra, decrement, MAC and the five-storey building against formulas and other routines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from logger.modal import five_storey
from logger.modal.decay import damping_of_two_peaks, log_decrement
from logger.modal.five_storey import chain, free_decay, with_damping_ratios
from logger.modal.mode import errors_of
from logger.modal.subspace import segment_products, summed_spectrum

from ..support.shapes import mac


def test_moments_are_the_products_of_lagged_samples() -> None:
    samples = np.random.default_rng(1).standard_normal((203, 3))
    segments = segment_products(samples, 5, 4)
    columns = np.hstack([samples[lag:lag + 199 - 199 % 4] for lag in range(5)])
    np.testing.assert_allclose(segments.whole().products * segments.whole().count, columns.T @ columns, atol=1e-9)
    without_second = np.delete(columns, np.arange(49, 98), axis=0)
    left = list(segments.without_one())[1]
    np.testing.assert_allclose(left.products * left.count, without_second.T @ without_second, atol=1e-9)


def test_damping_ratios_are_given_to_the_modes() -> None:
    mass, stiffness = chain(np.array([1.0, 2.0, 0.5]), np.array([300.0, 100.0, 200.0]))
    poles, shapes = with_damping_ratios(mass, stiffness, np.array([0.01, 0.4, 0.03])).poles()
    squares, vectors = eigh(stiffness, mass)
    np.testing.assert_allclose(np.abs(poles), np.sqrt(squares))
    np.testing.assert_allclose(-poles.real / np.abs(poles), [0.01, 0.4, 0.03])
    np.testing.assert_allclose(np.diag(mac(vectors, shapes)), 1.0)


def test_a_free_decay_is_the_formula() -> None:
    one = with_damping_ratios(np.eye(1), np.array([[400.0]]), np.array([0.1]))
    t_s = np.arange(200) / 50
    pole = 20 * (-0.1 + 1j * np.sqrt(0.99))
    position = (pole.conjugate() * np.exp(pole * t_s)).imag / pole.conjugate().imag  # 1 and at rest at 0
    velocity = (abs(pole) ** 2 * np.exp(pole * t_s)).imag / pole.conjugate().imag
    np.testing.assert_allclose(free_decay(one, np.ones(1), 50.0, 200)[:, 0], -400 * position - 4 * velocity, atol=1e-8)


def test_mac_knows_a_factor_from_a_difference() -> None:
    assert mac([1, 2, 3], [2j, 4j, 6j])[0, 0] == pytest.approx(1)
    assert mac([1, 0], [0, 1])[0, 0] == 0
    assert mac([1, 1], [1, 0])[0, 0] == pytest.approx(0.5)


def test_errors_of_frequency_and_damping_are_those_of_draws() -> None:
    rng = np.random.default_rng(2)
    covariance = np.array([[0.04, 0.01], [0.01, 0.09]])
    draws = rng.multivariate_normal([-3.0, 20.0], covariance, 200_000)
    poles = draws[:, 0] + 1j * draws[:, 1]
    frequency_std, damping_std = errors_of(-3 + 20j, covariance)
    assert frequency_std == pytest.approx(np.std(np.abs(poles) / (2 * np.pi)), rel=0.01)
    assert damping_std == pytest.approx(np.std(-poles.real / np.abs(poles)), rel=0.01)


def test_decrement_of_a_clean_and_a_noisy_wave() -> None:
    t_s = np.arange(3000) / 100
    wave = np.exp(-0.02 * 2 * np.pi * 1.5 * t_s) * np.cos(2 * np.pi * 1.5 * np.sqrt(1 - 0.02**2) * t_s)
    clean = log_decrement(wave, 100.0)
    assert clean.damping_ratio == pytest.approx(0.02, rel=0.02)
    assert clean.frequency_hz == pytest.approx(1.5, rel=1e-3)
    noisy = log_decrement(wave + 0.02 * np.random.default_rng(1).standard_normal(3000), 100.0)
    assert abs(noisy.damping_ratio - 0.02) < 4 * noisy.damping_std < 0.004
    assert damping_of_two_peaks(0.1978, 0.0855, 10) == pytest.approx(0.0134, abs=1e-4)  # Eq 5.3
    with pytest.raises(ValueError, match="at least 4 peaks"):
        log_decrement(np.exp(-t_s), 100.0)


def test_a_summed_spectrum_has_the_power_of_the_record() -> None:
    samples = np.random.default_rng(4).standard_normal((20_000, 2))
    power, step_hz = summed_spectrum(samples, 100.0, 8)
    assert step_hz == pytest.approx(0.04)
    # Hann's window keeps 3/8 of the power; half the bins lie below zero.
    assert 2 * power.sum(axis=1).mean() / 2500**2 == pytest.approx(2 * 3 / 8, rel=0.03)
    with pytest.raises(ValueError, match="found 8 of 12"):
        summed_spectrum(np.ones((100, 1)), 100.0, 8)


def test_the_building_against_what_is_printed() -> None:
    found = five_storey.frequencies_hz(five_storey.structure())
    assert found[[0, 2]] == pytest.approx([0.7453, 4.534], rel=3e-3)
    # Whatever the stiffness: with the printed first mode the third fits and the second is 2.600, not 2.500.
    scaled = found * 0.7453 / found[0]
    assert scaled[2] == pytest.approx(4.534, abs=5e-4)
    assert scaled[1] == pytest.approx(2.600, abs=5e-4)
    assert np.diag(five_storey.structure().mass) == pytest.approx([0.346] * 4 + [1.3007], abs=1e-4)


def test_two_sensors_on_the_building() -> None:
    first, second = five_storey.compare_sensors()
    assert abs(second.rms_g / first.rms_g - 1) < 0.05
    assert first.rms_g == pytest.approx(five_storey.PRINTED_RMS[0], rel=0.25)
    for one in (first, second):
        assert abs(one.decrement.damping_ratio - 0.0134) < 4 * one.decrement.damping_std
        assert one.peaks_hz[0] == pytest.approx(0.7453, abs=0.014)
