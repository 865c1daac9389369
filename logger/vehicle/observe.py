"""What a recorder would keep of a car with effects, at places where its own sensor does not sit.

Problem: a wheel's accelerometer, a travel sensor, a gyroscope each show something else of the same motion, and a fit
asks for all of them hundreds of times. Solution: a car is moved once, all signals are read off that motion, and the
transforms of them are kept as those of the sensor alone are: sensors are tried on them without moving the car again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.runs import Signal
from logger.vehicle.compose import Car, in_blocks, moved, recorded
from logger.vehicle.simulate import Passage
from logger.vehicle.stepping import force_input
from logger.vehicle.structure import Output, body_point, suspension_travel, wheel

Array = npt.NDArray[np.float64]

_MOST_TRIES = 200
_NEARLY_M = 1e-9
# Columns of ``Structure.body``; corners by their names, of cars with so many wheels.
_RATES = {"pitch_rate": 1, "roll_rate": 2}
_CORNERS = {1: {"front": 0}, 2: {"front": 0, "rear": 1},
            4: {"front": 0, "front_left": 0, "front_right": 1, "rear": 2, "rear_left": 2, "rear_right": 3}}


def observed(car: Car, passage: Passage, outputs: Sequence[Output]) -> Array:
    """Outputs (N, p) of a car on a passage, behind the recorder's filter and nothing else: the sensor's effects are not
    in them. Heights count from where the front left wheel begins."""
    return np.stack([passage.recorded(column, np.ones_like) for column in _fine(car, passage, outputs)], axis=1)


def recorded_signals(car: Car, passage: Passage, signals: tuple[Signal, ...]) -> Array:
    """What the recorder keeps of the sensor's acceleration and of other signals, these without their means, one after
    the other ((1 + s) N,).

    ValueError for a signal that this car does not have.
    """
    if not signals:
        return recorded(car, passage)
    sensor = Output(car.row, np.zeros(len(car.structure.wheels)), 2)
    outputs = [sensor, *(output_of(car, one) for one in signals)]
    found = passage.recorded_of((car.body, signals), lambda: _fine(car, passage, outputs), car.factor)
    found[0] = car.written(passage, found[0])
    found[1:] -= found[1:].mean(axis=1, keepdims=True)
    return found.ravel()


def output_of(car: Car, signal: Signal) -> Output:
    """The motion that a signal measures. ValueError for one that this car does not have."""
    structure = car.structure
    side, _, part = signal.of.rpartition("_")
    try:
        if part in ("wheel", "suspension"):
            of = suspension_travel if part == "suspension" else wheel
            return of(structure, _CORNERS[len(structure.wheels)][side])
        if signal.measures in _RATES:
            column = structure.body[:, _RATES[signal.measures]]
            if not column.any():
                raise ValueError(f"this body has no {signal.measures.replace('_', ' ')}")
            return Output(column, np.zeros(len(structure.wheels)), 1)
        return body_point(structure, signal.ahead_m - car.shift_m, signal.left_m)
    except KeyError:
        raise ValueError(f"signal {signal.name}: this vehicle has no {signal.of.replace('_', ' ')}") from None
    except ValueError as error:
        raise ValueError(f"signal {signal.name}: {error}") from None


def _fine(car: Car, passage: Passage, outputs: Sequence[Output]) -> Array:
    """Outputs at the fine instants (p, M)."""
    structure = car.structure
    n = len(structure.mass)
    elevation, _ = passage.under_wheels(structure)
    observe, direct = structure.output_matrices(outputs)
    if not car.bends_laws:
        return (in_blocks(structure, passage, observe) + elevation @ direct.T).T
    motion = moved(car, passage)
    onto = force_input(structure)[n:]
    pushed = np.array([one.row @ onto if one.order == 2 else np.zeros(onto.shape[1]) for one in outputs])
    return np.asarray((motion.states @ observe.T + elevation @ direct.T + motion.forces @ pushed.T).T)


def recorded_distance(car: Car, distance_m: Array) -> Array:
    """What a car that truly was at these distances (n,) records: the inverse of ``car.driven``.

    ValueError if there is none: an effect on the position signal may stretch it by less than two, not turn it round.
    """
    recorded_m = distance_m
    for _ in range(_MOST_TRIES):
        missing_m = distance_m - car.driven(recorded_m)
        recorded_m = recorded_m + missing_m
        if not np.abs(missing_m).max() > _NEARLY_M:
            return recorded_m
    raise ValueError("no recorded distance would stand for where the car was")
