"""A linear car by frequency: M, C and K at s, what outputs make of the road under the wheels, and how that depends on
the car's numbers.

With the dynamic stiffness D(s) = s2 M + s C + K, a road z under the wheels moves the coordinates by q, D q = R z, and a
sensor on the body reads s2 r q. D is symmetric, so one more solution, w of D w = s2 r, gives the derivative of the
reading by any number of the car: s2 dr q + w (dR z - dD q).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import Free, changed, read
from logger.vehicle.simulate import recorder_gain
from logger.vehicle.structure import Output, Structure, body_point
from logger.vehicle.vehicle import AT_CENTRE_OF_GRAVITY, SensorPlace, Vehicle

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

# Step of the differences that derivatives of matrices (exact: they are quadratic at most) and of roads are taken by.
_RELATIVE_STEP = 1e-3


def dynamic_stiffness(mass: Array, damping: Array, stiffness: Array, s: Complex) -> Complex:
    """s2 M + s C + K (..., n, n) of matrices (n, n) at s (...,) [1/s]."""
    at = s[..., None, None]
    return np.asarray((at * at) * mass + at * damping + stiffness)


def frequency_response(structure: Structure, outputs: Sequence[Output], f_hz: npt.ArrayLike) -> Complex:
    """Outputs per elevation under each wheel separately, for waves exp(2 pi i f t); no delay, no contact patch.

    f_hz (...) [Hz]; returns (..., p, w).
    """
    s = np.asarray(2j * np.pi * np.asarray(f_hz, float))
    dynamic = dynamic_stiffness(structure.mass, structure.damping, structure.stiffness, s)
    coordinates = np.linalg.solve(dynamic, structure.road.astype(complex))
    rows = np.array([output.row for output in outputs])
    orders = np.array([[output.order] for output in outputs])
    return s[..., None, None] ** orders * (rows @ coordinates) + np.array([output.road_row for output in outputs])


def body_acceleration_response(
    structure: Structure, f_hz: npt.ArrayLike, speed_mps: npt.ArrayLike, sensor: SensorPlace = AT_CENTRE_OF_GRAVITY
) -> Complex:
    """Body acceleration at the sensor per elevation under the front wheel [1/s2], at constant speed.

    ``f_hz`` [Hz] and ``speed_mps`` [m/s], greater than 0, are broadcast against each other. A moving average over the
    contact patch is a sinc in the road's wave number f / speed. Left and right wheels see the same road.
    """
    f, speed = np.broadcast_arrays(np.asarray(f_hz, float), np.asarray(speed_mps, float))
    per_wheel = frequency_response(structure, [body_point(structure, sensor.ahead_m, sensor.left_m)], f)[..., 0, :]
    return at_steady_speed(structure, per_wheel, f / speed)


def at_steady_speed(structure: Structure, by_wheel: Complex, wave_number_cpm: Array) -> Complex:
    """Out of a response per elevation under each wheel separately (..., w), that per elevation under the front wheel
    (...), for waves of the road (...) [cycle/m]: each wheel meets them later, over its contact patch."""
    delays = np.exp(-2j * np.pi * wave_number_cpm[..., None] * structure.behind_m)
    return np.asarray((by_wheel * delays).sum(axis=-1) * np.sinc(wave_number_cpm * structure.contact_patch_m))


# --- and its derivatives ---


@dataclass(frozen=True, eq=False)
class SensedCar:
    """A car's matrices and the row of its sensor (n,)."""

    structure: Structure
    row: Array

    def dynamic_stiffness(self, s: Complex) -> Complex:
        """D (f, n, n) at s (f,) [1/s]."""
        return dynamic_stiffness(self.structure.mass, self.structure.damping, self.structure.stiffness, s)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of a car's matrices by one number; and, for one that moves the wheels or their patches, the cars a
    little before and after, ``apart`` apart in it."""

    mass: Array
    damping: Array
    stiffness: Array
    road: Array
    row: Array
    before: SensedCar
    after: SensedCar
    apart: float

    @property
    def shifts_road(self) -> bool:
        """Whether the road comes under the wheels at other times, or over other patches."""
        before, after = self.before.structure, self.after.structure
        return before.contact_patch_m != after.contact_patch_m or bool((before.behind_m != after.behind_m).any())


def sensed_car(vehicle: Vehicle) -> SensedCar:
    """The car with its sensor where its file says. ValueError if it lacks what its model needs."""
    structure = structure_of(vehicle)
    return SensedCar(structure, body_point(structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m).row)


def sensitivity(vehicle: Vehicle, one: Free) -> Sensitivity:
    """How a car depends on one of its numbers, where it is now. ValueError as ``named_parameters.read``."""
    value = read(vehicle, one.name)
    step = _RELATIVE_STEP * (abs(value) if one.by_factors else 1.0)
    before, after = (sensed_car(changed(vehicle, {one.name: value + sign * step})) for sign in (-1, 1))
    low, high, apart = before.structure, after.structure, 2 * step
    return Sensitivity((high.mass - low.mass) / apart, (high.damping - low.damping) / apart,
                       (high.stiffness - low.stiffness) / apart, (high.road - low.road) / apart,
                       (after.row - before.row) / apart, before, after, apart)


class AxleResponse:
    """What the sensor reads per elevation under each axle, at a recorder's rate; left and right see the same road.

    behind_m           (x,) how far behind the front one each axle stands [m]
    contact_patch_m    [m]

    ValueError for a number that the vehicle does not have, or one that moves axles or the contact patch.
    """

    def __init__(self, vehicle: Vehicle, parameters: Sequence[Free], rate_hz: float) -> None:
        self.vehicle, self.parameters, self._rate_hz = vehicle, list(parameters), rate_hz
        for one in parameters:
            read(vehicle, one.name)
            if one.name.endswith("cg_distance_m") or one.name == "contact_patch_m":
                raise ValueError(f"{one.name} cannot be found where the road is not known: expected it to be measured")
        structure = sensed_car(vehicle).structure
        self.contact_patch_m = structure.contact_patch_m
        self.behind_m, self._axle = np.unique(structure.behind_m, return_inverse=True)

    def vehicle_with(self, values: Array) -> Vehicle:
        """The vehicle with these values of its free numbers."""
        return changed(self.vehicle, dict(zip([one.name for one in self.parameters], map(float, values), strict=True)))

    def responses(self, values: Array, f_hz: Array) -> tuple[Complex, Complex]:
        """Gains (x, f) [1/s2] behind the recorder's filter with these values (p,), and their derivatives (p, x, f)."""
        vehicle = self.vehicle_with(values)
        car, s = sensed_car(vehicle), np.asarray(2j * np.pi * f_hz)
        structure = car.structure
        axles = np.eye(len(self.behind_m))[self._axle]
        dynamic = car.dynamic_stiffness(s)
        forces = np.broadcast_to(structure.road @ axles, (len(s), len(structure.road), axles.shape[1]))
        q = np.linalg.solve(dynamic, forces.astype(complex))
        w = np.linalg.solve(dynamic, np.broadcast_to(car.row.astype(complex)[:, None], (len(s), len(car.row), 1)))
        w = (s * s)[:, None] * w[..., 0]
        filtered = recorder_gain(f_hz / self._rate_hz)
        gains = filtered * (s * s) * np.einsum("n,fnx->xf", car.row, q)
        derivatives = np.empty((len(self.parameters), *gains.shape), dtype=complex)
        for index, one in enumerate(self.parameters):
            change = sensitivity(vehicle, one)
            moved = dynamic_stiffness(change.mass, change.damping, change.stiffness, s) @ q
            by_forces = np.einsum("fn,fnx->xf", w, change.road @ axles - moved)
            derivatives[index] = filtered * (by_forces + s * s * np.einsum("n,fnx->xf", change.row, q))
        return gains, derivatives
