"""The examiner's roads and recorder against numbers known beforehand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, csd, freqs, welch

from .simulator.recorder import HUNDREDTH_G_MPS2, Noise, Sensor, band_limited, record
from .simulator.roads import CLASS_GD_M3, random_road, wheel_path

pytestmark = pytest.mark.slow  # the examination's own car is tried before an examination

STEP_S = 1 / 4000


def test_level_and_waviness_of_many_roads_are_those_of_their_class() -> None:
    at, densities, wavinesses = None, [], []
    for seed in range(6):
        road = random_road(np.random.default_rng(seed), 4000.0, 0.1, "C", features=False)
        n, density = welch(np.diff(road.left_m) / 0.1, 10.0, nperseg=4096, detrend=False)
        band = (n > 0.03) & (n < 2.0)
        at, densities = n[band], [*densities, density[band] / (2 * np.pi * n[band]) ** 2]
        wavinesses.append(road.waviness)
    fit = np.polyfit(np.log(at / 0.1), np.mean(np.log(densities), axis=0), 1)
    assert -fit[0] == pytest.approx(np.mean(wavinesses), abs=0.08)
    # The classes' levels spread by a factor of 1.66 either way.
    assert abs(np.log(np.exp(fit[1]) / CLASS_GD_M3["C"])) < np.log(1.66)


def test_tracks_share_long_waves_only() -> None:
    road = random_road(np.random.default_rng(3), 6000.0, 0.1, "B", features=False)
    left, right = np.diff(road.left_m), np.diff(road.right_m)
    n, across = csd(left, right, 10.0, nperseg=1024)
    both = np.abs(across) ** 2 / (welch(left, 10.0, nperseg=1024)[1] * welch(right, 10.0, nperseg=1024)[1])
    assert both[(n > 0.01) & (n < 0.05)].min() > 0.8
    assert both[(n > 1) & (n < 4)].mean() < 0.2
    assert left.std() == pytest.approx(right.std(), rel=0.2)


def test_the_tire_averages_the_straight_pieces_of_the_road() -> None:
    rng = np.random.default_rng(5)
    road = rng.standard_normal(50)
    at = rng.uniform(-1, 6, 40)
    height, rate = wheel_path(road, 0.1, at, np.full(40, 2.0), 0.23)

    def brute(place: float) -> float:
        fine = place + 0.23 * (np.arange(20_000) + 0.5) / 20_000 - 0.115
        return float(np.interp(fine, np.arange(50) * 0.1, road).mean())

    assert height == pytest.approx([brute(x) for x in at], abs=1e-6)
    assert rate == pytest.approx([2 * (brute(x + 1e-3) - brute(x - 1e-3)) / 2e-3 for x in at], abs=2e-2)
    point, slope = wheel_path(road, 0.1, at, np.ones(40), 0.0)
    assert point == pytest.approx(np.interp(at, np.arange(50) * 0.1, road))
    assert slope[at < 0] == pytest.approx(0)


def tone(hz: float) -> np.ndarray:
    return np.sin(2 * np.pi * hz * np.arange(round(4 / STEP_S)) * STEP_S)


@pytest.mark.parametrize("hz", [0.5, 5.0, 20.0, 37.9])
def test_what_is_below_38_hz_passes_unchanged(hz: float) -> None:
    at = np.arange(100, 300) / 100
    assert band_limited(tone(hz), 0.0, STEP_S, at) == pytest.approx(np.sin(2 * np.pi * hz * at), abs=1.5e-3)


@pytest.mark.parametrize("hz", [50.1, 62.0, 99.0, 400.0])
def test_what_is_above_50_hz_does_not_fold_back(hz: float) -> None:
    assert np.abs(band_limited(tone(hz), 0.0, STEP_S, np.arange(100, 300) / 100)).max() < 1e-3


def recorded_tone(hz: float, sensor: Sensor) -> complex:
    """Amplitude and phase of the record of a sensor on a body that moves with 1 m/s2."""
    omega = 2 * np.pi * hz
    t = np.arange(round(4 / STEP_S)) * STEP_S
    at = np.arange(200, 350) / 100
    got = record(-np.cos(omega * t) / omega, STEP_S, 0.0, sensor, at)
    wave = np.column_stack([np.sin(omega * at), np.cos(omega * at)])
    re, im = np.linalg.lstsq(wave, got, rcond=None)[0]
    return complex(re, im)


@pytest.mark.parametrize("hz", [2.0, 12.0, 31.0])
def test_every_sensor_has_its_textbook_response(hz: float) -> None:
    s = 2j * np.pi * hz
    own, zeta = 2 * np.pi * 20.0, 0.1
    mount = (2 * zeta * own * s + own**2) / (s**2 + 2 * zeta * own * s + own**2)
    second = freqs(*butter(2, 2 * np.pi * 15, analog=True), worN=[s.imag])[1][0]
    for sensor, expected in (
        (Sensor(), 1.0), (Sensor(gain=0.8), 0.8), (Sensor(delay_s=0.0137), np.exp(-0.0137 * s)),
        (Sensor(mount_hz=20.0, mount_zeta=zeta), mount), (Sensor(cutoff_hz=15.0), 1 / (1 + s / (30 * np.pi))),
        (Sensor(cutoff_hz=15.0, order=2), second),
    ):
        assert recorded_tone(hz, sensor) == pytest.approx(complex(expected), abs=3e-3)


def test_clipping_drift_and_engine() -> None:
    t = np.arange(round(4 / STEP_S)) * STEP_S
    rates, at = -np.cos(4 * np.pi * t) / (4 * np.pi), np.arange(50, 350) / 100
    assert np.abs(record(rates, STEP_S, 0.0, Sensor(clip_mps2=0.5), at)).max() < 0.56
    assert record(0 * t, STEP_S, 0.0, Sensor(engine_mps2=0.7, engine_hz=25.0), at).std() == pytest.approx(0.7, rel=0.02)
    grown = record(rates, STEP_S, 0.0, Sensor(drift=0.5), at)
    assert grown == pytest.approx((1 + 0.5 * at / 60.0) * np.sin(4 * np.pi * at), abs=3e-3)


def test_noise_is_white_or_filtered_or_rounded() -> None:
    rng = np.random.default_rng(0)
    clean = rng.standard_normal(20_000)
    assert (Noise(0.05, 0.0).add(clean, rng) - clean).std() == pytest.approx(0.05, rel=0.03)
    filtered = Noise(0.05, 0.0, filtered=True).add(clean, rng) - clean
    assert welch(filtered, 100, nperseg=400)[1][20:150].mean() == pytest.approx(0.05**2 / 50, rel=0.05)
    assert welch(filtered, 100, nperseg=400)[1][-4:].mean() < 0.01 * 0.05**2 / 50
    stepped = Noise(0.01, HUNDREDTH_G_MPS2).add(clean, rng)
    assert stepped / HUNDREDTH_G_MPS2 == pytest.approx(np.round(stepped / HUNDREDTH_G_MPS2))
    assert (stepped - clean).std() == pytest.approx(np.hypot(0.01, HUNDREDTH_G_MPS2 / np.sqrt(12)), rel=0.03)
