"""The limit for rounding that nothing dithers: what the bounds of coarse readings tell of a window's IRI at most.

Rounding is no white noise of step / sqrt(12) where the noise does not blur the steps. So the limit is simulated. On an
ISO road at a steady speed all is Gaussian but the rounding; a Gibbs sampler (Geman and Geman, IEEE PAMI 6, 1984; Albert
and Chib, JASA 88, 1993) draws in turn

- what was rounded, given the acceleration: a normal number between the bounds of its reading;
- acceleration and gravity's place within a step, given what was rounded: a Wiener filter and a draw around it;
- the road's level, given its waves, and once more with the waves scaled along (interweaving; Yu and Meng, JCGS 20,
  2011).

Given what was rounded, the slope of the Golden Car is Gaussian: the mean of its absolute value, averaged over all
draws, is the best value for the IRI that there is. The sampler knows the car, the speed, the noise, the shape of the
road's spectrum, and of its level what the estimator knows before a drive: half of all roads lie between 1.1 and 5.7
m/km. Nothing of it is the estimator's. Two chains, from the middle of the steps and from anywhere in them, say whether
it has settled.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np
from scipy.special import erf, ndtr, ndtri

from logger.dsp.filters import frequency_response
from logger.roads.iri import TIRE_BASE_M, golden_car_sections
from logger.vehicle.vehicle import Vehicle

from ..support.drives.measured import SPACING_M, Road, recorder_response, road_response

Array = np.ndarray

COMMON_IRI = 2.5
LEVEL_DEVIATION = 1.8
_THINNED = 4
_TRIALS = 4
_WANTED = 0.35  # share of trials taken (Roberts and Rosenthal, Statistical Science 16, 2001: 0.23 to 0.44)


@dataclass(frozen=True)
class Lap:
    """One lap of ``road`` as it was read: bounds (n,) of each reading [m/s2], infinite at an end of the range."""

    road: Road
    speed_mps: float
    low: Array
    high: Array
    noise_mps2: float


class Chain:
    """One run of the sampler. ``anywhere``: it begins anywhere within the bounds, not in their middle."""

    def __init__(self, vehicle: Vehicle, lap: Lap, seed: int, anywhere: bool) -> None:
        self._rng = np.random.default_rng(seed)
        self._noise = lap.noise_mps2
        inner = np.clip(lap.low, np.min(lap.high) - 100, None), np.clip(lap.high, None, np.max(lap.low) + 100)
        shift = float(np.mean(0.5 * (inner[0] + inner[1])))
        self._low, self._high = lap.low - shift, lap.high - shift
        self._count = len(lap.low)
        self._rounded = 0.5 * (inner[0] + inner[1]) - shift
        if anywhere:
            self._rounded = self._rng.uniform(inner[0] - shift, inner[1] - shift)
        road, wave_number = lap.road, lap.road.wave_number_cpm
        step_cpm = wave_number[1]
        self._points = len(road.elevation_m)
        self._both = min(self._count // 2 + 1, len(wave_number))
        self._response = road_response(vehicle, wave_number, lap.speed_mps) * recorder_response(
            wave_number * lap.speed_mps)
        self._power = np.zeros(self._count // 2 + 1)  # of the acceleration's rfft, at the road's own level
        felt = road.spectrum_m3 * np.abs(self._response) ** 2 * step_cpm * self._count**2 / 2
        self._power[1: self._both] = felt[1: self._both]
        golden = frequency_response(golden_car_sections(SPACING_M), wave_number, 1 / SPACING_M)
        self._golden = golden * (np.exp(2j * pi * wave_number * TIRE_BASE_M) - 1) / TIRE_BASE_M
        self._golden[0] = 0.0
        self._slope_power = np.abs(self._golden) ** 2 * road.spectrum_m3 * step_cpm
        self._expected = 2 * log(COMMON_IRI / road.level_m_per_km)
        self._log_level = self._expected
        self._wide, self._far = 0.3, 3 * self._noise / sqrt(self._count)

    def mean_absolute_slope(self, sweeps: int) -> Array:
        """Mean absolute slope of the Golden Car (points,) [m/m]; a quarter of the sweeps is for settling."""
        total, taken = np.zeros(self._points), 0
        for sweep in range(sweeps):
            settling = sweep < sweeps // 4
            felt = self._felt(settling)
            self._rounded = self._between(felt)
            if not settling and sweep % _THINNED == 0:
                total += self._absolute()
                taken += 1
        return total / taken

    def _share(self) -> Array:
        """Of each wave, what the rounded numbers would tell if they were known."""
        power = np.exp(self._log_level) * self._power
        return power / (power + self._count * self._noise**2)

    def _felt(self, settling: bool) -> Array:
        """Acceleration and gravity's place, and the level on the way."""
        share, noise = self._share(), self._count * self._noise**2
        white = self._rng.standard_normal((2, len(share)))
        waves = share * np.fft.rfft(self._rounded) + (white[0] + 1j * white[1]) * np.sqrt(0.5 * share * noise)
        place = float(self._rounded.mean()) + self._noise / sqrt(self._count) * self._rng.standard_normal()
        if self._count % 2 == 0:
            waves[-1] = 0.0
        waves[0] = 0.0
        self._take_level(waves)
        return self._interwoven(np.fft.irfft(waves, self._count), place, settling)

    def _take_level(self, waves: Array) -> None:
        used = self._power > 1e-12 * self._power.max()
        number, power = np.count_nonzero(used), float((np.abs(waves[used]) ** 2 / self._power[used]).sum())

        def chance(level: float) -> float:
            return -number * level - power * np.exp(-level) + self._before(level)

        for _ in range(_TRIALS):
            trial = self._log_level + 1.5 / sqrt(number) * self._rng.standard_normal()
            if log(self._rng.uniform()) < chance(trial) - chance(self._log_level):
                self._log_level = trial

    def _interwoven(self, accel: Array, place: float, settling: bool) -> Array:
        """Level and place once more, while the waves go along and what was rounded is left open."""
        now = self._chance(accel + place) + self._before(self._log_level)
        for number in range(_TRIALS):
            by_level = number % 2 == 0
            level = self._log_level + by_level * self._wide * self._rng.standard_normal()
            other = accel * np.exp(0.5 * (level - self._log_level))
            elsewhere = place + (not by_level) * self._far * self._rng.standard_normal()
            then = self._chance(other + elsewhere) + self._before(level)
            taken = log(self._rng.uniform()) < then - now
            if taken:
                accel, place, self._log_level, now = other, elsewhere, level, then
            if settling and by_level:
                self._wide *= np.exp(0.1 * (taken - _WANTED))
            elif settling:
                self._far *= np.exp(0.1 * (taken - _WANTED))
        return accel + place

    def _before(self, level: float) -> float:
        return -0.5 * ((level - self._expected) / LEVEL_DEVIATION) ** 2

    def _tails(self, felt: Array) -> tuple[Array, Array, Array]:
        """Chances below both bounds, from the tail in which they keep their digits, and where that is the upper one."""
        low, high = (self._low - felt) / self._noise, (self._high - felt) / self._noise
        mirrored = low > 0
        return ndtr(np.where(mirrored, -high, low)), ndtr(np.where(mirrored, -low, high)), mirrored

    def _chance(self, felt: Array) -> float:
        low, high, _ = self._tails(felt)
        return float(np.log(np.maximum(high - low, 1e-300)).sum())

    def _between(self, felt: Array) -> Array:
        """Normal numbers around ``felt`` between the bounds."""
        low, high, mirrored = self._tails(felt)
        drawn = ndtri(np.clip(low + (high - low) * self._rng.uniform(size=self._count), 1e-300, 1 - 1e-16))
        return np.clip(felt + self._noise * np.where(mirrored, -drawn, drawn), self._low, self._high)

    def _absolute(self) -> Array:
        share = np.zeros(len(self._golden))
        share[: self._both] = self._share()[: self._both]
        waves = np.zeros(len(self._golden), dtype=complex)
        waves[: self._both] = np.fft.rfft(self._rounded)[: self._both] * self._points / self._count
        known = share > 0
        waves[known] *= share[known] * self._golden[known] / self._response[known]
        waves[~known] = 0.0
        mean = np.fft.irfft(waves, self._points)
        left = sqrt(np.exp(self._log_level) * float(self._slope_power @ (1 - share)))
        return sqrt(2 / pi) * left * np.exp(-0.5 * (mean / left) ** 2) + mean * erf(mean / left / sqrt(2))


def best_values(
    vehicle: Vehicle, lap: Lap, begin_m: Array, end_m: Array, sweeps: int
) -> tuple[Array, Array]:
    """IRI [m/km] between places (w,) by each of two chains."""
    def of(seed: int) -> Array:
        slope = Chain(vehicle, lap, seed, anywhere=seed > 0).mean_absolute_slope(sweeps)
        sums = np.concatenate([[0.0], np.cumsum(slope)]) * SPACING_M
        at_m = np.arange(len(sums)) * SPACING_M
        return 1000 * (np.interp(end_m, at_m, sums) - np.interp(begin_m, at_m, sums)) / (end_m - begin_m)

    return of(0), of(1)
