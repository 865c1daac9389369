"""Effects on the record in time, against what they say done by hand to the record of the car without them."""

from types import SimpleNamespace

import numpy as np
import pytest

from logger.lab.unknown_road.same_road import response_of
from logger.runs import Signal
from logger.shipped import vehicle_file
from logger.simulation.virtual_drive import recorded_signals
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded, respond
from logger.vehicle.effect import Parameter, RecordEffect, Recording, Scale, SensorEffect, chosen
from logger.vehicle.linearise import known_car
from logger.vehicle.own_effect import look_through, try_out
from logger.vehicle.simulate import Passage

from ..support.lab.runs_with_residual import rough_track

CAR = read_vehicle(vehicle_file("rav4-2009"))
TIME_S = np.arange(400) / 100
SPEED_MPS = 10.0 + 2.0 * np.sin(TIME_S)
DISTANCE_M = 2.0 + 10.0 * TIME_S + 2.0 * (1 - np.cos(TIME_S))
PASSAGE = Passage(rough_track(80.0, 1), 100.0, DISTANCE_M)


class Words:
    title = source = signature = shown_by = "words"
    parameters = (Parameter("size", 1.0, 0.0, 10.0, 0.0, Scale.LINEAR, (1.0,), "how much"),)


class Settles(Words, RecordEffect):
    name = "settles"

    def record(self, p: SimpleNamespace, recording: Recording) -> np.ndarray:
        turning = p.size * recording.speed_mps**2 * np.cos(recording.distance_m / 0.3)
        return recording.accel_z_mps2 * np.exp(-recording.time_s) + turning


class Clips(Words, RecordEffect):
    name, stage = "clips", 1

    def record(self, p: SimpleNamespace, recording: Recording) -> np.ndarray:
        return np.clip(recording.accel_z_mps2, -p.size, p.size)


class Halves(Words, SensorEffect):
    name = "halves"

    def factor(self, p: SimpleNamespace, s: np.ndarray) -> np.ndarray:
        return np.full_like(s, 0.5)


def test_they_act_on_the_samples_behind_the_sensor_in_the_order_of_their_stage() -> None:
    plain = recorded(compose(CAR), PASSAGE)
    around = chosen(Settles(), {"size": 0.01}), chosen(Halves(), {"size": 1.0})
    car = compose(CAR, [chosen(Clips(), {"size": 1.0}), *around])
    settled = 0.5 * plain * np.exp(-TIME_S) + 0.01 * SPEED_MPS**2 * np.cos(DISTANCE_M / 0.3)
    expected = np.clip(settled, -1.0, 1.0)
    assert np.abs(expected).max() == 1.0 > np.abs(expected).min()
    # At the ends a speed is a difference over one step.
    for found in (recorded(car, PASSAGE), respond(car, PASSAGE).accel_z_mps2):
        np.testing.assert_allclose(found[1:-1], expected[1:-1], atol=2e-4)
    wheel = (Signal("wheel_mps2", "acceleration", "front_wheel"),)
    main, other = (recorded_signals(one, PASSAGE, wheel).reshape(2, -1) for one in (car, compose(CAR)))
    np.testing.assert_allclose(main[0][1:-1], expected[1:-1], atol=2e-4)
    np.testing.assert_array_equal(main[1], other[1])


def test_the_body_moves_as_without_them() -> None:
    assert compose(CAR, [chosen(Clips(), {"size": 1.0})]).body == compose(CAR).body


def test_what_takes_a_linear_car_refuses_them() -> None:
    car = compose(CAR, [chosen(Settles(), {"size": 1.0})])
    with pytest.raises(ValueError, match="settles acts on the record over time"):
        known_car(car)
    with pytest.raises(ValueError, match="expected a linear car"):
        response_of(car, 100.0)


def test_one_of_a_users_own_is_looked_through_and_tried() -> None:
    try_out(look_through(Settles()), SimpleNamespace(size=1.0), CAR)
