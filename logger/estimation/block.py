"""The road under one stretch of a drive, as far as the readings tell it: a least-squares problem, solved by FFT.

Problem. Readings y on a time grid are y = A r + drift + noise. r is the road on a grid of distance, A drives the car
over it with the speed as it was, so the rear axle meets the road a wheelbase later whatever the speed did, and the
road has a spectrum. The best estimate is that of a Kalman smoother or a Wiener filter; with changing speed neither is
a fixed filter.

Solution. The road is written r = F u with u white (amplitudes of its waves, each divided by its standard deviation).
Then the estimate solves (I + B' W B) u = B' W y with B = A F and W the weights of the readings (one over their
variance, 0 where there is none). A is quick to apply: waves to elevations by an inverse FFT, elevations to those under
each wheel by interpolation, and from there to the reading by an FFT in time; its transpose likewise. At constant
speed the matrix is nearly diagonal in u, which is the Wiener filter, and makes a preconditioner with which a few
steps of conjugate gradients are enough. Slow drift (gravity, tilt, braking, temperature) is a few cosines of broad
variance, eliminated exactly.

Both grids are periodic. In space the road goes on unseen for longer than it remembers; in time the first
``ENTRY_S`` are where the car's memory of what came before dies, and their readings must have no weight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np
import numpy.typing as npt

from logger.estimation.car_response import HIGHEST_HZ, WAVE_NUMBERS_CPM, CarResponse
from logger.estimation.road_spectrum import RoadSpectrum

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]

ENTRY_S = 2.5
UNSEEN_M = 60.0
SLOWEST_MPS = 0.4
_MARGIN_M = 5.0
_SPEED_CLASSES_PER_E = 10
_DRIFT_BELOW_HZ = 0.1
_DRIFT_MPS2 = 0.05


@dataclass(frozen=True)
class Solution:
    """waves     (k,) rfft of the white amplitudes u
    road         (k,) rfft of the elevations on the distance grid [m]
    fitted_mps2  (t,) the readings that this road and the drift explain
    drift_mps2   (t,) the drift alone
    gain         (k,) information over prior for each wave; g / (1 + g) of its variance is told by the readings
    """

    waves: ComplexArray
    road: ComplexArray
    fitted_mps2: Array
    drift_mps2: Array
    gain: Array


class TimeGrid:
    """What is the same for every block of ``count`` samples (even) at ``rate_hz``: how the car answers the road under
    each wheel, by frequency, and what drift looks like."""

    def __init__(self, car: CarResponse, count: int, rate_hz: float) -> None:
        self.car = car
        self.rate_hz = rate_hz
        self.by_wheel = car.by_wheel(np.asarray(np.fft.rfftfreq(count, 1 / rate_hz), dtype=np.float64))
        half_waves = np.arange(1, int(2 * _DRIFT_BELOW_HZ * count / rate_hz) + 1)
        phase = pi * half_waves * (np.arange(count)[:, None] + 0.5) / count
        self.drift = np.hstack([np.ones((count, 1)), np.cos(phase)])
        # The constant is gravity: nothing is known of it. The rest is small.
        self.drift_precision = np.array([1e-6, *np.full(len(half_waves), _DRIFT_MPS2**-2)])


class Block:
    """One stretch of a drive on a uniform time grid, ready to be solved for readings, weights and spectra.

    distance_m    (t,) where the front axle is, not decreasing
    spacing_m     of the distance grid

    ``start_m`` is the first distance of the grid, a whole multiple of ``align_m``, and ``count`` its number of points;
    ``moving`` (t,) says where the car is not standing, ``mean_speed_mps`` how fast it is there.
    """

    def __init__(self, grid: TimeGrid, distance_m: Array, spacing_m: float, align_m: float) -> None:
        car, rate_hz = grid.car, grid.rate_hz
        self._grid = grid
        self.spacing_m = spacing_m
        first_m = distance_m[0] - car.behind_m.max() - _MARGIN_M
        self.start_m = float(np.floor(first_m / align_m) * align_m)
        self.count = _fft_length((distance_m[-1] + _MARGIN_M + UNSEEN_M - self.start_m) / spacing_m)
        self.wave_number_cpm = np.asarray(np.fft.rfftfreq(self.count, spacing_m), dtype=np.float64)
        speed_mps = np.gradient(distance_m) * rate_hz
        self._highest_cpm = HIGHEST_HZ / max(float(speed_mps.max()), SLOWEST_MPS)
        # Reading between two points by a straight line weakens short waves; the division makes up for it.
        n = self.wave_number_cpm
        self._averaged = np.sinc(n * car.contact_patch_m) / np.sinc(n * spacing_m) ** 2
        place = (distance_m[:, None] - car.behind_m - self.start_m) / spacing_m
        self._low = np.floor(place).astype(np.int64)
        self._share = place - self._low
        self.moving = speed_mps > SLOWEST_MPS
        self.mean_speed_mps = float(speed_mps[self.moving].mean()) if self.moving.any() else SLOWEST_MPS
        self._speed_class = np.round(np.log(np.maximum(speed_mps, SLOWEST_MPS)) * _SPEED_CLASSES_PER_E).astype(int)

    def solve(
        self, reading_mps2: Array, weight: Array, spectrum: RoadSpectrum, steps: int, start: ComplexArray | None = None
    ) -> Solution:
        """The most probable road.

        reading_mps2    (t,) readings
        weight          (t,) one over the variance of each, 0 where there is none [(m/s2)-2]
        steps           of conjugate gradients
        start           ``waves`` of an earlier solution of this block, to go on from
        """
        deviation = self._wave_deviations(spectrum)
        shape = deviation * self._averaged
        weighted = weight[:, None] * self._grid.drift
        inner = np.linalg.inv(self._grid.drift.T @ weighted + np.diag(self._grid.drift_precision))

        def weigh(row: Array) -> Array:
            """The weights, less what the drift can explain (Woodbury)."""
            result: Array = weight * row - weighted @ (inner @ (weighted.T @ row))
            return result

        def normal(waves: ComplexArray) -> ComplexArray:
            return waves + self._transposed(weigh(self._applied(waves, shape)), shape)

        gain = self._gain(weight) * deviation**2
        target = self._transposed(weigh(reading_mps2), shape)
        waves = _conjugate_gradients(normal, target, 1 / (1 + gain), steps, start)
        explained = self._applied(waves, shape)
        drift = self._grid.drift @ (inner @ (weighted.T @ (reading_mps2 - explained)))
        return Solution(waves, waves * deviation, explained + drift, drift, gain)

    def _wave_deviations(self, spectrum: RoadSpectrum) -> Array:
        """Standard deviation of each wave of the road; 0 for the mean and for waves that the time grid cannot hold."""
        psd = spectrum.psd(self.wave_number_cpm)
        psd[(self.wave_number_cpm == 0) | (self.wave_number_cpm > self._highest_cpm)] = 0.0
        deviation: Array = np.sqrt(psd / (2 * self.spacing_m))
        return deviation

    def _gain(self, weight: Array) -> Array:
        """Information on each wave where the road is seen, were the speeds mixed evenly along it."""
        log_n = np.log(np.maximum(self.wave_number_cpm, WAVE_NUMBERS_CPM[0]))
        total = np.zeros(len(log_n))
        moving = self.moving & (weight > 0)
        for speed_class in np.unique(self._speed_class[moving]):
            power = self._grid.car.power(float(np.exp(speed_class / _SPEED_CLASSES_PER_E)))
            seen = weight[moving & (self._speed_class == speed_class)].sum()
            total += seen * np.interp(log_n, np.log(WAVE_NUMBERS_CPM), np.sqrt(power), right=0.0) ** 2
        return total / max(self.seen_points(weight > 0), 1)

    def seen(self, read: npt.NDArray[np.bool_]) -> Array:
        """(count,) 1 where the front wheel passed a point of the distance grid while there were readings, else 0."""
        seen = np.zeros(self.count + 1)
        reach = np.maximum(np.diff(self._low[:, 0], append=self._low[-1, 0] + 1), 1)
        np.add.at(seen, self._low[read, 0], 1.0)
        np.add.at(seen, np.minimum(self._low[read, 0] + reach[read], self.count), -1.0)
        result: Array = (np.cumsum(seen)[:-1] > 0).astype(np.float64)
        return result

    def seen_points(self, read: npt.NDArray[np.bool_]) -> int:
        """How many points of the distance grid the car passed between its first and its last reading."""
        at = np.flatnonzero(read)
        return int(self._low[at[-1], 0] - self._low[at[0], 0]) if len(at) else 0

    def _applied(self, waves: ComplexArray, shape: Array) -> Array:
        """B u: the readings that a road makes."""
        road = np.fft.irfft(waves * shape, self.count)
        total = np.zeros(len(self._grid.by_wheel), dtype=complex)
        for wheel in range(self._low.shape[1]):
            low, share = self._low[:, wheel], self._share[:, wheel]
            total += np.fft.rfft(road[low] * (1 - share) + road[low + 1] * share) * self._grid.by_wheel[:, wheel]
        return np.fft.irfft(total, len(self._low))

    def _transposed(self, row: Array, shape: Array) -> ComplexArray:
        """B' times a row in time."""
        spectrum = np.fft.rfft(row)
        road = np.zeros(self.count)
        for wheel in range(self._low.shape[1]):
            low, share = self._low[:, wheel], self._share[:, wheel]
            back = np.fft.irfft(spectrum * np.conj(self._grid.by_wheel[:, wheel]), len(row))
            road += np.bincount(low, back * (1 - share), self.count) + np.bincount(low + 1, back * share, self.count)
        return np.fft.rfft(road) * shape


