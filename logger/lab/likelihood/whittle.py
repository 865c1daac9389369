"""The likelihood of a run's residuals, whose level is free in each band of frequency.

Problem: the noise that a model leaves differs between runs and between frequencies, and no model of a car is exact.
Solution: residual power is measured by Welch's method in bands. With a free level in each, minus twice the logarithm of
the likelihood is the sum of n ln P over the bands (P. Whittle 1953, concentrated), n = 2 B T being the degrees of
freedom of bandwidth B in the time T. No level is below the discrepancy between two right simulations of a car, which is
a share of what was measured in the same band. Bands end where the run's pass band does: what was filtered away by
somebody, or shall not be compared, tells nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

import numpy as np
import numpy.typing as npt

from logger.dsp.pass_band import HALF_WIDTH_HZ
from logger.runs import READING, Run

Array = npt.NDArray[np.float64]

DISCREPANCY = 0.003
"""By what share of the signal in a band two right simulations of one car may differ. They differ most where a car has
dry friction, whose force comes late by part of a step. A judgement: with 1 %, searches called right models unexplained.
"""
BLOCK_S = 3.0
"""Of Welch's method: a resolution of a third of a hertz, where the narrowest band has 0.6."""
HIGHEST_OF_RATE = 0.37
"""Above it recorders' filters take away what no two of them take away alike."""
LOWEST_HZ = 0.4
"""Below it nothing is judged: a car hardly accelerates there, and sensors drift."""
# Least deviations: of the sensor's acceleration, and of another signal as a share of its own.
_LEAST_MPS2, _LEAST_SHARE = 1e-6, 1e-6
_ROUNDED = 1e-3  # samples: a rate is read off times that were rounded
# Ends of the bands at 100 samples a second [Hz].
_EDGES_HZ = (LOWEST_HZ, 1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 7.5, 9.0, 10.5, 12.0, 13.5, 15.0, 17.0, 19.0, 21.0, 23.0, 25.0,
             27.5, 30.0, 33.5, 37.0)
# Of a rig, whose wheels may hop above all that cars do, they go on as wide for their frequency.
_MORE_EDGES_HZ = tuple(37.0 * (37.0 / 33.5) ** number for number in range(1, 60))
# Of the highest frequencies, where a car leaves nothing and the recorder's filter even less.
_QUIET_OF_RATE = (0.465, 0.5)


class Bands:
    """The bands of one run: of its sensor's acceleration, or of one of its other signals.

    edges_hz    their ends (b + 1,) [Hz]
    freedom     degrees of freedom of each (b,)
    floor       the least level of each (b,) [m2/s4, or the square of another unit], as white noise of that level would
                have in all
    """

    def __init__(self, run: Run, signal: int | None = None) -> None:
        rate = run.rate_hz
        self.rate_hz, self.first, self.count = rate, run.first, run.count
        kept = run.count - run.first
        size = min(int(BLOCK_S * rate + _ROUNDED), kept)
        self._size = size
        taper = np.hanning(size + 1)[:-1]
        self._taper = taper / np.sqrt((taper**2).mean())
        starts = np.ceil(np.arange(0, kept, 0.5 * BLOCK_S * rate) - _ROUNDED).astype(int)
        self._starts = starts[starts <= kept - size]
        f_hz = np.fft.rfftfreq(size, 1 / rate)
        band_hz = run.pass_band_hz if signal is None else (0.0, rate / 2)
        edges = _edges_hz(run, band_hz)
        self.edges_hz = edges
        self._members = [np.flatnonzero((f_hz >= low) & (f_hz < high)) for low, high in pairwise(edges)]
        passed = band_hz[1] >= rate / 2
        self._quiet = np.flatnonzero((f_hz >= _QUIET_OF_RATE[0] * rate) & (f_hz < _QUIET_OF_RATE[1] * rate) & passed)
        # What was not read, or clipped, leaves zeros.
        self._share = 1.0 if run.usable is None else max(float(np.mean(run.usable[run.first:] == READING)), 1 / kept)
        self.freedom = 2 * np.array([len(one) for one in self._members]) / size * kept * self._share
        measured = (run.measured_mps2 if signal is None else run.more[signal]) * run.read
        least = _LEAST_MPS2**2 if signal is None else _LEAST_SHARE**2 * float(measured.var())
        self.floor = np.maximum(DISCREPANCY**2 * self.power(measured), least)

    def power(self, residual: Array) -> Array:
        """Mean power (b,) of a residual (n,), whole, as if it were white [m2/s4]."""
        spectrum = self._spectrum(residual)
        return np.array([spectrum[one].mean() for one in self._members])

    def levels(self, residual: Array) -> Array:
        """The most likely levels (b,) under a residual (n,)."""
        return np.maximum(self.power(residual), self.floor)

    def deviance(self, residual: Array) -> float:
        """Minus twice the log-likelihood of a residual (n,), without its constant."""
        power = self.power(residual)
        level = np.maximum(power, self.floor)
        return float(self.freedom @ (np.log(level) + power / level - 1))

    def quiet(self, residual: Array) -> tuple[float, float]:
        """Mean power of a residual where nothing but the sensor's noise is, as if it were white, and its freedom; both
        0 where that is outside of the pass band."""
        if not len(self._quiet):
            return 0.0, 0.0
        freedom = 2 * len(self._quiet) / self._size * (self.count - self.first) * self._share
        return float(self._spectrum(residual)[self._quiet].mean()), freedom

    def whitener(self, residual: Array) -> Whitener:
        """Weights by the levels under a residual (n,)."""
        return Whitener(self, self.levels(residual))

    def _spectrum(self, residual: Array) -> Array:
        """Mean power per frequency, scaled so that white noise has its variance at each."""
        blocks = np.lib.stride_tricks.sliding_window_view(residual[self.first:], self._size)[self._starts]
        power = (np.abs(np.fft.rfft(blocks * self._taper, axis=1)) ** 2).mean(axis=0)
        return np.asarray(power / (self._size * self._share))


