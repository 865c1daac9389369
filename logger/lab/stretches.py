"""Which stretches of a run are fitted and which judge the fit, and how much a model leaves in each band of frequency.

Problem: a fit must be judged on what it has not seen, and the noise that a model leaves differs between runs and
between frequencies, so that its likelihood needs a level for each. Solution: every run is cut into stretches, two
thirds of its time to fit and one third to judge; what is left in each set is measured by Welch's method in bands, and
minus twice the logarithm of the likelihood of residuals whose level in each band is free is the sum of n ln P over the
bands (P. Whittle 1953, concentrated), with n = 2 B T the degrees of freedom of bandwidth B in the time T.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from logger.runs import Run

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

FIT_S, JUDGE_S = 12.0, 6.0
"""Stretches take turns: so long to fit, then so long to judge; in a shorter run, two thirds and one third of it."""
_BLOCK_S = 3.0
_HIGHEST_OF_RATE = 0.37
_NOTHING = 1e-12  # [m2/s4]
_ROUNDED = 1e-3  # samples: a rate is read off times that were rounded
# Ends of the bands at 100 samples a second [Hz].
_EDGES_HZ = (0.4, 1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 7.5, 9.0, 10.5, 12.0, 13.5, 15.0, 17.0, 19.0, 21.0, 23.0, 25.0, 27.5,
             30.0, 33.5, 37.0)
# Of the highest frequencies, where a car leaves nothing and the recorder's filter even less.
_QUIET_OF_RATE = (0.465, 0.5)


@dataclass(frozen=True, eq=False)
class Cells:
    """Residual power of a set of stretches in one run: bands (b,).

    power    mean power, as white noise of that level would have in all [m2/s4]
    freedom  degrees of freedom
    """

    power: Array
    freedom: Array

    @property
    def deviance(self) -> float:
        """Minus twice the log-likelihood, without its constant."""
        return float(self.freedom @ np.log(self.power))


class Stretches:
    """How one run is cut. What a model leaves counts as no less than ``least_mps2`` in any band [m/s2].

    fit          which of the samples that count are fitted (n,); the others judge
    judges       whether there are others
    first        the first sample that counts, of ``count`` in the run
    edges_hz     ends of the bands (b + 1,) [Hz]
    """

    def __init__(self, run: Run, whole: bool = False, least_mps2: float = 0.0) -> None:
        rate = run.rate_hz
        self.rate_hz, self.first, self.count = rate, run.first, run.count
        time_s = (np.arange(run.count - run.first) + _ROUNDED) / rate
        turn_s = min(FIT_S + JUDGE_S, len(time_s) / rate)
        half_s = 0.5 * _BLOCK_S  # blocks begin so far apart: one has to begin where judging does
        fit_s = half_s * round(turn_s * FIT_S / (FIT_S + JUDGE_S) / half_s)
        fit = np.mod(time_s, turn_s) < fit_s
        if whole or turn_s - fit_s < _BLOCK_S:
            fit = np.ones_like(fit)
        size = min(int(_BLOCK_S * rate + _ROUNDED), len(fit))
        self._size = size
        taper = np.hanning(size + 1)[:-1]
        self._taper = taper / np.sqrt((taper**2).mean())
        # The first samples at or behind these times, as where fitting and judging change.
        starts = np.ceil(np.arange(np.ceil(len(fit) / (half_s * rate)) + 1) * half_s * rate - _ROUNDED).astype(int)
        self._starts = starts[starts <= len(fit) - size]
        inside = np.array([fit[start : start + size].mean() for start in self._starts])
        self._sets = {True: self._starts[inside == 1], False: self._starts[inside == 0]}
        if not len(self._sets[True]):
            self._sets[True] = self._starts
        if not len(self._sets[False]):
            fit = np.ones_like(fit)
        self.fit: Bools = fit
        self.judges = bool(len(self._sets[False]))
        f_hz = np.fft.rfftfreq(size, 1 / rate)
        edges = np.array([one for one in _EDGES_HZ if one < _HIGHEST_OF_RATE * rate - 0.5] + [_HIGHEST_OF_RATE * rate])
        self.edges_hz = edges
        self._members = [np.flatnonzero((f_hz >= low) & (f_hz < high)) for low, high in pairwise(edges)]
        self._quiet = np.flatnonzero((f_hz >= _QUIET_OF_RATE[0] * rate) & (f_hz < _QUIET_OF_RATE[1] * rate))
        self._least_power = max(least_mps2**2, _NOTHING)
        self._width_hz = np.array([len(one) for one in self._members]) * rate / size

    def cells(self, residual: Array, fitted: bool | None = True) -> Cells:
        """Of a residual (n,), whole; of the stretches that were fitted, of those that judge, or (None) of all."""
        starts = self._starts if fitted is None else self._sets[fitted]
        if not len(starts):  # no stretch judges
            return Cells(np.ones(len(self._members)), np.zeros(len(self._members)))
        spectrum = self._spectrum(residual, starts)
        power = np.array([spectrum[one].mean() for one in self._members])
        span_s = len(self.fit) if fitted is None else (self.fit == fitted).sum()
        return Cells(np.maximum(power, self._least_power), 2 * self._width_hz * span_s / self.rate_hz)

    def quiet(self, residual: Array) -> tuple[float, float]:
        """Mean power of a residual where nothing but the sensor's noise is, as if it were white, and its freedom."""
        spectrum = self._spectrum(residual, self._starts)
        freedom = 2 * len(self._quiet) * self.rate_hz / self._size * len(self.fit) / self.rate_hz
        return float(spectrum[self._quiet].mean()), freedom

    def _spectrum(self, residual: Array, starts: npt.NDArray[np.intp]) -> Array:
        """Mean power per frequency, scaled so that white noise has its variance at each."""
        kept = residual[self.first:]
        blocks = np.lib.stride_tricks.sliding_window_view(kept, self._size)[starts]
        return np.asarray((np.abs(np.fft.rfft(blocks * self._taper, axis=1)) ** 2).mean(axis=0) / self._size)


class Whitener:
    """Weighs each band of one run's residual by what is left there, and keeps the fitted stretches, or all."""

    def __init__(self, stretches: Stretches, cells: Cells, whole: bool = False) -> None:
        self._first = stretches.first
        self._fit = np.ones_like(stretches.fit) if whole else stretches.fit
        count = stretches.count - stretches.first
        f_hz = np.fft.rfftfreq(count, 1 / stretches.rate_hz)
        edges = stretches.edges_hz
        middle = 0.5 * (edges[1:] + edges[:-1])
        level = np.exp(np.interp(f_hz, middle, np.log(cells.power)))
        self._gain = np.where((f_hz >= edges[0]) & (f_hz < edges[-1]), 1 / np.sqrt(level), 0.0)
        self._count = count

    def __call__(self, samples: Array) -> Array:
        """(n,) or (columns, n), whole, to the samples that are kept (..., kept), in units of the noise."""
        part = samples[..., self._first:]
        white = np.fft.irfft(np.fft.rfft(part, axis=-1) * self._gain, self._count, axis=-1)
        return np.asarray(white[..., self._fit])


def unseen_in(stretches: Sequence[Stretches]) -> list[Bools]:
    """Which of the samples that count no fit saw (n,), per run; all, where nothing was kept from the fits."""
    if not any(one.judges for one in stretches):
        return [np.ones_like(one.fit) for one in stretches]
    return [~one.fit for one in stretches]


def deviance(cells: Sequence[Cells]) -> float:
    """Of several runs together."""
    return sum(one.deviance for one in cells)
