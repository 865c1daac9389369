"""What a recorder would keep of a car with effects, at places where its own sensor does not sit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.vehicle.compose import Car, moved
from logger.vehicle.passage import Passage
from logger.vehicle.stepping import force_input
from logger.vehicle.structure import Output

Array = npt.NDArray[np.float64]

_MOST_TRIES = 200
_NEARLY_M = 1e-9


def observed(car: Car, passage: Passage, outputs: Sequence[Output]) -> Array:
    """Outputs (N, p) of a car on a passage, behind the recorder's filter and nothing else: the sensor's effects are not
    in them. Heights count from where the front left wheel begins."""
    structure = car.structure
    n = len(structure.mass)
    motion = moved(car, passage)
    elevation, _ = passage.under_wheels(structure)
    observe, direct = structure.output_matrices(outputs)
    onto = force_input(structure)[n:]
    pushed = np.array([one.row @ onto if one.order == 2 else np.zeros(onto.shape[1]) for one in outputs])
    fine = motion.states @ observe.T + elevation @ direct.T + motion.forces @ pushed.T
    return np.stack([passage.recorded(column, np.ones_like) for column in fine.T], axis=1)


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
