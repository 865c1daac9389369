"""The full car against the half car, closed forms, statics and energy; and its outputs against hand calculations."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.shipped import vehicle_file, vehicle_names
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import frequency_response
from logger.vehicle.models import GOLDEN_CAR, full_car, half_car, quarter_car, structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.structure import Output, Structure, body_point, suspension_travel, tire_deflection, wheel
from logger.vehicle.vehicle import Axle, SensorPlace, Vehicle, with_load

from ..support.drives.linear_drive import body_acceleration_response

HALF = Vehicle(
    "lopsided", "half_car", 700.0, 1200.0,
    Axle(1.1, 45.0, 20e3, 1500.0, 200e3, 9e3), Axle(1.7, 60.0, 26e3, 1900.0, 220e3), contact_patch_m=0.2,
)
FULL = replace(HALF, model="full_car", sprung_mass_kg=1400.0, pitch_inertia_kg_m2=2400.0, roll_inertia_kg_m2=500.0,
               track_width_m=1.5)
BODY, PITCH, ROLL = 0, 1, 2
SHIPPED = {name: structure_of(read_vehicle(vehicle_file(name))) for name in vehicle_names()}


def reduced(car: Structure, onto: np.ndarray) -> tuple[np.ndarray, ...]:
    """M, C and K of a car whose coordinates can only be ``onto @ p``."""
    return tuple(onto.T @ matrix @ onto for matrix in (car.mass, car.damping, car.stiffness))


@pytest.mark.parametrize("full", [FULL, replace(FULL, roll_inertia_kg_m2=900.0, track_width_m=2.0)])
def test_with_both_sides_equal_it_is_two_half_cars(full: Vehicle) -> None:
    """Roll, roll inertia, track and anti-roll bars drop out to the last digits."""
    car, half = full_car(full), half_car(HALF)
    both = np.zeros((7, 4))
    both[BODY, 0] = both[PITCH, 1] = both[[3, 4], 2] = both[[5, 6], 3] = 1.0
    expected = (2 * half.mass, 2 * half.damping, 2 * half.stiffness)
    for matrix, twice in zip(reduced(car, both), expected, strict=True):
        assert matrix == pytest.approx(twice, rel=1e-14, abs=1e-9)
    f_hz = np.array([0.3, 1.2, 4.0, 11.0, 30.0])
    places = [(0.0, 0.6), (1.1, -0.4)]
    for (ahead_m, left_m), speed_mps in zip(places, (8.0, 25.0), strict=True):
        whole = body_acceleration_response(car, f_hz, speed_mps, SensorPlace(ahead_m, left_m))
        assert whole == pytest.approx(
            body_acceleration_response(half, f_hz, speed_mps, SensorPlace(ahead_m)), rel=1e-12,
        )


def test_a_half_car_with_two_equal_ends_bounces_like_a_quarter_car_with_half_its_body() -> None:
    axle = HALF.front
    half = half_car(replace(HALF, rear=axle))
    quarter = quarter_car(Vehicle("corner", "quarter_car", 350.0, None, axle, None, 0.2))
    bounce = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
    expected = (2 * quarter.mass, 2 * quarter.damping, 2 * quarter.stiffness)
    for matrix, twice in zip(reduced(half, bounce), expected, strict=True):
        assert matrix == pytest.approx(twice, rel=1e-14)
    assert abs(half.stiffness[0, 1]) + abs(half.damping[0, 1]) < 1e-9  # the bounce does not pitch it
    bounces = undamped_frequencies_hz(quarter)
    assert all(np.isclose(undamped_frequencies_hz(half), hz, rtol=1e-9).any() for hz in bounces)


def test_roll_of_a_car_with_equal_axles_against_the_roots_of_its_characteristic_equation() -> None:
    """Roll phi and one lift w of all left wheels (right ones -w): two equations, a quadratic in omega^2 by hand.

    With h = b / 2:  I phi'' + 4 k h (h phi - w) + 2 (K / h) (h phi - w) = 0, since one bar turns by (h phi - w) / h;
                     4 m w'' - 4 k (h phi - w) - 2 (K / h^2) (h phi - w) + 4 t w = 0.
    """
    axle = Axle(1.2, 50.0, 22e3, 1500.0, 200e3, 8e3)
    car = full_car(replace(FULL, front=axle, rear=axle))
    inertia, h = 500.0, 0.75
    effective = 4 * 22e3 + 2 * 8e3 / h**2  # force per (h phi - w)
    a = inertia * 4 * 50.0
    b = -(inertia * (effective + 4 * 200e3) + 4 * 50.0 * effective * h**2)
    c = effective * h**2 * 4 * 200e3
    discriminant = np.sqrt(b**2 - 4 * a * c)
    by_hand = np.sqrt(np.array([-b - discriminant, -b + discriminant]) / (2 * a)) / (2 * np.pi)
    found = undamped_frequencies_hz(car)
    assert all(np.isclose(found, hz, rtol=1e-9).any() for hz in by_hand)
    with_rigid_tires = replace(axle, tire_stiffness_n_per_m=1e9, unsprung_mass_kg=1.0)
    rigid = full_car(replace(FULL, front=with_rigid_tires, rear=with_rigid_tires))
    roll_hz = np.sqrt((4 * 22e3 * h**2 + 2 * 8e3) / inertia) / (2 * np.pi)  # springs and bars alone
    assert np.isclose(undamped_frequencies_hz(rigid), roll_hz, rtol=1e-4).any()


def test_anti_roll_bars_act_on_roll_alone() -> None:
    without = full_car(replace(FULL, front=replace(FULL.front, anti_roll_stiffness_n_m_per_rad=0.0)))
    bar = full_car(FULL).stiffness - without.stiffness
    posture = np.zeros(7)
    posture[ROLL] = 0.01  # the body rolls on standing wheels: the moment is stiffness times angle
    assert (bar @ posture)[ROLL] == pytest.approx(9e3 * 0.01)
    assert (bar @ posture)[[3, 4]] == pytest.approx([-9e3 * 0.01 / 1.5, 9e3 * 0.01 / 1.5])
    for still in (np.eye(7)[BODY], np.eye(7)[PITCH], np.array([0, 0, 0, 1.0, 1.0, -1.0, -1.0])):
        assert bar @ still == pytest.approx(np.zeros(7), abs=1e-9)
    assert np.linalg.matrix_rank(bar) == 1


@pytest.mark.parametrize("name", SHIPPED)
def test_matrices_are_symmetric_and_only_a_car_without_tires_can_drift(name: str) -> None:
    """Reciprocity; no spring or damper gives energy away; what is left without tires are the body's rigid motions."""
    car = SHIPPED[name]
    scale = np.abs(car.stiffness).max()
    for matrix in (car.mass, car.damping, car.stiffness):
        assert np.abs(matrix - matrix.T).max() <= 1e-14 * scale
    assert np.linalg.eigvalsh(car.mass).min() > 0
    assert np.linalg.eigvalsh(car.damping).min() > -1e-10 * np.abs(car.damping).max()
    assert np.linalg.eigvalsh(car.stiffness).min() > 0
    assert np.linalg.eigvals(car.state_space()[0]).real.max() < 0
    floating = replace(car, stiffness=car.stiffness - car.road @ car.wheels)
    energies = np.linalg.eigvalsh(floating.stiffness)
    rigid = len(car.mass) - len(car.wheels)  # up; pitch; roll
    assert np.abs(energies[:rigid]).max() < 1e-9 * scale
    assert energies[rigid:].min() > 1e-3 * scale
    assert undamped_frequencies_hz(floating)[:rigid] == pytest.approx(np.zeros(rigid), abs=1e-3)


