"""What drives a rig, given over time: the table under its wheels (a shaker, a bench car), and forces on its parts.

Problem: a rig has no road. Its recorder samples how high the table stood, at a rate of its own, and between two samples
the table moved smoothly: a straight line would take off a part of each quick motion (0.5 % at a twenty-fifth of the
rate). Solution: cubic splines through the samples, whose means over steps of time are exact. So are derivatives: what
stands on a table feels its acceleration, and a damper on its bench its velocity. White noise of the sensor that took
the samples, which would be most of these, is taken out first (``white_noise``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from logger.arrays import Array
from logger.dsp.white_noise import Denoised, answered, without_white_noise
from logger.dsp.whole_record import SEEN_OF_RATE
from logger.profiles.track import Alterations, Stance, Way

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_CUBIC = 3
FEWEST = _CUBIC + 1  # Samples that an excitation has at least


@dataclass(frozen=True)
class AppliedForce:
    """A measured force on a rig.

    name     of its column
    parts    the part that it pushes up, from the ground, or the two that it pushes apart
    """

    name: str
    parts: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Excitation:
    """Elevations under the wheels and forces, evenly sampled in time; before and after them they stay where they are,
    but before the first sample of a force there is none. A part that its bench moves is on its way then: it is taken to
    have moved as after its first sample, mirrored there, so that its velocity does not jump.

    rate_hz        samples a second
    elevation_m    (n,) under all wheels, or (n, 2) under the front and under the rear ones [m]
    start_s        when the first of them was, counted from the first sample of the record [s]
    force_n        (n, f) [N]; None: there are none
    forces         what each of them acts on
    moves_part     the elevations are how much longer a part is than at its rest, whose ends the bench moves
    share          of their amplitudes that may be motion (n,), as ``white_noise.answered``; None: all

    ValueError for a rate that is not above 0, samples that are not finite or of another shape, or fewer than four.
    """

    rate_hz: float
    elevation_m: Array
    start_s: float = 0.0
    force_n: Array | None = None
    forces: tuple[AppliedForce, ...] = ()
    moves_part: bool = False
    share: Array | None = None

    timed = True
    two_tracks = False

    def __post_init__(self) -> None:
        shape = self.elevation_m.shape
        is_table = len(shape) in (1, 2) and shape[0] >= FEWEST and shape[1:] in ((), (2,))
        if not (0 < self.rate_hz < np.inf and is_table):
            raise ValueError(f"excitation: expected a rate and elevations of shape (n,) or (n, 2), four or more, found "
                             f"{self.rate_hz} and {shape}")
        if not np.isfinite(self.elevation_m).all():
            raise ValueError("excitation: expected finite elevations")
        if self.forces and (self.force_n is None or self.force_n.shape != (shape[0], len(self.forces))
                            or not np.isfinite(self.force_n).all()):
            raise ValueError(f"excitation: expected finite samples of each of {len(self.forces)} forces")

    @cached_property
    def is_still(self) -> bool:
        """Whether nothing drives the rig: what it does goes on from how it begins. A part is moved by its bench."""
        return not (self.moves_part or np.ptp(self.elevation_m, axis=0).any()
                    or (self.force_n is not None and np.ptp(self.force_n, axis=0).any()))

    @property
    def end_s(self) -> float:
        """When the last sample was, counted from the first of the record [s]."""
        return self.start_s + (len(self.elevation_m) - 1) / self.rate_hz

    def under_wheels(self, way: Way, stance: Stance) -> tuple[Array, Array]:
        """As ``WheelTracks``, then the forces: whatever stands behind the front wheels is a rear wheel. What stands on
        a base feels the base's height, velocity and acceleration."""
        end_s, inside = self.end_s, np.clip(way.time_s, self.start_s, self.end_s)
        curves, near_s = self._curves(inside), self._near_s(way.time_s)
        beyond = curves * (way.time_s - inside)[:, None]
        if self.moves_part:
            curves, beyond = 2 * curves - self._curves(near_s), 2 * beyond
        integral = self._integrals(near_s) + beyond
        means = np.diff(integral, axis=0) / np.diff(way.time_s)[:, None]
        column = np.where(np.asarray(stance.behind_m) > 0, curves.shape[1] - 1, 0)
        values, means = [curves[:, column]], [means[:, column]]
        if stance.on_base:
            velocity, acceleration = (self._derivative(order, way.time_s) for order in (1, 2))
            values += [velocity, acceleration]
            means += [np.diff(one, axis=0) / np.diff(way.time_s)[:, None] for one in (values[0], velocity)]
        if self.forces:
            pushes = self._pushes(inside)
            late_s = np.maximum(way.time_s - end_s, 0.0)[:, None]
            values.append(np.where((way.time_s >= self.start_s)[:, None], pushes, 0.0))
            means.append(np.diff(self._impulses(inside) + late_s * pushes, axis=0) / np.diff(way.time_s)[:, None])
        return np.hstack(values), np.hstack(means)

    @property
    def is_noisy(self) -> bool:
        """Whether its samples show white noise, of which a part is still in it."""
        return any(one.deviation for one in (*self._denoised_m, *self._denoised_n))

    def with_noise_left(self, *draw: int) -> Excitation:
        """The same with noise like what is still in it, one draw of that by its numbers."""
        moved = [one.samples + one.left(*draw, 0, at) for at, one in enumerate(self._denoised_m)]
        pushed = [one.samples + one.left(*draw, 1, at) for at, one in enumerate(self._denoised_n)]
        return replace(self, elevation_m=np.stack(moved, axis=1).reshape(self.elevation_m.shape), share=None,
                       force_n=np.stack(pushed, axis=1) if pushed else None)

    def answered_by(self, force_n: Array, rate_hz: float) -> Excitation:
        """The same of a part, without what the force (m,) with which it answers shows to be noise."""
        if not self.moves_part or len(force_n) < FEWEST:
            return self
        at_s = self.start_s + np.arange(len(self.elevation_m)) / self.rate_hz
        force = np.interp(at_s, np.arange(len(force_n)) / rate_hz, force_n)
        share = answered(self.elevation_m.ravel(), force, self.rate_hz, SEEN_OF_RATE * rate_hz)
        return self if share.min() == 1 else replace(self, share=share)

    def times(self, table: float, forces: float) -> Excitation:
        """The same, the table's motion larger by a factor, and the forces by another."""
        return replace(self, elevation_m=table * self.elevation_m,
                       force_n=None if self.force_n is None else forces * self.force_n)

    @cached_property
    def _denoised_m(self) -> list[Denoised]:
        return [without_white_noise(one, self.share) for one in self.elevation_m.reshape(len(self.elevation_m), -1).T]

    @cached_property
    def _denoised_n(self) -> list[Denoised]:
        return [] if self.force_n is None else [without_white_noise(one) for one in self.force_n.T]

    def begun(self, later_s: float) -> Excitation:
        """The same for a record that begins so much later [s]."""
        return replace(self, start_s=self.start_s - later_s)

    def under_axle(self, way: Way, behind_m: float, patch_m: float) -> Array:
        """Elevations (M,) under an axle so far behind the front one [m]."""
        return np.asarray(self._curves(np.clip(way.time_s, self.start_s, self.end_s))[:, -1 if behind_m > 0 else 0])

    @property
    def acts_on(self) -> tuple[tuple[str, ...], ...]:
        """The parts that the forces act on."""
        return tuple(one.parts for one in self.forces)

    def as_it_is(self, surface: Alterations, actuators: Alterations) -> Excitation:
        """As ``WheelTracks``."""
        if self.force_n is None or not actuators:
            return self
        acting = self.force_n
        for one in actuators:
            acting = np.stack([one(self.rate_hz, force_n) for force_n in acting.T], axis=1)
        found = replace(self, force_n=acting)
        vars(found).update(_denoised_m=self._denoised_m, _curves=self._curves, _integrals=self._integrals)  # the same
        return found

    def forces_n(self, time_s: Array) -> Array:
        """The forces (M, f) at some times since the first sample of the record [s] [N]."""
        return np.asarray(self._pushes(np.clip(time_s, self.start_s, self.end_s)))

    def _derivative(self, order: int, time_s: Array) -> Array:
        """Of the elevation under the front wheels (M, 1), by time; 0 where it stays where it is."""
        inside, sign = np.clip(time_s, self.start_s, self.end_s), 0.0
        if self.moves_part:
            sign = -1.0 if order == 2 else 1.0
        found = self._curves.derivative(order)(self._near_s(time_s))[:, 0]
        return np.where(inside == time_s, found, sign * found)[:, None]

    def _near_s(self, time_s: Array) -> Array:
        """Times within the record: those before and after it at its ends, or as far within as they are beyond."""
        inside = np.clip(time_s, self.start_s, self.end_s)
        return np.clip(2 * inside - time_s, self.start_s, self.end_s) if self.moves_part else inside

    @cached_property
    def _curves(self) -> BSpline:
        return self._spline(np.stack([one.samples for one in self._denoised_m], axis=1))

    @cached_property
    def _pushes(self) -> BSpline:
        return self._spline(np.stack([one.samples for one in self._denoised_n], axis=1))

    @cached_property
    def _impulses(self) -> BSpline:
        return self._pushes.antiderivative()

    def _spline(self, samples: Array) -> BSpline:
        from scipy.interpolate import make_interp_spline

        time_s = self.start_s + np.arange(len(samples)) / self.rate_hz
        return make_interp_spline(time_s, samples, _CUBIC)

    @cached_property
    def _integrals(self) -> BSpline:
        return self._curves.antiderivative()
