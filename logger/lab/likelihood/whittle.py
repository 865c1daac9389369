"""The likelihood of a run's residuals, whose level is free: on a road in each band of frequency, on a rig in all.

Problem: the noise that a model leaves differs between runs and between frequencies, and no model of a car is exact.
Solution: residual power is measured by Welch's method in bands. With a free level in each, minus twice the logarithm of
the likelihood is the sum of n ln P over the bands (P. Whittle 1953, concentrated), n = 2 B T being the degrees of
freedom of bandwidth B in the time T. No level is below the discrepancy between two right simulations of a car, which is
a share of what was measured in the same band. A rig is moved in few bands, and what no model of it explains is most
where it moves most: levels of its own for each would give up the bands that say most, and numbers would follow from
what is left (measured: a friction axis came out with 7 % too much damping, a beam with twice the error). So a signal of
a rig has one level, and a fit is one by least squares (L. Ljung, System Identification, 1999: output error). Bands end
where the run's pass band does: what somebody filtered away, or what shall not be compared, holds no information.
"""

from __future__ import annotations

from copy import copy
from itertools import count, pairwise, takewhile
from typing import TYPE_CHECKING

import numpy as np

from logger.arrays import Array, Complex
from logger.bounds import DISCREPANCY, EVEN_SAMPLES, QUIETEST_MPS2
from logger.dsp.whole_record import HALF_WIDTH_HZ
from logger.runs import READING, Run, Signal

if TYPE_CHECKING:
    from scipy.sparse import csr_array

UNEXPLAINED = 0.10
"""A residual above the noise by this share of it, or more, is unexplained. A judgement: a fifth of the noise's
power."""
BLOCK_S = 3.0
"""Length of a block of Welch's method: a resolution of a third of a hertz, where the narrowest band has 0.6."""
HIGHEST_OF_RATE = 0.37
"""Share of the rate up to which records are compared: above it recorders' filters differ. Below
``resample.PASS_OF_RATE``, up to which a usual filter is flat."""
LOWEST_HZ = 0.4
"""Accelerations are not compared below: a car hardly accelerates there, and sensors drift."""
# Least noise of another signal than the sensor's acceleration, as a share of its own deviation: simulated records
# without noise need a level above 0.
_LEAST_SHARE = 1e-6
# Edges of the bands at 100 samples a second [Hz]: from half of the frequency wide at the bottom to a tenth at the top,
# as resonances with a damping ratio of 0.3 (the body) and 0.1 (the wheels) are.
_EDGES_HZ = (LOWEST_HZ, 1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 7.5, 9.0, 10.5, 12.0, 13.5, 15.0, 17.0, 19.0, 21.0, 23.0, 25.0,
             27.5, 30.0, 33.5, 37.0)
# Stretches in which a long run is whitened for the products of its columns; there a whitened sample is made of those of
# a block before and after it. Measured beside the dense Gaussian likelihood (120 s of a car with and without friction),
# whole or in stretches of 20 to 60 s: standard errors are right within 0.1 %, the log of the determinant within 0.005.
# Squares of what the ends of a record cut off are 3 to 40 % too large, but hold next to nothing. The shorter a stretch,
# the less time it takes, down to some 15 s, where the ends take more (measured).
_WHOLE_S, _STRETCH_S = 60.0, 20.0
# Shares of the rate between which neither a car nor the recorder's filter leaves anything (``simulate.recorder_gain``).
_NOISE_BAND_OF_RATE = (0.465, 0.5)


