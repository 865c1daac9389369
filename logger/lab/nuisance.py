"""What is never quite as the vehicle's file and the run's files say, although no physics is missing.

Problem: nominal masses and rates are a few per cent off, a speed signal wanders, and no recorder passes all frequencies
quite alike; a lab that does not grant this takes every small mistake for an effect, and one that grants too much lets
mistakes swallow effects. Solution: each number of the car may differ by a few per cent, each run's distance and its
scale of acceleration by a little, all with a cost: they are unknowns with a normal prior, whose deviation is what such
numbers are usually off by.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
import numpy.typing as npt

from logger.runs import Run
from logger.vehicle.named_parameters import changed, read, sized
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Tolerance:
    """How far off things usually are: standard deviations.

    numbers      of masses, inertias, springs and dampers, as a share (a band of 4 % either way has 2.3 %)
    lengths      of places on the car, as a share
    scale        of each run's distance, as a share
    start_m      of where each run begins [m]
    wander_m     of the distance signal, after one second; it grows with the root of the time [m]
    knot_s       between knots so far apart it is straight [s]
    gain         of the acceleration, as a share
    droop        of what a recorder takes away from a frequency, over its square as a share of the rate (the mean over
                 each sample takes 1.6; a filter that ripples by 0.1 dB some tenths)
    """

    numbers: float = 0.025
    lengths: float = 0.02
    scale: float = 0.0003
    start_m: float = 0.004
    wander_m: float = 0.004
    knot_s: float = 2.0
    gain: float = 0.005
    droop: float = 0.4


_LENGTHS = ("cg_distance_m", "contact_patch_m")
# Slopes are taken over so much of a logarithm: of a length, by which waves come late, over much less.
_STEP, _LENGTH_STEP = 0.002, 1e-4
_SLOWEST_MPS = 0.5
_FREE, _FIRMNESS = 2.0, 100.0


@dataclass(frozen=True)
class Nuisance:
    """Numbers of a vehicle that may be a little off: names, and (p,) deviations of their logarithms and steps to take
    slopes over.

    firm    a number that is off by more than ``_FREE`` deviations costs more and more
    """

    names: tuple[str, ...]
    deviations: Array
    steps: Array
    firm: bool = False

    def cost(self, logs: Array) -> float:
        """Of numbers that are off: squares of their deviations, and what firmness adds."""
        squares = float(((logs / self.deviations) ** 2).sum())
        return squares + (_FIRMNESS * float((self._beyond(logs) ** 4).sum()) if self.firm else 0.0)

    def firmness(self, logs: Array) -> tuple[Array, Array]:
        """Half of the first and of the second derivative (p,) of what firmness adds to the cost."""
        beyond = self._beyond(logs) if self.firm else np.zeros_like(logs)
        return (2 * _FIRMNESS * beyond**3 * np.sign(logs) / self.deviations,
                6 * _FIRMNESS * beyond**2 / self.deviations**2)

    def held(self, logs: Array) -> bool:
        """Whether firmness holds on to one of these numbers (p,), which would else be farther off."""
        return self.firm and bool(self._beyond(logs).any())

    def _beyond(self, logs: Array) -> Array:
        return np.maximum(np.abs(logs / self.deviations) - _FREE, 0.0)

    def vehicle(self, vehicle: Vehicle, logs: Array) -> Vehicle:
        """The vehicle with its numbers moved by these logarithms (p,)."""
        return changed(vehicle, {name: read(vehicle, name) * float(np.exp(log))
                                 for name, log in zip(self.names, logs, strict=True)})

    def logs(self, vehicle: Vehicle, other: Vehicle) -> Array:
        """The reverse: logarithms (p,) of another vehicle's numbers over those of this one."""
        return np.log([read(other, name) / read(vehicle, name) for name in self.names])


def nuisance_of(vehicle: Vehicle, tolerance: Tolerance, firm: bool = False) -> Nuisance:
    """What may be a little off in this vehicle."""
    kept = sized(vehicle)
    lengths = np.array([name.endswith(_LENGTHS) for name in kept], dtype=bool)
    return Nuisance(kept, np.where(lengths, tolerance.lengths, tolerance.numbers),
                    np.where(lengths, _LENGTH_STEP, _STEP), firm)


