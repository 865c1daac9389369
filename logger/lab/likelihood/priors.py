"""Priors of what is never quite as the files say, although no physics is missing.

Problem: nominal masses and rates are a few per cent off, a distance signal errs, and no recorder passes all frequencies
quite alike; a lab that does not grant this takes every small mistake for an effect, and one that grants too much lets
mistakes swallow effects. Solution: all of them are nuisance parameters with priors. A number of the car has a normal
prior, with a wall beyond two standard deviations: a car that may bend as it likes makes up for effects that it lacks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.vehicle.named_parameters import changed, read, sized
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

_WALL_FROM, _WALL_WEIGHT = 2.0, 100.0


@dataclass(frozen=True)
class Tolerance:
    """How far off things usually are: standard deviations.

    numbers      of masses, inertias, springs and dampers, as a share (a band of 4 % either way has 2.3 %)
    lengths      of places on the car, as a share
    gain         of the acceleration, as a share
    droop        of what a recorder takes away from a frequency, over its square as a share of the rate (the mean over
                 each sample takes 1.6; a filter that ripples by 0.1 dB some tenths)
    """

    numbers: float = 0.025
    lengths: float = 0.02
    gain: float = 0.005
    droop: float = 0.4


@dataclass(frozen=True)
class VehiclePrior:
    """Prior of a vehicle's numbers: their names, and (p,) standard deviations of their logarithms and steps to take
    slopes over.

    wall    a number that is off by more than two deviations costs more and more
    """

    names: tuple[str, ...]
    deviations: Array
    steps: Array
    wall: bool = True

    @staticmethod
    def of(vehicle: Vehicle, tolerance: Tolerance) -> VehiclePrior:
        """What may be a little off in this vehicle."""
        names = sized(vehicle)
        lengths = np.array([name.endswith(("cg_distance_m", "contact_patch_m")) for name in names], dtype=bool)
        # Slopes are taken over so much of a logarithm: of a length, by which waves come late, over much less.
        return VehiclePrior(names, np.where(lengths, tolerance.lengths, tolerance.numbers),
                            np.where(lengths, 1e-4, 0.002))

    def without_wall(self) -> VehiclePrior:
        """The same, normal all the way: it shows how far a car has to bend."""
        return replace(self, wall=False)

    def cost(self, logs: Array) -> float:
        """Minus twice the log-density, without its constant."""
        squares = float(((logs / self.deviations) ** 2).sum())
        return squares + (_WALL_WEIGHT * float((self._beyond(logs) ** 4).sum()) if self.wall else 0.0)

    def gradient(self, logs: Array) -> Array:
        """Half of the cost's first derivative (p,)."""
        wall = 2 * _WALL_WEIGHT * self._beyond(logs) ** 3 * np.sign(logs) / self.deviations if self.wall else 0.0
        return np.asarray(logs / self.deviations**2 + wall)

    def curvature(self, logs: Array) -> Array:
        """Half of the cost's second derivative (p,)."""
        wall = 6 * _WALL_WEIGHT * self._beyond(logs) ** 2 / self.deviations**2 if self.wall else 0.0
        return np.asarray(self.deviations**-2.0 + wall)

    def at_the_wall(self, logs: Array) -> bool:
        """Whether the wall holds on to one of these numbers (p,), which would else be farther off."""
        return self.wall and bool(self._beyond(logs).any())

    def within_wall(self, logs: Array) -> Array:
        """The nearest numbers (p,) that the wall does not hold."""
        return np.clip(logs, -_WALL_FROM * self.deviations, _WALL_FROM * self.deviations) if self.wall else logs

    def vehicle(self, vehicle: Vehicle, logs: Array) -> Vehicle:
        """The vehicle with its numbers moved by these logarithms (p,)."""
        return changed(vehicle, {name: read(vehicle, name) * float(np.exp(log))
                                 for name, log in zip(self.names, logs, strict=True)})

    def logs(self, vehicle: Vehicle, other: Vehicle) -> Array:
        """The reverse: logarithms (p,) of another vehicle's numbers over those of this one."""
        return np.log([read(other, name) / read(vehicle, name) for name in self.names])

    def _beyond(self, logs: Array) -> Array:
        return np.maximum(np.abs(logs / self.deviations) - _WALL_FROM, 0.0)
