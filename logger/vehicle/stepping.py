"""A car with nonlinear laws at its corners, stepped through time.

The linear part of the car is stepped exactly (as ``structure`` has it). What the laws add to it are forces that
depend on the motion itself; within a step they are straight lines from what they are at its beginning to what they come
to at its end, which is found by trying twice. Dry friction takes whatever value stops the suspension at the end of the
step, as far as it reaches, and keeps it for the step: that sticks and slips without a smallest speed (J. J. Moreau's
time stepping, in: Nonsmooth Mechanics and Applications, 1988). One that grows with the rate is found in the same way. A
mount in series with a damper has a state, its compression, stepped by the trapezoidal rule.

Laws come as tables, so that one loop serves all of them, in whatever combination; those by more than two variables, or
with states, as addresses of functions (``stepping_loop``). The loop is compiled when numba is
installed (the ``lab`` extra) and runs as plain Python, some hundred times slower, when it is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from logger.arrays import Array, Whole
from logger.profiles.track import Way
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.laws import MOST_MEMORY, CornerLaws, Law, Law2, Stribeck
from logger.vehicle.structure import AT_REST, BASE_INPUTS, Structure, straight_step

if TYPE_CHECKING:
    from logger.vehicle.stepping_loop import Asked

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


def begun(at_rest: Array, begins: Array) -> Array:
    """States (k,) that differ from those at rest by the first of ``begins``; by nothing where it is empty."""
    return at_rest + begins[: len(at_rest)] if len(begins) else at_rest


@lru_cache(maxsize=16)
def static_tire_loads_n(structure: Structure) -> Array:
    """What each tire carries at rest (w,) [N]."""
    if not structure.tires.any():
        return np.zeros(len(structure.tires))
    # Of all that rises with the road, forces apart:
    rise = np.linalg.solve(structure.stiffness, structure.road[:, :len(structure.tires)].sum(axis=1))
    sag = np.linalg.solve(structure.stiffness, -STANDARD_GRAVITY_MPS2 * (structure.mass @ rise))
    return np.asarray(-structure.tires * (structure.wheels @ sag))


@lru_cache(maxsize=16)
def force_input(structure: Structure) -> Array:
    """What forces at the suspensions, then at the tires, do to the state's derivative (2 n, 2 w)."""
    onto = -np.hstack([structure.travel.T, structure.wheels.T])
    return np.vstack([np.zeros_like(onto), np.linalg.solve(structure.mass, onto)])


@dataclass(frozen=True, eq=False)
class Stepper:
    """A car with its laws in steps of one length: all that is the same on every road.

    state_and_seen    (R, 2 n) the motion that the loop carries on, out of the state
    inputs_seen       (R, u) and out of what drives it: a base that moves under a mass
    others            as ``stepping_loop.steps`` has them
    """

    structure: Structure
    laws: tuple[CornerLaws, ...]
    step_s: float
    state_and_seen: Array
    inputs_seen: Array
    by_known: Array
    by_force: Array
    tabulated: tuple[Array, Array, Array]
    rubs: Array
    rubs_at: Whole

    @staticmethod
    def of(structure: Structure, laws: Sequence[CornerLaws], step_s: float) -> Stepper:
        """Of laws, one per wheel. ValueError for one by all that moves that cannot be compiled."""
        w, rubbing = len(structure.wheels), _rubbing(laws, 2 * len(structure.mass))
        state_and_seen, inputs_seen, known, at_end, held = _without_laws(
            structure, step_s, any(one.body_friction_n for one in laws))
        forces = np.ascontiguousarray(np.hstack([at_end, held @ _onto(rubbing, w)]).T)
        rubs = [[one.force_n, one.transition_mps, _looked_at(one, -float(forces[2 * w + i, one.places[0]])),
                 *one.stribeck] for i, one in enumerate(rubbing)]
        return Stepper(
            structure, tuple(laws), step_s, state_and_seen, inputs_seen, known, forces,
            _tabulated(structure, laws, step_s), np.array(rubs).reshape(-1, 5),
            np.array([one.places for one in rubbing], dtype=np.int64).reshape(-1, 3))

    def march(self, elevation: Array, mean: Array, way: Way | None = None, begins: Array = AT_REST) -> Motion:
        """The motion on a road, from a state that differs by ``begins`` (2 n,) from rest, and so do those of laws with
        a memory by what follows there (k,).

        elevation    (M, u) under the wheels at the instants [m], or of what inputs the structure has
        mean         (M - 1, u) over each step [m]
        way          None: it stands at 0, and time begins there
        """
        from logger.vehicle.stepping_loop import steps

        structure, n = self.structure, len(self.structure.mass)
        around = np.concatenate([2 * elevation[:1] - mean[:1], mean, 2 * elevation[-1:] - mean[-1:]])
        first = begun(structure.at_rest(elevation[0]), begins)
        if way is None:
            way = Way(np.zeros(len(elevation)), np.arange(0.0, len(elevation)) * self.step_s)
        return Motion(*steps(
            self.by_known, self.by_force, self.step_s, *self.tabulated, self.rubs, self.rubs_at,
            _asked(structure, self.laws, way, begins[2 * n:]),
            self.state_and_seen @ first + self.inputs_seen @ elevation[0], 2 * n, around, elevation))


