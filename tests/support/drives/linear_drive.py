"""What is read of a car that is given by its matrices: drive by drive, and wave by wave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from logger.profiles.track import Way, WheelTracks
from logger.vehicle.compose import linear_outputs
from logger.vehicle.laws import CornerLaws
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.simulate import FINE_RATE_HZ, Passage
from logger.vehicle.stepping import Motion, Stepper
from logger.vehicle.structure import Output, Structure, body_point
from logger.vehicle.vehicle import AT_CENTRE_OF_GRAVITY, SensorPlace


def drive(structure: Structure, outputs: Sequence[Output], track: WheelTracks, time_s: np.ndarray,
          distance_m: np.ndarray, fine_hz: float = FINE_RATE_HZ) -> np.ndarray:
    """Outputs (N, p) at the instants (N,), evenly spaced, at which the front tires stand at these places (N,)."""
    passage = Passage(track, (len(time_s) - 1) / float(time_s[-1] - time_s[0]), distance_m, fine_hz)
    return np.stack([passage.recorded(one, np.ones_like) for one in linear_outputs(structure, passage, outputs)], 1)


def body_acceleration_response(structure: Structure, f_hz: object, speed_mps: object,
                               sensor: SensorPlace = AT_CENTRE_OF_GRAVITY) -> np.ndarray:
    """Body acceleration at the sensor per elevation under the front wheel [1/s2], at constant speeds."""
    car = LinearCar(structure, body_point(structure, sensor.ahead_m, sensor.left_m))
    return car.response(f_hz, speed_mps)  # type: ignore[arg-type]


def march(structure: Structure, laws: Sequence[CornerLaws], elevation: np.ndarray, mean: np.ndarray, step_s: float,
          way: Way | None = None) -> Motion:
    """The motion from rest of a car with laws of its own, as ``Stepper.march``."""
    return Stepper.of(structure, laws, step_s).march(elevation, mean, way)
