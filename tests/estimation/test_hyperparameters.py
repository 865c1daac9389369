"""Learning of spectrum and noise against exact log evidence, and on generated roads of known spectrum."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from logger.estimation.car_response import CarResponse
from logger.estimation.road_solver import Block, Solution, TimeGrid
from logger.estimation.road_spectrum import (
    COMMON_ROAD,
    FLATTENED_BELOW_CPM,
    PIVOT_CPM,
    RoadSpectrum,
    learned,
    log_waves,
)
from logger.estimation.roughness import resolved_shares
from logger.estimation.sensor_noise import noise_slope, with_noise
from logger.roads import iso8608
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

NOISE_MPS2, DRIFT = 0.06, 0.05**2
RAV4 = structure_of(read_vehicle(vehicle_file("rav4-2009")))


@cache
def time_grid(count: int) -> TimeGrid:
    return TimeGrid(CarResponse(LinearCar(RAV4, body_point(RAV4))), count, 100.0)


def a_block(count: int, speed_mps: float) -> Block:
    return Block(time_grid(count), speed_mps / 100 * np.arange(count), 0.1524, 7.62)


def moved(spectrum: RoadSpectrum, level: float, waviness: float) -> RoadSpectrum:
    return RoadSpectrum(spectrum.log_level + level, spectrum.waviness + waviness)


def log_prior(spectrum: RoadSpectrum, before: RoadSpectrum | None) -> float:
    """Deviations as the module states them: what roads are like, and how far they wander between two blocks."""
    total = -0.5 * ((spectrum.log_level - COMMON_ROAD.log_level) / 1.8) ** 2
    total -= 0.5 * ((spectrum.waviness - 2) / 0.3) ** 2
    if before is not None:
        total -= 0.5 * ((spectrum.log_level - before.log_level) / 0.3) ** 2
        total -= 0.5 * ((spectrum.waviness - before.waviness) / 0.1) ** 2
    return total


@pytest.mark.parametrize("before", [None, RoadSpectrum.of_iri(3.1, 2.05)])
def test_one_step_is_newtons_on_the_evidence_of_waves(before: RoadSpectrum | None) -> None:
    """Waves each seen through noise of their own have a closed evidence; slope by differences, curvature expected."""
    rng = np.random.default_rng(1)
    n = np.linspace(0.004, 2.0, 400)
    now = RoadSpectrum.of_iri(3.0, 2.1)
    information = rng.uniform(0.1, 3.0, 400) * (0.05 / n)
    gain = information * now.psd(n) / now.psd(np.array([0.3]))
    power = (1 + gain) * rng.exponential(1.0, 400)  # of the reading of each wave, over its noise

    def log_posterior(level: float, waviness: float) -> float:
        there = moved(now, level, waviness)
        g = gain * there.psd(n) / now.psd(n)
        return float(-np.log1p(g).sum() - (power / (1 + g)).sum()) + log_prior(there, before)

    resolved = gain / (1 + gain)
    # The most probable waves have this power.
    found = learned(now, resolved * power / (1 + gain), resolved, log_waves(n), 1.0, before)
    h = 1e-4
    slope = np.array([
        log_posterior(h, 0) - log_posterior(-h, 0), log_posterior(0, h) - log_posterior(0, -h)
    ]) / (2 * h)
    tilt = -np.log(np.maximum(n, FLATTENED_BELOW_CPM) / PIVOT_CPM)
    rows = np.stack([np.ones(400), tilt])
    expected = (rows * resolved**2) @ rows.T + np.diag([1.8**-2, 0.3**-2])
    if before is not None:
        expected += np.diag([0.3**-2, 0.1**-2])
    step = np.linalg.solve(expected, slope)
    assert np.abs(step).max() < 0.7
    assert found.log_level - now.log_level == pytest.approx(step[0], rel=1e-4)
    assert found.waviness - now.waviness == pytest.approx(step[1], rel=1e-4)


def whitened(block: Block, solution: Solution, variance: np.ndarray) -> np.ndarray:
    """Power of each wave of the innovations over their deviations, as ``learned`` takes it."""
    white = np.fft.irfft(solution.waves, block.count) / np.sqrt(variance)
    return np.abs(np.fft.rfft(white)) ** 2 / block.count


def patchy(block: Block) -> np.ndarray:
    """A road whose variance goes up and down by a factor of four, with a rough metre in it."""
    place = block.spacing_m * np.arange(block.count)
    variance = 4.0 ** np.sin(place / 15.0)
    variance[(place > 120) & (place < 121)] = 100.0
    return variance


@pytest.mark.slow
@pytest.mark.parametrize("variance_of", [lambda block: np.ones(block.count), patchy])
def test_slope_is_that_of_the_exact_evidence_of_a_drive(variance_of: Callable[[Block], np.ndarray]) -> None:
    """log N(y; 0, B D B' + noise) by dense algebra, its slope by differences; the level is put off on purpose."""
    rng = np.random.default_rng(3)
    block = a_block(1024, 25.0)
    variance = variance_of(block)
    true, now = RoadSpectrum.of_iri(3.0), RoadSpectrum.of_iri(2.6, 2.05)
    innovations = np.sqrt(variance) * rng.standard_normal(block.count)
    reading = block.driven(np.fft.rfft(innovations) * block.wave_factors(true)) + rng.normal(0, NOISE_MPS2, 1024)
    unit = np.fft.rfft(np.eye(block.count), axis=1)
    # A apart from F, so that the matrix is built once: B B' = A S A'.
    matrix = np.array([block.driven(row * block.wave_factors(now)) for row in unit]).T
    ratio = block.wave_number_cpm

    def log_posterior(level: float, waviness: float) -> float:
        there = moved(now, level, waviness)
        shape = np.sqrt(there.psd(ratio) / now.psd(ratio))
        scaled = np.fft.irfft(np.fft.rfft(matrix, axis=1) * shape, block.count, axis=1)
        drift = time_grid(1024).drift.T
        covariance = (scaled * variance) @ scaled.T + NOISE_MPS2**2 * np.eye(1024)
        covariance += drift @ np.diag(1 / time_grid(1024).drift_precision(DRIFT)) @ drift.T
        return float(-0.5 * np.linalg.slogdet(covariance)[1] - 0.5 * reading @ np.linalg.solve(covariance, reading)
                     + log_prior(there, None))

    weight = np.full(1024, NOISE_MPS2**-2)
    solution = block.solve(reading, weight, now, variance, DRIFT, 400)
    share = block.seen_points(weight > 0) / block.count
    resolved = resolved_shares(np.log(variance), solution.gain, block.seen(weight > 0)).waves
    found = learned(now, whitened(block, solution, variance), resolved, block.log_waves, share, None)
    step = np.array([found.log_level - now.log_level, found.waviness - now.waviness])
    h = 0.02
    slope = np.array([
        log_posterior(h, 0) - log_posterior(-h, 0), log_posterior(0, h) - log_posterior(0, -h)
    ]) / (2 * h)
    seen = solution.gain > 0
    tilt = -np.log(np.maximum(block.wave_number_cpm[seen], FLATTENED_BELOW_CPM) / PIVOT_CPM)
    rows = np.stack([np.ones(seen.sum()), tilt])
    curvature = (rows * share * resolved[seen] ** 2) @ rows.T + np.diag([1.8**-2, 0.3**-2])
    exact = np.linalg.solve(curvature, slope)
    error = np.sqrt(np.diag(np.linalg.inv(curvature)))
    assert exact[0] > 2 * error[0]  # there is something to learn
    assert np.abs(step - exact) == pytest.approx([0.0, 0.0], abs=0.3 * error.max())


@pytest.mark.slow
@pytest.mark.parametrize("speed_mps", [5.0, 14.0, 30.0])
def test_level_and_waviness_are_found_again(speed_mps: float) -> None:
    """Thirty roads of random amplitudes; errors over the standard error by the waves' information, and the bias."""
    count = 2048
    rng = np.random.default_rng(round(speed_mps))
    block = a_block(count, speed_mps)
    weight = np.full(count, NOISE_MPS2**-2)
    weight[:250] = 0.0
    share = block.seen_points(weight > 0) / block.count
    even, scores, wavinesses = np.ones(block.count), [], []
    for iri, waviness in ((1.0, 2.2), (3.0, 1.9), (9.0, 2.0)):
        true = RoadSpectrum.of_iri(iri, waviness)
        for _ in range(10):
            road = np.fft.rfft(rng.standard_normal(block.count)) * block.wave_factors(true)
            reading = block.driven(road) + rng.normal(0, NOISE_MPS2, count)
            spectrum, waves = COMMON_ROAD, None
            for _ in range(8):
                solution = block.solve(reading, weight, spectrum, even, DRIFT, 8, waves)
                waves = solution.waves
                resolved = solution.gain / (1 + solution.gain)
                spectrum = learned(spectrum, whitened(block, solution, even), resolved, block.log_waves, share, None)
            rows = np.stack([np.ones(len(resolved)), -block.log_waves])
            information = (rows * share * resolved**2) @ rows.T + np.diag([1.8**-2, 0.3**-2])
            std = np.sqrt(np.linalg.inv(information)[0, 0])
            scores.append((spectrum.log_level - true.log_level) / std)
            wavinesses.append(spectrum.waviness - waviness)
    assert abs(np.mean(scores)) < 0.6
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.4
    assert abs(np.mean(wavinesses)) < 0.08 and np.std(wavinesses) < 0.2


def noise_found(residual: np.ndarray, weight: np.ndarray, resolved_waves: float = 0.0) -> float:
    log_noise = 0.0
    for _ in range(12):
        log_noise = with_noise(log_noise, *noise_slope(residual, weight / np.exp(log_noise), resolved_waves))
    return float(np.exp(log_noise))


def only(noise: np.ndarray, highest_hz: float) -> np.ndarray:
    """What a recorder passes."""
    waves = np.fft.rfft(noise)
    waves[np.fft.rfftfreq(len(noise), 0.01) > highest_hz] = 0.0
    return np.fft.irfft(waves, len(noise))


@pytest.mark.parametrize("highest_hz", [50.0, 38.0])
@pytest.mark.parametrize("factor", [0.5, 1.0, 3.0])
def test_noise_is_found_from_residuals(factor: float, highest_hz: float) -> None:
    """Also where all above 38 Hz was filtered out: the noise per hertz counts. The mean over forty draws, so that the
    tolerance is not for luck; a quarter of the time nothing was read."""
    rng = np.random.default_rng(2)
    weight = np.full(2048, NOISE_MPS2**-2)
    weight[:500] = 0.0
    found = [
        noise_found(only(np.sqrt(factor) * NOISE_MPS2 * rng.standard_normal(2048), highest_hz), weight)
        for _ in range(40)
    ]
    assert np.mean(found) == pytest.approx(factor, rel=0.05)
    assert np.std(found) < 0.15 * factor


def test_what_the_road_took_of_the_noise_is_made_up_for() -> None:
    """A fit with as many free waves as the road has: a share of the noise goes with them."""
    rng = np.random.default_rng(4)
    found = []
    for _ in range(20):
        waves = np.fft.rfft(NOISE_MPS2 * rng.standard_normal(2048))
        waves[100:500] = 0.0  # 2.4 to 12.2 Hz, 800 of 2048 numbers
        found.append(noise_found(np.fft.irfft(waves, 2048), np.full(2048, NOISE_MPS2**-2), 800.0))
    assert np.mean(found) == pytest.approx(1.0, rel=0.05)


def test_a_pothole_that_is_not_explained_yet_is_no_noise() -> None:
    rng = np.random.default_rng(5)
    residual = NOISE_MPS2 * rng.standard_normal(2048)
    weight = np.full(2048, NOISE_MPS2**-2)
    place = np.arange(2048) / 100 - 11.3
    swing = 5.0 * np.exp(-place / 0.3) * np.sin(2 * np.pi * 11 * place) * (place > 0)
    assert np.mean(swing**2) > 10 * NOISE_MPS2**2
    assert noise_found(residual + swing, weight) == pytest.approx(noise_found(residual, weight), rel=0.12)


def test_a_sensor_that_hangs_is_not_taken_for_one_without_noise() -> None:
    log_noise = 0.0
    for _ in range(200):
        log_noise = with_noise(log_noise, *noise_slope(np.zeros(1000), np.full(1000, 1e6), 300.0))
    assert log_noise == pytest.approx(-2.0, rel=1e-6)


def test_nothing_read_leaves_what_roads_are_like() -> None:
    block = a_block(1024, 15.0)
    waves = np.zeros(len(block.wave_number_cpm))
    found = learned(COMMON_ROAD, waves, waves, block.log_waves, 0.0, None)
    assert found == COMMON_ROAD
    assert with_noise(0.0, *noise_slope(np.zeros(1024), np.zeros(1024), 0.0)) == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize("waviness", [1.6, 2.0, 2.4])
def test_a_spectrum_of_an_iri_is_that_of_the_standard(waviness: float) -> None:
    """Gd(n) = Gd(n0) (n / n0)^-w with Gd(n0) of Eq 4.40, flat where it would grow beyond bounds."""
    spectrum = RoadSpectrum.of_iri(2.7, waviness)
    assert spectrum.gd_n0_cm3 == pytest.approx((2.7 / 0.5386) ** 2)
    n = np.array([0.01, 0.1, 0.7, 3.0])
    assert spectrum.psd(n) == pytest.approx(iso8608.displacement_psd(n, spectrum.gd_n0_cm3, waviness))
    assert spectrum.psd(np.array([0.0, 0.005])) == pytest.approx(np.full(2, spectrum.psd(n[:1])[0]))