class Bands:
    """The bands of one run: of its sensor's acceleration, or of one of its other signals.

    edges_hz    (b + 1,) [Hz]
    freedom     degrees of freedom of each band (b,)
    one_level   whether all bands have one level, as on a rig
    floor       least level of each band (b,), as the variance of white noise of that level [m2/s4, or the square of
                another unit]
    """

    def __init__(self, run: Run, signal: int | None = None) -> None:
        rate = run.rate_hz
        self.rate_hz, self.first, self.count = rate, run.first, run.count
        kept = run.count - run.first
        size = min(int(BLOCK_S * rate + EVEN_SAMPLES), kept)
        self._size = size
        taper = np.hanning(size + 1)[:-1]
        self._taper = taper / np.sqrt((taper**2).mean())
        starts = np.ceil(np.arange(0, kept, 0.5 * BLOCK_S * rate) - EVEN_SAMPLES).astype(int)
        self._starts = starts[starts <= kept - size]
        f_hz = np.fft.rfftfreq(size, 1 / rate)
        band_hz = run.pass_band_hz if signal is None else (0.0, rate / 2)
        edges = _edges_hz(run, band_hz, run.facts.main if signal is None else run.signals[signal])
        # A run of a second has lines 1 Hz apart: a band that holds none belongs to the one below.
        held = np.diff(np.searchsorted(f_hz, edges)) > 0
        edges = np.array([edges[0], *edges[:-1][held][1:], edges[-1]])
        self.edges_hz = edges
        self._members = [np.flatnonzero((f_hz >= low) & (f_hz < high)) for low, high in pairwise(edges)]
        passed = band_hz[1] >= rate / 2
        low, high = (share * rate for share in _NOISE_BAND_OF_RATE)
        self._noise_lines = np.flatnonzero((f_hz >= low) & (f_hz < high) & passed)
        # Residuals are 0 where nothing was read, or a reading was clipped.
        self._share = 1.0 if run.usable is None else max(float(np.mean(run.usable[run.first:] == READING)), 1 / kept)
        self.freedom = 2 * np.array([len(one) for one in self._members]) / size * kept * self._share
        measured = (run.measured_mps2 if signal is None else run.more[signal]) * run.read
        least = QUIETEST_MPS2**2 if signal is None else _LEAST_SHARE**2 * float(measured.var())
        self.floor = np.maximum(DISCREPANCY**2 * self.power(measured), least)
        self.one_level = run.timed

    def power(self, residual: Array) -> Array:
        """Mean power (b,) of a residual (n,), whole, as if it were white [m2/s4]."""
        spectrum = self._spectrum(residual)
        return np.array([spectrum[one].mean() for one in self._members])

    def block_powers(self, samples: Array) -> Array:
        """Power (blocks, b) of samples (n,), whole, in each block of Welch's method as if they were white; blocks
        overlap by half."""
        spectra = self._spectra(samples)
        return np.stack([spectra[:, one].mean(axis=1) for one in self._members], axis=1)

    def levels(self, residual: Array) -> Array:
        """The most likely noise levels (b,) under a residual (n,)."""
        return self._levels(self.power(residual))

    def _levels(self, power: Array) -> Array:
        """The same under the power (b,) of a residual."""
        free = np.full_like(power, np.average(power, weights=self.freedom)) if self.one_level else power
        return np.maximum(free, self.floor)

    def deviance(self, residual: Array) -> float:
        """Minus twice the log-likelihood of a residual (n,), without its constant."""
        power = self.power(residual)
        level = self._levels(power)
        return float(self.freedom @ (np.log(level) + power / level - 1))

    def noise_band_power(self, residual: Array) -> tuple[float, float]:
        """Mean power of a residual at the highest frequencies, where only the sensor's noise is, as if it were white,
        and its degrees of freedom; both 0 where these are outside of the pass band."""
        if not len(self._noise_lines):
            return 0.0, 0.0
        freedom = 2 * len(self._noise_lines) / self._size * (self.count - self.first) * self._share
        return float(self._spectrum(residual)[self._noise_lines].mean()), freedom

    def whitener(self, residual: Array) -> Whitener:
        """The whitening filter for the levels under a residual (n,)."""
        return Whitener(self, self.levels(residual))

    def scatter_whitener(self, residual: Array, carried: Array) -> Whitener:
        """A filter after which the products of columns are their scores' covariance: of fits that weigh samples by the
        levels under a residual (n,), whose noise has its power in each band but for that (b,) which came in with the
        measured input."""
        noise = np.maximum(self.power(residual) - carried, self.floor)
        return Whitener(self, self.levels(residual) ** 2 / noise)

    def flat_whitener(self, samples: Array) -> Whitener:
        """A filter that weighs all bands alike, in units of the r.m.s. of samples (n,) in them."""
        power = float(np.average(self.levels(samples), weights=self.freedom))
        return Whitener(self, np.full(len(self.floor), power))

    def _spectrum(self, residual: Array) -> Array:
        """Mean power per frequency, scaled so that white noise has its variance at each."""
        return np.asarray(self._spectra(residual).mean(axis=0))

    def _spectra(self, residual: Array) -> Array:
        """The same of each block (blocks, f)."""
        blocks = np.lib.stride_tricks.sliding_window_view(residual[self.first:], self._size)[self._starts]
        return np.asarray(np.abs(np.fft.rfft(blocks * self._taper, axis=1)) ** 2 / (self._size * self._share))