@pytest.mark.parametrize("name", SHIPPED)
def test_response_between_two_points_is_the_same_both_ways(name: str) -> None:
    """Maxwell: a force at i moves j as a force at j moves i. R is diagonal in the wheels, so responses show it."""
    car = SHIPPED[name]
    count = len(car.wheels)
    heights = [wheel(car, index, order=0) for index in range(count)]
    per_force = frequency_response(car, heights, [0.8, 5.0, 12.0]) / np.diag(car.wheels @ car.road)
    assert per_force == pytest.approx(np.swapaxes(per_force, 1, 2), rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("name", SHIPPED)
def test_on_a_plane_however_tilted_every_car_stands_as_on_the_level(name: str) -> None:
    car = SHIPPED[name]
    motions = int(car.body.any(axis=0).sum())
    front_m = car.travel[0, 1] if motions > 1 else 0.0
    rise, nose, left = 0.1, 0.02, 0.03
    places = np.column_stack([np.ones(len(car.wheels)), front_m - car.behind_m, car.left_m])
    plane = places @ np.array([rise, nose if motions > 1 else 0.0, left if motions > 2 else 0.0])
    posture = np.concatenate([np.array([rise, nose, left])[:motions], plane])
    assert car.stiffness @ posture == pytest.approx(car.road @ plane, rel=1e-9, abs=1e-6)
    state = np.concatenate([posture, np.zeros_like(posture)])
    asked = [body_point(car), suspension_travel(car, 0), tire_deflection(car, len(plane) - 1), wheel(car, 0, order=0)]
    c_rows, d_rows = car.output_matrices(asked)
    assert c_rows @ state + d_rows @ plane == pytest.approx([0.0, 0.0, 0.0, plane[0]], abs=1e-9)


def test_the_wheels_stand_where_the_tape_measure_says() -> None:
    car = full_car(FULL)
    assert car.behind_m == pytest.approx([0.0, 0.0, 2.8, 2.8])
    assert car.left_m == pytest.approx([0.75, -0.75, 0.75, -0.75])
    assert half_car(HALF).behind_m == pytest.approx([0.0, 2.8])


def test_a_bump_under_the_left_front_wheel_lifts_nose_and_left_side() -> None:
    car = full_car(FULL)
    asked = [body_point(car, 1.0, 0.0, 0), body_point(car, 0.0, 1.0, 0), body_point(car, order=0)]
    nose, left, middle = frequency_response(car, asked, 1e-3)[:, 0].real
    assert nose > middle > 0
    assert left > middle
    assert body_point(car, 0.3, -0.2, 0).row[:3] == pytest.approx([1.0, 0.3, -0.2])


@given(st.integers(0, 3), st.floats(-1.5, 1.5), st.floats(-0.7, 0.7), st.floats(0.05, 40.0))
@settings(max_examples=40)
def test_outputs_in_time_and_in_frequency_agree(index: int, ahead_m: float, left_m: float, f_hz: float) -> None:
    """C (i w - A)^-1 B + D of the state space is the frequency response; a rate is i w times what it is the rate of."""
    car = full_car(FULL)
    asked = [body_point(car, ahead_m, left_m, order) for order in (0, 1, 2)]
    asked += [wheel(car, index, order) for order in (0, 1, 2)]
    asked += [suspension_travel(car, index, order) for order in (0, 1, 2)] + [tire_deflection(car, index)]
    s = 2j * np.pi * f_hz
    (a, b), (c, d) = car.state_space(), car.output_matrices(asked)
    expected = c @ np.linalg.solve(s * np.eye(14) - a, b.astype(complex)) + d
    found = frequency_response(car, asked, f_hz)
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-9)
    for first in (0, 3, 6):
        assert found[first + 1] == pytest.approx(s * found[first], rel=1e-9)
        assert found[first + 2] == pytest.approx(s**2 * found[first], rel=1e-9)


