"""A car with nonlinear laws at its corners, stepped through time.

The linear part of the car is stepped exactly (as ``state_space`` has it). What the laws add to it are forces that
depend on the motion itself; within a step they are straight lines from what they are at its beginning to what they come to at
its end, which is found by trying twice. Dry friction takes whatever value stops the suspension at the end of the step,
as far as it reaches, and keeps it for the step: that sticks and slips without a smallest speed (J. J. Moreau's time
stepping, in: Nonsmooth Mechanics and Applications, 1988). A mount in series with a damper has a state, its
compression, stepped by the trapezoidal rule.

Laws come as tables, so that one loop serves all of them, in whatever combination. The loop is compiled when numba is
installed (the ``lab`` extra) and runs as plain Python, some hundred times slower, when it is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.vehicle.laws import CornerLaws, Law2
from logger.vehicle.state_space import straight_step
from logger.vehicle.structure import Structure

Array = npt.NDArray[np.float64]

# Points of the tables; those of two variables have so many on either side of 0.
_POINTS = 8001
_TRAVEL_SIDE, _RATE_SIDE = 120, 160
_GRAVITY_MPS2 = 9.80665


@dataclass(frozen=True, eq=False)
class Motion:
    """How a car moved: M instants.

    states    (M, 2 n) coordinates, then their velocities
    forces    (M, 2 w) what the laws added at the suspensions, then at the tires [N]
    """

    states: Array
    forces: Array


def static_tire_loads_n(structure: Structure) -> Array:
    """What each tire carries at rest (w,) [N]."""
    rise = np.linalg.solve(structure.stiffness, structure.road.sum(axis=1))  # of all that rises with the road
    sag = np.linalg.solve(structure.stiffness, -_GRAVITY_MPS2 * (structure.mass @ rise))
    return np.asarray(-structure.tires * (structure.wheels @ sag))


def force_input(structure: Structure) -> Array:
    """What forces at the suspensions, then at the tires, do to the state's derivative (2 n, 2 w)."""
    onto = -np.hstack([structure.travel.T, structure.wheels.T])
    return np.vstack([np.zeros_like(onto), np.linalg.solve(structure.mass, onto)])


def march(structure: Structure, laws: Sequence[CornerLaws], elevation: Array, mean: Array, step_s: float) -> Motion:
    """The motion of a car on a road, from rest.

    laws         one per wheel
    elevation    (M, w) under the wheels at the instants [m]
    mean         (M - 1, w) over each step [m]
    """
    from logger.vehicle.stepping_loop import steps  # loads the compiler, if there is one

    n, w = len(structure.mass), len(structure.wheels)
    a, b = structure.state_space()
    around = np.concatenate([2 * elevation[:1] - mean[:1], mean, 2 * elevation[-1:] - mean[-1:]])
    transition, at_start, at_end = straight_step(a, np.hstack([b, force_input(structure)]), step_s)
    gain = np.hstack([at_start[:, :w] + at_end[:, :w], at_end[:, :w] - at_start[:, :w]])
    drive = np.hstack([mean, (around[2:] - around[:-2]) / 4]) @ gain.T
    rest = np.concatenate([np.linalg.solve(structure.stiffness, structure.road @ elevation[0]), np.zeros(n)])
    tables = [_Tables.of(one, step_s) for one in laws]
    states, forces = steps(
        transition, drive, at_start[:, w:].copy(), at_end[:, w:].copy(), structure.travel, structure.wheels,
        elevation, np.diff(around, axis=0) / step_s, rest, step_s,
        np.stack([one.spring for one in tables]), np.stack([one.damper for one in tables]),
        np.stack([one.mount for one in tables]), np.stack([one.other for one in tables]),
        np.stack([one.tire for one in tables]),
        np.array([[one.dry_friction_n, tables[i].mount_n_per_m, tables[i].mount_low, tables[i].mount_per_unit,
                   one.tire_damping_n_s_per_m, structure.tires[i], float(one.tire_pulls)]
                  for i, one in enumerate(laws)]),
        np.array([one.damping_n_s_per_m for one in laws]),
        static_tire_loads_n(structure),
    )
    return Motion(states, forces)


@dataclass(frozen=True, eq=False)
class _Tables:
    """What a corner's laws add to its linear spring, damper and tire, tabulated; a table of one point is none."""

    spring: Array
    damper: Array
    mount: Array
    mount_n_per_m: float
    mount_low: float
    mount_per_unit: float
    other: Array
    tire: Array

    @staticmethod
    def of(laws: CornerLaws, step_s: float) -> _Tables:
        from logger.vehicle.stepping_loop import RATE_MPS, TRAVEL_M, UNIT_M, UNIT_MPS

        travel = np.linspace(-TRAVEL_M, TRAVEL_M, _POINTS)
        rate = np.linspace(-RATE_MPS, RATE_MPS, _POINTS)
        damper = laws.damper(rate)
        mount, low, step = np.zeros(_POINTS), 0.0, 1.0
        if np.isfinite(laws.mount_n_per_m):
            # What law(v) + k h / 2 v has to be gives v: the trapezoidal rule solved for the damper's own rate.
            known = damper + 0.5 * laws.mount_n_per_m * step_s * rate
            low, step = float(known[0]), float((known[-1] - known[0]) / (_POINTS - 1))
            mount = np.interp(low + step * np.arange(_POINTS), known, rate)
        other = np.zeros((1, 1))
        if laws.others:
            at_m = _even_in_arsinh(UNIT_M, TRAVEL_M, _TRAVEL_SIDE)
            at_mps = _even_in_arsinh(UNIT_MPS, RATE_MPS, _RATE_SIDE)
            other = _sum(laws.others, *np.meshgrid(at_m, at_mps, indexing="ij"))
        springs, tires = (
            np.sum([law(travel) for law in some], axis=0) if some else np.zeros(_POINTS)
            for some in (laws.springs, laws.tires)
        )
        stiffness = laws.mount_n_per_m if np.isfinite(laws.mount_n_per_m) else 0.0
        return _Tables(springs, damper - laws.damping_n_s_per_m * rate, mount, stiffness, low, 1 / step, other, tires)


def _sum(laws: Sequence[Law2], travel_m: Array, rate_mps: Array) -> Array:
    return np.asarray(np.sum([law(travel_m, rate_mps) for law in laws], axis=0))


def _even_in_arsinh(unit: float, reach: float, side: int) -> Array:
    """Points from -reach to reach, ``side`` on either side of 0, denser around it."""
    return unit * np.sinh(np.linspace(-1, 1, 2 * side + 1) * np.arcsinh(reach / unit))
