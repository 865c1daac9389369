"""A car's acceleration at a steady speed, and what even readings of it leave open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class SteadyMotion:
    """psd    (f,) spectrum of the acceleration, one-sided, at frequencies evenly from 0 to half the rate [(m/s2)2/Hz]
    rate_hz   of the readings

    Readings are even where each has the same variance [(m/s2)2]; they leave S N / (S + N), N their own spectrum.
    """

    psd: Array
    rate_hz: float

    @property
    def variance(self) -> float:
        """Of the acceleration before anything is read [(m/s2)2]."""
        return float(self.psd.mean()) * self.rate_hz / 2

    def remaining_variance(self, variance: float) -> float:
        """Variance that is left of each acceleration [(m/s2)2]."""
        return float(self._left_psd(variance).mean()) * self.rate_hz / 2

    def covariance_left(self, variance: float) -> Array:
        """The same by lag, (2 (f - 1),), as in a record that repeats [(m/s2)2]."""
        return np.fft.irfft(self._left_psd(variance)) * self.rate_hz / 2

    def resolved_per_reading(self, variance: float) -> float:
        """Degrees of freedom that the motion takes of each reading, 0 to 1."""
        return float((self._left_psd(variance) / self._noise_psd(variance)).mean())

    def _noise_psd(self, variance: float) -> float:
        return 2 * variance / self.rate_hz

    def _left_psd(self, variance: float) -> Array:
        noise = self._noise_psd(variance)
        left: Array = self.psd * noise / (self.psd + noise)
        return left
