"""Whole records through filters without delay: thinned, cut to a band, or of uneven times.

A whole record thinned: fewer samples a second of the same motion.

Problem: what a program looks at lies far below what a fast recorder took, and bands, noise and work grow with the rate.
Solution: all that lies above half the lower rate is taken out at once, by the record's transform (streams are thinned
by ``resample.Decimator``), so that white noise stays white up to there.

A record without what lies outside of a band of frequencies, and without delay.

A filter of linear phase whose delay is taken out: a sinc in a Kaiser window. Its gain is one half at an end of the band
and is 60 dB down a hertz beyond it, so that what is compared inside is hardly touched by what is outside.

Samples at uneven times, laid on an even grid through an anti-alias filter.

Problem: a recorder whose steps vary gives no record that a filter could read, and straight lines between its samples
lose what is fast: a tenth at a fifth of the rate. Taking every so many of them folds what is faster into the record.

Solution: first the samples of an even grid of the record's own mean rate that explain the readings best, between which
a windowed sinc runs (least squares; K. Groechenig and T. Strohmer, in F. Marvasti, Nonuniform Sampling, 2001, ch. 6).
They are sought as a correction of straight lines, so that what a hole leaves open stays a straight line. Then another
windowed sinc (``low_pass``) to the rate that is wanted: of a lower one it passes all up to 0.45 of the rate.
"""

from functools import lru_cache
from math import ceil
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Complex
from logger.dsp.filters import STOP_DB, kaiser_half_length, kaiser_window, low_pass_taps

_REACH = 12  # grid steps on either side
_KERNEL_STOP_DB = 70.0
SEEN_OF_RATE = 0.45
"""Share of its rate below which a record shows what there is: above it, its recorder lets hardly anything through."""
_RIDGE = 1e-2
_CHUNK, _MARGIN = 4096, 48
_BAND_REACH = 24  # steps of the lower rate
_MOST_WEIGHTS = 200_000  # at once: some MB, however far the kernel of a fast record reaches
_HOLE_STEPS = 1.6
_PHASES = 2048
"""Kernels are tabulated at so many fractions of a step, with straight lines between: their curvature, at most (pi
cutoff)^2 / 3 + the window's own, makes that wrong by 1e-7, a thousandth of what the stop band lets through."""


class _Kernel:
    """A windowed sinc at places ``share + offsets`` (k,) of its steps, for any share of a step, 0 to 1."""

    def __init__(self, offsets: npt.NDArray[np.floating[Any]], half: float, cutoff: float) -> None:
        self._phases = ceil(_PHASES * cutoff)
        apart = np.arange(self._phases + 1)[:, None] / self._phases + offsets
        self._table = np.sinc(cutoff * apart) * kaiser_window(apart, half, _KERNEL_STOP_DB)
        self._steps = np.diff(self._table, axis=0)

    def at(self, share: Array) -> Array:
        """Weights (n, k) at shares (n,)."""
        place = share * self._phases
        low = np.clip(place.astype(np.int64), 0, self._phases - 1)
        return np.asarray(self._table[low] + (place - low)[:, None] * self._steps[low])


def mean_rate_hz(t_s: Array) -> float:
    """Samples a second of a record at uneven times (n,), n > 1, without its holes."""
    steps = np.diff(t_s)
    kept = steps[steps <= _HOLE_STEPS * np.median(steps)]
    return float(1.0 / kept.mean())


def on_even_grid(t_s: Array, samples: Array, own_hz: float, rate_hz: float) -> Array:
    """Samples (n, axes) at growing times (n,) [s], laid at t_s[0] + k / rate_hz up to the last time: (m, axes).

    own_hz    about the rate of the samples, as ``mean_rate_hz``: nothing above half of it is in what comes out
    """
    even = _at_own_rate(t_s, samples, own_hz)
    count = int((t_s[-1] - t_s[0]) * rate_hz + 1e-6) + 1
    return _band_limited(even, np.arange(count, dtype=np.float64) * (own_hz / rate_hz), min(1.0, rate_hz / own_hz))


def _at_own_rate(t_s: Array, samples: Array, own_hz: float) -> Array:
    """The even grid from the first time on, (m, axes)."""
    place = (t_s - t_s[0]) * own_hz
    count = ceil(float(place[-1]) - 1e-6) + 1
    grid = np.arange(count, dtype=np.float64)
    even = np.stack([np.interp(grid, place, axis) for axis in samples.T], axis=1)
    laid = even.copy()
    kernel = _Kernel(_REACH - 1.0 - np.arange(2 * _REACH), _REACH, 1.0)
    for start in range(0, count, _CHUNK):
        low, high = max(0, start - _MARGIN), min(count, start + _CHUNK + _MARGIN)
        inside = slice(*np.searchsorted(place, [low, high - 1 + 1e-9]))
        more = _correction(place[inside] - low, samples[inside], laid[low:high], kernel)
        end = min(count, start + _CHUNK)
        even[start:end] += more[start - low : end - low]
    return even


