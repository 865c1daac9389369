"""Low-pass filters: Butterworth's, a sinc in a Kaiser window, and one that lowers the rate."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

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


Array = npt.NDArray[np.float64]


_SAMPLES_PER_PERIOD = 2.5
_STOP_DB = 60.0


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
        return ceil(kaiser_half_length(_STOP_DB, 2 * np.pi * (stop_hz - pass_hz) / self.rate_hz))

    def _kernel(self, place: Array) -> Array:
        """The filter at places counted in samples from its middle."""
        window = kaiser_window(place, self._half + 1, _STOP_DB)
        return np.asarray(np.sinc(sum(self._edges) / self.rate_hz * place) * window)