def _edges_hz(run: Run, band_hz: tuple[float, float]) -> Array:
    """Ends of a run's bands (b + 1,) within its pass band, one band at least [Hz]. At an end of the pass band the
    filter that ends it takes something away already."""
    ends_hz = (*_EDGES_HZ, *_MORE_EDGES_HZ) if run.timed else _EDGES_HZ
    low_hz, high_hz = band_hz
    high_hz = min(high_hz - HALF_WIDTH_HZ if high_hz < run.rate_hz / 2 else high_hz, HIGHEST_OF_RATE * run.rate_hz)
    low_hz = max(low_hz + min(HALF_WIDTH_HZ, 0.5 * low_hz), ends_hz[0])
    inside = [one for one in ends_hz if low_hz + 0.5 < one < high_hz - 0.5]
    return np.array([low_hz, *inside, max(high_hz, low_hz + 1.0)])


class Whitener:
    """Weighs each band of one run by its level."""

    def __init__(self, bands: Bands, levels: Array) -> None:
        from scipy.fft import next_fast_len

        self._first, self._count = bands.first, bands.count - bands.first
        self._padded = next_fast_len(self._count, real=True)
        f_hz = np.fft.rfftfreq(self._padded, 1 / bands.rate_hz)
        edges = bands.edges_hz
        self._inside = slice(*np.searchsorted(f_hz, edges[[0, -1]]))
        middle = 0.5 * (edges[1:] + edges[:-1])
        self._gain = np.exp(-0.5 * np.interp(f_hz[self._inside], middle, np.log(levels)))

    def __call__(self, samples: Array) -> Array:
        """(n,) or (columns, n), whole, to numbers (..., kept) whose products are those of the whitened samples that
        count, in units of the noise: Parseval's theorem, without the frequencies that no band has."""
        both_sides = np.sqrt(2 / self._padded)
        return (self._spectrum(samples) * (both_sides * self._gain)).view(float)

    def in_time(self, samples: Array) -> Array:
        """(n,) or (columns, n), whole, to the samples that count (..., n - first), in units of the noise."""
        spectrum = np.zeros((*samples.shape[:-1], self._padded // 2 + 1), complex)
        spectrum[..., self._inside] = self._spectrum(samples) * self._gain
        return np.fft.irfft(spectrum, self._padded, axis=-1)[..., : self._count]

    def _spectrum(self, samples: Array) -> npt.NDArray[np.complex128]:
        """Of the samples that count, where there are bands."""
        return np.fft.rfft(samples[..., self._first:], self._padded, axis=-1)[..., self._inside]


class Judge(Protocol):
    """What tells how likely residuals are: the bands of one signal, or of several."""

    def deviance(self, residual: Array) -> float:
        """As ``Bands``."""


def deviance(bands: Sequence[Judge], residuals: Sequence[Array]) -> float:
    """Of several runs together."""
    return sum(one.deviance(residual) for one, residual in zip(bands, residuals, strict=True))
