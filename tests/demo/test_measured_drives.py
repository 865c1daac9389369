"""The drives that benchmarks judge by: two ways to drive a car agree, and roads and readings are what they say."""

from __future__ import annotations

import numpy as np
import pytest

from logger.roads.iri import rectified_slope, window_iri
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.units import STANDARD_GRAVITY_MPS2, WINDOW_M
from logger.vehicle.models import half_car
from logger.vehicle.vehicle import Vehicle

from ..support.drives.linear_drive import body_acceleration_response
from ..support.drives.measured import (
    SPACING_M,
    Accelerometer,
    Receiver,
    iso_road,
    measured_like_road,
    place_of,
    road_response,
    steady_drive,
    thinned,
    varied_drive,
)


@pytest.fixture(scope="module")
def car() -> Vehicle:
    return read_vehicle(vehicle_file("ford-escort"))


def test_equations_written_out_agree_with_the_models(car: Vehicle) -> None:
    f_hz = np.geomspace(0.1, 45.0, 100)
    model = body_acceleration_response(half_car(car), f_hz, 11.0)
    assert road_response(car, f_hz / 11.0, 11.0) == pytest.approx(model, rel=1e-9)


def test_a_steady_drive_in_time_is_that_of_the_fourier_sum(car: Vehicle) -> None:
    steady = steady_drive(car, iso_road(3.0, 600.0, 1), 20.0, 5.0)
    speed = steady.speed_mps[0]
    varied = varied_drive(car, steady.road, [(0.0, speed), (25.0, speed)])
    there = np.interp(varied.place_m, steady.place_m, np.arange(len(steady.place_m)))
    assert there[1000] == pytest.approx(round(there[1000]), abs=1e-6)
    expected = steady.accel_mps2[round(there[1000]):][:1000]
    assert varied.accel_mps2[1000:2000] == pytest.approx(expected, abs=0.02 * float(expected.std()))


@pytest.mark.parametrize("make", [iso_road, measured_like_road])
def test_roads_have_their_level_and_the_exact_iri(make) -> None:
    road = make(4.0, 1200.0, 5)
    assert float(road.iri(0.0, road.length_m)) == pytest.approx(4.0, rel=0.3)
    lap = window_iri(rectified_slope(np.tile(road.elevation_m, 3), SPACING_M), SPACING_M,
                     road.length_m + WINDOW_M * np.arange(20))
    edges_m = WINDOW_M * np.arange(20)
    assert road.iri(edges_m[:-1], edges_m[1:]) == pytest.approx(lap, rel=1e-6)
    assert road.iri(edges_m[:-1] - road.length_m, edges_m[1:] - road.length_m) == pytest.approx(lap, rel=1e-6)


def test_the_spectrum_that_is_reported_is_that_of_the_elevations() -> None:
    road = iso_road(3.0, 2000.0, 8, waviness=1.8)
    waves = np.abs(np.fft.rfft(road.elevation_m)) ** 2 * 2 * SPACING_M / len(road.elevation_m)
    inside = (road.wave_number_cpm > 0.02) & (road.wave_number_cpm < 2.8)
    assert np.mean(waves[inside] / road.spectrum_m3[inside]) == pytest.approx(1.0, abs=0.06)


def test_readings_stand_on_steps_and_within_the_range() -> None:
    chip = Accelerometer("chip", 0.1, STANDARD_GRAVITY_MPS2 / 16, counts=(-32, 31))
    rng = np.random.default_rng(3)
    readings, clipped = chip.read(np.linspace(-40.0, 40.0, 1001), rng)
    counts = readings / chip.step_mps2
    assert counts == pytest.approx(np.rint(counts), abs=1e-9)
    assert counts.min() == -32
    assert counts.max() == 31
    assert (clipped == ((counts < -31.5) | (counts > 30.5))).all()


def test_thinning_keeps_what_is_slow() -> None:
    time_s = np.arange(8000) / 800
    slow, quick = np.sin(2 * np.pi * 5 * time_s), np.sin(2 * np.pi * 90 * time_s)
    assert thinned(slow + quick, 8) == pytest.approx(slow[::8], abs=1e-6)


def test_the_receiver_tells_where_the_car_was(car: Vehicle) -> None:
    drive = varied_drive(car, iso_road(2.0, 600.0, 2), [(0.0, 10.0), (20.0, 15.0)])
    fixes = Receiver(slow_error_m=0.0, speed_noise_mps=0.0).fixes(drive, 1_000_000, np.random.default_rng(1))
    at_s = 0.37 + np.arange(len(fixes))
    reported_m = [place_of(fix.lat_deg) for fix in fixes if fix.lat_deg is not None]
    assert reported_m == pytest.approx(np.interp(at_s * 100, np.arange(len(drive.place_m)), drive.place_m), abs=1e-3)
    late_s = np.array([fix.t_us for fix in fixes]) / 1e6 - 1.0 - at_s
    assert late_s.min() >= 0.15
    assert late_s.max() < 0.25
