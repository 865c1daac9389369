"""Only what lies below a frequency: a low-pass filter that also lowers the rate.

Problem: a filter alone (the 20 Hz of 6.2.1 of Blum 2015) leaves samples that hardly differ from their neighbours, and
whatever weighs residuals afterwards takes the emptied band for certainty. Solution: behind the filter only as many
samples are kept as the band needs, two and a half per period of its upper edge; what was independent stays nearly so.
Measurement and prediction go through the same filter, so its shape biases nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
import numpy.typing as npt

from logger.dsp import kaiser

Array = npt.NDArray[np.float64]

_SAMPLES_PER_PERIOD = 2.5
_STOP_DB = 60.0


@dataclass(frozen=True)
class DecimatingLowPass:
    """Passes up to ``cutoff_hz`` of a record at ``rate_hz``; None passes all and keeps every sample.

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
        return ceil(kaiser.half_length(_STOP_DB, 2 * np.pi * (stop_hz - pass_hz) / self.rate_hz))

    def _kernel(self, place: Array) -> Array:
        """The filter at places counted in samples from its middle."""
        window = kaiser.window(place, self._half + 1, _STOP_DB)
        return np.asarray(np.sinc(sum(self._edges) / self.rate_hz * place) * window)
