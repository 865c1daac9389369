"""Power spectra of even segments, summed (5.5.1 of Blum 2015).

The transform of one long record is as rough as its noise. Summing those of equal segments smooths it, at the price of
resolution. The sum here is of powers, with a Hann window.
"""

from __future__ import annotations

import numpy as np

from logger.modal.mode import Array

_FEWEST_SEGMENTS = 4
_SHORTEST_SEGMENT = 64


def summed_spectrum(samples: Array, rate_hz: float, segments: int) -> tuple[Array, float]:
    """Power of each of equal segments of a record (samples, channels), summed over channels, (segments, bins), and the
    spacing of the bins [Hz]."""
    length = len(samples) // max(segments, 1)
    if segments < _FEWEST_SEGMENTS or length < _SHORTEST_SEGMENT:
        raise ValueError(f"expected {_FEWEST_SEGMENTS} segments or more of {_SHORTEST_SEGMENT} samples or more, found "
                         f"{segments} of {length}")
    cut = samples[:segments * length].reshape(segments, length, -1)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(length) + 0.5) / length)
    seen = np.fft.rfft((cut - cut.mean(axis=1, keepdims=True)) * window[:, None], axis=1)
    return (np.abs(seen) ** 2).sum(axis=2), rate_hz / length
