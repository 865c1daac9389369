"""Cars with effects as linear ones, against hand formulas and against their own simulation."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from logger.profiles.track import Track
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.models import GOLDEN_CAR
from logger.vehicle.modes import modes, modes_of_car
from logger.vehicle.simulate import Passage

RAV4 = read_vehicle(vehicle_file("rav4-2009"))
N_CPM = np.geomspace(0.004, 3.3, 300)
LINEAR = {
    "payload": {"mass_kg": 120.0}, "cg_shift": {"shift_m": 0.2}, "tire_enveloping": {"contact_patch_m": 0.1},
    "occupant": {}, "body_bending": {}, "sensor_offset": {"offset_m": 0.6}, "sensor_gain": {"gain": 1.2},
    "sensor_bandwidth": {"cutoff_hz": 8.0}, "sensor_mount_resonance": {"frequency_hz": 15.0, "damping_ratio": 0.1},
    "time_offset": {"delay_s": 0.05}, "tire_damping": {}, "top_mount_compliance": {"mount_stiffness_n_per_m": 5e4},
}


def effect(name: str, **values: float) -> Chosen:
    one = shipped_effects()[name]
    return chosen(one, one.usual | values)


def road(iri_height: float) -> np.ndarray:
    return iri_height**2 * 1e-6 * (N_CPM / 0.1) ** -2.0


@pytest.mark.parametrize("name", LINEAR)
def test_a_linear_effect_is_exact(name: str) -> None:
    """A wave of the road through the simulation comes out as the factor says, in size and in time."""
    one, speed_mps, wave_m = effect(name, **LINEAR[name]), 20.0, 4.0
    place_m = speed_mps * np.arange(1200) / 100
    track = Track(0.02, 0.005 * np.sin(2 * np.pi * np.arange(0, 300, 0.02) / wave_m))
    car = compose(RAV4, [one])
    seen = recorded(car, Passage(track, 100.0, place_m))[600:1000]
    known = known_vehicle(RAV4, [one])
    assert isinstance(known, LinearCar) and not known.depends_on_motion
    factor = complex(known.response(np.array([speed_mps / wave_m]), speed_mps)[0])
    reported = (-1j * 0.005 * factor * np.exp(2j * np.pi * place_m[600:1000] / wave_m)).real
    assert np.sqrt(np.mean((seen - reported) ** 2)) < 0.02 * np.sqrt(np.mean(reported**2))


def test_a_mount_is_in_series_with_its_damper_and_a_tire_damps_beside_its_spring() -> None:
    car = known_vehicle(GOLDEN_CAR, [effect("top_mount_compliance", mount_stiffness_n_per_m=5e3),
                                     effect("tire_damping", tire_damping_n_s_per_m=3.0)])
    assert isinstance(car, LinearCar)
    axle, s = GOLDEN_CAR.front, 2j * pi * np.array([0.5, 2.0, 11.0, 30.0])
    damper = 1 / (1 / (s * axle.suspension_damping_n_s_per_m) + 1 / 5e3)
    strut, tire = axle.suspension_stiffness_n_per_m + damper, axle.tire_stiffness_n_per_m + 3.0 * s
    body = s**2 * GOLDEN_CAR.sprung_mass_kg + strut
    wheel = s**2 * axle.unsprung_mass_kg + strut + tire
    expected = s**2 * strut * tire / (body * wheel - strut**2)
    assert car.by_wheel(s.imag / (2 * pi))[:, 0] == pytest.approx(expected, rel=1e-9)
    for one in modes_of_car(car):
        if one.damping_ratio < 1:
            root = 2 * pi * one.frequency_hz * (-one.damping_ratio + 1j * sqrt(1 - one.damping_ratio**2))
            damper = 1 / (1 / (root * axle.suspension_damping_n_s_per_m) + 1 / 5e3)
            strut, tire = axle.suspension_stiffness_n_per_m + damper, axle.tire_stiffness_n_per_m + 3.0 * root
            whole = (root**2 * GOLDEN_CAR.sprung_mass_kg + strut) * (
                root**2 * axle.unsprung_mass_kg + strut + tire) - strut**2
            assert abs(whole) < 1e-6 * abs(strut * tire)


def test_modes_of_a_plain_car_are_those_of_its_matrices() -> None:
    car = known_vehicle(RAV4)
    assert isinstance(car, LinearCar)
    assert [one.frequency_hz for one in modes_of_car(car)] == [one.frequency_hz for one in modes(car.structure)]


@pytest.mark.parametrize("height", [0.5, 2.0, 8.0])
def test_slopes_that_stand_in_follow_from_the_motion_that_they_make(height: float) -> None:
    """Coulomb friction and a cubic spring have closed forms."""
    car = known_vehicle(RAV4, [effect("dry_friction", friction_force_n=60.0),
                               effect("progressive_spring", cubic_stiffness_n_per_m3=1e7)])
    linear = car.at(20.0, N_CPM, road(height))
    assert car.depends_on_motion
    waves = linear.waves(N_CPM, 20.0)
    power = road(height) * N_CPM * np.log(N_CPM[1] / N_CPM[0])
    for corner, rate, travel in zip(linear.corners, waves.rate.T, waves.travel.T, strict=True):
        rate_mps, travel_m = (np.sqrt(np.abs(one) ** 2 @ power) for one in (rate, travel))
        # speeds and heights of roads within 20 % share one car
        assert corner.beside_n_s_per_m == pytest.approx(sqrt(2 / pi) * 60.0 / rate_mps, rel=0.25)
        assert corner.spring_n_per_m == pytest.approx(3 * 1e7 * travel_m**2, rel=0.5)
        assert corner.rest_m == pytest.approx(0.0, abs=1e-9)


def test_uneven_dampers_draw_the_body_down_and_stops_hold_it_up() -> None:
    drawn = known_vehicle(RAV4, [effect("damper_asymmetry", rebound_to_bump_ratio=3.0)]).at(20.0, N_CPM, road(6.0))
    held = known_vehicle(RAV4, [effect("bump_stop", clearance_m=0.005)]).at(20.0, N_CPM, road(6.0))
    assert drawn.corners[0].rest_m < -1e-4 and held.corners[0].rest_m > 1e-4
    assert drawn.corners[0].damper_n_s_per_m == pytest.approx(RAV4.front.suspension_damping_n_s_per_m, rel=1e-3)


def test_a_tire_lifts_more_the_rougher_the_road() -> None:
    car = known_vehicle(RAV4, [effect("wheel_lift")])
    held = [car.at(25.0, N_CPM, road(height)).corners[0].contact for height in (1.0, 30.0, 60.0)]
    assert held[0] == pytest.approx(1.0, abs=1e-6) and 0.5 < held[2] < held[1] < 1.0


def test_friction_that_hardly_slides_locks_the_suspension() -> None:
    smooth = known_vehicle(RAV4, [effect("dry_friction", friction_force_n=500.0)]).at(10.0, N_CPM, road(0.2))
    assert np.isfinite(smooth.by_wheel(np.array([1.0, 10.0]))).all()
    assert smooth.corners[0].beside_n_s_per_m > 20 * RAV4.front.suspension_damping_n_s_per_m


def test_an_effect_that_does_nothing_leaves_the_car_as_it_is() -> None:
    plain, idle = known_vehicle(RAV4), known_vehicle(RAV4, [effect("tire_damping", tire_damping_n_s_per_m=0.0)])
    f_hz = np.array([0.7, 3.0, 12.0])
    assert idle.at(10.0, N_CPM, road(1.0)).by_wheel(f_hz) == pytest.approx(
        plain.at(10.0, N_CPM, road(1.0)).by_wheel(f_hz), rel=1e-9)


def test_a_full_car_takes_them_too() -> None:
    full = read_vehicle(vehicle_file("rav4-2009-full"))
    half = replace(RAV4, sensor=full.sensor)
    some = [effect("dry_friction", friction_force_n=80.0), effect("top_mount_compliance")]
    f_hz = np.array([1.0, 4.0, 11.0])
    by_side = [known_vehicle(one, some).at(15.0, N_CPM, road(2.0)).response(f_hz, 15.0) for one in (half, full)]
    assert by_side[1] == pytest.approx(by_side[0], rel=1e-3)


@pytest.mark.parametrize(("name", "values"), [
    ("dry_friction", {"friction_force_n": 150.0}), ("damper_blow_off", {}), ("progressive_spring", {}),
])
def test_a_stand_in_does_not_depend_on_what_was_asked_before(name: str, values: dict[str, float]) -> None:
    """The search begins at the most similar one, and ends where it would have from the start."""
    asked, fresh = (known_vehicle(RAV4, [effect(name, **values)]) for _ in range(2))
    for speed_mps, height in ((10.0, 0.5), (25.0, 3.0), (13.0, 1.0)):
        asked.at(speed_mps, N_CPM, road(height))
    f_hz = np.array([1.0, 3.0, 11.0])
    found, alone = (one.at(20.0, N_CPM, road(2.0)).response(f_hz, 20.0) for one in (asked, fresh))
    assert np.abs(found - alone) == pytest.approx(0.0, abs=0.01 * np.abs(alone).max())


@pytest.mark.parametrize(("name", "values", "moved"), [
    ("dry_friction", {"friction_force_n": 150.0}, {"friction_force_n": 165.0}),
    ("damper_blow_off", {"knee_velocity_m_per_s": 0.05, "slope_ratio": 0.4},
     {"knee_velocity_m_per_s": 0.05, "slope_ratio": 0.5}),
])
def test_two_turns_are_enough_for_a_car_that_is_nearly_another(
    name: str, values: dict[str, float], moved: dict[str, float]
) -> None:
    """Of what the change does to the response, little is left out."""
    one, other, fresh = (known_vehicle(RAV4, [effect(name, **said)]) for said in (values, moved, moved))
    f_hz = np.geomspace(0.5, 20.0, 60)
    near = one.at(20.0, N_CPM, road(4.0))
    found, whole = (car.response(f_hz, 20.0) for car in (
        other.at(20.0, N_CPM, road(4.0), near), fresh.at(20.0, N_CPM, road(4.0))))
    assert np.linalg.norm(found - whole) < 0.25 * np.linalg.norm(whole - near.response(f_hz, 20.0))
