"""What readings say of the weighted acceleration of the ride itself, without noise and rounding.

The block's solution is the most probable acceleration of the car; its weighting is that of the ride. For a steady speed
what the readings leave open of it is, by frequency, |W|^2 S N / (S + N): S the spectrum that the road gives the car, N
that of the noise, W the weighting. Where nothing was read, all of |W|^2 S is.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, hypot, sqrt

import numpy as np

from logger.arrays import Array, Bools, Complex
from logger.comfort.uncertain_ride import (
    PowerSum,
    RideSums,
    expected_fourth_powers,
    expected_squares,
    fourth_power_sum,
    larger,
    square_sum,
)
from logger.estimation.car_response import CarResponse, steady_motion
from logger.estimation.road_spectrum import RoadSpectrum
from logger.estimation.sensor_noise import Sensor
from logger.estimation.time_grid import frequencies_hz
from logger.vehicle.named_parameters import WEAKEST

_LINES = 1024  # of time that spectra are taken over: ten seconds at 100 Hz, finer than the axles' comb in them
_LAGS_S = 1.0
_RUNNING_S = 1.0  # ISO 2631-1 clause 6.3.1
_RUNNING_PARTS = 2  # of that time: places of its end that are so near together go together
_LEAST_RESOLVED = 1e-3
_LEVEL_TRIAL = 0.3  # of the log level, to see what it does to a ride
# As found on drives of known ride, with gravity anywhere within a step (tests/benchmarks/comfort_noise.py): the share
# by which a ride is off beyond its error, times the noise and what blurs the steps, both in steps. Median of ten rows
# whose noise is 0.03 to 0.08 steps and whose blur 0.13 to 0.86, each within a factor of 2.3; at 0.16 steps nothing is.
_ROUGH_SHARE = 2.5e-3


@dataclass(frozen=True)
class RideKnowledge:
    """What the readings leave open of the weighted acceleration at a steady speed.

    variance       before anything is read [(m/s2)2]
    left           of it, once the readings are known
    correlation    (l,) of what is left, at lags of whole samples
    noise_share    of the variance of a reading's noise, what gets into the weighted acceleration
    accel_variance    of the acceleration before the weighting, before anything is read [(m/s2)2]
    """

    variance: float
    left: float
    correlation: Array
    noise_share: float
    accel_variance: float

    @property
    def resolved(self) -> float:
        """Share of the variance that the readings resolve."""
        return 1 - self.left / self.variance


@dataclass(frozen=True)
class RidePlace:
    """What is known where a ride was felt.

    car              there; ``speed_mps`` steady; ``variance`` of a reading there, as the solution took it [(m/s2)2]
    spectrum         of the road there, ``log_level_std`` the standard error of its log level
    sensor           as it is believed to be, ``noise_log_std`` the standard error of its noise, a share of it
    scale_log_std    share by which the ride may be off because of that
    other_psd        (f,) spectrum of what else moves the car, one-sided, at the frequencies of a block [(m/s2)2/Hz];
                     None: nothing
    """

    car: CarResponse
    speed_mps: float
    variance: float
    spectrum: RoadSpectrum
    log_level_std: float
    sensor: Sensor
    noise_log_std: float
    scale_log_std: float = 0.0
    other_psd: Array | None = None


class RidePosterior:
    """The weighted ride, in blocks of ``count`` samples at ``rate_hz``.

    response    of the weighting at frequencies (n,) [Hz]
    """

    def __init__(self, response: Callable[[Array], Complex], count: int, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._count = count
        self._response = response(frequencies_hz(count, rate_hz))
        self._f_hz = frequencies_hz(_LINES, rate_hz)
        self._power = np.abs(response(self._f_hz)) ** 2
        self._lags = round(_LAGS_S * rate_hz)
        self._running = round(_RUNNING_S * rate_hz)

    def weighted(self, accel_mps2: Array) -> Array:
        """The acceleration (count,) of a block, weighted; its first seconds are those of a start."""
        return np.fft.irfft(np.fft.rfft(accel_mps2) * self._response, self._count)

    def knowledge(self, place: RidePlace) -> tuple[RideKnowledge, RideKnowledge]:
        """At a place, and were the road there rougher by ``_LEVEL_TRIAL``."""
        road = steady_motion(place.car, place.speed_mps, place.spectrum, self._rate_hz, _LINES).psd
        other: Array | float = 0.0
        if place.other_psd is not None:
            # Each frequency as the mean of its own neighbourhood, so that every second one has the power of all.
            other = np.interp(self._f_hz, frequencies_hz(self._count, self._rate_hz),
                              np.convolve(place.other_psd, (0.25, 0.5, 0.25), mode="same"))
        return self._known(road + other, place.variance), self._known(exp(_LEVEL_TRIAL) * road + other, place.variance)

    def _known(self, ride: Array, variance: float) -> RideKnowledge:
        """Of a ride of this spectrum (f,) [(m/s2)2/Hz], for readings of this variance [(m/s2)2]."""
        noise = 2 * variance / self._rate_hz
        wiener_gain = ride / (ride + noise)
        step_hz = self._rate_hz / _LINES
        left = np.fft.irfft(self._power * wiener_gain * noise)[:self._lags] * self._rate_hz / 2
        return RideKnowledge(variance=float(self._power @ ride) * step_hz, left=float(left[0]),
                             correlation=left / left[0], noise_share=float((self._power * wiener_gain**2).mean()),
                             accel_variance=float(ride.sum()) * step_hz)

    def sums(self, weighted_mps2: Array, inside: Bools, unread: Bools, place: RidePlace) -> RideSums | None:
        """What the figures of the samples ``inside`` (t,) of a block are made of; None where the ride hides between two
        steps.

        weighted_mps2    (t,) most probable weighted acceleration
        unread           (t,) there was no reading
        """
        knows, louder = self.knowledge(place)
        rough = hypot(_rough_log_std(knows.accel_variance, place.sensor), place.scale_log_std)
        if rough > WEAKEST:
            return None
        numbers = np.flatnonzero(inside)
        span = slice(max(int(numbers[0]) - self._running + 1, 0), int(numbers[-1]) + 1)
        mean = weighted_mps2[span]
        std = _deviation(knows, unread[span])
        # Were the level higher, more of the readings would be taken for ride, and more be left open.
        stretched = mean * (louder.resolved / max(knows.resolved, _LEAST_RESOLVED))
        louder_std = _deviation(louder, unread[span])
        noise_off = 2 * place.noise_log_std * place.sensor.noise_rms_mps2**2 * knows.noise_share
        per_log_level = place.log_level_std / _LEVEL_TRIAL

        def squares_of(chosen: Bools | slice) -> PowerSum:
            squares = square_sum(mean[chosen], std[chosen], knows.correlation)
            more = expected_squares(stretched[chosen], louder_std[chosen])
            return replace(squares, shared=hypot((more - squares.mean) * per_log_level, noise_off * len(mean[chosen]),
                                                 2 * rough * squares.mean))

        chosen = inside[span]
        squares, fourths = squares_of(chosen), fourth_power_sum(mean[chosen], std[chosen], knows.correlation)
        more = expected_fourth_powers(stretched[chosen], louder_std[chosen])
        fourths = replace(fourths, shared=hypot((more - fourths.mean) * per_log_level, 6 * noise_off * squares.mean,
                                                4 * rough * fourths.mean))
        energy = np.concatenate([[0.0], np.cumsum(mean**2 + std**2)])
        ends = numbers - span.start + 1
        sums = energy[ends] - energy[np.maximum(ends - self._running, 0)]
        largest, before = None, 0
        for part in np.array_split(np.arange(len(ends)), 1 + len(ends) // (self._running // _RUNNING_PARTS)):
            end = int(ends[part[np.argmax(sums[part])]])
            running = squares_of(slice(max(end - self._running, 0), end))
            common = max(1 - (end - before) / self._running, 0.0)
            largest, before = running if largest is None else larger(largest, running, common), end
        assert largest is not None
        return RideSums(len(numbers), squares, fourths, largest, self._running)


def _deviation(knows: RideKnowledge, unread: Bools) -> Array:
    return np.sqrt(np.where(unread, knows.variance, knows.left))


def _rough_log_std(accel_variance: float, sensor: Sensor) -> float:
    """Share by which a ride may be off because noise and ride blur the steps little: how rough the road is and where
    gravity lies within a step are then hard to distinguish, and the propagation of bounds is rough."""
    noise_mps2 = sensor.noise_rms_mps2
    return _ROUGH_SHARE * sensor.step_mps2**2 / (noise_mps2 * sqrt(accel_variance + noise_mps2**2))
