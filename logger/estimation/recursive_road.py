"""Recursive estimation: what is known of road and sensor, carried from one block of readings to the next.

A block cannot be solved without the road's spectrum, its roughness from place to place, the noise, and what coarse
readings tell; none of them is known before it is solved. So each block is solved with what the one before it led to,
in a few steps from where that one ended, and the belief follows. The first block has none before it: it gets more
rounds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log, sqrt

import numpy as np
import numpy.typing as npt

from logger.estimation.car_response import CarResponse
from logger.estimation.hyperparameters import COMMON_ROAD, Belief, learnt, noise_factor, with_noise
from logger.estimation.iri_posterior import acceleration_variance_left, reading_noise_psd, vehicle_error_variance
from logger.estimation.local_variance import LocalRoughness, mean_told
from logger.estimation.quantisation import Readings, bounds, first_guess, improved, unexplained
from logger.estimation.road_solver import Block, Solution
from logger.estimation.road_spectrum import RoadSpectrum
from logger.estimation.sensor_noise import Sensor
from logger.estimation.time_grid import RATE_HZ, Samples

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
Bools = npt.NDArray[np.bool_]

_STEPS = 8
_FIRST_STEPS = 24
_FIRST_ROUNDS = 8
_COARSE_ROUNDS, _COARSE_STEPS = 2, 3
_MOST_DEVIATIONS = 3.0


@dataclass(frozen=True)
class SolvedBlock:
    """road      (k,) rfft of the elevations on the block's grid [m]
    variance     of a reading, noise, rounding and the car's own error, while it moved [(m/s2)2]
    """

    road: ComplexArray
    variance: float


class FollowedRoad:
    """One road after another, as one car and one sensor find them, on a distance grid of ``spacing_m``.

    vehicle_error    share that each axle's gain may be off, because no file fits a car
    """

    def __init__(self, car: CarResponse, sensor: Sensor, spacing_m: float, vehicle_error: float) -> None:
        self._car = car
        self._vehicle_error = vehicle_error
        self._sensor = sensor
        self._spacing_m = spacing_m
        self._belief = Belief(COMMON_ROAD)
        self.start_anew()

    def start_anew(self) -> None:
        """Another drive begins: spectrum and noise are taken along, all that belongs to places is not."""
        self._begun = False
        self._gaussian: Readings | None = None
        self._solved_last: tuple[Block, ComplexArray] | None = None
        self._local = LocalRoughness(self._spacing_m)

    @property
    def begun(self) -> bool:
        """A block of this drive has been solved."""
        return self._begun

    def move_on(self, fresh: Samples) -> None:
        """The next block is without its oldest samples, and has these behind."""
        if self._gaussian is None:
            return
        guess = first_guess(fresh.reading_mps2, self._sensor)
        self._gaussian = Readings(
            np.concatenate([self._gaussian.value_mps2[len(fresh):], guess.value_mps2]),
            np.concatenate([self._gaussian.variance[len(fresh):], guess.variance]),
        )

    def solved(self, block: Block, samples: Samples, read: Bools) -> SolvedBlock:
        """The block's road, while the belief follows; ``read`` (t,) says which samples count."""
        rounds, steps = (_COARSE_ROUNDS, _COARSE_STEPS) if self._sensor.is_coarse else (1, _STEPS)
        if not self._begun:
            rounds, steps = _FIRST_ROUNDS, _FIRST_STEPS
        before = self._belief.spectrum if self._begun else None
        self._begun = True
        for _ in range(rounds):
            result = self._round(block, samples, read, steps, before)
        return result

    def _round(
        self, block: Block, samples: Samples, read: Bools, steps: int, before: RoadSpectrum | None
    ) -> SolvedBlock:
        """Solve with what is believed, then believe what the solution says."""
        readings = self._as_gaussian(samples)
        there, _ = self.level_at(round(block.start_m / self._spacing_m), block.count)
        variance = readings.variance + vehicle_error_variance(
            self._car, block.mean_speed_mps, there, self._vehicle_error, RATE_HZ
        )
        weight = np.where(read, 1 / variance, 0.0)
        seen, seen_share = block.seen(read), block.seen_points(read) / block.count
        first, spectrum = round(block.start_m / self._spacing_m), self._belief.spectrum
        local = self._local.at(first, block.count).variance
        start = None if self._solved_last is None else block.carried_over(*self._solved_last)
        solution = block.solve(readings.value_mps2, weight, spectrum, local, steps, start)

        innovations = np.fft.irfft(solution.waves, block.count)
        told = mean_told(solution.gain, local[seen > 0])
        # A lone obstacle is no level: an innovation counts for the level with at most some expected deviations.
        expected = sqrt(2 * float(told.sum()) / block.count)
        white = np.clip(innovations / np.sqrt(local), -_MOST_DEVIATIONS * expected, _MOST_DEVIATIONS * expected)
        power = np.abs(np.fft.rfft(white)) ** 2 / block.count
        self._belief = learnt(self._belief, power, told, block.wave_number_cpm, seen_share, before)
        self._local.learn(first, innovations, local, solution.gain, seen)
        self._solved_last = block, block.same_road(solution.waves, spectrum, self._belief.spectrum)
        moving = weight[block.moving & read]
        typical = 1 / float(moving.mean()) if len(moving) else float(variance.mean())
        if self._sensor.is_coarse:
            self._gaussian = self._improved(readings, samples, read, block, solution, typical)
        else:
            residual = readings.value_mps2 - solution.fitted_mps2
            self._belief = with_noise(self._belief, residual, weight, 2 * seen_share * float(told.sum()))
        return SolvedBlock(solution.road, typical)

    def _as_gaussian(self, samples: Samples) -> Readings:
        if not self._sensor.is_coarse:
            noise = self._sensor.variance_mps2_2 * noise_factor(self._belief)
            return Readings(samples.reading_mps2, np.full(len(samples), noise))
        return first_guess(samples.reading_mps2, self._sensor) if self._gaussian is None else self._gaussian

    def _improved(
        self, readings: Readings, samples: Samples, read: Bools, block: Block, solution: Solution, variance: float
    ) -> Readings:
        speed_mps = block.mean_speed_mps
        noise_psd = reading_noise_psd(variance, RATE_HZ, speed_mps)
        left = acceleration_variance_left(self._car, speed_mps, self._belief.spectrum, noise_psd)
        low, high = bounds(samples.reading_mps2, samples.at_end, self._sensor.step_mps2)
        left += unexplained(solution.fitted_mps2[read], low[read], high[read], self._sensor)
        return improved(readings, low, high, solution.fitted_mps2, left, self._sensor)

    def level_at(self, first: int, count: int) -> tuple[RoadSpectrum, float]:
        """The spectrum at points ``first`` ... ``first + count - 1`` of the distance grid, and the standard error of
        its log level."""
        local = self._local.at(first, count)
        spectrum = self._belief.spectrum
        there = replace(spectrum, log_level=spectrum.log_level + log(float(local.variance.mean())))
        return there, sqrt(self._belief.log_level_std**2 + float(local.log_error.mean()))