def test_travel_and_deflection_are_differences_of_heights() -> None:
    car = full_car(FULL)
    f_hz = [0.5, 3.0, 15.0]
    for index, (ahead_m, left_m) in enumerate([(1.1, 0.75), (1.1, -0.75), (-1.7, 0.75), (-1.7, -0.75)]):
        asked = [body_point(car, ahead_m, left_m, 0), wheel(car, index, 0), suspension_travel(car, index),
                 tire_deflection(car, index)]
        end, hub, travel, tire = np.moveaxis(frequency_response(car, asked, f_hz), 1, 0)
        assert travel == pytest.approx(end - hub, rel=1e-9, abs=1e-12)
        assert tire == pytest.approx(hub - np.eye(4)[index], rel=1e-9, abs=1e-12)


def test_a_sensor_away_from_the_centre_feels_pitch_as_the_distance_times_its_acceleration() -> None:
    car = half_car(HALF)
    f_hz, speed = np.array([0.7, 1.5, 6.0]), 15.0
    at = {place: body_acceleration_response(car, f_hz, speed, SensorPlace(place)) for place in (-0.5, 0.0, 1.0)}
    assert at[-0.5] - at[0.0] == pytest.approx(-0.5 * (at[1.0] - at[0.0]), rel=1e-9)
    assert np.abs(at[1.0] - at[0.0]).min() > 0.1


def test_points_that_a_model_does_not_have() -> None:
    quarter = quarter_car(GOLDEN_CAR)
    with pytest.raises(ValueError, match="does not pitch"):
        body_point(quarter, ahead_m=0.1)
    with pytest.raises(ValueError, match="does not roll"):
        body_point(half_car(HALF), left_m=-0.1)
    with pytest.raises(ValueError, match="only an output of order 0"):
        Output(np.zeros(2), np.ones(1), 2)
    with pytest.raises(ValueError, match="expected 0, 1 or 2"):
        Output(np.zeros(2), np.zeros(1), 3)


def test_a_full_car_needs_all_its_numbers() -> None:
    for missing in ("rear", "track_width_m", "pitch_inertia_kg_m2", "roll_inertia_kg_m2"):
        with pytest.raises(ValueError, match="lopsided: a full car needs"):
            structure_of(replace(FULL, **{missing: None}))


def test_load_adds_to_the_sprung_mass_and_to_nothing_else() -> None:
    assert with_load(HALF, 72.5) == replace(HALF, sprung_mass_kg=772.5)
    empty, loaded = half_car(HALF), half_car(with_load(HALF, 700.0))
    assert (loaded.mass - empty.mass)[0, 0] == 700.0
    assert np.array_equal(loaded.stiffness, empty.stiffness)