def _edges_hz(run: Run, band_hz: tuple[float, float], of: Signal) -> Array:
    """Edges of a run's bands (b + 1,) within its pass band, one band at least [Hz]. They stop short of an end of the
    pass band, where its filter begins to act. On a rig, whose wheels may hop above all that cars do, bands of the last
    relative width go on up to there; and forces and places, which are as large in slow motions as in quick ones, are
    compared from 0 on."""
    low_hz, high_hz = band_hz
    high_hz = min(high_hz - HALF_WIDTH_HZ if high_hz < run.rate_hz / 2 else high_hz, HIGHEST_OF_RATE * run.rate_hz)
    widening, top_hz = _EDGES_HZ[-1] / _EDGES_HZ[-2], _EDGES_HZ[-1]
    more_hz = (top_hz * widening**number for number in count(1))
    ends_hz = (*_EDGES_HZ, *takewhile(lambda one: one < high_hz, more_hz)) if run.timed else _EDGES_HZ
    lowest_hz = LOWEST_HZ if of.may_drift or not run.timed else 0.0
    low_hz = max(low_hz + min(HALF_WIDTH_HZ, 0.5 * low_hz), lowest_hz)
    inside = [one for one in ends_hz if low_hz + 0.5 < one < high_hz - 0.5]
    return np.array([low_hz, *inside, max(high_hz, low_hz + 1.0)])


class Whitener:
    """Whitens the samples of one run: divides each band by the root of its level."""

    def __init__(self, bands: Bands, levels: Array) -> None:
        from scipy.fft import next_fast_len

        self._bands, self._levels = bands, levels
        self._first, self._count = bands.first, bands.count - bands.first
        self._padded = next_fast_len(self._count, real=True)
        f_hz = np.fft.rfftfreq(self._padded, 1 / bands.rate_hz)
        edges = bands.edges_hz
        self._inside = slice(*np.searchsorted(f_hz, edges[[0, -1]]))
        middle = 0.5 * (edges[1:] + edges[:-1])
        self._gain = np.exp(-0.5 * np.interp(f_hz[self._inside], middle, np.log(levels)))
        # Parseval's theorem: each frequency but 0 stands for its negative as well.
        self._sides = np.sqrt(np.where(f_hz[self._inside] > 0, 2.0, 1.0) / self._padded)

    @property
    def kept(self) -> int:
        """Number of the numbers that whitened samples are."""
        return 2 * len(self._gain)

    def __call__(self, samples: Array) -> Array:
        """Samples (n,) or (columns, n), whole, as numbers (..., kept) whose products are those of the whitened samples
        that count, in units of the noise, without the frequencies outside of all bands."""
        return (self._spectrum(samples) * (self._sides * self._gain)).view(float)

    def line_deviances(self, samples: Array) -> Array:
        """Minus twice the log-likelihood of each line of the spectrum (kept / 2,) of samples (n,), whole, at its level;
        without its constant."""
        return (self(samples)**2).reshape(-1, 2).sum(axis=1) - 4 * np.log(self._gain)

    def adjoint(self, white: Array) -> Array:
        """Samples (..., n), whole, whose products with other samples are those of numbers (..., kept) with these
        whitened."""
        found = np.zeros((*white.shape[:-1], self._first + self._count))
        found[..., self._first :] = self._in_time(white.view(complex) * (self._gain / self._sides))
        return found

    def products(self, rows: csr_array) -> Array:
        """Products (k, k) of sparse rows of samples (k, n), whole, whitened. Those of a long run are summed stretch by
        stretch, of what is not 0 there: time and memory grow with the run's length, not with that times the number of
        rows."""
        found, rate = np.zeros((rows.shape[0], rows.shape[0])), self._bands.rate_hz
        length, reach = round(_STRETCH_S * rate), round(BLOCK_S * rate)
        if self._count <= _WHOLE_S * rate or self._bands.one_level:  # on a rig rows are few, and as long as the record
            white = self(rows.toarray())
            return white @ white.T
        stretch = copy(self._bands)
        stretch.first, stretch.count = 0, length
        whitener = Whitener(stretch, self._levels)
        for begin in range(self._first - reach, self._first + self._count - reach, length - 2 * reach):
            start, stop = max(begin, self._first), min(begin + length, self._first + self._count)
            inside = rows[:, start:stop]
            there = np.flatnonzero(np.diff(inside.indptr))
            samples = np.zeros((len(there), length))
            samples[:, start - begin : stop - begin] = inside[there].toarray()
            white = whitener.in_time(samples)[:, reach : length - reach]
            found[np.ix_(there, there)] += white @ white.T
        return found

    def in_time(self, samples: Array) -> Array:
        """Whitened samples that count (..., n - first) of samples (n,) or (columns, n), in units of the noise."""
        return self._in_time(self._spectrum(samples) * self._gain)

    def _in_time(self, inside: Complex) -> Array:
        """Samples that count (..., n - first) by their spectrum at the frequencies of the bands."""
        spectrum = np.zeros((*inside.shape[:-1], self._padded // 2 + 1), complex)
        spectrum[..., self._inside] = inside
        return np.fft.irfft(spectrum, self._padded, axis=-1)[..., : self._count]

    def _spectrum(self, samples: Array) -> Complex:
        """Spectrum of the samples that count, at the frequencies of the bands."""
        return np.fft.rfft(samples[..., self._first:], self._padded, axis=-1)[..., self._inside]
