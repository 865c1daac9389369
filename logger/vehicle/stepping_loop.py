"""The loop of ``stepping``: plain numbers and arrays, so that it can be compiled.

It is compiled when numba is there (the ``lab`` extra), at its first use, and kept on disk; else it runs as it stands.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

try:
    import numba
except ImportError:
    COMPILED = False
else:
    COMPILED = True


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    return numba.njit(cache=True, nogil=True)(function) if COMPILED else function


TRAVEL_M, RATE_MPS = 0.4, 8.0
"""Tables of one variable reach from minus to plus this [m, m/s], and go on straight beyond."""
UNIT_M, UNIT_MPS = 0.01, 0.02
"""Tables of two variables are even in arsinh of travel and rate over these."""
_PASSES = 2


@_compiled
def _read(tables: Array, i: int, low: float, per_unit: float, at: float) -> float:
    """The value of table i, on a straight line between its points and beyond them."""
    place = (at - low) * per_unit
    cell = min(max(int(place), 0), tables.shape[1] - 2)
    share = place - cell
    return tables[i, cell] + share * (tables[i, cell + 1] - tables[i, cell])


@_compiled
def _read_pair(tables: Array, corner: int, travel: float, rate: float) -> float:
    """The value of a table of two variables, held at its edges."""
    _, rows, columns = tables.shape
    row = (np.arcsinh(travel / UNIT_M) / np.arcsinh(TRAVEL_M / UNIT_M) + 1) * 0.5 * (rows - 1)
    column = (np.arcsinh(rate / UNIT_MPS) / np.arcsinh(RATE_MPS / UNIT_MPS) + 1) * 0.5 * (columns - 1)
    i = min(max(int(row), 0), rows - 2)
    j = min(max(int(column), 0), columns - 2)
    x = min(max(row - i, 0.0), 1.0)
    y = min(max(column - j, 0.0), 1.0)
    low = tables[corner, i, j] + y * (tables[corner, i, j + 1] - tables[corner, i, j])
    high = tables[corner, i + 1, j] + y * (tables[corner, i + 1, j + 1] - tables[corner, i + 1, j])
    return low + x * (high - low)


@_compiled
def _suspension(
    i: int, spring: Array, damper: Array, mount: Array, other: Array, numbers: Array, damping: Array, mounted: Array,
    last_rates: Array, step_s: float, travel: float, rate: float, found: Array,
) -> float:
    """What the laws of suspension i add to the linear ones, but for dry friction [N].

    mounted    (w, 2) of the mounts at the beginning of the step: compression, and the damper's own rate
    found      the same at the end, written here
    """
    force = _read(spring, i, -TRAVEL_M, 0.5 / TRAVEL_M * (spring.shape[1] - 1), travel)
    stiffness = numbers[i, 1]
    if stiffness == 0.0:
        force += _read(damper, i, -RATE_MPS, 0.5 / RATE_MPS * (damper.shape[1] - 1), rate)
    else:
        carried = mounted[i, 0] + 0.5 * step_s * (last_rates[i] - mounted[i, 1] + rate)
        found[i, 1] = _read(mount, i, numbers[i, 2], numbers[i, 3], stiffness * carried)
        found[i, 0] = carried - 0.5 * step_s * found[i, 1]
        force += stiffness * found[i, 0] - damping[i] * rate
    if other.size > len(other):
        force += _read_pair(other, i, travel, rate)
    return force


@_compiled
def _tire(i: int, tables: Array, numbers: Array, static_n: Array, deflection: float, rate: float) -> float:
    """What the laws of tire i add to its linear spring [N]."""
    force = _read(tables, i, -TRAVEL_M, 0.5 / TRAVEL_M * (tables.shape[1] - 1), deflection) + numbers[i, 4] * rate
    if numbers[i, 6] == 0.0:  # the tire cannot pull: the force on the road is static - k d - force, at least 0
        force = min(force, static_n[i] - numbers[i, 5] * deflection)
    return force


@_compiled
def steps(
    transition: Array, drive: Array, at_start: Array, at_end: Array, travel_of: Array, wheels_of: Array,
    elevation: Array, road_rate: Array, start: Array, step_s: float, spring: Array, damper: Array, mount: Array,
    other: Array, tire: Array, numbers: Array, damping: Array, static_n: Array,
) -> tuple[Array, Array]:
    """States (M, 2 n) and forces (M, 2 w); see ``stepping.march``.

    transition, at_start, at_end    of the state, and of forces that are straight lines over a step
    drive                           (M - 1, 2 n) what the road does to the state in each step
    spring ... tire                 (w, points) tables
    numbers                         (w, 7): dry friction, the mount's stiffness (0: none), where its table begins and
                                    its points per unit, the tire's damping and stiffness, and whether it pulls
    """
    count, m = len(drive) + 1, len(start)
    n, w = m // 2, len(travel_of)
    states, forces = np.zeros((count, m)), np.zeros((count, 2 * w))
    held = at_start[:, :w] + at_end[:, :w]  # of forces that stay the same over a step: dry friction
    yielding = np.zeros((w, w))  # rate of each suspension per dry friction in each
    for i in range(w):
        for j in range(w):
            for c in range(n):
                yielding[i, j] += travel_of[i, c] * held[n + c, j]
    mounted, mounted_next = np.zeros((w, 2)), np.zeros((w, 2))
    smooth, tried, dry = np.zeros(2 * w), np.zeros(2 * w), np.zeros(w)
    state, base, moved = start.copy(), np.zeros(m), np.zeros(m)
    rates, last_rates = np.zeros(w), np.zeros(w)
    states[0] = start
    for k in range(count - 1):
        for r in range(m):
            value = drive[k, r]
            for c in range(m):
                value += transition[r, c] * state[c]
            for c in range(2 * w):
                value += at_start[r, c] * smooth[c]
            base[r] = value
        for c in range(2 * w):
            tried[c] = smooth[c]
        for sweep in range(_PASSES + 1):
            for r in range(m):
                value = base[r]
                for c in range(2 * w):
                    value += at_end[r, c] * tried[c]
                moved[r] = value
            for i in range(w):
                rates[i] = 0.0
                for c in range(n):
                    rates[i] += travel_of[i, c] * moved[n + c]
            for _ in range(2):
                for i in range(w):
                    if numbers[i, 0] > 0.0:
                        free = rates[i]
                        for j in range(w):
                            if j != i:
                                free += yielding[i, j] * dry[j]
                        dry[i] = min(max(-free / yielding[i, i], -numbers[i, 0]), numbers[i, 0])
            for r in range(m):
                for i in range(w):
                    moved[r] += held[r, i] * dry[i]
            if sweep == _PASSES:
                break
            for i in range(w):
                travel, rate, height, lift = 0.0, 0.0, 0.0, 0.0
                for c in range(n):
                    travel += travel_of[i, c] * moved[c]
                    rate += travel_of[i, c] * moved[n + c]
                    height += wheels_of[i, c] * moved[c]
                    lift += wheels_of[i, c] * moved[n + c]
                tried[i] = _suspension(i, spring, damper, mount, other, numbers, damping, mounted, last_rates, step_s,
                                       travel, rate, mounted_next)
                tried[w + i] = _tire(i, tire, numbers, static_n, height - elevation[k + 1, i],
                                     lift - road_rate[k + 1, i])
        for r in range(m):
            state[r] = moved[r]
            states[k + 1, r] = moved[r]
        for i in range(w):
            last_rates[i] = 0.0
            for c in range(n):
                last_rates[i] += travel_of[i, c] * state[n + c]
            mounted[i, 0], mounted[i, 1] = mounted_next[i, 0], mounted_next[i, 1]
            forces[k + 1, i] = tried[i] + dry[i]
            forces[k + 1, w + i] = tried[w + i]
        for c in range(2 * w):
            smooth[c] = tried[c]
    return states, forces
