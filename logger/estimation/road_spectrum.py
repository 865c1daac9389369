"""Prior spectrum of a road, by two numbers, and how a stretch tells them.

A road of ISO 8608 has Gd(n) = Gd(n0) (n / n0)^-w; its increments are white noise when the waviness w is 2. Level
and waviness are learned on the way, so they are kept where they can be separated: the level at a wave number in the
middle of those that shake a car.
"""

from dataclasses import dataclass
from math import exp, log

import numpy as np

from logger.arrays import Array
from logger.estimation.scored_variances import LARGEST_STEP
from logger.roads.iso8608 import CM3_M3, REFERENCE_N0_CPM, gd_n0_from_iri
from logger.units import COMMON_IRI

PIVOT_CPM = 0.2
"""Where a level is counted: in the middle of the waves that shake a car."""
FLATTENED_BELOW_CPM = 0.01
"""Longer waves than ISO 8608 has (0.011 cycle/m) are as high as this one."""

# Of level and waviness: what roads are like (half of them between 1.1 and 5.7 m/km; wavinesses of 1.8 to 2.5 are
# common, ISO 8608, annex C), and how far both may have wandered since the last stretch.
COMMON_DEVIATIONS, _STEP_DEVIATIONS = (1.8, 0.3), (0.3, 0.1)
_WAVINESS_RANGE = (1.2, 3.2)


@dataclass(frozen=True)
class RoadSpectrum:
    """log_level    natural logarithm of Gd(0.2 cycle/m) [m3]
    waviness        w of ISO 8608
    """

    log_level: float
    waviness: float

    @classmethod
    def of_iri(cls, iri_m_per_km: float, waviness: float = 2.0) -> "RoadSpectrum":
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


COMMON_ROAD = RoadSpectrum.of_iri(COMMON_IRI)


def learned(
    now: RoadSpectrum, power: Array, resolved: Array, log_waves: Array, seen_share: float, before: RoadSpectrum | None
) -> RoadSpectrum:
    """One scoring step for level and waviness.

    The evidence (marginal likelihood) of a Gaussian model is largest where each wave's estimated power equals the share
    of its prior variance that the readings resolve: sum |u|^2 = sum g / (1 + g) (MacKay 1992). Its slope and curvature
    in the level and the waviness are such sums, so one scoring step per stretch follows both.

    power         (k,) of each wave of the white innovations, where 1 is expected of a wave that is fully resolved
    resolved      (k,) share of each wave that the readings resolve where the road was read
    log_waves     (k,) of each, as ``road_spectrum.log_waves``
    seen_share    of the distance grid, where the car was read
    before        the spectrum of the stretch before; None: there was none
    """
    used = resolved > 0
    power, resolved = power[used], resolved[used]
    slopes = np.stack([np.ones(len(power)), -log_waves[used]])
    gradient = slopes @ (power - seen_share * resolved)
    curvature = (slopes * (seen_share * resolved**2)) @ slopes.T
    for centre, deviations in ((COMMON_ROAD, COMMON_DEVIATIONS), (before, _STEP_DEVIATIONS)):
        if centre is not None:
            precision = np.array(deviations) ** -2.0
            gradient -= precision * [now.log_level - centre.log_level, now.waviness - centre.waviness]
            curvature += np.diag(precision)
    level, waviness = np.clip(np.linalg.solve(curvature, gradient), -LARGEST_STEP, LARGEST_STEP)
    return RoadSpectrum(now.log_level + float(level), float(np.clip(now.waviness + waviness, *_WAVINESS_RANGE)))
