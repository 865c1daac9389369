"""The limit for rounding that nothing dithers: what the bounds of coarse readings tell of a window's IRI at most.

Rounding is no white noise of step / sqrt(12) where the noise does not blur the steps. So the limit is simulated, at a
steady speed on a road whose spectrum is known, and whose level may change along it. A sampler draws in turn

- the road's white innovations, by Hamiltonian steps, from their normal distribution times the probability that each
  reading is between its bounds, with gravity's place within a step (Neal, Handbook of Markov Chain Monte Carlo, 2011);
- levels of a stretch of cells as they are before anything is read, given those beside it, while the innovations keep
  their share of the level and so the road goes along (interweaving; Yu and Meng, JCGS 20, 2011);
- levels of all cells, given the road (forward filtering, backward sampling).

The mean of the absolute value of the Golden Car's slope, over all draws, is the best value for the IRI that there is.
The sampler knows the car, the speed, the noise or what is believed of it before, the shape of the spectrum and how
levels change, and of their mean what the estimator knows before a drive: half of all roads lie between 1.1 and 5.7
m/km. Nothing of it is the estimator's.

Two chains say whether it has settled: one begins on the true road, which is a draw of what is sought as good as any
other; one begins far from it, on a smooth road with much noise that becomes the true one.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log, pi, sqrt

import numpy as np
import scipy.fft
from scipy.special import log_ndtr, ndtr

from logger.dsp.filters import frequency_response
from logger.estimation.road_spectrum import COMMON_DEVIATIONS
from logger.estimation.sensor_noise import NoiseBelief
from logger.roads.iri import TIRE_BASE_M, golden_car_sections
from logger.vehicle.vehicle import Vehicle

from ..support.drives.measured import GRID_HZ, SPACING_M, Accelerometer, Drive, Road, recorder_response, road_response
from .estimator import LEAD_S

Array = np.ndarray

COMMON_IRI = 2.5
CELL_M = 2.0
_POINT_M = 1 / 6  # half of the shortest wave of the roads
_LEAPS, _WANTED = 14, 0.65  # of a Hamiltonian path; share of them taken (Beskos and others, Bernoulli 19, 2013)
_TRIALS = 12
_STRETCH_CELLS = (5, 100)


@dataclass(frozen=True)
class Lap:
    """One lap of ``road`` as it was read: bounds (n,) of each reading [m/s2], infinite at an end of the range; and what
    is believed of the noise before, where it is not known."""

    road: Road
    speed_mps: float
    low: Array
    high: Array
    noise_mps2: float
    guess: NoiseBelief | None = None

    @classmethod
    def of(cls, drive: Drive, sensor: Accelerometer, readings: Array, clipped: Array, guess: NoiseBelief | None = None
           ) -> Lap:
        """The lap of a steady drive that begins ``LEAD_S`` before it, of readings (t,), some at an end of the range."""
        speed_mps, begin = float(drive.speed_mps[0]), round(LEAD_S * GRID_HZ)
        lap = slice(begin, begin + round(drive.road.length_m / speed_mps * GRID_HZ))
        end = np.where(clipped[lap], np.sign(readings[lap] - np.median(readings)), 0.0)
        low = np.where(end < 0, -np.inf, readings[lap] - sensor.step_mps2 / 2)
        high = np.where(end > 0, np.inf, readings[lap] + sensor.step_mps2 / 2)
        return cls(drive.road, speed_mps, low, high, sensor.noise_mps2, guess)


@dataclass(frozen=True)
class Changes:
    """How a road's log level changes from cell to cell, a Markov chain: its values (l,) and the probability (l, l) of
    each after each. ``start`` (l,) is its stationary distribution."""

    values: Array
    moves: Array

    @property
    def start(self) -> Array:
        """(l,)"""
        system = np.vstack([self.moves.T - np.eye(len(self.values)), np.ones(len(self.values))])
        return np.maximum(np.linalg.lstsq(system, np.append(np.zeros(len(self.values)), 1.0), rcond=None)[0], 0.0)


NONE = Changes(np.zeros(1), np.ones((1, 1)))


class Chain:
    """One run of the sampler, from the true road or from ``afar``."""

    def __init__(self, vehicle: Vehicle, lap: Lap, changes: Changes, seed: int, afar: bool) -> None:
        self._rng = np.random.default_rng(seed)
        self._low, self._high, self._noise, self._afar = lap.low, lap.high, lap.noise_mps2, afar
        self._guess = lap.guess
        self._samples = len(lap.low)
        road = lap.road
        self._count = scipy.fft.next_fast_len(2 * ceil(road.length_m / _POINT_M / 2), real=True)
        self.spacing_m = road.length_m / self._count
        wave_number = scipy.fft.rfftfreq(self._count, self.spacing_m)
        factor = -1j * np.sqrt(road.spectrum_m3[: len(wave_number)] / (2 * self.spacing_m))
        factor[-1] = 0.0  # the shortest wave of the grid has no quarter
        self._both = min(self._samples // 2, len(wave_number) - 1)
        self._response = factor * road_response(vehicle, wave_number, lap.speed_mps) * recorder_response(
            wave_number * lap.speed_mps) * (self._samples / self._count)
        golden = frequency_response(golden_car_sections(SPACING_M), wave_number, 1 / SPACING_M)
        self._golden = golden * (np.exp(2j * pi * wave_number * TIRE_BASE_M) - 1) / TIRE_BASE_M * factor
        self._golden[0] = 0.0
        self._cell = (np.arange(self._count) * self.spacing_m // CELL_M).astype(int)
        self._points = np.bincount(self._cell)
        self._changes, self._start = changes, changes.start
        self._expected = 2 * log(COMMON_IRI / road.level_m_per_km)
        finite = np.isfinite(lap.low) & np.isfinite(lap.high)
        self._step_mps2 = float((lap.high - lap.low)[finite].mean())
        self._place = float(0.5 * (lap.high + lap.low)[finite].mean())
        self._size = 0.1
        at_m = (np.arange(len(self._points)) + 0.5) * CELL_M
        level = 2 * np.log(np.interp(at_m, np.arange(len(road.gain)) * SPACING_M, road.gain))
        self._levels = np.abs(level[:, None] - changes.values).argmin(axis=1)
        self._white = self._rng.standard_normal(self._count)
        self._common = self._expected if afar else 0.0
        if not afar:
            waves = scipy.fft.rfft(self._white * self._deviation())
            known = factor != 0
            elevation = scipy.fft.rfft(road.elevation_m)[: len(waves)] * self._count / len(road.elevation_m)
            waves[known] = elevation[known] / factor[known]
            self._white = scipy.fft.irfft(waves, self._count) / self._deviation()
        else:
            self._levels[:] = np.abs(changes.values).argmin()
            self._white *= 0.3

    def mean_absolute_slope(self, sweeps: int) -> Array:
        """Mean absolute slope of the Golden Car (points,) [m/m]; a quarter of the sweeps is for settling."""
        total, settling, noise = np.zeros(self._count), sweeps // 4, self._noise
        blurred = max(0.5 * self._step_mps2 / noise, 1.0) if self._afar else 1.0
        for sweep in range(sweeps):
            if self._guess is None or sweep < settling / 1.5:
                self._noise = noise * blurred ** max(1 - 1.5 * sweep / settling, 0.0)
            taken = self._drive()
            if sweep < settling:
                self._size *= np.exp(0.1 * (taken - _WANTED))
            self._interweave()
            self._level()
            if sweep >= settling:
                waves = scipy.fft.rfft(self._white * self._deviation()) * self._golden
                total += np.abs(scipy.fft.irfft(waves, self._count))
        return total / (sweeps - settling)

    def _deviation(self) -> Array:
        return np.exp(0.5 * (self._changes.values[self._levels][self._cell] + self._common))

    def _felt(self, deviation: Array, white: Array) -> Array:
        waves = np.zeros(self._samples // 2 + 1, dtype=complex)
        waves[: self._both] = (scipy.fft.rfft(white * deviation) * self._response)[: self._both]
        return scipy.fft.irfft(waves, self._samples)

    def _chance(self, felt: Array) -> tuple[float, Array]:
        """Log probability of all bounds, and its slope (n,), from the tail in which numbers keep their digits."""
        low, high = (self._low - felt) / self._noise, (self._high - felt) / self._noise
        mirrored = low > 0
        below, above = np.where(mirrored, -high, low), np.where(mirrored, -low, high)
        share = ndtr(above) - ndtr(below)
        far = share < 1e-200
        logs = np.where(far, log_ndtr(above), np.log(np.maximum(share, 1e-200)))
        slope = (np.exp(-0.5 * below**2 - logs) - np.exp(-0.5 * above**2 - logs)) / sqrt(2 * pi)
        slope = np.where(far, -above, slope)
        return float(logs.sum()), np.where(mirrored, -slope, slope) / self._noise

    def _drive(self) -> float:
        """A Hamiltonian path of innovations and gravity's place: the probability that it is taken."""
        deviation, variance = self._deviation(), self._noise**2 + self._step_mps2**2 / 12
        mass = 1 + np.mean(deviation**2) * np.abs(self._response) ** 2 * (self._count / self._samples) / variance
        place_mass = self._samples / variance
        rush = scipy.fft.irfft(scipy.fft.rfft(self._rng.standard_normal(self._count)) * np.sqrt(mass), self._count)
        place_rush = sqrt(place_mass) * self._rng.standard_normal()
        white, place, size = self._white, self._place, self._size * self._rng.uniform(0.7, 1.3)

        def pushed() -> tuple[float, Array, float]:
            chance, slope = self._chance(self._felt(deviation, white) + place)
            waves = np.zeros(len(mass), dtype=complex)
            waves[: self._both] = (scipy.fft.rfft(slope)[: self._both] * np.conj(self._response[: self._both])
                                   * self._count / self._samples)
            return chance - 0.5 * white @ white, deviation * scipy.fft.irfft(waves, self._count) - white, slope.sum()

        def on_the_way() -> Array:
            return np.asarray(scipy.fft.irfft(scipy.fft.rfft(rush) / mass, self._count))

        def energy() -> float:
            return float(0.5 * rush @ on_the_way() + 0.5 * place_rush**2 / place_mass - chance)

        chance, push, place_push = pushed()
        before = energy()
        for _ in range(_LEAPS):
            rush, place_rush = rush + 0.5 * size * push, place_rush + 0.5 * size * place_push
            white, place = white + size * on_the_way(), place + size * place_rush / place_mass
            chance, push, place_push = pushed()
            rush, place_rush = rush + 0.5 * size * push, place_rush + 0.5 * size * place_push
        probability = float(np.exp(min(before - energy(), 0.0)))
        if self._rng.uniform() < probability:
            self._white, self._place = white, place
        return probability

    def _interweave(self) -> None:
        now = self._chance(self._felt(self._deviation(), self._white) + self._place)[0] + self._before(self._common)
        for number in range(_TRIALS):
            levels, common, noise = self._levels, self._common, self._noise
            if number % 4 == 1 and self._guess is not None:
                self._noise *= np.exp(self._rng.choice((0.03, 0.2)) * self._rng.standard_normal())
            elif number % 4 == 0:
                self._common = common + self._rng.choice((0.05, 0.2)) * self._rng.standard_normal()
            elif len(self._start) > 1:
                self._levels = self._redrawn()
            then = self._chance(self._felt(self._deviation(), self._white) + self._place)[0] + self._before(
                self._common)
            if log(self._rng.uniform()) < then - now:
                now = then
            else:
                self._levels, self._common, self._noise = levels, common, noise

    def _before(self, common: float) -> float:
        """Log probability of the mean level, and of the noise, before anything is read."""
        off = (common - self._expected) / COMMON_DEVIATIONS[0]
        noise_off = 0.0 if self._guess is None else (log(self._noise) - self._guess.log_mean) / self._guess.log_std
        return -0.5 * (off**2 + noise_off**2)

    def _redrawn(self) -> Array:
        """Levels with those of a stretch as they may be between their neighbours."""
        cells = len(self._levels)
        length = round(np.exp(self._rng.uniform(*np.log(_STRETCH_CELLS))))
        first = int(self._rng.integers(1 - length, cells))
        part = np.arange(max(first, 0), min(first + length, cells))
        moves, levels = self._changes.moves, self._levels.copy()
        behind = [np.ones(len(moves)) if part[-1] + 1 == cells else moves[:, levels[part[-1] + 1]]]
        for _ in part[1:]:
            behind.append(moves @ behind[-1])
        for cell, later in zip(part.tolist(), reversed(behind), strict=True):
            levels[cell] = self._drawn((moves[levels[cell - 1]] if cell else self._start) * later)
        return levels

    def _drawn(self, weights: Array) -> int:
        sums = np.cumsum(weights)
        return int(np.searchsorted(sums, self._rng.uniform() * sums[-1]))

    def _level(self) -> None:
        """Levels of all cells, and their mean, for the road as it is."""
        slopes, values, moves = self._white * self._deviation(), self._changes.values, self._changes.moves
        power = np.bincount(self._cell, slopes**2)
        logs = -0.5 * (np.exp(-self._common) * power[:, None] * np.exp(-values) + self._points[:, None] * values)
        like = np.exp(np.maximum(logs - logs.max(axis=1, keepdims=True), -300.0))
        ahead, now = np.empty_like(like), self._start
        for cell, one in enumerate(like):
            now = ahead[cell] = (now * one) / (now @ one)
            now = now @ moves
        self._levels = np.empty(len(like), dtype=int)
        weights = ahead[-1]
        for cell in reversed(range(len(like))):
            self._levels[cell] = self._drawn(weights)
            weights = ahead[cell - 1] * moves[:, self._levels[cell]]
        total = float(power @ np.exp(-values[self._levels]))

        def chance(common: float) -> float:
            return -0.5 * (self._count * common + total * np.exp(-common)) + self._before(common)

        for _ in range(_TRIALS):
            trial = self._common + 2 / sqrt(self._count) * self._rng.standard_normal()
            if log(self._rng.uniform()) < chance(trial) - chance(self._common):
                self._common = trial
        self._white = slopes / self._deviation()


def best_values(
    vehicle: Vehicle, lap: Lap, begin_m: Array, end_m: Array, sweeps: int, changes: Changes = NONE
) -> tuple[Array, Array]:
    """IRI [m/km] between places (w,), on any lap, by each of two chains."""
    def of(seed: int) -> Array:
        chain = Chain(vehicle, lap, changes, seed, afar=seed > 0)
        sums = np.concatenate([[0.0], np.cumsum(chain.mean_absolute_slope(sweeps))]) * chain.spacing_m

        def up_to(place_m: Array) -> Array:
            laps, rest = np.divmod(place_m / chain.spacing_m, len(sums) - 1)
            return laps * sums[-1] + np.interp(rest, np.arange(len(sums)), sums)

        return 1000 * (up_to(end_m) - up_to(begin_m)) / (end_m - begin_m)

    return of(0), of(1)