@lru_cache(maxsize=16)
def _without_laws(structure: Structure, step_s: float, with_ends: bool) -> tuple[Array, Array, Array, Array, Array]:
    """``state_and_seen``, ``inputs_seen`` and ``by_known`` of a car, with the body's ends of its suspensions or
    without, and what its motion (R, 2 w) gets from forces at the end of a step, and from ones that stay the same."""
    from logger.vehicle.stepping_loop import LANES  # loads the compiler, if there is one

    n, w = len(structure.mass), len(structure.wheels)
    a, b = structure.state_space()
    u = b.shape[1]
    transition, at_start, at_end = straight_step(a, np.hstack([b, force_input(structure)]), step_s)
    inputs = [at_start[:, :u] + at_end[:, :u], at_end[:, :u] - at_start[:, :u]]
    seen = np.zeros((4 * w, 2 * n))  # places and rates of suspensions, then of wheels
    seen[:w, :n] = seen[w:2 * w, n:] = structure.travel
    seen[2 * w:3 * w, :n] = seen[3 * w:, n:] = structure.wheels
    through = np.zeros((len(seen), u))
    if structure.on_base:  # from which its place is counted
        through[2 * w, BASE_INPUTS.index("height")] = through[3 * w, BASE_INPUTS.index("velocity")] = 1.0
    if with_ends:
        seen = np.vstack([seen, np.hstack([np.zeros((w, n)), structure.travel + structure.wheels])])
        through = np.vstack([through, through[w:2 * w] + through[3 * w:]])
    rest = (-len(seen) - 2 * n) % LANES
    state_and_seen = np.vstack([np.eye(2 * n), seen, np.zeros((rest, 2 * n))])
    inputs_seen = np.vstack([np.zeros((2 * n, u)), through, np.zeros((rest, u))])
    known = np.ascontiguousarray((state_and_seen @ np.hstack([transition, at_start[:, u:], *inputs])).T)
    known[-2 * u:] += np.tile(inputs_seen.T, (2, 1))  # at the end of a step: the mean over it, and the rise
    return (state_and_seen, inputs_seen, known, state_and_seen @ at_end[:, u:],
            state_and_seen @ (at_start[:, u:] + at_end[:, u:]))


@dataclass(frozen=True)
class _Rubs:
    """One pair that rubs.

    places    the row of its rate in the motion, and where its force is recorded: at a suspension, at a tire; -1: not
    """

    force_n: float
    transition_mps: float
    stribeck: Stribeck
    places: tuple[int, int, int]


def _rubbing(laws: Sequence[CornerLaws], m: int) -> list[_Rubs]:
    """All that rubs in a car with so many states: the suspensions, the wheels on their guides, the body on its."""
    w = len(laws)
    suspensions = [_Rubs(one.dry_friction_n, one.friction_transition_mps, one.stribeck, (m + w + i, i, -1))
                   for i, one in enumerate(laws)]
    wheels = [_Rubs(one.wheel_friction_n, one.guide_transition_mps, one.guide_stribeck, (m + 3 * w + i, -1, w + i))
              for i, one in enumerate(laws)]
    body = [_Rubs(one.body_friction_n, one.guide_transition_mps, one.guide_stribeck, (m + 4 * w + i, i, w + i))
            for i, one in enumerate(laws)]
    return [one for one in (*suspensions, *wheels, *body) if one.force_n > 0]


def _onto(rubbing: Sequence[_Rubs], w: int) -> Array:
    """Which forces at suspensions, then at tires, each friction makes (2 w, f)."""
    onto = np.zeros((2 * w, len(rubbing)))
    for i, one in enumerate(rubbing):
        onto[[place for place in one.places[1:] if place >= 0], i] = 1.0
    return onto


def _looked_at(one: _Rubs, ease: float) -> float:
    """At which share of a step friction looks at the rate, which it can change by force times ``ease``. A half would
    be right to second order, but nothing comes to rest then; what grows slowly with the rate needs hardly more."""
    pull = ease * one.force_n * one.stribeck.ratio
    sudden = pull / (pull + _SLOW * one.transition_mps) if pull > 0 else 1.0
    return _GROWS_AT + (_RUBS_AT - _GROWS_AT) * sudden