def _correction(place: Array, samples: Array, laid: Array, kernel: _Kernel) -> Array:
    """What to add to ``laid`` (m, axes) on a grid so that a sinc through it, the ``kernel``, meets samples (n, axes) at
    ``place`` (n,), counted in steps of the grid; beyond its ends it is taken to go on as their mirror image."""
    from scipy.linalg import solveh_banded

    count = len(laid)
    first = np.floor(place).astype(np.int64) - _REACH + 1
    columns = first[:, None] + np.arange(2 * _REACH)
    weights = kernel.at(place - np.floor(place))
    off = samples - np.einsum("nk,nka->na", weights, _continued(laid, 2 * _REACH)[columns + 2 * _REACH])
    weights[(columns < 0) | (columns >= count)] = 0.0
    columns = np.clip(columns, 0, count - 1)
    banded = np.zeros((2 * _REACH, count))
    for lag in range(2 * _REACH):
        products = weights[:, : 2 * _REACH - lag] * weights[:, lag:]
        banded[lag] = np.bincount(columns[:, : 2 * _REACH - lag].ravel(), products.ravel(), count)
    banded[0] += _RIDGE
    right = np.stack([np.bincount(columns.ravel(), (weights * axis[:, None]).ravel(), count) for axis in off.T], axis=1)
    return np.asarray(solveh_banded(banded, right, lower=True))


def _continued(even: Array, reach: int) -> Array:
    """Samples (n, axes) with so many more at both ends: their mirror image about the last sample, as far as it goes."""
    around = np.pad(even, ((min(reach, len(even) - 1),) * 2, (0, 0)), mode="reflect", reflect_type="odd")
    return np.pad(around, ((reach - (len(around) - len(even)) // 2,) * 2, (0, 0)), mode="edge")


def _band_limited(even: Array, at: Array, cutoff: float) -> Array:
    """Samples (n, axes) of an even grid, taken at places (m,) counted in its steps, without what lies above ``cutoff``
    of half its rate. The ends are continued by their mirror image about the last sample."""
    half = ceil(_BAND_REACH / cutoff)
    around = _continued(even, half + 1)
    offsets = np.arange(-half, half + 1)
    found = np.empty((len(at), even.shape[1]))
    rows = ceil(_MOST_WEIGHTS / len(offsets))
    kernel = _Kernel(offsets - 0.5, half + 1, cutoff)
    for start in range(0, len(at), rows):
        here = at[start : start + rows]
        nearest = np.rint(here).astype(np.int64)
        weights = kernel.at(nearest - here + 0.5)
        weights /= weights.sum(axis=1, keepdims=True)
        found[start : start + rows] = np.einsum("mk,mka->ma", weights, around[nearest[:, None] + offsets + half + 1])
    return found


_MIRRORED = 100  # thinned samples, at each end


def thinned(samples: Array, factor: int) -> Array:
    """Every ``factor``-th of samples (n,), the first among them, of what lies below half of the lower rate.

    Both ends are continued by their mirror image about the last sample, as a transform takes a record for a circle.
    ValueError for a factor below 1.
    """
    from scipy.signal import resample

    if factor < 1:
        raise ValueError(f"cannot thin by {factor}")
    if factor == 1 or len(samples) <= factor:
        return samples[::factor]
    count = len(samples)
    before = min(_MIRRORED, (count - 1) // factor) * factor
    after = before + -(count + 2 * before) % factor
    around = np.pad(samples, (before, after), mode="reflect", reflect_type="odd")
    found = np.asarray(resample(around, len(around) // factor), float)
    return found[before // factor :][: -(-count // factor)]


HALF_WIDTH_HZ = 1.0
"""From an end of the band to where the filter passes all, and to where it passes nothing. It costs 0.9 s of record on
either side (``reach``): in front of it half of the 2 s that are left out of every run."""


def in_band(samples: Array, rate_hz: float, low_hz: float, high_hz: float) -> Array:
    """Samples (n,) without what lies below ``low_hz`` and above ``high_hz``; an end at 0, or at half the rate, is
    none. Before and after the record its ends are held."""
    found = np.asarray(samples, float)
    if high_hz < rate_hz / 2:
        found = _low_passed(found, high_hz, HALF_WIDTH_HZ, rate_hz)
    if low_hz > 0:
        found = found - _low_passed(found, low_hz, min(HALF_WIDTH_HZ, 0.5 * low_hz), rate_hz)
    return found


def reach(rate_hz: float) -> int:
    """How many samples at an end of a record are not what they would be, had it gone on, where its band is cut."""
    return ceil(kaiser_half_length(STOP_DB, 4 * np.pi * HALF_WIDTH_HZ / rate_hz))


def _low_passed(samples: Array, cutoff_hz: float, half_width_hz: float, rate_hz: float) -> Array:
    from scipy.fft import next_fast_len

    half = ceil(kaiser_half_length(STOP_DB, 4 * np.pi * half_width_hz / rate_hz))
    held = np.pad(samples, half, mode="edge")
    size = next_fast_len(len(held), real=True)
    gain = _gain(half, 2 * cutoff_hz / rate_hz, size)
    return np.fft.irfft(np.fft.rfft(held, size) * gain, size)[2 * half : len(held)]


@lru_cache(maxsize=32)  # records of one length pass the same filter hundreds of times
def _gain(half: int, cutoff: float, size: int) -> Complex:
    """Transform of the taps of a low-pass, the first at 0, over so many samples."""
    return np.fft.rfft(low_pass_taps(half, 1, cutoff, STOP_DB), size)
