"""Butterworth's low-pass (S. Butterworth, On the Theory of Filter Amplifiers, 1930), of any order."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Complex = npt.NDArray[np.complex128]

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
