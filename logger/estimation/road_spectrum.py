"""Prior spectrum of a road, by two numbers.

A road of ISO 8608 has Gd(n) = Gd(n0) (n / n0)^-w; its increments are white noise when the waviness w is 2. Level
and waviness are learnt on the way, so they are kept where they can be separated: the level at a wave number in the
middle of those that shake a car.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log

import numpy as np
import numpy.typing as npt

from logger.roads.iso8608 import CM3_M3, REFERENCE_N0_CPM, gd_n0_from_iri

Array = npt.NDArray[np.float64]

PIVOT_CPM = 0.2
"""Where a level is counted: in the middle of the waves that shake a car."""
FLATTENED_BELOW_CPM = 0.01
"""Longer waves than ISO 8608 has (0.011 cycle/m) are as high as this one."""


@dataclass(frozen=True)
class RoadSpectrum:
    """log_level    natural logarithm of Gd(0.2 cycle/m) [m3]
    waviness        w of ISO 8608
    """

    log_level: float
    waviness: float

    @classmethod
    def of_iri(cls, iri_m_per_km: float, waviness: float = 2.0) -> RoadSpectrum:
        """The spectrum whose degree of roughness Gd(n0) belongs to this IRI (Eq 4.40 of Blum 2015)."""
        gd_n0 = gd_n0_from_iri(iri_m_per_km) * CM3_M3
        return cls(log(gd_n0) - waviness * log(PIVOT_CPM / REFERENCE_N0_CPM), waviness)

    @property
    def gd_n0_cm3(self) -> float:
        """Degree of roughness Gd(n0) [cm3]."""
        return exp(self.log_level + self.waviness * log(PIVOT_CPM / REFERENCE_N0_CPM)) / CM3_M3

    def psd(self, wave_number_cpm: Array) -> Array:
        """Displacement spectrum [m3], one-sided, at wave numbers [cycle/m]; flat below 0.01 cycle/m."""
        return self.psd_of(log_waves(wave_number_cpm))

    def psd_of(self, logs: Array) -> Array:
        """The same at waves (...) whose ``log_waves`` are known."""
        return np.exp(self.log_level - self.waviness * logs)


def log_waves(wave_number_cpm: Array) -> Array:
    """Logarithm (...) of wave numbers [cycle/m] over the pivot's, where the spectrum is not flat."""
    return np.log(np.maximum(wave_number_cpm, FLATTENED_BELOW_CPM) / PIVOT_CPM)
