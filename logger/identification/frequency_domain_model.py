"""What a vehicle's accelerometer would have recorded on the runs that were driven, and how that depends on each number.

Problem: a fit asks for the model's response, and for its derivative by every free number, tens of times; stepping the
car finely through each run for each of them takes seconds. Solution: a linear car answers each frequency by itself,
whatever the speed did, because the speed only shapes what passes under the wheels, and that does not depend on masses,
springs and dampers. So the road under each wheel is laid out in time once, finely, by its exact mean over each step,
band-limited as the recorder does it, and transformed; every prediction then is a small linear system per frequency. The
same solution, with one more for the sensor's row (the matrices are symmetric), gives all derivatives exactly.

A transform takes a record for one period of an endless one. Behind the record the road therefore comes back to where it
began and the car comes to rest; and the transform is taken along s = damping + i omega, which makes what comes round
from the end a ten-thousandth of what is left of it there.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.identification.drive_model import DriveModel
from logger.identification.unknown_inputs import is_input, run_and_name
from logger.vehicle.frequency_response import SensedCar, Sensitivity, sensed_car, sensitivity

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]


class VehicleModel(DriveModel):
    """A linear car without effects."""

    exact = True

    def predict(self, values: Array) -> list[Array]:
        """As ``Predictor``: accelerations without the beginnings of the records [m/s2]."""
        car = sensed_car(self.vehicle_with(values))
        return [self.observed(run, road.samples(_response(
                    car, road.s, road.under_wheels(car.structure, self.road_with(values, run)))))
                for run, road in enumerate(self._roads)]

    def linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        """As ``DifferentiablePredictor``; derivatives are exact but for those by places and lengths of the car, which
        shift the road."""
        vehicle = self.vehicle_with(values)
        car = sensed_car(vehicle)
        changes = {index: sensitivity(vehicle, one) for index, one in enumerate(self.parameters)
                   if not is_input(one.name)}
        predictions, slopes = [], []
        for run, road in enumerate(self._roads):
            at = self.road_with(values, run)
            under = road.under_wheels(car.structure, at)
            q, w = _solved(car, road.s, under)
            derivatives = np.zeros((len(self.parameters), len(road.s)), dtype=complex)
            for index, change in changes.items():
                moved = None
                if change.shifts_road:
                    before, after = (road.under_wheels(one.structure, at) for one in (change.before, change.after))
                    moved = (after - before) / change.apart
                derivatives[index] = _by_car(car, change, road.s, under, q, w, moved)
            for index, name in self._inputs_of(run):
                derivatives[index] = _through(car, w, road.by_input(car.structure, at, name))
            prediction = road.samples(road.s**2 * (q @ car.row))
            predictions.append(self.observed(run, prediction))
            slopes.append(self.observed_slopes(run, prediction, road.samples(derivatives).T))
        return predictions, slopes

    def _inputs_of(self, run: int) -> list[tuple[int, str]]:
        """Which free numbers change the road's input in a run: their indices, and their names for all runs."""
        names = [(index, *run_and_name(one.name)) for index, one in enumerate(self.parameters) if is_input(one.name)]
        return [(index, name) for index, only, name in names if only in (None, run)]


def _response(car: SensedCar, s: Complex, under: Complex) -> Complex:
    """Transform (f,) of the sensor's acceleration, of a road (f, w) under the wheels."""
    forces = under @ car.structure.road.T
    return np.asarray(s**2 * (np.linalg.solve(car.dynamic_stiffness(s), forces[..., None])[..., 0] @ car.row))


def _solved(car: SensedCar, s: Complex, under: Complex) -> tuple[Complex, Complex]:
    """q and w (f, n), with D = s2 M + s C + K, D q = R z and D w = s2 r; the sensor reads y = s2 r q."""
    forces = np.stack([under @ car.structure.road.T, (s * s)[:, None] * car.row], axis=-1)
    q, w = np.moveaxis(np.linalg.solve(car.dynamic_stiffness(s), forces), -1, 0)
    return q, w


def _through(car: SensedCar, w: Complex, moved: Complex) -> Complex:
    """What the sensor makes (f,) of a change (f, w) of the road under the wheels: w R dz."""
    return np.asarray((w * (moved @ car.structure.road.T)).sum(axis=1))


def _by_car(car: SensedCar, change: Sensitivity, s: Complex, under: Complex, q: Complex, w: Complex,
            moved: Complex | None) -> Complex:
    """Derivative (f,) of the sensor's acceleration by a number of the car: s2 dr q + w (dR z - dD q) + w R dz."""
    s2 = s * s
    force = under @ change.road.T - s2[:, None] * (q @ change.mass.T) - s[:, None] * (q @ change.damping.T)
    force -= q @ change.stiffness.T
    derivative = (w * force).sum(axis=1) + s2 * (q @ change.row)
    return np.asarray(derivative if moved is None else derivative + _through(car, w, moved))
