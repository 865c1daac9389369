"""What a vehicle's accelerometer would have recorded on the runs that were driven, and how that depends on each number.

Problem: a fit asks for the model's response, and for its derivative by every free number, tens of times; stepping the
car finely through each run for each of them takes seconds. Solution: a linear car answers each frequency by itself,
whatever the speed did, because the speed only shapes what passes under the wheels, and that does not depend on masses,
springs and dampers. So the road under each wheel is laid out in time once, finely, by its exact mean over each step,
band-limited as the recorder does it, and transformed; every prediction then is a small linear system per frequency. The
same solution, with one for the sensor's row beside it (the matrices are symmetric), gives all derivatives exactly.

A transform takes a record for one period of an endless one. Behind the record the road therefore comes back to where it
began and the car comes to rest; and the transform is taken along s = damping + i omega, which makes what comes round
from the end a ten-thousandth of what is left of it there.

Everything that fits knows only ``Model``, or ``Differentiable`` where a model has derivatives of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.identification.road_transform import RoadInTime
from logger.identification.unknown_inputs import (
    RoadInput,
    changed_input,
    check_names,
    is_input,
    read_input,
    run_and_name,
)
from logger.roads.iso8608 import displacement_psd
from logger.runs import Run
from logger.vehicle.frequency_response import (
    SensedCar,
    Sensitivity,
    body_acceleration_response,
    sensed_car,
    sensitivity,
)
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import AXLES, BOTH, Free, changed, read
from logger.vehicle.simulate import recorder_gain
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

# Classes of speed that a record is described by, the slowest there is, and the longest period of a random road.
_SPEEDS = 12
_SLOWEST_MPS = 0.5
_LONGEST_S = 100.0


class VehicleModel:
    """A linear car on the runs of ``records``: free numbers ``parameters``, all others as in ``vehicle`` and ``road``.

    A free number is the car's (``named_parameters.names``) or the road's (``unknown_inputs``). The car comes to the
    first sample of a record at the speed it has there, over the road that the track has there. ValueError for a name
    that neither has a number of, or that sets what another one sets.
    """

    exact = True

    def __init__(self, vehicle: Vehicle, parameters: Sequence[Free], records: Sequence[Run],
                 road: RoadInput | None = None) -> None:
        self.vehicle, self.parameters, self.records = vehicle, list(parameters), list(records)
        self.road = road or RoadInput()
        wanted = [one.name for one in parameters]
        check_names(wanted, len(records))
        for name in wanted:
            read_input(self.road, name) if is_input(name) else read(vehicle, name)
            part, _, leaf = name.rpartition(".")
            if wanted.count(name) > 1 or (part in AXLES and f"{BOTH}.{leaf}" in wanted):
                raise ValueError(f"expected every number once, found {name} twice")
        self._roads = [RoadInTime(record) for record in records]
        self.measured = [record.kept_mps2 for record in records]

    def vehicle_with(self, values: Array) -> Vehicle:
        """The vehicle with these values of its free numbers."""
        return changed(self.vehicle, {name: value for name, value in self._named(values) if not is_input(name)})

    def road_with(self, values: Array, run: int) -> RoadInput:
        """The road's input in a run, counted from 0, with these values of the free numbers."""
        return changed_input(self.road, {name: value for name, value in self._named(values) if is_input(name)}, run)

    def predict(self, values: Array) -> list[Array]:
        """As ``Model``: accelerations without the beginnings of the records [m/s2]."""
        car = sensed_car(self.vehicle_with(values))
        return [road.samples(_response(car, road.s, road.under_wheels(car.structure, self.road_with(values, run))))
                for run, road in enumerate(self._roads)]

    def linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        """As ``Differentiable``; derivatives are exact but for those by places and lengths of the car, which shift the
        road."""
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
            predictions.append(road.samples(road.s**2 * (q @ car.row)))
            slopes.append(road.samples(derivatives).T)
        return predictions, slopes

    def _inputs_of(self, run: int) -> list[tuple[int, str]]:
        """Which free numbers change the road's input in a run: their indices, and their names for all runs."""
        names = [(index, *run_and_name(one.name)) for index, one in enumerate(self.parameters) if is_input(one.name)]
        return [(index, name) for index, only, name in names if only in (None, run)]

    def _named(self, values: Array) -> list[tuple[str, float]]:
        return list(zip([one.name for one in self.parameters], map(float, values), strict=True))

    def road_spectra(self, values: Array, f_hz: Array) -> list[Array]:
        """What the sensor makes of a random road of Gd(n0) = 1 cm3 under the whole of each record: one-sided spectra
        (f,) behind the recorder's filter [m2/s4/Hz per cm3], the mean over the speeds that were driven."""
        vehicle = self.vehicle_with(values)
        structure = structure_of(vehicle)
        spectra = []
        for run, record in enumerate(self.records):
            true_mps = record.speed_mps[record.first:] / self.road_with(values, run).speed_scale
            speed = np.quantile(true_mps, (np.arange(_SPEEDS) + 0.5) / _SPEEDS)[:, None]
            speed = np.unique(np.maximum(speed, _SLOWEST_MPS), axis=0)
            f = np.maximum(f_hz, 1 / _LONGEST_S)
            response = np.abs(body_acceleration_response(structure, f, speed, vehicle.sensor)) ** 2
            recorder = recorder_gain(f_hz / record.rate_hz) ** 2
            spectra.append((response * displacement_psd(f / speed, 1.0) / speed).mean(axis=0) * recorder)
        return spectra

    def inputs(self, values: Array) -> list[Array]:
        """Vertical acceleration of the road under the wheels (n, w) per record with these values [m/s2], band-limited,
        for tests."""
        structure = structure_of(self.vehicle)
        return [road.samples(road.s**2 * road.under_wheels(structure, self.road_with(values, run)).T).T
                for run, road in enumerate(self._roads)]


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
