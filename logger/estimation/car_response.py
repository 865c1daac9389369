"""How a car's reading depends on the road, by frequency: the bridge from a car to the estimator. Its acceleration at a
steady speed, and what even readings of it leave open."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import exp, log

import numpy as np

from logger.arrays import Array, Complex
from logger.estimation.road_spectrum import RoadSpectrum, log_waves
from logger.estimation.time_grid import frequencies_hz
from logger.roads.iri import STANDARD_SPEED_MPS, TIRE_BASE_M
from logger.vehicle.linear_car import LinearCar, frequency_response
from logger.vehicle.models import GOLDEN_CAR, quarter_car
from logger.vehicle.structure import suspension_travel

HIGHEST_HZ = 42.0  # recorders pass less from here on
SPEEDS_PER_E = 20  # speeds within 2.5 % share one response
WAVE_NUMBERS_CPM = np.geomspace(0.004, 3.3, 300)
LOG_WAVES = log_waves(WAVE_NUMBERS_CPM)
WAVE_NUMBER_STEPS_CPM = WAVE_NUMBERS_CPM * log(WAVE_NUMBERS_CPM[1] / WAVE_NUMBERS_CPM[0])


class CarResponse:
    """The reading of one car, as a function of the road under its axles; left and right wheels see the same road.

    off    the cars that it may be instead: each a standard error away, in directions that have nothing to do with one
           another
    is_measured    those are of a car that was measured; False: they are what cars are like

    ``behind_m`` (x,) is how far behind the front axle each axle stands [m], the front axle first.
    """

    def __init__(self, car: LinearCar, off: Sequence[LinearCar] = (), is_measured: bool = True) -> None:
        self._car = car
        self.is_measured = is_measured
        self.off = tuple(off)
        self._powers: dict[int, Array] = {}
        self._apart: tuple[float, Array] | None = None
        self._changes: dict[int, Complex] = {}
        self.behind_m, self._axle = np.unique(car.structure.behind_m, return_inverse=True)
        self.contact_patch_m = car.structure.contact_patch_m

    def by_axle(self, f_hz: Array) -> Complex:
        """Reading per elevation under each axle, (x, f) [1/s2]; nothing at 0 Hz and above what recorders pass."""
        seen = (f_hz > 0) & (f_hz <= HIGHEST_HZ)
        response = np.zeros((len(self.behind_m), len(f_hz)), np.complex128)
        response[:, seen] = (self._car.by_wheel(f_hz[seen]) @ np.eye(len(self.behind_m))[self._axle]).T
        return response

    def power_apart(self, speed_mps: float) -> Array:
        """Sum over the axles of each one's own squared gain, at ``WAVE_NUMBERS_CPM`` [1/s4], where ``power`` is the
        square of their sum: where both axles' shares cancel, what a wrong model leaves is as large as they are. The
        last one is kept."""
        if self._apart is not None and self._apart[0] == speed_mps:
            return self._apart[1]
        gain = np.abs(self.by_axle(WAVE_NUMBERS_CPM * speed_mps)) * np.sinc(WAVE_NUMBERS_CPM * self.contact_patch_m)
        self._apart = speed_mps, (gain**2).sum(axis=0)
        return self._apart[1]

    def power(self, speed_mps: float) -> Array:
        """Squared gain from road to reading at ``WAVE_NUMBERS_CPM`` [1/s4]: delays and contact patch included.

        The speed is rounded to steps of 5 %, and what was computed is kept.
        """
        key = round(log(speed_mps) * SPEEDS_PER_E)
        if key not in self._powers:
            speed_mps = exp(key / SPEEDS_PER_E)
            f_hz = WAVE_NUMBERS_CPM * speed_mps
            self._powers[key] = np.abs(self._car.response(f_hz, speed_mps)) ** 2 * (f_hz <= HIGHEST_HZ)
        return self._powers[key]

    def changes(self, speed_mps: float) -> Complex:
        """What the gain from road to reading, at ``WAVE_NUMBERS_CPM``, changes by for each of the cars that it may be
        instead, as a share of its own (o, n). Where the gain is nothing that may be any number; speeds as ``power``."""
        key = round(log(speed_mps) * SPEEDS_PER_E)
        if key not in self._changes:
            speed_mps = exp(key / SPEEDS_PER_E)
            own, *others = (one.response(WAVE_NUMBERS_CPM * speed_mps, speed_mps) for one in (self._car, *self.off))
            self._changes[key] = np.array([other / own - 1 for other in others]).reshape(-1, len(own))
        return self._changes[key]


@dataclass(frozen=True)
class SteadyMotion:
    """psd    (f,) spectrum of the acceleration, one-sided, at frequencies evenly from 0 to half the rate [(m/s2)2/Hz]
    rate_hz   of the readings

    Readings are even where each has the same variance [(m/s2)2]; they leave S N / (S + N), N their own spectrum.
    """

    psd: Array
    rate_hz: float

    @property
    def variance(self) -> float:
        """Of the acceleration before anything is read [(m/s2)2]."""
        return float(self.psd.mean()) * self.rate_hz / 2

    def covariance_left(self, variance: float) -> Array:
        """What is left by lag, (2 (f - 1),), as in a record that repeats [(m/s2)2], for readings of one variance."""
        return np.fft.irfft(self._resolved(variance), 2 * (len(self.psd) - 1)) * variance

    def resolved_per_reading(self, variance: Array | float) -> Array | float:
        """Degrees of freedom that the motion takes of each reading, 0 to 1; for one variance or for many."""
        return self._resolved(variance).sum(axis=-1) / len(self.psd)

    def _resolved(self, variance: Array | float) -> Array:
        """Share S / (S + N) of each frequency, (..., b) for variances (...), up to the last that has any motion."""
        noise = np.asarray(2 * variance / self.rate_hz)[..., None]
        return np.asarray(self._moved / (self._moved + noise))

    @cached_property
    def _moved(self) -> Array:
        """The spectrum up to its last frequency that is not 0: readings are taken far more often than a car moves."""
        moved = np.flatnonzero(self.psd)
        return self.psd[:moved[-1] + 1] if len(moved) else self.psd[:1]


def steady_motion(car: CarResponse, speed_mps: float, spectrum: RoadSpectrum, rate_hz: float, count: int
                  ) -> SteadyMotion:
    """What such a road makes of the car, at the frequencies of ``count`` samples (even)."""
    per_hz = car.power(speed_mps) * spectrum.psd_of(LOG_WAVES) / speed_mps
    f_hz = frequencies_hz(count, rate_hz)
    return SteadyMotion(np.interp(f_hz / speed_mps, WAVE_NUMBERS_CPM, per_hz, left=0.0, right=0.0), rate_hz)


@lru_cache(maxsize=32)
def golden_car_on_grid(count: int, spacing_m: float) -> Complex:
    """``golden_car_slope`` for the rfft of ``count`` elevations at this spacing [m]; kept, for there are few counts."""
    return golden_car_slope(np.asarray(np.fft.rfftfreq(count, spacing_m), dtype=np.float64))


def golden_car_slope(wave_number_cpm: Array) -> Complex:
    """Slope between body and wheel of the Golden Car per elevation [1/m], with its tire's 250 mm average.

    As in the exact filter (``logger.roads.iri``) the average reaches ahead of where the value counts.
    """
    car = quarter_car(GOLDEN_CAR)
    rate = frequency_response(car, [suspension_travel(car, 0, order=1)], wave_number_cpm * STANDARD_SPEED_MPS)[:, 0, 0]
    ahead = np.exp(1j * np.pi * wave_number_cpm * TIRE_BASE_M)
    return rate / STANDARD_SPEED_MPS * np.sinc(wave_number_cpm * TIRE_BASE_M) * ahead
