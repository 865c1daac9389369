"""The weighted ride out of coarse readings, against that of the car that was simulated."""

from __future__ import annotations

from functools import cache
from math import isnan

import numpy as np
import pytest

from logger.comfort.uncertain_ride import RideFigures
from logger.dsp.weightings.wk import WEIGHTING
from logger.estimation.car_response import CarResponse
from logger.estimation.ride_posterior import RidePlace, RidePosterior
from logger.estimation.road_spectrum import COMMON_ROAD
from logger.estimation.sensor_noise import Sensor
from logger.estimation.streaming import RoadEstimator, WindowEstimate
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.units import WINDOW_M
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import half_car
from logger.vehicle.structure import body_point

from ..support.drives.measured import Accelerometer, Drive, iso_road, steady_drive

NOISE_MPS2, STEP_MPS2 = 0.1, 9.80665 / 16
LEAD_S = 14.0
SPEED_MPS = 13.0


@cache
def drive(level_m_per_km: float, windows: int = 90) -> Drive:
    road = iso_road(level_m_per_km, windows * WINDOW_M, 5)
    return steady_drive(read_vehicle(vehicle_file("rav4-2009")), road, SPEED_MPS, LEAD_S)


def estimates(
    level_m_per_km: float, sensor: Sensor, window_m: float = WINDOW_M, push: int = 50, weighted: bool = True,
    windows: int = 90,
) -> list[WindowEstimate]:
    found = drive(level_m_per_km, windows)
    chip = Accelerometer("chip", sensor.noise_rms_mps2, sensor.step_mps2)
    readings, _ = chip.read(found.accel_mps2, np.random.default_rng(6))
    structure = half_car(read_vehicle(vehicle_file("rav4-2009")))
    estimator = RoadEstimator(LinearCar(structure, body_point(structure)), sensor, window_m,
                              ride_response=WEIGHTING.response if weighted else None)
    usable = np.ones(len(readings), dtype=np.bool_)
    distance_m = found.place_m - found.place_m[0]
    out = []
    for low in range(0, len(readings), push):
        part = slice(low, low + push)
        out += estimator.push(readings[part], usable[part], np.zeros(len(usable[part])), distance_m[part])
    return out + estimator.finish()


def exact(level_m_per_km: float, number: int, window_m: float = WINDOW_M) -> tuple[float, float, float]:
    """a_w, MTVV and VDV of a window."""
    found = drive(level_m_per_km)
    waves = np.fft.rfft(found.accel_mps2) * WEIGHTING.response(np.fft.rfftfreq(len(found.accel_mps2), 0.01))
    squares = np.fft.irfft(waves, len(found.accel_mps2))**2
    inside = np.floor((found.place_m - found.place_m[0]) / window_m) == number
    running = np.convolve(squares, np.full(100, 0.01))[:len(squares)]
    return (float(np.sqrt(squares[inside].mean())), float(np.sqrt(running[inside].max())),
            float((squares[inside]**2).sum() * 0.01) ** 0.25)


@pytest.fixture(scope="module")
def coarse() -> list[WindowEstimate]:
    return estimates(3.5, Sensor(NOISE_MPS2, STEP_MPS2))


def later(found: list[WindowEstimate], window_m: float = WINDOW_M) -> list[WindowEstimate]:
    """Those behind the lead."""
    return [one for one in found if one.number * window_m > LEAD_S * SPEED_MPS]


@pytest.mark.slow
def test_the_ride_is_found_between_steps_larger_than_it(coarse: list[WindowEstimate]) -> None:
    found = later(coarse)
    truth = np.array([exact(3.5, one.number) for one in found])
    rides = [(one.ride.a_w, one.ride.mtvv, one.ride.vdv) for one in found]
    values = np.array([[figure.value for figure in one] for one in rides])
    stds = np.array([[figure.std for figure in one] for one in rides])
    assert truth[:, 0].mean() < 0.5 * STEP_MPS2
    assert np.all(np.abs(values.mean(axis=0) / truth.mean(axis=0) - 1) < 0.05)
    off = np.abs(values - truth) / stds
    assert np.all((np.mean(off <= 1, axis=0) > 0.55) & (np.mean(off <= 2, axis=0) > 0.88))
    assert np.all(np.mean(off <= 0.5, axis=0) < 0.65)


def test_fine_readings_without_noise_give_the_ride_itself() -> None:
    found = later(estimates(3.5, Sensor(1e-3, 1e-3)))
    truth = np.array([exact(3.5, one.number)[0] for one in found])
    values = np.array([one.ride.a_w.value for one in found])
    np.testing.assert_allclose(values, truth, rtol=0.05)


@pytest.mark.slow
def test_long_windows_are_made_of_several_pieces() -> None:
    window_m = 4 * WINDOW_M
    found = later(estimates(3.5, Sensor(NOISE_MPS2, STEP_MPS2), window_m), window_m)
    truth = np.array([exact(3.5, one.number, window_m) for one in found])
    values = np.array([(one.ride.a_w.value, one.ride.mtvv.value, one.ride.vdv.value) for one in found])
    assert len(found) > 15
    assert np.all(np.abs(values.mean(axis=0) / truth.mean(axis=0) - 1) < 0.06)


def test_splitting_the_readings_changes_nothing() -> None:
    one, other = (estimates(3.5, Sensor(NOISE_MPS2, STEP_MPS2), push=count, windows=40) for count in (50, 37))
    assert not all(isnan(each.ride.a_w.value) for each in one)
    assert repr([each.ride for each in one]) == repr([each.ride for each in other])


def test_a_ride_far_below_a_step_is_not_reported() -> None:
    found = later(estimates(1.0, Sensor(0.05, 4 * STEP_MPS2), windows=45))
    assert len(found) > 10
    assert all(isnan(one.ride.a_w.value) for one in found)


def test_an_unsure_noise_widens_the_errors_and_moves_nothing() -> None:
    structure = half_car(read_vehicle(vehicle_file("rav4-2009")))
    car = CarResponse(LinearCar(structure, body_point(structure)))
    posterior = RidePosterior(WEIGHTING.response, 2048, 100.0)
    weighted = posterior.weighted(np.random.default_rng(7).standard_normal(2048))
    inside = np.zeros(2048, dtype=np.bool_)
    inside[1000:1060] = True

    def figures(noise_log_std: float) -> RideFigures:
        place = RidePlace(car, SPEED_MPS, 0.03, COMMON_ROAD, 0.1, Sensor(NOISE_MPS2, STEP_MPS2), noise_log_std)
        sums = posterior.sums(weighted, inside, np.zeros(2048, dtype=np.bool_), place)
        assert sums is not None
        return sums.figures(0.01)

    sure, unsure = figures(0.0), figures(0.5)
    assert unsure.a_w.value == sure.a_w.value
    assert unsure.a_w.std > sure.a_w.std
    assert unsure.vdv.std > sure.vdv.std


def test_without_a_weighting_there_is_no_ride() -> None:
    found = estimates(3.5, Sensor(NOISE_MPS2, STEP_MPS2), weighted=False, windows=40)
    assert all(isnan(one.ride.a_w.value) for one in found)
