"""The linear frequency response of a car with effects, as a table: exact where it has one, else on the average.

Problem: where nobody measured the road, it has to be integrated out, which is possible for a linear car. With most
effects a car is linear, with some in ways that no constant matrix describes (a spring in series with a damper, a
delay). Solution: the response is computed frequency by frequency from the same parts as simulations; whether a corner's
laws are linear is tested at some motions. Where they are not, each drive over each stretch of road moves them by an
amplitude of its own, and has the response of the linear car that comes nearest there (``vehicle.linearise``): what
friction does is then no damping, but one that falls from stretch to stretch as the motion grows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.estimation.road_spectrum import FLATTENED_BELOW_CPM
from logger.identification.unknown_road.road_state import displacement_psd_m3
from logger.vehicle.compose import Car
from logger.vehicle.laws import CornerLaws
from logger.vehicle.linearise import known_car, linearised
from logger.vehicle.named_parameters import Free
from logger.vehicle.simulate import recorder_gain
from logger.vehicle.structure import Output

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

_STEP_HZ = 0.025
"""Step of the table: eight are as wide as a resonance at 1 Hz with a damping ratio of 0.1."""


def _is_linear(laws: CornerLaws) -> bool:
    """Whether all forces of a corner are linear in its motion; a damper is tested at some rates in both directions."""
    if laws.springs or laws.others or laws.motions or laws.tires or laws.rubs or not laws.tire_pulls:
        return False
    rates_mps = np.array([-2.0, -0.5, -0.1, 0.02, 0.3, 1.0, 3.0])
    slopes = laws.damper(rates_mps) / rates_mps
    return bool(np.ptp(slopes) <= 1e-9 * np.abs(slopes).max())


def frequencies_of(rate_hz: float) -> Array:
    """Frequencies (f,) of the table [Hz]."""
    return np.arange(0.0, rate_hz / 2 + _STEP_HZ, _STEP_HZ)


def response_of(car: Car, rate_hz: float) -> Complex:
    """Reading per elevation under each axle (x, f) at ``frequencies_of``, the recorder's filter included [1/s2].

    Left and right wheels are on the same road. ValueError for a car whose laws are not linear.
    """
    if not is_linear(car):
        raise ValueError("expected a car that answers in proportion to the road")
    f_hz = frequencies_of(rate_hz)
    structure, s = car.structure, np.asarray(2j * np.pi * f_hz, np.complex128)
    axles = np.unique(structure.behind_m, return_inverse=True)[1]
    dampers = np.stack([_damper(one, s) for one in car.laws], axis=1) - s[:, None] * structure.dampers
    tires = s[:, None] * np.array([one.tire_damping_n_s_per_m for one in car.laws])
    dynamic = (s * s)[:, None, None] * structure.mass + s[:, None, None] * structure.damping + structure.stiffness
    dynamic = dynamic + np.einsum("fw,wi,wj->fij", dampers, structure.travel, structure.travel)
    dynamic = dynamic + np.einsum("fw,wi,wj->fij", tires, structure.wheels, structure.wheels)
    forces = (structure.road + tires[:, None, :] * structure.wheels.T) @ np.eye(axles.max() + 1)[axles]
    motion = np.linalg.solve(dynamic, forces)
    behind = recorder_gain(f_hz / rate_hz) * car.factor(s) * s * s
    return np.asarray(behind * np.einsum("n,fnx->xf", car.row, motion))


@dataclass(frozen=True)
class Motion:
    """What moves a car over a stretch: its speed [m/s], and the level and the waviness of the road (``RoadState``)."""

    speed_mps: float
    level: float
    waviness: float


def is_linear(car: Car) -> bool:
    """Whether a car answers in proportion to the road."""
    return not car.records and all(map(_is_linear, car.laws))


def responses_of(car: Car, rate_hz: float, motions: Sequence[Motion], highest_cpm: float = 4.0,
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
    f_hz = frequencies_of(rate_hz)
    axles = np.unique(car.structure.behind_m, return_inverse=True)[1]
    by_axle = np.eye(axles.max() + 1)[axles]
    output = Output(car.row, np.zeros(len(car.structure.wheels)), 2)
    behind = recorder_gain(f_hz / rate_hz)
    moving_cpm = np.geomspace(FLATTENED_BELOW_CPM, highest_cpm, waves)
    found = []
    for motion in motions:
        psd_m3 = displacement_psd_m3(motion.level, motion.waviness, np.append(0.0, moving_cpm))[1:]
        linear = linearised(car, output, motion.speed_mps, moving_cpm, psd_m3)
        found.append(behind * (linear.by_wheel(f_hz) @ by_axle).T)
    return np.asarray(found)


def _shape(car: Car, rate_hz: float) -> tuple[int, int]:
    return len(np.unique(car.structure.behind_m)), len(frequencies_of(rate_hz))


def _damper(laws: CornerLaws, s: Complex) -> Complex:
    """Force per extension of a damper in series with its mount."""
    alone = s * float(laws.damper(np.ones(1))[0])
    return alone if np.isinf(laws.mount_n_per_m) else alone / (1 + alone / laws.mount_n_per_m)


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