@dataclass(frozen=True, eq=False)
class Wander:
    """How the record of one run may be off, by normal numbers k: those of its places, then two of its recorder.

    basis       (n, k - 2) of the distance [m]: straight lines between knots, and the distance itself
    precision   (k, k) inverse covariance of k
    """

    basis: Array
    precision: Array

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return len(self.precision)

    @property
    def knots(self) -> int:
        """How many of the numbers, the first ones, are of knots."""
        return self.count - 1 - _RECORDER

    def moved_m(self, k: Array) -> Array:
        """By how much the car was farther than its distance signal said (n,)."""
        return np.asarray(self.basis @ k[:-_RECORDER])

    def recorded(self, prediction: Array, k: Array, run: Run) -> Array:
        """A prediction (n,) as such a recorder has it."""
        rise = rate_of_change(prediction, run.rate_hz)
        return np.asarray(prediction + k[-_RECORDER:] @ _by_recorder(prediction, rise, run))

    @property
    def by_factor(self) -> Array:
        """The numbers (k,) of a distance that is longer by one times itself."""
        return np.asarray(np.eye(self.count)[-1 - _RECORDER])

    def through(self, moved_m: Array, run: Run) -> Array:
        """The numbers (k,) with which the distance is farther by this (n,) at the knots [m], its recorder as it is."""
        at = np.linspace(0, run.count - 1, self.knots)
        return np.concatenate([np.interp(at, np.arange(run.count), moved_m), np.zeros(1 + _RECORDER)])

    def slopes(self, prediction: Array, run: Run) -> WanderSlopes:
        """What k does to a prediction (n,)."""
        rise = rate_of_change(prediction, run.rate_hz)
        return WanderSlopes(self, rise / np.maximum(run.speed_mps, _SLOWEST_MPS), _by_recorder(prediction, rise, run))


@dataclass(frozen=True, eq=False)
class WanderSlopes:
    """What the wander of a run does to a prediction, to first order: by the place (n,) [m/s2 per m], and by the
    recorder's numbers (2, n). What each of k does is made from these when it is asked for, as it takes much memory."""

    wander: Wander
    by_place: Array
    by_recorder: Array

    def times(self, k: Array) -> Array:
        """What so much of k does (n,) [m/s2]."""
        return np.asarray(self.wander.moved_m(k) * self.by_place + k[-_RECORDER:] @ self.by_recorder)

    def columns(self) -> Array:
        """What each of k does: (k, n) [m/s2 per unit]."""
        return np.vstack([self.wander.basis.T * self.by_place, self.by_recorder])


_RECORDER = 2


def _by_recorder(prediction: Array, rise: Array, run: Run) -> Array:
    """What the recorder's numbers do to a prediction (n,) that changes at these rates (n,): (2, n)."""
    return np.stack([prediction, rate_of_change(rise, run.rate_hz) / (2 * np.pi * run.rate_hz) ** 2])


def rate_of_change(samples: Array, rate_hz: float) -> Array:
    """The derivative of evenly spaced samples (n,), right to 0.03 % up to a third of their rate: central differences of
    order 48 (B. Fornberg, Mathematics of Computation 51, 1988). The difference of two neighbours would be half of it at
    30 Hz."""
    half = len(_DIFFERENCES)
    past_ends = np.pad(samples, half, mode="reflect", reflect_type="odd")
    return np.asarray(np.convolve(past_ends, [*_DIFFERENCES[::-1], 0.0, *-_DIFFERENCES], mode="valid") * rate_hz)


_HALF_ORDER = 24
_DIFFERENCES = np.array([
    (-1.0) ** (k + 1) * comb(2 * _HALF_ORDER, _HALF_ORDER - k) / (k * comb(2 * _HALF_ORDER, _HALF_ORDER))
    for k in range(1, _HALF_ORDER + 1)
])


def wander_of(run: Run, tolerance: Tolerance) -> Wander:
    """The wander that is granted to a run."""
    time_s = np.arange(run.count) / run.rate_hz
    knots = max(2, round(time_s[-1] / tolerance.knot_s) + 1)
    place = time_s / time_s[-1] * (knots - 1)
    hats = np.maximum(0.0, 1 - np.abs(place[:, None] - np.arange(knots)))
    basis = np.column_stack([hats, run.distance_m - run.distance_m[0]])
    steps = np.diff(np.eye(knots), axis=0) / (tolerance.wander_m * np.sqrt(time_s[-1] / (knots - 1)))
    precision = np.zeros((knots + 1 + _RECORDER, knots + 1 + _RECORDER))
    precision[:knots, :knots] = steps.T @ steps
    precision[0, 0] += tolerance.start_m**-2
    precision[knots, knots] = tolerance.scale**-2
    precision[-2, -2], precision[-1, -1] = tolerance.gain**-2, tolerance.droop**-2
    return Wander(basis, precision)
