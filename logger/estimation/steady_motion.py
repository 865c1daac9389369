"""A car's acceleration at a steady speed, and what even readings of it leave open."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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

    def covariance_left(self, variance: float) -> Array:
        """What is left by lag, (2 (f - 1),), as in a record that repeats [(m/s2)2], for readings of one variance."""
        return np.fft.irfft(self._resolved(variance), 2 * (len(self.psd) - 1)) * variance

    def resolved_per_reading(self, variance: Array | float) -> Array | float:
        """Degrees of freedom that the motion takes of each reading, 0 to 1; for one variance or for many."""
        return self._resolved(variance).sum(axis=-1) / len(self.psd)

    def _resolved(self, variance: Array | float) -> Array:
        """Share S / (S + N) of each frequency, (..., b) for variances (...), up to the last that has any motion."""
        noise = np.asarray(2 * variance / self.rate_hz)[..., None]
        share: Array = self._moved / (self._moved + noise)
        return share

    @cached_property
    def _moved(self) -> Array:
        """The spectrum up to its last frequency that is not 0: readings are taken far more often than a car moves."""
        moved = np.flatnonzero(self.psd)
        return self.psd[:moved[-1] + 1] if len(moved) else self.psd[:1]