def _conjugate_gradients(
    matrix: Callable[[ComplexArray], ComplexArray],
    target: ComplexArray,
    preconditioner: Array,
    steps: int,
    start: ComplexArray | None,
) -> ComplexArray:
    """Solve matrix x = target for a real row given by its rfft (conjugate gradients of Hestenes and Stiefel)."""
    x = preconditioner * target if start is None else start
    residual = target - matrix(x)
    direction = preconditioned = preconditioner * residual
    size = _product(residual, preconditioned)
    for _ in range(steps):
        if size <= 0.0:
            break
        image = matrix(direction)
        step = size / _product(direction, image)
        x = x + step * direction
        residual = residual - step * image
        preconditioned = preconditioner * residual
        size, before = _product(residual, preconditioned), size
        direction = preconditioned + (size / before) * direction
    return x


def _product(one: ComplexArray, other: ComplexArray) -> float:
    """Scalar product of two real rows of even length given by their rfft, but for a constant factor."""
    both = 2 * np.vdot(one, other).real
    return float(both - (one[0] * other[0]).real - (one[-1] * other[-1]).real)


def _fft_length(least: float) -> int:
    """The next 2^k or 3 2^k: quick to transform, and even."""
    power = 1 << int(np.ceil(np.log2(least)))
    return power * 3 // 4 if power * 3 // 4 >= least else power
