"""A vehicle as a linear response to the road under each of its axles, with derivatives by its free numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.identification.prediction import car_of, change_of, recorder_gain
from logger.vehicle.named_parameters import Free, changed, read
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]


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
        structure = car_of(vehicle).structure
        self.contact_patch_m = structure.contact_patch_m
        self.behind_m, self._axle = np.unique(structure.behind_m, return_inverse=True)

    def vehicle_with(self, values: Array) -> Vehicle:
        """The vehicle with these values of its free numbers."""
        return changed(self.vehicle, dict(zip([one.name for one in self.parameters], map(float, values), strict=True)))

    def responses(self, values: Array, f_hz: Array) -> tuple[Complex, Complex]:
        """Gains (x, f) [1/s2] behind the recorder's filter with these values (p,), and their derivatives (p, x, f)."""
        vehicle = self.vehicle_with(values)
        car, s = car_of(vehicle), 2j * np.pi * f_hz
        structure = car.structure
        axles = np.eye(len(self.behind_m))[self._axle]
        dynamic = ((s * s)[:, None, None] * structure.mass + s[:, None, None] * structure.damping
                   + structure.stiffness)
        forces = np.broadcast_to(structure.road @ axles, (len(s), len(structure.road), axles.shape[1]))
        q = np.linalg.solve(dynamic, forces.astype(complex))
        w = np.linalg.solve(dynamic, np.broadcast_to(car.row.astype(complex)[:, None], (len(s), len(car.row), 1)))
        w = (s * s)[:, None] * w[..., 0]
        filtered = recorder_gain(f_hz / self._rate_hz)
        gains = filtered * (s * s) * np.einsum("n,fnx->xf", car.row, q)
        derivatives = np.empty((len(self.parameters), *gains.shape), dtype=complex)
        for index, one in enumerate(self.parameters):
            change = change_of(vehicle, one)
            moved = ((s * s)[:, None, None] * change.mass + s[:, None, None] * change.damping + change.stiffness) @ q
            by_forces = np.einsum("fn,fnx->xf", w, change.road @ axles - moved)
            derivatives[index] = filtered * (by_forces + s * s * np.einsum("n,fnx->xf", change.row, q))
        return gains, derivatives
