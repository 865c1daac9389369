"""From an estimated road to its IRI: what is known of the Golden Car's slope, and the mean of its absolute value.

An estimated road is too smooth: what the readings do not resolve is missing in it. The slope of the Golden Car at a
place is known with a mean and a variance, and the IRI asks for the mean of its absolute value, which the variance adds
to (folded normal distribution). The error of a window follows from the covariance of those absolute values. For a
steady speed both are integrals over wave numbers: of the road's spectrum S, gain H and noise N, S N / (|H|^2 S + N) is
left.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import pi, sqrt

import numpy as np

from logger.arrays import Array, Complex
from logger.estimation.car_response import (
    LOG_WAVES,
    WAVE_NUMBER_STEPS_CPM,
    WAVE_NUMBERS_CPM,
    CarResponse,
    golden_car_slope,
)
from logger.estimation.normal_distribution import mean_absolute, variance_of_mean_absolute
from logger.estimation.road_spectrum import RoadSpectrum
from logger.roads.iri import PER_KM

_SLOPE_POWER = np.abs(golden_car_slope(WAVE_NUMBERS_CPM)) ** 2 * WAVE_NUMBER_STEPS_CPM
_NODES, _NODE_WEIGHTS = np.polynomial.hermite_e.hermegauss(3)  # in standard errors of the log level
_NODE_WEIGHTS /= _NODE_WEIGHTS.sum()
_FORGOTTEN_M = 40.0
_RISES = np.linspace(-12.0, 12.0, 33)


def reading_noise_psd(variance: float, rate_hz: float, speed_mps: float) -> float:
    """White noise of readings, as a spectrum over wave number at a speed [(m/s2)2 per cycle/m]."""
    return 2 * variance / rate_hz * speed_mps


def resolved_share(car: CarResponse, speed_mps: float, spectrum: RoadSpectrum, noise_psd: float) -> Array:
    """Share of the variance of each wave at ``WAVE_NUMBERS_CPM`` that the readings resolve."""
    signal = car.power(speed_mps) * spectrum.psd_of(LOG_WAVES)
    return signal / (signal + noise_psd)


def vehicle_error_variance(
    car: CarResponse, speed_mps: float, spectrum: RoadSpectrum, vehicle_error: float, rate_hz: float
) -> float:
    """White noise of readings that costs the IRI as much as a model whose axles' gains are each off by a share
    ``vehicle_error`` [(m/s2)2]: the error's density over wave numbers, weighted as the IRI weights them.

    Where its numbers are off by their standard errors and that costs more, the noise of as much: what a gain turns into
    road, it multiplies by 1 / gain, so the errors count most where the axles' shares cancel. A gain that is off
    elsewhere moves all readings of a drive alike, which is no noise (``SlopeKnowledge.vehicle_std``). Nor is the spread
    of cars where nobody measured this one: as noise it would be as large as the readings, and take off the road what it
    hides (BMA220, ten published cars, 20 to 60 mph: -14 % with it, +2 % without)."""
    road = spectrum.psd_of(LOG_WAVES)
    weight = _SLOPE_POWER * road
    off = vehicle_error**2 * car.power_apart(speed_mps)
    density = float((off * road) @ weight / weight.sum())
    if car.off and car.is_measured:
        gain = car.power(speed_mps) + off
        seen = gain > 0
        turned = _SLOPE_POWER[seen] / gain[seen]
        changed = car.power(speed_mps) * (np.abs(car.changes(speed_mps)) ** 2).sum(axis=0)
        density = max(density, float((changed * road)[seen] @ turned / turned.sum()))
    return density * rate_hz / (2 * speed_mps)


@dataclass(frozen=True)
class SlopeKnowledge:
    """What the readings leave open of the Golden Car's slope at a steady speed.

    variance         before anything is read [m2/m2]
    log_left         (r,) logarithm of what is left of it, once the readings are known [m2/m2], where the road's level
                     is higher by each of ``_RISES``
    correlation      (l,) of what is left, at lags of whole steps of the distance grid
    vehicle_std      share by which the vehicle's numbers, by their standard errors, may make the slope wrong
    """

    variance: float
    log_left: Array
    correlation: Array
    vehicle_std: float = 0.0

    def left(self, rise: Array) -> Array:
        """Variance that is left where the road's log level is higher by ``rise`` (any shape)."""
        return np.exp(np.interp(rise, _RISES, self.log_left))

    @property
    def resolved(self) -> float:
        """Share of the variance that the readings resolve."""
        return 1 - float(self.left(np.zeros(1))[0]) / self.variance


def slope_knowledge(car: CarResponse, speed_mps: float, spectrum: RoadSpectrum, variance: float, rate_hz: float,
                    spacing_m: float, lags: int) -> SlopeKnowledge:
    """For readings of this variance [(m/s2)2] at this speed [m/s], and so many lags of the distance grid."""
    prior = _SLOPE_POWER * spectrum.psd_of(LOG_WAVES)
    resolved = resolved_share(car, speed_mps, spectrum, reading_noise_psd(variance, rate_hz, speed_mps))
    left = (prior * (1 - resolved)) @ _by_lag(spacing_m, lags)
    # of a rise e^l the share resolved goes from s to s e^l / (1 - s + s e^l)
    rise = np.exp(_RISES)[:, None]
    by_rise = (rise / (1 - resolved + resolved * rise)) @ (prior * (1 - resolved))
    return SlopeKnowledge(float(prior.sum()), np.log(by_rise), left / left[0],
                          _vehicle_std(car, speed_mps, prior * resolved**2))


