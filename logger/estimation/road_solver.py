"""The road under one stretch of a drive, as far as the readings resolve it: a least-squares problem, solved by FFT.

Problem. Readings y on a time grid are y = A r + drift + noise. r is the road on a grid of distance, A drives the car
over it with the speed as it was, so the rear axle meets the road a wheelbase later whatever the speed did, and the
road has a spectrum. The best estimate is that of a Kalman smoother or a Wiener filter; with changing speed neither is
a fixed filter.

Solution. The road is written r = F v: F shapes its spectrum, and the innovations v are white, but for a variance D that
may differ from place to place. Then the estimate solves (1/D + B' W B) v = B' W y with B = A F and W the weights of the
readings (one over their variance, 0 where there is none). A is quick to apply: waves to elevations by an inverse FFT,
elevations to those under each axle by interpolation, and from there to the reading by an FFT in time; its transpose
likewise. At constant speed and with D = 1 the matrix is nearly diagonal in the waves of v, which is the Wiener filter,
and makes a preconditioner with which a few steps of conjugate gradients are enough. Slow drift (gravity, tilt, braking,
temperature) is a constant and a few cosines, eliminated exactly.

Both grids are periodic. In space the road goes on unseen for longer than it remembers; in time the first
``ENTRY_S`` are where the car's memory of what came before dies, and their readings must have no weight.
"""

from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from math import pi

import numpy as np

from logger.arrays import Array, Bools, Complex
from logger.estimation.car_response import HIGHEST_HZ, WAVE_NUMBERS_CPM, CarResponse
from logger.estimation.road_spectrum import RoadSpectrum, log_waves
from logger.estimation.time_grid import at_readings, frequencies_hz

ENTRY_S = 2.5
UNSEEN_M = 60.0
SLOWEST_MPS = 0.4
MARGIN_M = 5.0
_FAST_SHARE = 0.98
_SPEED_CLASSES_PER_E = 10
_DRIFT_BELOW_HZ = 0.1
_WORTH_A_STEP = 5.0  # of log probability; a lone bump on a smooth road needs more steps than roads do
_MOST_TIMES = 4
_LOG_WAVE_NUMBERS = np.log(WAVE_NUMBERS_CPM)


@dataclass(frozen=True)
class Solution:
    """waves     (k,) rfft of the innovations v on the distance grid
    road         (k,) rfft of the elevations there [m]
    innovations  (n,) v itself, point by point
    fitted_mps2  (y,) the readings that this road and the drift explain
    drift_mps2   (y,) the drift alone
    drift        (d,) amplitudes of its constant and cosines [m/s2]
    drift_information    (d, d) of the readings about them, were the road known [(m/s2)-2]
    gain         (k,) information over prior of each wave where D is 1; the readings resolve g / (1 + g) of its variance
    """

    waves: Complex
    road: Complex
    innovations: Array
    fitted_mps2: Array
    drift_mps2: Array
    drift: Array
    drift_information: Array
    gain: Array


class TimeGrid:
    """What is the same for every block of ``count`` samples (even) at ``rate_hz``, each read ``reads`` times at even
    steps: how the car answers the road under each axle, by frequency, and what drift looks like."""

    def __init__(self, car: CarResponse, count: int, rate_hz: float, reads: int = 1) -> None:
        self.car = car
        self.rate_hz = rate_hz
        self.reads = reads
        self.by_axle = car.by_axle(frequencies_hz(count, rate_hz))
        in_a_step = np.zeros_like(self.by_axle)
        in_a_step[:, 1:] = self.by_axle[:, 1:] / np.arange(1, self.by_axle.shape[1])
        power = np.fft.irfft(1j * in_a_step) ** 2
        self.step_power = np.fft.rfft(power / power.sum(axis=1, keepdims=True))
        self.drift = _drift(count * reads, int(2 * _DRIFT_BELOW_HZ * count / rate_hz))

    def drift_precision(self, variance: float) -> Array:
        """Of the constant, which is gravity and of which nothing is known, and of the cosines (1 + half_waves,) of so
        much variance each [(m/s2)-2]."""
        return np.array([1e-6, *np.full(len(self.drift) - 1, 1 / variance)])

    def drift_evidence(self, solution: Solution, variance: float, share: float) -> tuple[Array, float, float]:
        """Variance (y,) that the readings leave of the drift [(m/s2)2], and slope and expected curvature of their log
        evidence in the logarithm of the ``variance`` of its cosines (MacKay 1992), where the road, which is not known
        either, leaves a ``share`` of what they say of it."""
        left = np.linalg.inv(share * solution.drift_information + np.diag(self.drift_precision(variance)))
        told = 1 - np.diag(left)[1:] / variance
        slope = 0.5 * float(np.sum(solution.drift[1:] ** 2 / variance - told))
        return np.einsum("ij,ij->j", left @ self.drift, self.drift), slope, 0.5 * float(told @ told)


