"""The half and the quarter car against statics and a second derivation of the response."""

import numpy as np
import pytest

from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.models import GOLDEN_CAR, half_car, quarter_car
from logger.vehicle.vehicle import Axle, Vehicle

from ..support.drives.linear_drive import body_acceleration_response

RAV4 = read_vehicle(vehicle_file("rav4-2009"))
LOPSIDED = Vehicle(
    "lopsided", "half_car", 700.0, 1200.0,
    Axle(1.1, 45.0, 20e3, 1500.0, 200e3), Axle(1.7, 60.0, 26e3, 1900.0, 220e3), contact_patch_m=0.0,
)


@pytest.mark.parametrize("vehicle", [RAV4, LOPSIDED], ids=lambda vehicle: vehicle.name)
def test_a_half_car_lifted_as_a_whole_or_tilted_feels_no_force(vehicle: Vehicle) -> None:
    """On a road that is raised, or a straight slope, the car stands as it stood: K q = R z exactly, no damper moves."""
    car = half_car(vehicle)
    l1, l2 = vehicle.front.cg_distance_m, vehicle.rear.cg_distance_m
    lifted = np.array([1.0, 0.0, 1.0, 1.0])
    tilted = np.array([0.0, 1.0, l1, -l2])
    for posture in (lifted, tilted):
        assert car.stiffness @ posture == pytest.approx(car.road @ posture[2:], abs=1e-6)
        assert car.damping @ posture == pytest.approx(np.zeros(4), abs=1e-9)
    for matrix in (car.mass, car.damping, car.stiffness):
        assert matrix == pytest.approx(matrix.T, abs=1e-6)


def response_by_hand(vehicle: Vehicle, f_hz: float, speed_mps: float) -> complex:
    """The same four equations of motion, written out force by force from Newton's laws and solved as they stand."""
    s = 2j * np.pi * f_hz
    front, rear = vehicle.front, vehicle.rear
    h1 = front.suspension_stiffness_n_per_m + s * front.suspension_damping_n_s_per_m
    h2 = rear.suspension_stiffness_n_per_m + s * rear.suspension_damping_n_s_per_m
    t1, t2 = front.tire_stiffness_n_per_m, rear.tire_stiffness_n_per_m
    l1, l2 = front.cg_distance_m, rear.cg_distance_m
    road = [1.0, np.exp(-s * (l1 + l2) / speed_mps)]
    # Unknowns: body end over the front axle, body end over the rear axle, front wheel, rear wheel.
    heave = np.array([l2, l1]) / (l1 + l2)
    pitch = np.array([1.0, -1.0]) / (l1 + l2)
    m, inertia = vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2
    equations = np.array([
        [m * s**2 * heave[0] + h1, m * s**2 * heave[1] + h2, -h1, -h2],
        [inertia * s**2 * pitch[0] + l1 * h1, inertia * s**2 * pitch[1] - l2 * h2, -l1 * h1, l2 * h2],
        [-h1, 0, front.unsprung_mass_kg * s**2 + h1 + t1, 0],
        [0, -h2, 0, rear.unsprung_mass_kg * s**2 + h2 + t2],
    ])
    ends = np.linalg.solve(equations, np.array([0, 0, t1 * road[0], t2 * road[1]]))[:2]
    patch = vehicle.contact_patch_m * f_hz / speed_mps
    averaging = np.sin(np.pi * patch) / (np.pi * patch) if patch else 1.0
    return s**2 * (heave @ ends) * averaging


@pytest.mark.parametrize("vehicle", [RAV4, LOPSIDED], ids=lambda vehicle: vehicle.name)
def test_half_car_response_agrees_with_newtons_laws_written_out(vehicle: Vehicle) -> None:
    f_hz = np.array([0.05, 0.7, 1.16, 1.5, 4.0, 11.0, 25.0])
    for speed_mps in (4.5, 17.9, 31.3):
        response = body_acceleration_response(half_car(vehicle), f_hz, speed_mps)
        expected = [response_by_hand(vehicle, f, speed_mps) for f in f_hz]
        assert response == pytest.approx(np.array(expected), rel=1e-9)


def test_a_slow_swell_lifts_the_whole_car() -> None:
    """At a wave far longer than the car and far below resonance the body follows the road."""
    response = body_acceleration_response(half_car(RAV4), 0.01, 30.0)
    assert -response / (2 * np.pi * 0.01) ** 2 == pytest.approx(1.0, abs=0.01)


def test_quarter_car_response_at_resonance_of_a_single_mass() -> None:
    """With a rigid tire and a light wheel the quarter car is one mass on a moving base, which has a textbook answer."""
    car = Vehicle("mass", "quarter_car", 300.0, None, Axle(0.0, 1e-3, 20e3, 1500.0, 1e12), None, 0.0)
    f_hz = np.array([0.3, 1.3, 5.0])
    r = 2 * np.pi * f_hz / np.sqrt(20e3 / 300.0)
    zeta = 1500.0 / (2 * np.sqrt(20e3 * 300.0))
    transmissibility = (1 + 2j * zeta * r) / (1 - r**2 + 2j * zeta * r)
    expected = -((2 * np.pi * f_hz) ** 2) * transmissibility
    assert body_acceleration_response(quarter_car(car), f_hz, 20.0) == pytest.approx(expected, rel=1e-5)


def test_a_half_car_needs_two_axles() -> None:
    with pytest.raises(ValueError, match="rear axle"):
        half_car(GOLDEN_CAR)
