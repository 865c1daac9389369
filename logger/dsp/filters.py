"""Filters on streams: second-order sections with numpy alone, Butterworth's, a sinc in a Kaiser window, one that thins.

Problem: a recursive filter needs its last output before it can give the next one, which in Python means a loop per
sample; and a stream arrives in pieces of any length, while the log made from it must not depend on the pieces, not
even in the last bit.

Solution: the cascade is written once as one state-space system, and its work over a fixed block of 64 samples as
one matrix: outputs and next state = step @ [inputs, state]. The inputs of the current block are kept, zero where
they have not arrived. The matrix is causal, so a zero to come only ever meets a zero of the matrix, and adding
zeros is exact: a row has the same bits whether the rest of its block has arrived or not. Every evaluation is the same
product of the same shape, so no split of the input can change a bit, and no sample waits for its block to fill.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Literal

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Complex

SectionRows = Array | Sequence[Sequence[float]]

BLOCK = 64


def _checked_rows(sos: SectionRows) -> Array:
    rows = np.asarray(sos, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 6 or len(rows) == 0:
        raise ValueError(f"sections must be rows of 6 coefficients, not an array of shape {rows.shape}")
    return rows / rows[:, 3:4]


def _state_space(rows: Array) -> tuple[Array, Array, Array, float]:
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


def _block_step(A: Array, B: Array, C: Array, D: float) -> Array:
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

    def process(self, x: Array) -> Array:
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


def frequency_response(sos: SectionRows, f_hz: npt.ArrayLike, fs_hz: float) -> Complex:
    """Complex response of the sections at the frequencies ``f_hz`` [Hz] when run at ``fs_hz`` [Hz]."""
    delay = np.exp(-2j * np.pi * np.asarray(f_hz, dtype=np.float64) / fs_hz)
    response = np.ones_like(delay)
    for b0, b1, b2, a0, a1, a2 in np.asarray(sos, dtype=np.float64):
        response *= (b0 + delay * (b1 + delay * b2)) / (a0 + delay * (a1 + delay * a2))
    return response


def butterworth_sos(kind: Literal["low", "high"], cutoff_hz: float, fs_hz: float) -> Array:
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


_NYQUIST = 0.4999


def butterworth(order: int, s: Complex, cutoff_hz: float, sampled_hz: float = 0.0) -> Complex:
    """What an oscillation exp(s t) is multiplied by, s (...) [1/s]: with x = s / (2 pi cutoff) the product of
    1 / (1 + 2 sin((2 k - 1) pi / (2 n)) x + x^2) over k = 1 ... n / 2, and of 1 / (1 + x) where the order n is odd.

    sampled_hz    samples a second that the filter is run on: x = tanh(s / 2 r) / tan(pi cutoff / r), the bilinear
                  transform (A. Oppenheim and R. Schafer, Discrete-Time Signal Processing, 7.2); a cut-off beyond half
                  of them passes all. 0: it is none that is run on samples
    """
    x = s / (2 * np.pi * cutoff_hz)
    if sampled_hz:
        x = np.tanh(s / (2 * sampled_hz)) / np.tan(np.pi * min(cutoff_hz / sampled_hz, _NYQUIST))
    result = 1 / (1 + x) if order % 2 else np.ones_like(x)
    for k in range(1, order // 2 + 1):
        result = result / (1 + 2 * np.sin((2 * k - 1) * np.pi / (2 * order)) * x + x * x)
    return np.asarray(result)



_SAMPLES_PER_PERIOD = 2.5
STOP_DB = 60.0


def kaiser_half_length(stop_db: float, width: float) -> float:
    """Samples, not rounded, on either side of the middle of a filter whose transition is ``width`` wide [rad/sample]
    and ends so many dB down."""
    return (stop_db - 7.95) / (2.285 * width) / 2


def beta(stop_db: float) -> float:
    """Shape of the window whose side lobes are so many dB down."""
    return 0.1102 * (stop_db - 8.7)


def low_pass_taps(half: int, steps: int, cutoff: float, stop_db: float) -> Array:
    """Filter (2 half + 1,), symmetric, its sum 1, for taking one sample in ``steps``: half the amplitude at ``cutoff``
    [of half the rate that is left].

    J. F. Kaiser, Nonrecursive digital filter design using the I0-sinh window function (1974); Oppenheim and Schafer,
    Discrete-Time Signal Processing, 7.6. A transition of width w [rad/sample] that ends A dB down takes (A - 7.95) /
    (2.285 w) steps and a window of beta = 0.1102 (A - 8.7), for A above 50.
    """
    taps = np.sinc(cutoff * (np.arange(-half, half + 1) / steps)) * np.kaiser(2 * half + 1, beta(stop_db))
    return np.asarray(taps / taps.sum())


def kaiser_window(offset: Array, half: float, stop_db: float) -> Array:
    """The Kaiser window at any offsets from its middle, 0 beyond ``half``."""
    inside = np.clip(1 - (offset / half) ** 2, 0.0, None)
    return np.asarray(np.i0(beta(stop_db) * np.sqrt(inside)) / np.i0(beta(stop_db)))


@dataclass(frozen=True)
class DecimatingLowPass:
    """Passes up to ``cutoff_hz`` of a record at ``rate_hz``; None passes all and keeps every sample.

    Problem: a filter alone (the 20 Hz of 6.2.1 of Blum 2015) leaves samples that hardly differ from their neighbours,
    and whatever weighs residuals afterwards takes the emptied band for certainty. Solution: behind the filter only as
    many samples are kept as the band needs, two and a half per period of its upper edge; what was independent stays
    nearly so. Measurement and prediction go through the same filter, so its shape biases nothing.

    ValueError for a cut-off that is not above 0 and below half the rate.
    """

    rate_hz: float
    cutoff_hz: float | None = None

    def __post_init__(self) -> None:
        if self.cutoff_hz is not None and not 0 < self.cutoff_hz < self.rate_hz / 2:
            raise ValueError(f"low-pass: expected above 0 and below {self.rate_hz / 2:g} Hz, found {self.cutoff_hz:g}")

    @property
    def kept_hz(self) -> float:
        """Rate of what comes out."""
        return self.rate_hz if self.cutoff_hz is None else min(self.rate_hz, _SAMPLES_PER_PERIOD * self.cutoff_hz)

    @property
    def reach(self) -> int:
        """How many samples the filter looks back and ahead, in all."""
        return 0 if self.cutoff_hz is None else 2 * self._half

    def apply(self, samples: Array) -> Array:
        """What is left (m, ...) of samples (n, ...); the ends, where the filter would look outside, are left out.

        ValueError unless they are more than its ``reach``.
        """
        if self.cutoff_hz is None:
            return samples
        half = self._half
        if len(samples) <= self.reach:
            raise ValueError(f"low-pass: expected more than {self.reach} samples, found {len(samples)}")
        at = np.arange(half, len(samples) - half - 0.5, self.rate_hz / self.kept_hz)
        nearest = np.rint(at).astype(int)
        offsets = np.arange(-half, half + 1)
        weights = self._kernel(offsets + (nearest - at)[:, None])
        weights /= weights.sum(axis=1, keepdims=True)
        kept = np.zeros((len(at), *samples.shape[1:]))
        for offset, weight in zip(offsets, weights.T, strict=True):
            kept += (samples[nearest + offset].T * weight).T
        return kept

    def gain(self, f_hz: Array) -> Array:
        """The filter's gain at frequencies before it (f,)."""
        if self.cutoff_hz is None:
            return np.ones_like(f_hz)
        taps = self._kernel(np.arange(-self._half, self._half + 1.0))
        lags = np.arange(1, self._half + 1)
        both = taps[self._half] + 2 * np.cos(2 * np.pi * np.outer(f_hz, lags) / self.rate_hz) @ taps[self._half + 1:]
        return np.asarray(both / taps.sum())

    @property
    def _edges(self) -> tuple[float, float]:
        """The end of what passes and the beginning of what does not; half way lies half the kept rate."""
        assert self.cutoff_hz is not None
        return self.cutoff_hz, self.kept_hz - self.cutoff_hz

    @property
    def _half(self) -> int:
        pass_hz, stop_hz = self._edges
        return ceil(kaiser_half_length(STOP_DB, 2 * np.pi * (stop_hz - pass_hz) / self.rate_hz))

    def _kernel(self, place: Array) -> Array:
        """The filter at places counted in samples from its middle."""
        window = kaiser_window(place, self._half + 1, STOP_DB)
        return np.asarray(np.sinc(sum(self._edges) / self.rate_hz * place) * window)
