"""Modes of simulated records against the eigenvalues of what was simulated; records without modes."""

from __future__ import annotations

import numpy as np
import pytest

from logger.modal.analysis import decays, find_modes
from logger.modal.five_storey import Masses, chain, free_decay, random_response, with_damping_ratios
from logger.modal.mode import FoundMode

from ..support.shapes import mac
from ..support.slow import slow

RATE_HZ = 100.0
FREQUENCIES_HZ = 2.48 * np.sin((2 * np.arange(1, 6) - 1) * np.pi / 22) / np.sin(np.pi / 22)  # of a uniform chain


def five(ratios: list[float]) -> Masses:
    stiffness = (2 * np.pi * 2.48 / (2 * np.sin(np.pi / 22))) ** 2
    return with_damping_ratios(*chain(np.ones(5), np.full(5, stiffness)), np.array(ratios))


def noisy(clean: np.ndarray, share: float, seed: int) -> np.ndarray:
    return clean + share * clean.std(axis=0) * np.random.default_rng(seed).standard_normal(clean.shape)


def random_record(masses: Masses, seconds: float, seed: int) -> np.ndarray:
    force = np.random.default_rng(seed).standard_normal((round(400 * seconds), len(masses.mass)))
    return noisy(random_response(masses, force, RATE_HZ), 0.1, seed + 1000)


def check(found: tuple[FoundMode, ...], ratios: list[float], sds: float) -> None:
    """All five and no other, each within so many standard deviations, which are small themselves."""
    assert len(found) == 5
    for mode, frequency_hz, ratio in zip(found, FREQUENCIES_HZ, ratios, strict=True):
        assert abs(mode.frequency_hz - frequency_hz) < sds * mode.frequency_std_hz < 0.2 * sds * frequency_hz
        assert abs(mode.damping_ratio - ratio) < sds * mode.damping_std < sds * max(0.01, 0.2 * ratio)


@pytest.mark.parametrize("share", [0.01, 0.1])
@pytest.mark.parametrize("seed", [1, 2])
def test_five_light_modes_in_a_noisy_decay(share: float, seed: int) -> None:
    masses = five([0.01] * 5)
    record = noisy(free_decay(masses, np.eye(5)[0], RATE_HZ, 2000), share, seed) + 9.81
    result = find_modes(record, RATE_HZ)
    check(result.modes, [0.01] * 5, 4.0)
    shapes = np.array([mode.shape for mode in result.modes]).T
    assert np.diag(mac(masses.poles()[1], shapes)).min() > 0.9
    assert result.rejected
    assert all(one.reason for one in result.rejected)


@pytest.mark.slow
def test_the_truth_lies_within_two_errors_as_often_as_it_should() -> None:
    clean = free_decay(five([0.03] * 5), np.eye(5)[0], RATE_HZ, 600)
    inside = []
    for seed in range(12):
        modes = find_modes(noisy(clean, 0.05, seed), RATE_HZ).modes
        for mode, frequency_hz in zip(modes, FREQUENCIES_HZ, strict=True):
            inside.append(abs(mode.frequency_hz - frequency_hz) < 2 * mode.frequency_std_hz)
            inside.append(abs(mode.damping_ratio - 0.03) < 2 * mode.damping_std)
    assert np.mean(inside) > 0.88  # of 120


@pytest.mark.parametrize("digits", [3, *slow(6, 10)])
def test_noise_that_shrinks_with_the_signal_has_no_modes(digits: int) -> None:
    clean = free_decay(five([0.01] * 5), np.eye(5)[0], RATE_HZ, 2000)
    rounded = np.array([[float(f"{one:.{digits}g}") for one in row] for row in clean])
    check(find_modes(rounded, RATE_HZ).modes, [0.01] * 5, 6.0)


@pytest.mark.parametrize("seed", [1, *slow(2, 3)])
def test_a_sensor_that_errs_by_a_share_of_what_it_reads(seed: int) -> None:
    clean = free_decay(five([0.01] * 5), np.eye(5)[0], RATE_HZ, 2000)
    share = 0.02 * np.random.default_rng(seed).standard_normal(clean.shape)
    check(find_modes(clean * (1 + share), RATE_HZ).modes, [0.01] * 5, 4.0)