@lru_cache(maxsize=2)
def _drift(count: int, half_waves: int) -> Array:
    """A constant and so many cosines (1 + half_waves, count); kept, for they are those of any car."""
    phase = pi * np.arange(half_waves + 1)[:, None] * (np.arange(count) + 0.5) / count
    return np.cos(phase)


class Block:
    """One stretch of a drive on a uniform time grid of t samples, ready to be solved for its y readings, a whole
    multiple of that, weights and spectra.

    distance_m    (t,) where the front axle is, not decreasing
    spacing_m     of the distance grid

    ``car`` is how the car answers, ``start_m`` the first distance of the grid, a whole multiple of ``align_m``, and
    ``count`` its number of points;
    ``moving`` (t,) says where the car is not standing, ``mean_speed_mps`` how fast it is there.
    """

    def __init__(self, grid: TimeGrid, distance_m: Array, spacing_m: float, align_m: float) -> None:
        car, rate_hz = grid.car, grid.rate_hz
        self.grid = grid
        self.car = car
        self.spacing_m = spacing_m
        first_m = distance_m[0] - car.behind_m.max() - MARGIN_M
        self.start_m = float(np.floor(first_m / align_m) * align_m)
        self.count = quick_fft_length((distance_m[-1] + MARGIN_M + UNSEEN_M - self.start_m) / spacing_m)
        self.wave_number_cpm, self.log_waves, self._log_n, self._averaged = _waves_of(
            self.count, spacing_m, car.contact_patch_m)
        speed_mps = np.gradient(distance_m) * rate_hz
        # Not the highest speed: a single place that is wrong by metres must not cost the short waves of the block.
        self._highest_cpm = HIGHEST_HZ / max(float(np.quantile(speed_mps, _FAST_SHARE)), SLOWEST_MPS)
        place = (distance_m - car.behind_m[:, None] - self.start_m) / spacing_m
        low = np.floor(place).astype(np.int64)
        self._front = low[0]
        self._advance = np.diff(self._front, append=self._front[-1])
        # (2, axles, t): the points on either side of each axle, and their shares in the elevation there
        self._points = np.stack([low, low + 1])
        self._shares = np.stack([1 - (place - low), place - low])
        self.moving = speed_mps > SLOWEST_MPS
        self.mean_speed_mps = float(speed_mps[self.moving].mean()) if self.moving.any() else SLOWEST_MPS
        self._speed_class = np.round(np.log(np.maximum(speed_mps, SLOWEST_MPS)) * _SPEED_CLASSES_PER_E).astype(int)

    def on(self, grid: TimeGrid) -> "Block":
        """The same stretch, driven by a car whose axles stand as this one's do and that answers otherwise."""
        other = copy(self)
        other.grid, other.car = grid, grid.car
        return other

    def solve(self, reading_mps2: Array, weight: Array, spectrum: RoadSpectrum, relative_variance: Array,
              drift_variance: float, steps: int, start: Complex | None = None) -> Solution:
        """The most probable road.

        reading_mps2    (y,) readings
        weight          (y,) one over the variance of each, 0 where there is none [(m/s2)-2]
        relative_variance    (count,) of the road at each point, about 1
        drift_variance    of each cosine of the drift [(m/s2)2]
        steps           of conjugate gradients (Hestenes and Stiefel), from ``start`` or from a flat road
        start           ``waves`` of an earlier solution of this block to go on from, or ``carried_over`` ones
        """
        factor = self.wave_factors(spectrum)
        shaped = factor * self._averaged
        gain = self._gain(weight) * np.abs(factor) ** 2
        weighted = self.grid.drift * weight
        information = weighted @ self.grid.drift.T
        inner = np.linalg.inv(information + np.diag(self.grid.drift_precision(drift_variance)))
        pair = np.empty((2, len(factor)), np.complex128)

        def weigh(row: Array) -> Array:
            """The weights, less what the drift can explain (Woodbury)."""
            return np.asarray(weight * row - (inner @ (weighted @ row)) @ weighted)

        def seen_as(waves: Complex) -> tuple[Array, Array]:
            """Innovations point by point, and the readings of the car on them."""
            np.multiply(waves, shaped, out=pair[0])
            pair[1] = waves
            elevation, white = np.fft.irfft(pair, self.count)
            return white, self._read(self._under(elevation))

        def brought_back(weighed: Array, unlikely: Array) -> tuple[Complex, Complex]:
            """A row in time under the car's transpose, and one on the distance grid, as waves of the innovations."""
            scattered, held = np.fft.rfft(np.stack([self._scattered(weighed), unlikely]))
            return np.conj(shaped) * scattered, held

        if start is None:
            waves: Complex = np.zeros(len(factor), np.complex128)
            white, explained = np.zeros(self.count), np.zeros(len(weight))
        else:
            waves = start * (factor != 0)
            white, explained = seen_as(waves)
        # The prior precision of innovations is one over their variance from point to point.
        pull, held = brought_back(weigh(reading_mps2 - explained), white / relative_variance)
        residual = pull - held
        direction, before = np.zeros_like(waves), np.inf
        for done in range(1, _MOST_TIMES * steps + 1):
            preconditioned = residual / (1 + gain)
            size = _product(residual, preconditioned)
            if size <= 0.0:
                break
            direction = preconditioned + (size / before) * direction
            along, image = seen_as(direction)
            unlikely, weighed = along / relative_variance, weigh(image)
            bend = float(along @ unlikely + image @ weighed)
            if bend <= 0.0:  # of a road that is as good as flat, in which the smallest numbers end
                break
            step = size / (self.count * bend)
            waves = waves + step * direction
            white = white + step * along
            explained = explained + step * image
            is_enough = step * size < 2 * self.count * _WORTH_A_STEP
            if done >= steps and is_enough:
                break
            if done < _MOST_TIMES * steps:
                pull, held = brought_back(weighed, unlikely)
                residual = residual - step * (pull + held)
            before = size
        amplitudes = inner @ (weighted @ (reading_mps2 - explained))
        drift = amplitudes @ self.grid.drift
        return Solution(waves, waves * factor, white, explained + drift, drift, amplitudes, information, gain)

    def carried_over(self, earlier: "Block", waves: Complex) -> Complex:
        """``waves`` of an earlier block on the same spacing as they lie in this one; road that is new is still flat.

        Innovations are local, so they can be cut and shifted where elevations would get an edge.
        """
        if (earlier.start_m, earlier.count) == (self.start_m, self.count):
            return waves
        white = np.fft.irfft(waves, earlier.count)
        behind = round((self.start_m - earlier.start_m) / self.spacing_m)
        kept = white[behind: min(earlier.count, behind + self.count)] if behind >= 0 else white[:0]
        return np.fft.rfft(kept, self.count)

    def same_road(self, waves: Complex, old: RoadSpectrum, new: RoadSpectrum) -> Complex:
        """``waves`` found with one spectrum as they are with another, for the same road."""
        return waves * np.sqrt(old.psd_of(self.log_waves) / new.psd_of(self.log_waves))

    def wave_factors(self, spectrum: RoadSpectrum) -> Complex:
        """F: from white innovations to elevations [m]; 0 for the mean and for waves that the time grid cannot hold.

        A quarter of a wave behind, as an integral is: where the waviness is 2, innovations are the road's slope, so
        that what is rough at one place is an innovation at that place.
        """
        psd = spectrum.psd_of(self.log_waves)
        psd[(self.wave_number_cpm == 0) | (self.wave_number_cpm > self._highest_cpm)] = 0.0
        factor: Complex = -1j * np.sqrt(psd / (2 * self.spacing_m))
        factor[-1] = 0.0  # the shortest wave of the grid has no quarter
        return factor

    def _gain(self, weight: Array) -> Array:
        """Information on each wave where the road is seen, were the speeds mixed evenly along it."""
        weight = self._per_sample(weight)
        moving = self.moving & (weight > 0)
        slowest = self._speed_class.min()
        by_class = np.bincount(self._speed_class[moving] - slowest, weight[moving])
        found = np.flatnonzero(by_class)
        powers = [self.car.power(speed_mps) for speed_mps in np.exp((slowest + found) / _SPEED_CLASSES_PER_E).tolist()]
        total = by_class[found] @ np.array(powers).reshape(len(found), len(WAVE_NUMBERS_CPM))
        gain: Array = np.interp(self._log_n, _LOG_WAVE_NUMBERS, np.sqrt(total), right=0.0) ** 2
        return gain / max(self.seen_points(weight > 0), 1)

    def seen(self, read: Bools) -> Array:
        """(count,) 1 where the front wheel passed a point of the distance grid while there were readings, else 0."""
        first, reach = self._front[read], np.maximum(self._advance, 1)[read]
        begins, ends = (np.bincount(at, minlength=self.count + 1)
                        for at in (first, np.minimum(first + reach, self.count)))
        return np.asarray((np.cumsum(begins - ends)[:-1] > 0).astype(np.float64))

    def seen_points(self, read: Bools) -> int:
        """How many points of the distance grid the car passed while there were readings."""
        return int(self._advance @ read)

    def point_at(self, sample: int) -> int:
        """The point of the distance grid behind the front wheel at a sample."""
        return int(self._front[sample])

    def about(self, row: Array) -> Array:
        """Mean (count,) of a row (y,) over the readings that show a step of the road at each point, as much as they do
        with either axle; between the nearest where none does."""
        row = self._per_sample(row) / self.grid.reads
        back = np.fft.irfft(np.fft.rfft(row) * np.conj(self.grid.step_power), len(row))
        points = self._points.ravel()
        weight = np.bincount(points, self._shares.ravel(), self.count)
        total = np.bincount(points, (self._shares * back).ravel(), self.count)
        passed = np.flatnonzero(weight)
        return np.interp(np.arange(self.count), passed, total[passed] / weight[passed])

    def felt(self, row: Array) -> Array:
        """Mean (t,) of a row (count,) over the places whose steps of the road each sample shows, as much as it does."""
        low, high = row.take(self._points) * self._shares
        under = np.fft.rfft(low + high) * self.grid.step_power
        return np.maximum(np.fft.irfft(under, len(self._front)).mean(axis=0), row.min())

    def _per_sample(self, row: Array) -> Array:
        """Sum (t,) of a row (y,) over the readings of each sample."""
        return row.reshape(-1, self.grid.reads).sum(axis=1)

    def driven(self, road: Complex) -> Array:
        """A r: the readings (y,) [m/s2] of the car on a road, which is given by the rfft of its elevations [m]."""
        return self._read(self.under(road))

    def under(self, road: Complex) -> Complex:
        """The rfft in time of the elevations under the axles (x, f) [m], contact patch and all, of such a road."""
        return self._under(np.fft.irfft(road * self._averaged, self.count))

    def transposed(self, row: Array) -> Complex:
        """A' times a row (y,) in time, as an rfft."""
        return np.fft.rfft(self._scattered(row)) * self._averaged

    def _read(self, under: Complex) -> Array:
        first, *others = under * self.grid.by_axle
        for one in others:
            first += one
        return at_readings(first, len(self._front), self.grid.reads)

    def _under(self, elevation: Array) -> Complex:
        low, high = elevation.take(self._points) * self._shares
        return np.fft.rfft(low + high)

    def _scattered(self, row: Array) -> Array:
        count = len(self._front)
        back = np.fft.irfft(np.fft.rfft(row)[:count // 2 + 1] * np.conj(self.grid.by_axle), count)
        return np.asarray(np.bincount(self._points.ravel(), (self._shares * back).ravel(), self.count), np.float64)


@lru_cache(maxsize=32)
def _waves_of(count: int, spacing_m: float, contact_patch_m: float) -> tuple[Array, Array, Array, Array]:
    """Of a grid: wave numbers (k,) [cycle/m], ``log_waves`` of them, the logarithms of those (k,) that ``CarResponse``
    knows, and ``patch_gain``; kept, for there are few counts."""
    n = np.asarray(np.fft.rfftfreq(count, spacing_m), dtype=np.float64)
    return n, log_waves(n), np.log(np.maximum(n, WAVE_NUMBERS_CPM[0])), patch_gain(n, contact_patch_m, spacing_m)


def patch_gain(wave_number_cpm: Array, contact_patch_m: float, spacing_m: float) -> Array:
    """Gain (k,) from elevations on a grid to their mean over a contact patch, read by a straight line between points.

    Such a reading weakens short waves; the division makes up for it.
    """
    return np.asarray(np.sinc(wave_number_cpm * contact_patch_m) / np.sinc(wave_number_cpm * spacing_m) ** 2)


def _product(one: Complex, other: Complex) -> float:
    """Scalar product of two real rows of even length given by their rfft, times that length."""
    both = 2 * np.vdot(one, other).real
    return float(both - (one[0] * other[0]).real - (one[-1] * other[-1]).real)


def quick_fft_length(least: float) -> int:
    """The next of 4, 5, 6, 7 times a power of two from ``least`` samples up: quick to transform, and even."""
    power = 1 << max(int(np.ceil(np.log2(least))) - 3, 1)
    return next(factor * power for factor in (4, 5, 6, 7, 8) if factor * power >= least)
