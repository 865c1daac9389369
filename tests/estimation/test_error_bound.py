"""The limit against a simulated Wiener filter that knows everything, on roads whose IRI is computed exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erf

from logger.estimation.error_bound import ErrorBound, Limit, pooled_r2
from logger.estimation.road_spectrum import RoadSpectrum
from logger.estimation.sensor_noise import Sensor
from logger.roads.elevation_spectrum import iri_of_road
from logger.roads.iri import rectified_slope, window_iri
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

from ..support.drives.measured import road_response

CAR = read_vehicle(vehicle_file("rav4-2009"))
STRUCTURE = structure_of(CAR)
SPACING_M = 0.05
COUNT = 160_000
WINDOW_M = 7.62
LEVELS = (1.0, 2.5, 7.0)


def limits(sensor: Sensor, window_m: float = WINDOW_M) -> ErrorBound:
    return ErrorBound(LinearCar(STRUCTURE, body_point(STRUCTURE)), sensor, window_m)


def golden_car(n: np.ndarray) -> np.ndarray:
    """Slope of the Golden Car per elevation from its two equations of motion (Sayers 1995), 250 mm average ahead."""
    s = 2j * np.pi * n * (80 / 3.6)
    body, link, wheel = s * s + 6.0 * s + 63.3, 6.0 * s + 63.3, 0.15 * s * s + 6.0 * s + 63.3 + 653.0
    rate = s * (link - body) * 653.0 / (body * wheel - link * link)
    return rate / (80 / 3.6) * np.sinc(0.25 * n) * np.exp(1j * np.pi * 0.25 * n)


def driven_and_filtered(level: float, speed_mps: float, noise_mps2: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Exact IRI of the windows of 8 km of Gaussian road, and what the Wiener filter makes of readings at 100 Hz."""
    rng = np.random.default_rng(seed)
    length_m = COUNT * SPACING_M
    samples = round(length_m / speed_mps * 100)
    speed_mps = length_m / samples * 100
    n = np.fft.rfftfreq(COUNT, SPACING_M)
    road_m3 = (level / 0.5386) ** 2 * 1e-6 * (np.maximum(n, 0.01) / 0.1) ** -2.0
    road = np.fft.irfft(np.fft.rfft(rng.standard_normal(COUNT)) * np.sqrt(road_m3 / (2 * SPACING_M)), COUNT)
    both = min(samples // 2 + 1, len(n))
    gain = np.where(n * speed_mps <= 42.0, road_response(CAR, n, speed_mps), 0)[:both]
    waves = np.zeros(samples // 2 + 1, dtype=complex)
    waves[:both] = np.fft.rfft(road)[:both] * gain
    readings = np.fft.irfft(waves, samples) * samples / COUNT + noise_mps2 * rng.standard_normal(samples)
    noise_m3 = noise_mps2**2 / 50 * speed_mps  # one-sided per cycle/m
    power = np.abs(gain) ** 2 * road_m3[:both]
    estimated = np.zeros(len(n), dtype=complex)
    estimated[:both] = np.fft.rfft(readings)[:both] * COUNT / samples * road_m3[:both] * np.conj(gain) / (
        power + noise_m3)
    mean = np.fft.irfft(estimated * golden_car(n), COUNT)
    left = road_m3.copy()
    left[:both] *= noise_m3 / (power + noise_m3)
    spread = np.sqrt(np.sum(np.abs(golden_car(n)) ** 2 * left) * n[1])
    best = np.sqrt(2 / np.pi) * spread * np.exp(-0.5 * (mean / spread) ** 2) + mean * erf(mean / spread / np.sqrt(2))
    exact = rectified_slope(np.concatenate([road, road[:5]]), SPACING_M)
    edges_m = np.arange(5, int(COUNT * SPACING_M / WINDOW_M)) * WINDOW_M
    return window_iri(exact, SPACING_M, edges_m), window_iri(best, SPACING_M, edges_m)


@pytest.mark.slow
@pytest.mark.parametrize("noise_mps2", [0.058, 0.2])
@pytest.mark.parametrize("speed_mps", [4.5, 13.0, 31.0])
def test_a_filter_that_knows_everything_reaches_the_limit(speed_mps: float, noise_mps2: float) -> None:
    known = limits(Sensor(noise_mps2, 0.0))
    expected = [known.at(speed_mps, RoadSpectrum.of_iri(level)) for level in LEVELS]
    exact, best = np.stack([driven_and_filtered(level, speed_mps, noise_mps2, seed)
                            for seed, level in enumerate(LEVELS)], axis=1)
    assert pooled_r2(expected) == pytest.approx(1 - np.mean((best - exact) ** 2) / np.var(exact), abs=0.005)
    for limit, e, b in zip(expected, exact, best, strict=True):
        assert limit.iri_m_per_km == pytest.approx(e.mean(), rel=0.02)
        assert limit.spread_m_per_km == pytest.approx(e.std(), rel=0.07)
        assert limit.std_m_per_km == pytest.approx(np.sqrt(np.mean((b - e) ** 2)), rel=0.08)


@pytest.mark.parametrize("window_m", [7.62, 30.48, 300.0])
def test_how_much_windows_differ_is_what_the_road_s_own_relation_says(window_m: float) -> None:
    spectrum = RoadSpectrum.of_iri(3.0)
    limit = limits(Sensor(0.05, 0.0), window_m).at(20.0, spectrum)
    road = iri_of_road(spectrum.gd_n0_cm3, window_m)
    assert limit.iri_m_per_km == pytest.approx(road.value, rel=0.01)
    assert limit.spread_m_per_km == pytest.approx(road.std, rel=0.01)


def test_without_noise_nearly_all_is_reported_and_with_much_nothing() -> None:
    spectrum = RoadSpectrum.of_iri(3.0)
    r2 = [limits(Sensor(noise, 0.0)).at(8.0, spectrum).r2 for noise in (1e-4, 0.01, 0.1, 1.0, 1e4)]
    assert r2 == sorted(r2, reverse=True)
    assert r2[0] > 0.99
    assert r2[-1] == pytest.approx(0, abs=1e-6)


def test_steps_count_as_noise() -> None:
    spectrum, step = RoadSpectrum.of_iri(3.0), 0.1
    stepped = limits(Sensor(0.05, step)).at(20.0, spectrum)
    assert stepped == limits(Sensor((0.05**2 + step**2 / 12) ** 0.5, 0.0)).at(20.0, spectrum)


def test_pooled_by_hand() -> None:
    # errors squared 0.01 and 0.09, own variances 0.04 and 0.36, means 1 and 3 with variance 1
    assert pooled_r2([Limit(1.0, 0.2, 0.1), Limit(3.0, 0.6, 0.3)]) == pytest.approx(1 - 0.05 / (0.2 + 1.0))
    assert pooled_r2([Limit(1.0, 0.2, 0.1)]) == pytest.approx(Limit(1.0, 0.2, 0.1).r2) == pytest.approx(0.75)