def test_heavy_modes_in_a_decay_are_taken_in_together() -> None:
    ratios = [0.35, 0.10, 0.05, 0.30, 0.03]
    record = noisy(free_decay(five(ratios), np.eye(5)[4], RATE_HZ, 1000), 0.01, 3)
    found = find_modes(record, RATE_HZ).modes
    assert len(found) == 5
    np.testing.assert_allclose([mode.damping_ratio for mode in found], ratios, rtol=0.3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_modes_that_are_over_in_a_few_samples(seed: int) -> None:
    """Body and wheels of half a car on its springs."""
    rates = [23_088.0, 23_088.0, 238_180.0, 238_180.0]
    ends = np.array([[1.0, 1.0, -1.0, 0.0], [1.0, -1.0, 0.0, -1.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    ratios = np.array([0.35, 0.4, 0.3, 0.3])
    car = with_damping_ratios(np.diag([875.0, 509.0, 45.0, 70.0]), ends.T @ np.diag(rates) @ ends, ratios)
    record = noisy(free_decay(car, np.array([1.0, 0.6, 0.0, 0.0]), RATE_HZ, 2000), 0.1, seed)
    found = find_modes(record, RATE_HZ).modes
    assert len(found) == 4
    for mode, pole, ratio in zip(found, car.poles()[0], ratios, strict=True):
        assert abs(mode.frequency_hz - abs(pole) / (2 * np.pi)) < 4 * mode.frequency_std_hz
        assert abs(mode.damping_ratio - ratio) < 4 * mode.damping_std < 0.04


def pair(seconds: float) -> np.ndarray:
    """Two light modes 2 % apart, in two channels."""
    t_s = np.arange(round(100 * seconds)) / 100
    first, second = (np.exp(-r * 2 * np.pi * f * t_s) * np.cos(2 * np.pi * f * t_s) for f, r in ((3.0, 0.01),
                                                                                              (3.06, 0.012)))
    noise = 0.02 * np.random.default_rng(0).standard_normal((2, len(t_s)))
    return np.stack([first + second + noise[0], first - 0.8 * second + noise[1]], axis=1)


def test_poles_that_grow_do_no_harm_in_a_long_decay() -> None:
    found = find_modes(pair(60.0), RATE_HZ, decay=True).modes
    np.testing.assert_allclose([mode.frequency_hz for mode in found], [3.0, 3.06], rtol=2e-3)


@pytest.mark.slow
def test_heavy_and_light_damping_under_random_forces() -> None:
    ratios = [0.35, 0.10, 0.05, 0.30, 0.03]
    result = find_modes(random_record(five(ratios), 200.0, 1), RATE_HZ)
    check(result.modes, ratios, 4.0)
    assert result.order == 10


@pytest.mark.parametrize(("ratio", "frequency_hz"), [(0.05, 10.0), *slow((0.05, 2.0), (0.4, 2.0), (0.4, 10.0))])
def test_one_mode_under_random_forces(frequency_hz: float, ratio: float) -> None:
    """Errors near the Cramer-Rao bound of a second-order process in noise, computed by Whittle's formula."""
    bound = {(2.0, 0.05): (0.0083, 0.175), (2.0, 0.4): (0.044, 0.089),
             (10.0, 0.05): (0.0040, 0.079), (10.0, 0.4): (0.031, 0.046)}[frequency_hz, ratio]
    one = with_damping_ratios(np.eye(1), np.eye(1) * (2 * np.pi * frequency_hz) ** 2, np.array([ratio]))
    errors = []
    for seed in range(12):
        found = find_modes(random_record(one, 60.0, seed), RATE_HZ, decay=False).modes
        assert len(found) == 1
        errors.append((found[0].frequency_hz / frequency_hz - 1, found[0].damping_ratio / ratio - 1))
    over = np.sqrt(np.mean(np.square(errors), axis=0)) / bound
    assert (over < 1.6).all()  # of 12 records: a bound that is attained gives 1.45 once in a hundred


@pytest.mark.slow
def test_a_measured_input() -> None:
    rng = np.random.default_rng(5)
    masses, push = five([0.02] * 5), rng.standard_normal(8000)
    force = np.zeros((32_000, 5))
    force[:, 0] = np.repeat(push, 4)
    record = noisy(random_response(masses, force, RATE_HZ), 0.03, 6)
    check(find_modes(record, RATE_HZ, push[:, None]).modes, [0.02] * 5, 4.0)


def test_white_noise_has_no_modes() -> None:
    for seed in range(3):
        assert find_modes(np.random.default_rng(seed).standard_normal((3000, 2)), RATE_HZ).modes == ()


def test_a_hum_has_no_modes() -> None:
    hum = np.sin(2 * np.pi * 5 * np.arange(3000) / 100)
    for noise in (0.1, 0.0):
        for seed in range(3 if noise else 1):
            record = hum + noise * np.random.default_rng(seed).standard_normal(3000)
            assert find_modes(record[:, None], RATE_HZ, decay=False).modes == ()


def test_a_decay_of_noise_has_no_modes() -> None:
    for seed in range(5):
        noise = np.random.default_rng(seed).standard_normal((1500, 2))
        assert find_modes(noise, RATE_HZ, decay=True).modes == ()


def test_a_mode_that_was_not_excited_is_not_there() -> None:
    masses = five([0.01] * 5)
    only_two = masses.poles()[1][:, :2].real.sum(axis=1)
    found = find_modes(noisy(free_decay(masses, only_two, RATE_HZ, 2000), 0.1, 3), RATE_HZ).modes
    np.testing.assert_allclose([mode.frequency_hz for mode in found], FREQUENCIES_HZ[:2], rtol=0.01)


def test_what_kind_of_record_it_is() -> None:
    masses = five([0.01] * 5)
    assert decays(free_decay(masses, np.eye(5)[0], RATE_HZ, 2000))
    assert not any(decays(random_record(masses, 60.0, seed)) for seed in range(5))


def test_a_record_that_is_too_short() -> None:
    record = random_record(five([0.02] * 5), 60.0, 3)
    with pytest.raises(ValueError, match="at least 100 samples, found 99"):
        find_modes(record[:99], RATE_HZ)


@pytest.mark.parametrize("is_pushed", [True, False])
@pytest.mark.parametrize("samples", [100, 250])
def test_short_records_end_in_modes_or_words(is_pushed: bool, samples: int) -> None:
    record = random_record(five([0.02] * 5), 5.0, 3)[:samples]
    try:
        find_modes(record, RATE_HZ, record[:, :1] ** 2 if is_pushed else None)
    except ValueError as error:
        assert "expected" in str(error)
