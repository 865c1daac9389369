"""From degree of roughness to IRI and back, with the spread that a road's length leaves (4.3.4 of Blum 2015).

The dissertation drives the IRI's car over 400 random roads and lays a line through the results: IRI = 0.5386 Gd^0.5
(Eq 4.37 to 4.40). That number is the average of long roads of waviness 2; a road of 100 m may be 10 % off it, a road of
another waviness twice as much. Here the relation is computed instead.

The suspension's slope s of the IRI's car on a random road is a Gaussian process with the spectrum

    S(n) = |H(n)|^2 (2 pi n)^2 Gd(n),   n from 0.011 to 2.83 cycle/m,

and the IRI is the mean of |s| over the road. Its expectation is sqrt(2 / pi) times the standard deviation of s. Two
values of |s| whose slopes have the correlation rho are correlated themselves: their covariance, in units of the mean
squared, is sqrt(1 - rho^2) + rho asin(rho) - 1. Its integral along the road is how much the IRI spreads.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.roads.iso8608 import HIGHEST_CPM, LOWEST_CPM, STANDARD_WAVINESS, displacement_psd
from logger.roads.wavelength import slope_gain

Array = npt.NDArray[np.float64]

_STEP_CPM = 1 / 2048
_LAG_M = 1 / 8
_LAGS = 4096  # to 512 m, when the car remembers nothing


@dataclass(frozen=True)
class Expected:
    """A value and its standard deviation from one stretch of road to the next."""

    value: float
    std: float


def iri_per_root_gd(waviness: float = STANDARD_WAVINESS) -> float:
    """Expected IRI of a road with Gd(n0) = 1 cm3 [m/km]; IRI grows with the root of Gd. For a waviness of 2: 0.543."""
    return float(1000 * np.sqrt(2 / np.pi * np.sum(_slope_spectrum(waviness)) * _STEP_CPM))


def relative_spread(length_m: float, waviness: float = STANDARD_WAVINESS) -> float:
    """Standard deviation over mean of the IRI of stretches of this length [m] of one and the same random road."""
    likeness = np.fft.irfft(_slope_spectrum(waviness), round(1 / (_STEP_CPM * _LAG_M)))[:_LAGS]
    rho = np.clip(likeness / likeness[0], -1, 1)
    covariance = np.sqrt(1 - rho**2) + rho * np.arcsin(rho) - 1
    covariance[0] /= 2
    within = np.maximum(1 - _LAG_M * np.arange(_LAGS) / length_m, 0)
    return float(np.sqrt(2 / length_m * _LAG_M * (covariance @ within)))


def iri_of_road(gd_n0_cm3: float, length_m: float, waviness: float = STANDARD_WAVINESS) -> Expected:
    """IRI [m/km] to expect of a stretch of this length [m] of a road with this degree of roughness [cm3]."""
    iri_m_per_km = iri_per_root_gd(waviness) * gd_n0_cm3**0.5
    return Expected(iri_m_per_km, iri_m_per_km * relative_spread(length_m, waviness))


def gd_of_road(iri_m_per_km: float, length_m: float, waviness: float = STANDARD_WAVINESS) -> Expected:
    """Degree of roughness [cm3] of the road that a stretch of this length [m] and IRI [m/km] was cut from.

    Gd goes with the square of the IRI, so it spreads twice as much.
    """
    gd_n0_cm3 = (iri_m_per_km / iri_per_root_gd(waviness)) ** 2
    return Expected(gd_n0_cm3, gd_n0_cm3 * 2 * relative_spread(length_m, waviness))


def _slope_spectrum(waviness: float) -> Array:
    """S(n) for Gd(n0) = 1 cm3 at 0, step, 2 step ... [1 per cycle/m]."""
    wave_number = _STEP_CPM * np.arange(int(HIGHEST_CPM / _STEP_CPM) + 1)
    heard = np.zeros(len(wave_number))
    on_road = wave_number >= LOWEST_CPM
    n = wave_number[on_road]
    heard[on_road] = (slope_gain(n) * 2 * np.pi * n) ** 2 * displacement_psd(n, 1.0, waviness)
    return heard
