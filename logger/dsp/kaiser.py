"""Low-pass filters of linear phase: a sinc in a Kaiser window, by Kaiser's two rules.

J. F. Kaiser, Nonrecursive digital filter design using the I0-sinh window function (1974); Oppenheim and Schafer,
Discrete-Time Signal Processing, 7.6. A transition of width w [rad/sample] that ends A dB down takes (A - 7.95) / (2.285
w) steps and a window of beta = 0.1102 (A - 8.7), for A above 50.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def half_length(stop_db: float, width: float) -> float:
    """Samples, not rounded, on either side of the middle of a filter whose transition is ``width`` wide [rad/sample]
    and ends so many dB down."""
    return (stop_db - 7.95) / (2.285 * width) / 2


def beta(stop_db: float) -> float:
    """Shape of the window whose side lobes are so many dB down."""
    return 0.1102 * (stop_db - 8.7)


def low_pass_taps(half: int, steps: int, cutoff: float, stop_db: float) -> Array:
    """Filter (2 half + 1,), symmetric, its sum 1, for taking one sample in ``steps``: half the amplitude at ``cutoff``
    [of half the rate that is left]."""
    taps = np.sinc(cutoff * (np.arange(-half, half + 1) / steps)) * np.kaiser(2 * half + 1, beta(stop_db))
    return np.asarray(taps / taps.sum())


def window(offset: Array, half: float, stop_db: float) -> Array:
    """The Kaiser window at any offsets from its middle, 0 beyond ``half``."""
    inside = np.clip(1 - (offset / half) ** 2, 0.0, None)
    return np.asarray(np.i0(beta(stop_db) * np.sqrt(inside)) / np.i0(beta(stop_db)))
