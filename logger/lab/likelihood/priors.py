"""Priors of the nuisance parameters: what is never quite as the files say, although no physics is missing.

Problem: nominal masses and rates are a few per cent off, a distance signal errs, and no recorder passes all frequencies
quite alike; a lab that allows for none of this takes every small mistake for an effect, and one that allows for too
much lets mistakes absorb effects. Solution: all of them are nuisance parameters with priors. A number of the car has a
normal prior with soft bounds at two standard deviations: a car whose numbers are free imitates effects that it lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.vehicle.named_parameters import changed, read, sized
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

_SOFT_BOUND_SIGMA, _SOFT_BOUND_WEIGHT = 2.0, 100.0
"""Beyond so many standard deviations a number costs the fourth power of what it is beyond, so many times, besides: half
a deviation beyond costs 6, one costs 100 (a judgement: 95 % of right numbers lie within)."""
UNUSUAL_SIGMA = 3.0
"""More standard deviations of its prior are unusual of a nuisance parameter: of a dozen right numbers one goes as far
in thirty comparisons (normal distribution)."""
CONFLICT_SIGMA = 4.0
"""A nuisance parameter so many standard deviations off is in conflict with its prior: of a dozen right numbers one goes
as far in 1300 comparisons (normal distribution)."""


@dataclass(frozen=True)
class Tolerance:
    """Standard deviations of the priors.

    numbers      of masses, inertias, springs and dampers, as a share (a band of 4 % either way has 2.3 %)
    lengths      of places on the car, as a share
    gain         of the acceleration, as a share
    droop        of what a recorder takes away from a frequency, over its square as a share of the rate (the mean over
                 each sample takes 1.6; a filter that ripples by 0.1 dB some tenths)
    rough        of masses, inertias, springs and dampers in a file that turns out to be a rough one, as a share: a band
                 of 10 % either way (a judgement: data sheets and textbook cars are off by as much)
    band         in which numbers may well be, in these deviations: 4 % either way have 2.5 %
    """

    numbers: float = 0.025
    lengths: float = 0.02
    gain: float = 0.005
    droop: float = 0.4
    rough: float = 0.0625
    band: float = 1.6

    @property
    def share(self) -> float:
        """By how much masses, springs and dampers may well be off, either way."""
        return self.band * self.numbers


def is_length(names: Sequence[str]) -> npt.NDArray[np.bool_]:
    """Which of a vehicle's numbers (p,) are lengths."""
    return np.array([name.endswith(("cg_distance_m", "contact_patch_m")) for name in names], dtype=bool)


@dataclass(frozen=True)
class VehiclePrior:
    """Prior of a vehicle's numbers: their names, and (p,) standard deviations and difference steps of their logarithms.

    soft_bounds    whether a number more than two standard deviations off costs more than by a normal distribution
    """

    names: tuple[str, ...]
    deviations: Array
    steps: Array
    soft_bounds: bool = True

    @staticmethod
    def of(vehicle: Vehicle, tolerance: Tolerance) -> VehiclePrior:
        """The prior of a vehicle's numbers."""
        names = sized(vehicle)
        lengths = is_length(names)
        # A step of a length, by which waves come late, has to be much smaller.
        return VehiclePrior(names, np.where(lengths, tolerance.lengths, tolerance.numbers),
                            np.where(lengths, 1e-4, 0.002))

    def without_soft_bounds(self) -> VehiclePrior:
        """The normal prior alone, which shows how far the runs move a number."""
        return replace(self, soft_bounds=False)

    def cost(self, logs: Array) -> float:
        """Minus twice the log-density, without its constant."""
        squares = float(((logs / self.deviations) ** 2).sum())
        return squares + (_SOFT_BOUND_WEIGHT * float((self._beyond(logs) ** 4).sum()) if self.soft_bounds else 0.0)

    def gradient(self, logs: Array) -> Array:
        """Half of the cost's first derivative (p,)."""
        bounds = 2 * _SOFT_BOUND_WEIGHT * self._beyond(logs) ** 3 * np.sign(logs) / self.deviations
        return np.asarray(logs / self.deviations**2 + (bounds if self.soft_bounds else 0.0))

    def curvature(self, logs: Array) -> Array:
        """Half of the cost's second derivative (p,)."""
        bounds = 6 * _SOFT_BOUND_WEIGHT * self._beyond(logs) ** 2 / self.deviations**2 if self.soft_bounds else 0.0
        return np.asarray(self.deviations**-2.0 + bounds)

    def at_soft_bounds(self, logs: Array) -> bool:
        """Whether one of these numbers (p,) is beyond its soft bounds, which hold it back."""
        return self.soft_bounds and bool(self._beyond(logs).any())

    def clip_to_soft_bounds(self, logs: Array) -> Array:
        """The nearest numbers (p,) within the soft bounds."""
        ends = _SOFT_BOUND_SIGMA * self.deviations
        return np.clip(logs, -ends, ends) if self.soft_bounds else logs

    def any_beyond(self, logs: Array, deviations: float) -> bool:
        """Whether a mass, spring or damper lies farther off than so many standard deviations (p,)."""
        return bool((np.abs(logs / self.deviations)[~is_length(self.names)] > deviations).any())

    def off_on_the_whole(self, logs: Array, errors: Array, band: float = Tolerance.band, known: float = 0.5,
                         several: int = 4, farthest: float = 2.5) -> bool:
        """Whether the masses, springs and dampers that were measured, by these standard errors (p,), lie beyond the
        band that they may well be off by, on the whole (r.m.s.): then it is the file that is rough, and not an effect
        that is missing.

        band        its end, in deviations of the prior
        known       a number is measured where its standard error is less than this share of its prior's
        several     so many say what a file is worth (``another_car`` asks for as many)
        farthest    none counts as farther off than so many deviations: a missing effect pulls few numbers, but far
        """
        measured = ~is_length(self.names) & (errors < known * self.deviations)
        off = np.minimum(np.abs(logs[measured]) / self.deviations[measured], farthest)
        return len(off) >= several and float(np.sqrt(np.mean(off**2))) > band

    def vehicle(self, vehicle: Vehicle, logs: Array) -> Vehicle:
        """The vehicle with its numbers times the exponentials of these logarithms (p,)."""
        return changed(vehicle, {name: read(vehicle, name) * float(np.exp(log))
                                 for name, log in zip(self.names, logs, strict=True)})

    def logs(self, vehicle: Vehicle, other: Vehicle) -> Array:
        """Logarithms (p,) of another vehicle's numbers over those of this one."""
        return np.log([read(other, name) / read(vehicle, name) for name in self.names])

    def _beyond(self, logs: Array) -> Array:
        """Standard deviations beyond the soft bounds (p,)."""
        return np.maximum(np.abs(logs / self.deviations) - _SOFT_BOUND_SIGMA, 0.0)
