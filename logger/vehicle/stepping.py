"""A car with nonlinear laws at its corners, stepped through time.

The linear part of the car is stepped exactly (as ``state_space`` has it). What the laws add to it are forces that
depend on the motion itself; within a step they are straight lines from what they are at its beginning to what they come
to at its end, which is found by trying twice. Dry friction takes whatever value stops the suspension at the end of the
step, as far as it reaches, and keeps it for the step: that sticks and slips without a smallest speed (J. J. Moreau's
time stepping, in: Nonsmooth Mechanics and Applications, 1988). One that grows with the rate is found in the same way. A
mount in series with a damper has a state, its compression, stepped by the trapezoidal rule.

Laws come as tables, so that one loop serves all of them, in whatever combination. The loop is compiled when numba is
installed (the ``lab`` extra) and runs as plain Python, some hundred times slower, when it is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.laws import CornerLaws, Law, Law2
from logger.vehicle.state_space import straight_step
from logger.vehicle.structure import Structure

Array = npt.NDArray[np.float64]

# Points of the tables; those of two variables have so many on either side of 0.
_POINTS = 8001
_TRAVEL_SIDE, _RATE_SIDE = 120, 160
_RUBS_AT, _GROWS_AT, _SLOW = 0.7, 0.55, 200.0


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
    sag = np.linalg.solve(structure.stiffness, -STANDARD_GRAVITY_MPS2 * (structure.mass @ rise))
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
    from logger.vehicle.stepping_loop import LANES, steps  # loads the compiler, if there is one

    n, w = len(structure.mass), len(structure.wheels)
    a, b = structure.state_space()
    transition, at_start, at_end = straight_step(a, np.hstack([b, force_input(structure)]), step_s)
    road = [at_start[:, :w] + at_end[:, :w], at_end[:, :w] - at_start[:, :w]]
    held = at_start[:, w : 2 * w] + at_end[:, w : 2 * w]  # dry friction stays the same over a step
    seen = np.vstack([np.kron(order, rows) for rows in (structure.travel, structure.wheels) for order in np.eye(2)])
    state_and_seen = np.vstack([np.eye(2 * n), seen, np.zeros(((-len(seen) - 2 * n) % LANES, 2 * n))])
    known, forces = (
        np.ascontiguousarray((state_and_seen @ np.hstack(some)).T)
        for some in ([transition, at_start[:, w:], *road], [at_end[:, w:], held])
    )
    around = np.concatenate([2 * elevation[:1] - mean[:1], mean, 2 * elevation[-1:] - mean[-1:]])
    rest = np.concatenate([np.linalg.solve(structure.stiffness, structure.road @ elevation[0]), np.zeros(n)])
    ease = -np.diag(forces[2 * w :, 2 * n + w : 2 * n + 2 * w])
    return Motion(*steps(known, forces, step_s, *_tabulated(structure, laws, step_s, ease), rest, around, elevation))


def _looked_at(one: CornerLaws, ease: float) -> float:
    """At which share of a step friction looks at the rate, which it can change by force times ``ease``. A half would
    be right to second order, but nothing comes to rest then; what grows slowly with the rate needs hardly more."""
    pull = ease * one.dry_friction_n
    sudden = pull / (pull + _SLOW * one.friction_transition_mps) if pull > 0 else 1.0
    return _GROWS_AT + (_RUBS_AT - _GROWS_AT) * sudden


def _tabulated(
    structure: Structure, laws: Sequence[CornerLaws], step_s: float, ease: Array,
) -> tuple[Array, Array, Array]:
    """What the laws add to the linear springs, dampers and tires, as the loop reads it: tables of one and of two
    variables, and numbers."""
    from logger.vehicle.stepping_loop import RATE_MPS, TRAVEL_M

    travel = np.linspace(-TRAVEL_M, TRAVEL_M, _POINTS)
    rate = np.linspace(-RATE_MPS, RATE_MPS, _POINTS)
    loads = static_tire_loads_n(structure)
    tables, pairs, numbers = [], [], []
    for i, one in enumerate(laws):
        mounted = bool(np.isfinite(one.mount_n_per_m))
        mount, low, step = _mount(one, rate, step_s) if mounted else (np.zeros(_POINTS), 0.0, 1.0)
        damper = one.damper(rate) - one.damping_n_s_per_m * rate
        tables.append([_sum(one.springs, travel), damper, mount, _sum(one.tires, travel)])
        pairs.append(_pairs(one.others))
        numbers.append([
            bool(one.springs), bool(damper.any()), mounted, bool(one.tires), bool(one.others), one.dry_friction_n,
            one.friction_transition_mps, _looked_at(one, ease[i]), one.mount_n_per_m if mounted else 0.0, low,
            1 / step, one.damping_n_s_per_m, structure.tires[i], one.tire_damping_n_s_per_m,
            np.inf if one.tire_pulls else loads[i],
        ])
    return np.array(tables).swapaxes(0, 1).copy(), np.array(pairs), np.array(numbers, dtype=float)


def _mount(laws: CornerLaws, rate: Array, step_s: float) -> tuple[Array, float, float]:
    """The damper's own rate when a mount is in series with it: a table, where it begins, and its step.

    What law(v) + k h / 2 v has to be gives v: the trapezoidal rule solved for v.
    """
    known = laws.damper(rate) + 0.5 * laws.mount_n_per_m * step_s * rate
    reach = max(-known[0], known[-1])
    # The table is even about 0, where most dampers have a corner that must not be cut, and goes on straight.
    before, after = np.diff(rate)[0] / np.diff(known)[[0, -1]] * [-reach - known[0], reach - known[-1]]
    at = np.linspace(-reach, reach, _POINTS)
    own = np.interp(at, [-reach, *known, reach], [rate[0] + before, *rate, rate[-1] + after])
    return own, float(at[0]), float(2 * reach / (_POINTS - 1))


def _pairs(laws: Sequence[Law2]) -> Array:
    """The sum of laws of travel and rate, as a table."""
    from logger.vehicle.stepping_loop import RATE_MPS, TRAVEL_M, UNIT_M, UNIT_MPS

    if not laws:
        return np.zeros((1, 1))
    at_m = _even_in_arsinh(UNIT_M, TRAVEL_M, _TRAVEL_SIDE)
    at_mps = _even_in_arsinh(UNIT_MPS, RATE_MPS, _RATE_SIDE)
    return _sum(laws, *np.meshgrid(at_m, at_mps, indexing="ij"))


def _sum(laws: Sequence[Law] | Sequence[Law2], *at: Array) -> Array:
    return sum((law(*at) for law in laws), np.zeros_like(at[0]))


def _even_in_arsinh(unit: float, reach: float, side: int) -> Array:
    """Points from -reach to reach, ``side`` on either side of 0, denser around it."""
    return unit * np.sinh(np.linspace(-1, 1, 2 * side + 1) * np.arcsinh(reach / unit))
