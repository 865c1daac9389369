"""The linear frequency response of a car with effects, as a table: exact where it has one, else on the average.

Problem: where nobody measured the road, it has to be integrated out, which is possible for a linear car. Solution: the
response of a car with linear laws is tabulated. Where laws are not linear, each drive over each stretch of road moves
them by an amplitude of its own, and has the response of the linear car that comes nearest there
(``vehicle.linearise``): what friction does is then no damping, but one that falls from stretch to stretch as the motion
grows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.estimation.road_spectrum import FLATTENED_BELOW_CPM
from logger.identification.unknown_road.marginal_likelihood import displacement_psd_m3
from logger.vehicle.compose import Car
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.linearise import is_linear, known_car, linearised
from logger.vehicle.named_parameters import Free
from logger.vehicle.simulate import recorder_gain
from logger.vehicle.structure import Output

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

_STEP_HZ = 0.025
"""Step of the table: eight are as wide as a resonance at 1 Hz with a damping ratio of 0.1."""


def frequencies_of(rate_hz: float) -> Array:
    """Frequencies (f,) of the table [Hz]."""
    return np.arange(0.0, rate_hz / 2 + _STEP_HZ, _STEP_HZ)


def response_of(car: Car, rate_hz: float) -> Complex:
    """Reading per elevation under each axle (x, f) at ``frequencies_of``, the recorder's filter included [1/s2].

    Left and right wheels are on the same road. ValueError for a car whose laws are not linear.
    """
    if not is_linear(car):
        raise ValueError("expected a car that answers in proportion to the road")
    linear = known_car(car)
    assert isinstance(linear, LinearCar)
    return _by_axle(linear, rate_hz)


def _by_axle(linear: LinearCar, rate_hz: float) -> Complex:
    f_hz, axles = frequencies_of(rate_hz), np.unique(linear.structure.behind_m, return_inverse=True)[1]
    by_axle = linear.by_wheel(f_hz) @ np.eye(axles.max() + 1)[axles]
    return np.asarray(recorder_gain(f_hz / rate_hz) * by_axle.T)


@dataclass(frozen=True)
class DriveConditions:
    """What moves a car over a stretch: its speed [m/s], and the level and the waviness of the road (``RoadState``)."""

    speed_mps: float
    level: float
    waviness: float


def responses_of(car: Car, rate_hz: float, motions: Sequence[DriveConditions], highest_cpm: float = 4.0,
                 waves: int = 80) -> Complex:
    """Readings as ``response_of`` for each of some motions (d, x, f): of the linear car that comes nearest to one that
    is not linear, the same for all of one that is.

    highest_cpm, waves    a suspension is moved by so many waves of the road, from those below which its spectrum is
                          flat to those as short as a tire's contact

    ValueError for effects on the record in time, and for laws that are others at another place or time.
    """
    if is_linear(car):
        return np.broadcast_to(response_of(car, rate_hz), (len(motions), *_shape(car, rate_hz)))
    if car.records:
        raise ValueError("expected a car whose record is what its sensor felt")
    known_car(car)  # refuses laws that no linear ones stand in for
    output = Output(car.row, np.zeros(len(car.structure.wheels)), 2)
    moving_cpm = np.geomspace(FLATTENED_BELOW_CPM, highest_cpm, waves)
    found = []
    for motion in motions:
        psd_m3 = displacement_psd_m3(motion.level, motion.waviness, np.append(0.0, moving_cpm))[1:]
        found.append(_by_axle(linearised(car, output, motion.speed_mps, moving_cpm, psd_m3), rate_hz))
    return np.asarray(found)


def _shape(car: Car, rate_hz: float) -> tuple[int, int]:
    return len(np.unique(car.structure.behind_m)), len(frequencies_of(rate_hz))


@dataclass(frozen=True, eq=False)
class Tabulated:
    """A table of a car's response, for any values of its parameters.

    behind_m, contact_patch_m    as its structure's, each axle once
    rate_hz                      of the recorder
    gains, slopes                responses (x, f) and derivatives (p, x, f) at ``frequencies_of``
    """

    behind_m: Array
    contact_patch_m: float
    rate_hz: float
    gains: Complex
    slopes: Complex

    @property
    def parameters(self) -> Sequence[Free]:
        """Parameters of the derivatives."""
        return [Free(f"number {index}", 0.0, -1.0, 1.0, place=True) for index in range(len(self.slopes))]

    def responses(self, values: Array, f_hz: Array) -> tuple[Complex, Complex]:
        """Responses and derivatives interpolated at other frequencies."""
        place = np.minimum(f_hz / _STEP_HZ, self.gains.shape[-1] - 1.001)
        low = place.astype(np.intp)
        share = place - low
        gains, slopes = ((1 - share) * one[..., low] + share * one[..., low + 1] for one in (self.gains, self.slopes))
        return gains, slopes
