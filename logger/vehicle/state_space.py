"""Linear equations in time, stepped exactly and in blocks.

A car on a road is x' = A x + B u. Between two samples the input is known (held, or a straight line), so the step
can be taken without error through the matrix exponential. Stepping sample by sample in Python is slow; a block of
L steps is one matrix product, and only the state at the block's end has to be carried on.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_BLOCK = 32


def matrix_exponential(a: Array) -> Array:
    """exp(a) of a square matrix, by scaling, a Taylor series to rounding error, and squaring."""
    squarings = max(0, int(np.ceil(np.log2(max(np.abs(a).sum(axis=1).max(), 1e-300)))) + 2)
    scaled = a / 2.0**squarings
    result = term = np.eye(len(a))
    for order in range(1, 15):
        term = term @ scaled / order
        result = result + term
    for _ in range(squarings):
        result = result @ result
    return result


def held_step(a: Array, b: Array, step_s: float) -> tuple[Array, Array]:
    """F and G of x[k+1] = F x[k] + G u[k], exact for an input that is constant over the step."""
    n, m = b.shape
    whole = matrix_exponential(np.block([[a, b], [np.zeros((m, n + m))]]) * step_s)
    return whole[:n, :n], whole[:n, n:]


def straight_step(a: Array, b: Array, step_s: float) -> tuple[Array, Array, Array]:
    """F, G0, G1 of x[k+1] = F x[k] + G0 u[k] + G1 u[k+1], exact for an input that is a straight line over the step."""
    n, m = b.shape
    bottom = np.block([[np.zeros((m, n + m)), np.eye(m) / step_s], [np.zeros((m, n + 2 * m))]])
    whole = matrix_exponential(np.vstack([np.block([a, b, np.zeros((n, m))]), bottom]) * step_s)
    end = whole[:n, n + m:]
    return whole[:n, :n], whole[:n, n:n + m] - end, end


def recursion(transition: Array, drive: Array, start: Array) -> Array:
    """States x[1] ... x[N] of x[k+1] = F x[k] + drive[k] from x[0] = start.

    transition (n, n), drive (N, n), start (n,); returns (N, n).
    """
    count, n = drive.shape
    powers = [np.eye(n)]
    for _ in range(_BLOCK):
        powers.append(powers[-1] @ transition)
    spread = np.zeros((_BLOCK, n, _BLOCK, n))  # [output step, state, input step, state]
    for late in range(_BLOCK):
        for early in range(late + 1):
            spread[late, :, early, :] = powers[late - early]
    blocks = -(-count // _BLOCK)
    padded = np.zeros((blocks * _BLOCK, n))
    padded[:count] = drive
    forced = (padded.reshape(blocks, -1) @ spread.reshape(_BLOCK * n, _BLOCK * n).T).reshape(blocks, _BLOCK, n)
    carried = np.empty((blocks, n))
    state = start
    for block in range(blocks):
        carried[block] = state
        state = forced[block, -1] + powers[_BLOCK] @ state
    free = (carried @ np.vstack(powers[1:]).T).reshape(blocks, _BLOCK, n)
    return (forced + free).reshape(-1, n)[:count]