def _asked(structure: Structure, laws: Sequence[CornerLaws], way: Way, begins: Array) -> Asked:
    """Laws by all that moves as the loop reads them, their states (k,) begun so far from rest; where there are none it
    asks for no place and no time."""
    from logger.vehicle.stepping_loop import ANSWERS, FELT, addresses_of, numbers_in_order

    whole, numbers, memories = list[list[int]](), [0.0], list[list[float]]()
    for i, corner in enumerate(laws):
        for one in corner.motions:
            whole.append([*addresses_of(one), i, one.between.value, len(numbers), len(one.memory)])
            numbers += numbers_in_order(one)
            memories.append([*one.memory, *[0.0] * (MOST_MEMORY - len(one.memory))])
    w = len(structure.behind_m)
    places, clock = _places(way, structure) if whole else (np.empty((len(way.time_s), one)) for one in (w, 3))
    law, states = np.array(whole, dtype=np.int64).reshape(-1, 6), np.array(memories, float).reshape(-1, MOST_MEMORY)
    own = np.arange(MOST_MEMORY) < law[:, -1:]
    states[own] = begun(states[own], begins)
    return (law, np.array(numbers, float), np.zeros((len(whole), FELT)), states, np.zeros(FELT),
            np.zeros(FELT + MOST_MEMORY), np.zeros(ANSWERS), places, clock)


@lru_cache(maxsize=16)
def _places(way: Way, structure: Structure) -> tuple[Array, Array]:
    """Where the wheels stand (M, w), and time, speed and number of the run (M, 3)."""
    clock = way.time_s, np.gradient(way.distance_m, way.time_s), np.full(len(way.time_s), way.run)
    return way.distance_m[:, None] - structure.behind_m, np.stack(clock, axis=1)


def _tabulated(structure: Structure, laws: Sequence[CornerLaws], step_s: float) -> tuple[Array, Array, Array]:
    """What the laws add to the linear springs, dampers and tires, as the loop reads it: tables of one and of two
    variables, and numbers."""
    from logger.vehicle.stepping_loop import RATE_MPS, TRAVEL_M

    travel, rate = _even(TRAVEL_M), _even(RATE_MPS)
    loads = static_tire_loads_n(structure)
    tables, pairs, numbers = np.zeros((4, len(laws), _POINTS)), [], []
    paired = any(one.others for one in laws)
    for i, (one, (springs, damper, mount, tires)) in enumerate(zip(laws, tables.swapaxes(0, 1), strict=True)):
        mounted, (low, step) = bool(np.isfinite(one.mount_n_per_m)), (0.0, 1.0)
        if mounted:
            mount[:], low, step = _mount(one, rate, step_s)
        if one.springs:
            springs[:] = _sum(one.springs, travel)
        if one.tires:
            tires[:] = _sum(one.tires, travel)
        damper[:] = one.damper(rate) - one.damping_n_s_per_m * rate
        pairs.append(_pairs(one.others, paired))
        numbers.append([bool(one.springs), bool(damper.any()), mounted, bool(one.tires), bool(one.others),
                        one.mount_n_per_m if mounted else 0.0, low, 1 / step, one.damping_n_s_per_m, structure.tires[i],
                        one.tire_damping_n_s_per_m, np.inf if one.tire_pulls else loads[i], one.mount_play_m])
    return tables, np.array(pairs), np.array(numbers, dtype=float)


@cache
def _even(reach: float) -> Array:
    """Where a table of one variable has its points (``_POINTS``,), from minus to plus a reach."""
    return np.linspace(-reach, reach, _POINTS)


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


def _pairs(laws: Sequence[Law2], paired: bool) -> Array:
    """The sum of laws of travel and rate, as a table; of one point in a car where no corner has such a law."""
    from logger.vehicle.stepping_loop import RATE_MPS, TRAVEL_M, UNIT_M, UNIT_MPS

    if not paired:
        return np.zeros((1, 1))
    at_m = _even_in_arsinh(UNIT_M, TRAVEL_M, _TRAVEL_SIDE)
    at_mps = _even_in_arsinh(UNIT_MPS, RATE_MPS, _RATE_SIDE)
    return np.ascontiguousarray(_sum(laws, *np.meshgrid(at_m, at_mps, indexing="ij")))


def _sum(laws: Sequence[Law] | Sequence[Law2], *at: Array) -> Array:
    return sum((law(*at) for law in laws), np.zeros_like(at[0]))


def _even_in_arsinh(unit: float, reach: float, side: int) -> Array:
    """Points from -reach to reach, ``side`` on either side of 0, denser around it."""
    return unit * np.sinh(np.linspace(-1, 1, 2 * side + 1) * np.arcsinh(reach / unit))
