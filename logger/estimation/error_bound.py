"""Error bound: how well a window's IRI can be known at best, when road, noise and car are known exactly.

Problem. An R2 of 0.95 is poor where 0.99 is possible, and excellent where 0.955 is. How much is possible depends on the
speed, the sensor, the length of the window and the road.

Solution. The Golden Car's slope y on a random road is a Gaussian process. The best any estimator can know of it is the
Wiener filter's mean, which leaves an error independent of it; its best value for the window's IRI is the mean of |y|
over what it knows. The variance of that value from window to window has a closed form. Two draws y and y' from what is
known are each as likely as the truth, and E[E(|y(x)| | readings) E(|y(x + l)| | readings)] = E |y(x) y'(x + l)|. They
are jointly Gaussian, with the covariance of what the readings resolve: its spectrum is that of y times the share
resolved. For two Gaussian variables of variance V and correlation r

    cov(|a|, |b|) = 2 V / pi (sqrt(1 - r^2) + r asin(r) - 1)

(as in ``logger.roads.elevation_spectrum``), so its integral over a window gives the variance of the windows' exact IRI
with the correlation of y, and that of the best values with the correlation resolved. The mean squared error is their
difference.

Rounding counts as white noise of step / sqrt(12). Where the noise does not blur the steps of a coarse sensor that is
not what rounding does, and an estimator that takes it as bounds can do a little better than this says.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, pi, sqrt

import numpy as np

from logger.arrays import Array
from logger.estimation.car_response import HIGHEST_HZ, WAVE_NUMBERS_CPM, golden_car_slope
from logger.estimation.iri_posterior import reading_noise_psd
from logger.estimation.road_spectrum import RoadSpectrum
from logger.estimation.sensor_noise import Sensor
from logger.estimation.time_grid import RATE_HZ
from logger.roads.iri import PER_KM
from logger.vehicle.linearise import KnownCar

FINE_M = 0.05
"""Steps in which the Golden Car's slope is followed, nearly: a window is a whole number of them [m]."""
_FORGOTTEN_M = 400.0  # the slope has no memory of what lies so far behind


@dataclass(frozen=True)
class Limit:
    """Windows of random road of one spectrum, driven at one speed; all [m/km].

    iri_m_per_km       their mean IRI
    spread_m_per_km    standard deviation of their exact IRI
    std_m_per_km       r.m.s. error of the best possible values for it
    """

    iri_m_per_km: float
    spread_m_per_km: float
    std_m_per_km: float

    @property
    def r2(self) -> float:
        """Share of the variance of the exact IRI that the best possible values explain."""
        return 1 - (self.std_m_per_km / self.spread_m_per_km) ** 2


class ErrorBound:
    """The limit for a car with its sensor's place, a sensor on the grid of 100 Hz and a window [m]."""

    def __init__(self, car: KnownCar, sensor: Sensor, window_m: float) -> None:
        self._car = car
        self._variance = sensor.variance_mps2_2
        self._lags = ceil(window_m / FINE_M)
        spacing_m = window_m / self._lags
        self._count = 1 << (ceil((window_m + _FORGOTTEN_M) / spacing_m) - 1).bit_length()
        self._wave_number_cpm = np.asarray(np.fft.rfftfreq(self._count, spacing_m), dtype=np.float64)
        self._slope_power = np.abs(golden_car_slope(self._wave_number_cpm)) ** 2 / (2 * spacing_m)
        # Mean over all pairs of places in a window, by their lag.
        self._weight = 2 / self._lags * (1 - np.arange(self._lags) / self._lags)
        self._weight[0] /= 2

    def at(self, speed_mps: float, spectrum: RoadSpectrum) -> Limit:
        """For a steady speed, above 0, on road of this spectrum."""
        psd = spectrum.psd(self._wave_number_cpm)
        car = self._car.at(speed_mps, WAVE_NUMBERS_CPM, spectrum.psd(WAVE_NUMBERS_CPM))
        seen = self._wave_number_cpm * speed_mps <= HIGHEST_HZ
        signal = np.zeros(len(psd))
        signal[seen] = np.abs(car.response(self._wave_number_cpm[seen] * speed_mps, speed_mps)) ** 2 * psd[seen]
        resolved = signal / (signal + reading_noise_psd(self._variance, RATE_HZ, speed_mps))
        covariance = np.fft.irfft(self._slope_power * psd, self._count)
        covariance_resolved = np.fft.irfft(self._slope_power * psd * resolved, self._count)
        variance = float(covariance[0])
        exact = self._window_variance(covariance / variance)
        best = self._window_variance(covariance_resolved / variance)
        mean = sqrt(2 / pi * variance)
        return Limit(PER_KM * mean, PER_KM * mean * sqrt(exact), PER_KM * mean * sqrt(max(exact - best, 0.0)))

    def _window_variance(self, correlation: Array) -> float:
        """Variance of a window's mean of |y|, in units of the mean squared."""
        r = np.clip(correlation[: self._lags], -1, 1)
        return float(self._weight @ (np.sqrt(1 - r**2) + r * np.arcsin(r) - 1))


def pooled_r2(limits: Sequence[Limit]) -> float:
    """R2 over as many windows of each kind, the mean of each kind being known: rough and smooth roads are distinguished
    easily, so it is above that of each."""
    squared_error = np.mean([one.std_m_per_km**2 for one in limits])
    variance = np.mean([one.spread_m_per_km**2 for one in limits]) + np.var([one.iri_m_per_km for one in limits])
    return float(1 - squared_error / variance)