def _vehicle_std(car: CarResponse, speed_mps: float, weight: Array) -> float:
    """A gain that is off by a share dH / H makes the wave that is found off by as much, as far as the readings tell
    it; the road's level is learned from those waves, so that what they do not tell goes with them."""
    if not car.off:
        return 0.0
    return float(np.linalg.norm(car.changes(speed_mps).real @ weight)) / float(weight.sum())


@lru_cache(maxsize=2)
def _by_lag(spacing_m: float, lags: int) -> Array:
    """How each wave at ``WAVE_NUMBERS_CPM`` goes on over so many steps (n, lags); kept, for it is that of any car."""
    return np.cos(2 * pi * WAVE_NUMBERS_CPM[:, None] * spacing_m * np.arange(lags))


@dataclass(frozen=True)
class WindowIri:
    """IRI of a window [m/km]; its standard error is its ``own``, that of the road's ``level``, which the neighbours
    share, and that of the numbers of vehicle and sensor, ``common`` to all windows.

    begins_with, ends_with    IRI over the way by which the window may be misplaced, at its beginning and at its end
                              [m/km]: a window further on loses as much at the one and gains as much at the other
    scatter                   variance of the IRI over such ways, along the window [(m/km)2]
    """

    iri_m_per_km: float
    own_std_m_per_km: float
    level_std_m_per_km: float
    common_std_m_per_km: float
    begins_with_m_per_km: float
    ends_with_m_per_km: float
    scatter: float


def window_iri(slope: Array, unseen: Array, rise: Array, knowledge: SlopeKnowledge, log_level_std: float,
               length_m: float, misplaced_m: float) -> WindowIri:
    """IRI of the window whose estimated slopes are given from edge to edge.

    slope            (p,) at the points of the distance grid [m/m]
    unseen           (p,) share of the slope's variance, 0 to 1, that comes from road that was not read at all
    rise             (p,) of the road's log level there over that of ``knowledge``
    knowledge        at the window's speed
    log_level_std    standard error of the road's log level, over which the mean is taken
    length_m         of the window [m]
    misplaced_m      standard error of its place [m]
    """
    weight = np.full(len(slope), 1 / (len(slope) - 1))
    weight[[0, -1]] *= 0.5
    rises = rise + log_level_std * _NODES[:, None]
    variances = knowledge.variance * np.exp(rises)
    left = knowledge.left(rises)
    resolved = 1 - left / variances
    # Were the level higher, more of the readings would be taken for road, and more be left open.
    slopes = slope * (resolved / np.maximum(resolved[1], 1e-3))
    deviations = np.sqrt(left + (variances - left) * unseen)
    by_level = mean_absolute(slopes, deviations)
    absolute, means = _NODE_WEIGHTS @ by_level, by_level @ weight
    mean = float(_NODE_WEIGHTS @ means)
    own = variance_of_mean_absolute(slope, deviations[1], knowledge.correlation, weight)
    level, common = sqrt(float(_NODE_WEIGHTS @ (means - mean) ** 2)), mean * knowledge.vehicle_std
    points = min(1 + round(misplaced_m / length_m * (len(slope) - 1)), len(slope) // 2)
    begins, ends = float(absolute[:points].mean()), float(absolute[-points:].mean())
    parts = absolute[: len(absolute) // points * points].reshape(-1, points).mean(axis=1)
    return WindowIri(PER_KM * mean, PER_KM * sqrt(own), PER_KM * level, PER_KM * common, PER_KM * begins,
                     PER_KM * ends, PER_KM**2 * float(parts.var(ddof=1)))


def by_slope(row: Array, spacing_m: float) -> Array:
    """Mean (n,) of a row (n,) along the road, with the shares that the variance of the Golden Car's slope at each point
    has from there, on a closed grid; of a block, whose last ``UNSEEN_M`` nobody drove, nothing goes round."""
    return np.fft.irfft(np.fft.rfft(row) * _memory_waves(spacing_m, len(row)), len(row))


@lru_cache(maxsize=32)
def _memory_waves(spacing_m: float, length: int) -> Complex:
    """The rfft, over so many points, of where the variance of the Golden Car's slope comes from, by the way back in
    steps of the grid; kept, for there are few such numbers.

    Road slopes are nearly white, so it is the square of the response to one step of slope, over its sum. Most of it
    comes from the last metre and a half, the rest from as far as the body swings on.
    """
    count = 2 * int(_FORGOTTEN_M / spacing_m)
    wave_number_cpm = np.asarray(np.fft.rfftfreq(count, spacing_m), dtype=np.float64)
    per_slope = np.zeros(len(wave_number_cpm), dtype=np.complex128)
    per_slope[1:] = golden_car_slope(wave_number_cpm[1:]) / (2j * pi * wave_number_cpm[1:])
    power = np.fft.irfft(per_slope, count)[: count // 2] ** 2
    return np.asarray(np.fft.rfft(power / power.sum(), length))
