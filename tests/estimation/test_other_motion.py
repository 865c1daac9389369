"""Motion that no road makes, out of residuals that were made with a known one, and in the ride of a shaken car."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from logger.estimation.car_response import SteadyMotion
from logger.estimation.other_motion import OtherMotion
from logger.estimation.sensor_noise import Sensor

from ..support.drives.measured import Drive
from . import test_ride_posterior as ride

Array = npt.NDArray[np.float64]

COUNT, HOP, RATE_HZ = 2048, 200, 100.0
LINE_HZ, LINE_MPS2 = 25.3, 0.15
NOTHING = np.zeros(COUNT // 2 + 1)


def line(rms_mps2: float, samples: int) -> Array:
    return rms_mps2 * np.sqrt(2) * np.sin(2 * np.pi * LINE_HZ / RATE_HZ * np.arange(samples))


def followed(residual: Array, variance: Array, road_psd: Array = NOTHING) -> OtherMotion:
    """What is found of residuals (n,) of these variances (n,), block by block."""
    found = OtherMotion()
    for low in range(0, len(residual) - COUNT, HOP):
        part = slice(low, low + COUNT)
        found.move_on(HOP)
        found.learn(residual[part], 1 / variance[part], SteadyMotion(road_psd, RATE_HZ))
        found.find(residual[part], 1 / variance[part])
    return found


@pytest.mark.parametrize("seed", range(4))
def test_white_residuals_show_no_other_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    variance = rng.uniform(0.02, 0.3, 60_000)
    found = followed(np.sqrt(variance) * rng.standard_normal(60_000), variance)
    assert found.psd is None
    assert found.variance_left == 0.0
    assert np.all(found.motion_mps2 == 0.0)


def test_a_line_is_found_with_its_strength_and_phase() -> None:
    rng = np.random.default_rng(11)
    variance = rng.uniform(0.02, 0.3, 20_048)
    true = line(LINE_MPS2, len(variance))
    found = followed(true + np.sqrt(variance) * rng.standard_normal(len(variance)), variance)
    assert found.psd is not None
    f_hz = np.linspace(0, RATE_HZ / 2, len(found.psd))
    assert np.all(np.abs(f_hz[found.psd > 0] - LINE_HZ) < 1.0)
    assert found.psd.sum() * f_hz[1] == pytest.approx(LINE_MPS2**2, rel=0.25)
    last = true[(len(true) - COUNT - 1) // HOP * HOP:][:COUNT]
    # Where it ends nothing is known of what comes after; in the middle it is known to a third.
    assert np.std((found.motion_mps2 - last)[300:-300]) < 0.35 * LINE_MPS2
    beside = found.beside(SteadyMotion(NOTHING, RATE_HZ))
    assert beside.variance == pytest.approx(LINE_MPS2**2, rel=0.25)


def test_what_the_road_takes_of_a_line_is_given_back_to_its_strength() -> None:
    """A road as strong as the noise N takes part of what is a motion M: of their sum it leaves (M + N) / (M + 2 N)."""
    rng = np.random.default_rng(12)
    count, density = 40_048, 2 * 0.1 / RATE_HZ
    f_hz = np.fft.rfftfreq(count, 1 / RATE_HZ)
    motion = np.where(np.abs(f_hz - LINE_HZ) < 0.5, 20 * density, 0.0)
    waves = rng.standard_normal(len(f_hz)) + 1j * rng.standard_normal(len(f_hz))
    total = np.sqrt(motion + 2 * density) * (motion + density) / (motion + 2 * density)
    residual = np.fft.irfft(total * waves * np.sqrt(RATE_HZ * count) / 2, count)
    found = followed(residual, np.full(count, 0.1), np.full(COUNT // 2 + 1, density))
    assert found.psd is not None
    assert found.psd.sum() * RATE_HZ / COUNT == pytest.approx(20 * density, rel=0.3)


def test_another_drive_begins_with_no_other_motion() -> None:
    rng = np.random.default_rng(13)
    variance = np.full(10_048, 0.1)
    found = followed(line(0.3, 10_048) + np.sqrt(variance) * rng.standard_normal(10_048), variance)
    assert found.psd is not None
    found.restart()
    assert found.psd is None
    assert np.all(found.motion_mps2 == 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("level_m_per_km", [1.5, 3.5])
def test_the_ride_of_a_car_that_its_engine_shakes_has_that_shaking_in_it(
    level_m_per_km: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    still = ride.drive(level_m_per_km)
    shaken = replace(still, accel_mps2=still.accel_mps2 + line(0.2, len(still.accel_mps2)))

    def drive(*_: float) -> Drive:
        return shaken

    monkeypatch.setattr(ride, "drive", drive)
    found = ride.later(ride.estimates(level_m_per_km, Sensor(ride.NOISE_MPS2, ride.STEP_MPS2)))
    truth = np.array([ride.exact(level_m_per_km, one.number) for one in found])
    values = np.array([(one.ride.a_w.value, one.ride.mtvv.value, one.ride.vdv.value) for one in found])
    assert np.all(np.abs(values.mean(axis=0) / truth.mean(axis=0) - 1) < 0.06)
