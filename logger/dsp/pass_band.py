"""A record without what lies outside of a band of frequencies, and without delay.

A filter of linear phase whose delay is taken out: a sinc in a Kaiser window (``kaiser``). Its gain is one half at an
end of the band and is 60 dB down a hertz beyond it, so that what is compared inside is hardly touched by what is
outside.
"""

from __future__ import annotations

from functools import cache
from math import ceil

import numpy as np
import numpy.typing as npt

from logger.dsp import kaiser

Array = npt.NDArray[np.float64]

HALF_WIDTH_HZ = 1.0
"""From an end of the band to where the filter passes all, and to where it passes nothing. It costs 0.9 s of record on
either side (``reach``): in front of it half of the 2 s that are left out of every run."""
_STOP_DB = 60.0


def in_band(samples: Array, rate_hz: float, low_hz: float, high_hz: float) -> Array:
    """Samples (n,) without what lies below ``low_hz`` and above ``high_hz``; an end at 0, or at half the rate, is
    none. Before and after the record its ends are held."""
    found = np.asarray(samples, float)
    if high_hz < rate_hz / 2:
        found = _through(found, _taps(high_hz, HALF_WIDTH_HZ, rate_hz))
    if low_hz > 0:
        found = found - _through(found, _taps(low_hz, min(HALF_WIDTH_HZ, 0.5 * low_hz), rate_hz))
    return found


def reach(rate_hz: float) -> int:
    """How many samples at an end of a record are not what they would be, had it gone on, where its band is cut."""
    return ceil(kaiser.half_length(_STOP_DB, 4 * np.pi * HALF_WIDTH_HZ / rate_hz))


@cache
def _taps(cutoff_hz: float, half_width_hz: float, rate_hz: float) -> Array:
    half = ceil(kaiser.half_length(_STOP_DB, 4 * np.pi * half_width_hz / rate_hz))
    return kaiser.low_pass_taps(half, 1, 2 * cutoff_hz / rate_hz, _STOP_DB)


def _through(samples: Array, taps: Array) -> Array:
    from scipy.signal import fftconvolve

    half = len(taps) // 2
    return np.asarray(fftconvolve(np.pad(samples, half, mode="edge"), taps, mode="valid"))
