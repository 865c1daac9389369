"""The bridge from a structure to the estimator, against the models' own answers and the exact Golden Car."""

import numpy as np
import pytest
from scipy.signal import sosfreqz

from logger.estimation.car_response import (
    HIGHEST_HZ,
    WAVE_NUMBERS_CPM,
    CarResponse,
    golden_car_on_grid,
    golden_car_slope,
)
from logger.roads.iri import TIRE_BASE_M, golden_car_sections
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import changed
from logger.vehicle.structure import body_point
from logger.vehicle.vehicle import SensorPlace

from ..support.drives.linear_drive import body_acceleration_response


@pytest.mark.parametrize("name", ["golden-car", "rav4-2009", "rav4-2009-full"])
@pytest.mark.parametrize("speed_mps", [4.0, 31.0])
def test_power_is_that_of_the_car_at_a_steady_speed(name: str, speed_mps: float) -> None:
    """Within what rounding the speed to 5 % leaves: of all power, not of each wave near a notch."""
    car = structure_of(read_vehicle(vehicle_file(name)))
    ahead_m = 0.0 if name == "golden-car" else 0.7
    found = CarResponse(LinearCar(car, body_point(car, ahead_m))).power(speed_mps)
    seen = WAVE_NUMBERS_CPM * speed_mps <= HIGHEST_HZ
    exact = np.abs(body_acceleration_response(car, WAVE_NUMBERS_CPM * speed_mps, speed_mps, SensorPlace(ahead_m))) ** 2
    road = WAVE_NUMBERS_CPM**-2.0 * WAVE_NUMBERS_CPM
    assert (found * road)[seen].sum() == pytest.approx((exact * road)[seen].sum(), rel=0.1)
    assert not found[WAVE_NUMBERS_CPM * speed_mps > HIGHEST_HZ * 1.03].any()


def test_speeds_that_are_alike_share_a_response_and_others_do_not_change_it() -> None:
    car = structure_of(read_vehicle(vehicle_file("rav4-2009")))
    one, other = (CarResponse(LinearCar(car, body_point(car, 0.7))) for _ in range(2))
    first = one.power(17.0)
    for speed_mps in (5.0, 30.0):
        assert one.power(speed_mps) == pytest.approx(other.power(speed_mps), rel=1e-12)
    assert one.power(17.2) is first
    assert first == pytest.approx(other.power(17.0), rel=1e-12)


def test_a_full_car_has_one_response_per_axle() -> None:
    full = structure_of(read_vehicle(vehicle_file("rav4-2009-full")))
    car = CarResponse(LinearCar(full, body_point(full)))
    assert car.behind_m.tolist() == [0.0, full.behind_m.max()]
    f_hz = np.array([0.0, 1.0, 5.0, 41.0, 43.0])
    by_axle = car.by_axle(f_hz)
    assert by_axle.shape == (2, 5) and not by_axle[:, [0, 4]].any()
    delays = np.exp(-2j * np.pi * car.behind_m[:, None] * f_hz / 10.0)
    exact = body_acceleration_response(full, f_hz[1:4], 10.0) / np.sinc(f_hz[1:4] / 10.0 * full.contact_patch_m)
    assert (by_axle * delays).sum(axis=0)[1:4] == pytest.approx(exact, rel=1e-9)


def test_golden_car_slope_is_that_of_the_exact_filter() -> None:
    """The exact filter on a profile of 1 mm, its tire's average and its place taken from the definition."""
    spacing_m = 0.001
    wave_number = np.geomspace(0.005, 3.0, 60)
    phase = 2 * np.pi * wave_number * spacing_m
    base = round(TIRE_BASE_M / spacing_m)
    slope = (np.exp(1j * phase * base) - 1) / TIRE_BASE_M  # to the sample 250 mm ahead, counted at the end of the step
    exact = sosfreqz(golden_car_sections(spacing_m), phase)[1] * slope * np.exp(-1j * phase)
    found = golden_car_slope(wave_number)
    assert np.abs(found - exact).max() < 0.01 * np.abs(exact).max()
    assert np.abs(found) == pytest.approx(np.abs(exact), rel=0.01)


def test_golden_car_on_a_grid_is_kept() -> None:
    assert golden_car_on_grid(64, 0.15) is golden_car_on_grid(64, 0.15)
    assert golden_car_on_grid(64, 0.15) == pytest.approx(golden_car_slope(np.fft.rfftfreq(64, 0.15)))


def test_what_other_numbers_change_is_looked_up_nearly_exactly() -> None:
    """Weighted by the reading's power on a common road, against the responses themselves."""
    vehicle, speed_mps = read_vehicle(vehicle_file("rav4-2009")), 16.0
    own, *off = (known_vehicle(changed(vehicle, moved)) for moved in (
        {}, {"sprung_mass_kg": 910.0}, {"front.tire_stiffness_n_per_m": 2.6e5}, {"rear.cg_distance_m": 1.52}))
    cars = [one.at(speed_mps, WAVE_NUMBERS_CPM, WAVE_NUMBERS_CPM) for one in (own, *off)]
    response = CarResponse(cars[0], cars[1:])
    speed_mps = np.exp(round(np.log(speed_mps) * 20) / 20)
    f_hz = WAVE_NUMBERS_CPM * speed_mps
    whole = np.array([one.response(f_hz, speed_mps) for one in cars])
    power = response.power(speed_mps) * WAVE_NUMBERS_CPM**-1.0
    found, exact = response.changes(speed_mps), whole[1:] / whole[0] - 1
    assert ((np.abs(found - exact) ** 2) @ power < 0.03**2 * (np.abs(exact) ** 2) @ power).all()
