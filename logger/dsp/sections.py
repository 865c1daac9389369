"""Second-order sections that run on a stream, with numpy alone.

Problem: a recursive filter needs its last output before it can give the next one, which in Python means a loop per
sample; and a stream arrives in pieces of any length, while the log made from it must not depend on the pieces, not
even in the last bit.

Solution: the cascade is written once as one state-space system, and its work over a fixed block of 64 samples as
one matrix: outputs and next state = step @ [inputs, state]. The inputs of the current block are kept, zero where
they have not arrived. The matrix is causal, so a zero to come only ever meets a zero of the matrix, and adding
zeros is exact: a row has the same bits whether the rest of its block has arrived or not. Every evaluation is the same
product of the same shape, so no split of the input can change a bit, and no sample waits for its block to fill.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
SectionRows = npt.NDArray[np.float64] | Sequence[Sequence[float]]

BLOCK = 64


def _checked_rows(sos: SectionRows) -> Floats:
    rows = np.asarray(sos, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 6 or len(rows) == 0:
        raise ValueError(f"sections must be rows of 6 coefficients, not an array of shape {rows.shape}")
    return rows / rows[:, 3:4]


def _state_space(rows: Floats) -> tuple[Floats, Floats, Floats, float]:
    """The cascade as x' = A x + B u, y = C x + D u; two states per section, transposed direct form II."""
    size = 2 * len(rows)
    A, B, C, D = np.zeros((size, size)), np.zeros(size), np.zeros(size), 1.0
    for number, (b0, b1, b2, _, a1, a2) in enumerate(rows):
        at = 2 * number
        # the section's input is the cascade so far: C x + D u
        into = np.array([b1 - a1 * b0, b2 - a2 * b0])
        A[at : at + 2] = np.outer(into, C)
        A[at : at + 2, at : at + 2] = [[-a1, 1.0], [-a2, 0.0]]
        B[at : at + 2] = into * D
        C, D = b0 * C, b0 * D
        C[at] = 1.0
    return A, B, C, D


def _block_step(A: Floats, B: Floats, C: Floats, D: float) -> Floats:
    """(BLOCK + n, BLOCK + n) matrix taking [inputs of a block, state] to [outputs of the block, next state]."""
    size = len(B)
    step = np.zeros((BLOCK + size, BLOCK + size))
    impulse = np.empty(BLOCK)
    impulse[0] = D
    reach, power = B.copy(), np.eye(size)
    for row in range(BLOCK):
        step[row, BLOCK:] = C @ power
        step[BLOCK:, BLOCK - 1 - row] = reach
        if row + 1 < BLOCK:
            impulse[row + 1] = C @ reach
        reach, power = A @ reach, A @ power
    step[BLOCK:, BLOCK:] = power
    for column in range(BLOCK):
        step[column:BLOCK, column] = impulse[: BLOCK - column]
    return step


class BlockFilter:
    """A cascade of second-order sections that keeps its state between calls.

    sos: (n, 6) rows b0, b1, b2, a0, a1, a2, stable. Raises ValueError for another shape. Inputs have to be finite:
    a NaN would spoil the block it stands in and everything after it.
    """

    def __init__(self, sos: SectionRows) -> None:
        self._A, self._B, C, D = _state_space(_checked_rows(sos))
        self._step = _block_step(self._A, self._B, C, D)
        self._filled = 0
        self._inputs_state = np.zeros(len(self._step))

    def reset(self, value: float = 0.0) -> None:
        """Forget the past: start as if the input had been ``value`` for ever."""
        rest = np.linalg.solve(np.eye(len(self._B)) - self._A, self._B * value)
        self._filled = 0
        self._inputs_state[:BLOCK] = 0.0
        self._inputs_state[BLOCK:] = rest

    def process(self, x: Floats) -> Floats:
        """Filter the next samples, (n,) -> (n,), without delay; any split of a stream gives the same bits."""
        y = np.empty(len(x))
        done = 0
        while done < len(x):
            start = self._filled
            stop = min(BLOCK, start + len(x) - done)
            self._inputs_state[start:stop] = x[done : done + stop - start]
            outputs_state = self._step @ self._inputs_state
            y[done : done + stop - start] = outputs_state[start:stop]
            done += stop - start
            if stop == BLOCK:
                self._inputs_state[:BLOCK] = 0.0
                self._inputs_state[BLOCK:] = outputs_state[BLOCK:]
                stop = 0
            self._filled = stop
        return y


def frequency_response(sos: SectionRows, f_hz: npt.ArrayLike, fs_hz: float) -> npt.NDArray[np.complex128]:
    """Complex response of the sections at the frequencies ``f_hz`` [Hz] when run at ``fs_hz`` [Hz]."""
    delay = np.exp(-2j * np.pi * np.asarray(f_hz, dtype=np.float64) / fs_hz)
    response = np.ones_like(delay)
    for b0, b1, b2, a0, a1, a2 in np.asarray(sos, dtype=np.float64):
        response *= (b0 + delay * (b1 + delay * b2)) / (a0 + delay * (a1 + delay * a2))
    return response


def butterworth_sos(kind: Literal["low", "high"], cutoff_hz: float, fs_hz: float) -> Floats:
    """One second-order Butterworth section, (1, 6), -3 dB exactly at ``cutoff_hz`` [Hz] for the rate ``fs_hz`` [Hz].

    Bilinear transform with prewarping (Oppenheim and Schafer, Discrete-Time Signal Processing, 7.2.2). Raises
    ValueError for a cutoff outside (0, fs/2) or another kind.
    """
    if not 0.0 < cutoff_hz < fs_hz / 2:
        raise ValueError(f"a cutoff of {cutoff_hz} Hz does not lie between 0 and half of {fs_hz} Hz")
    k = math.tan(math.pi * cutoff_hz / fs_hz)
    norm = 1.0 + math.sqrt(2.0) * k + k * k
    a1, a2 = 2.0 * (k * k - 1.0) / norm, (1.0 - math.sqrt(2.0) * k + k * k) / norm
    if kind == "low":
        gain, middle = k * k / norm, 2.0
    elif kind == "high":
        gain, middle = 1.0 / norm, -2.0
    else:
        raise ValueError(f"a Butterworth section is 'low' or 'high', not {kind!r}")
    return np.array([[gain, middle * gain, gain, 1.0, a1, a2]])
