"""Linear equations in time, stepped exactly and in blocks.

A car on a road is x' = A x + B u. Between two samples the input is known (a straight line), so the step can be taken
without error through the matrix exponential. Stepping sample by sample in Python is slow; but a stretch of steps can be
taken for all stretches of a drive at once, and only the state at the end of each has to be carried on.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_BLOCK = 16
_STEPS = np.arange(_BLOCK)


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


def straight_step(a: Array, b: Array, step_s: float) -> tuple[Array, Array, Array]:
    """F, G0, G1 of x[k+1] = F x[k] + G0 u[k] + G1 u[k+1], exact for an input that is a straight line over the step.

    For an input that is held over the step both ends are the same: F and G0 + G1.
    """
    n, m = b.shape
    bottom = np.block([[np.zeros((m, n + m)), np.eye(m) / step_s], [np.zeros((m, n + 2 * m))]])
    whole = matrix_exponential(np.vstack([np.block([a, b, np.zeros((n, m))]), bottom]) * step_s)
    end = whole[:n, n + m:]
    return whole[:n, :n], whole[:n, n:n + m] - end, end


def recursion(transition: Array, drive: Array, start: Array) -> Array:
    """States x[1] ... x[N] of x[k+1] = F x[k] + drive[k] from x[0] = start.

    transition (n, n), drive (N, n), start (n,); returns (N, n).

    The steps are cut into about sqrt(N) stretches of as many steps. What the drive alone does within a stretch is
    stepped through for all stretches at once; then the state is carried from stretch to stretch.
    """
    count, n = drive.shape
    length = max(1, int(np.sqrt(count)))
    stretches = -(-count // length)
    padded = np.zeros((stretches * length, n))
    padded[:count] = drive
    states = padded.reshape(stretches, length, n).swapaxes(0, 1).copy()  # (step, stretch, n)
    powers = np.empty((length, n, n))  # of the transition, transposed as rows are states
    powers[0] = transition.T
    for step in range(1, length):
        states[step] += states[step - 1] @ transition.T
        powers[step] = powers[step - 1] @ transition.T
    carried = np.empty((stretches, n))
    state = start
    for stretch in range(stretches):
        carried[stretch] = state
        state = states[-1, stretch] + state @ powers[-1]
    states += carried @ powers
    return states.swapaxes(0, 1).reshape(-1, n)[:count]


def driven_outputs(transition: Array, gain: Array, observe: Array, inputs: Array, start: Array) -> Array:
    """y[0] ... y[N] of x[k+1] = F x[k] + G v[k], y[k] = C x[k] from x[0] = start.

    transition (n, n), gain (n, m), observe (p, n), inputs v (N, m), start (n,); returns (N + 1, p).

    A block of L steps is one step of a bigger system with L times the inputs and outputs: one state in L is computed,
    and nearly all the work is three matrix products.
    """
    n, m = gain.shape
    p, count = len(observe), len(inputs)
    blocks = count // _BLOCK + 1
    padded = np.zeros((blocks * _BLOCK, m))
    padded[:count] = inputs
    rows = padded.reshape(blocks, _BLOCK * m)
    powers = np.empty((_BLOCK + 1, n, n))
    powers[0] = np.eye(n)
    for steps in range(_BLOCK):
        powers[steps + 1] = powers[steps] @ transition
    driven = powers[:-1] @ gain  # what an input does to the state so many steps after the next one
    to_end = driven[::-1].swapaxes(1, 2)
    seen = (observe @ powers[:-1]).transpose(2, 0, 1)
    answers = np.concatenate([observe @ driven, np.zeros((_BLOCK, p, m))])  # an input that is still to come: nothing
    through = answers[(_STEPS - _STEPS[:, None] - 1) % (2 * _BLOCK)].transpose(0, 3, 1, 2)
    states = np.empty((blocks, n))
    states[0] = start
    states[1:] = recursion(powers[-1], rows[:-1] @ to_end.reshape(-1, n), start)
    result = states @ seen.reshape(n, -1) + rows @ through.reshape(_BLOCK * m, -1)
    return result.reshape(-1, p)[: count + 1]
