"""From the r.m.s. of a car's vertical acceleration to the roughness of the road under it.

At a given speed the response of a linear car is proportional to the height of the road's waves, and so is the IRI.
For roads of one spectral shape their ratio is therefore a number per speed (6.3 and Fig 6.6 of Blum 2015). The
dissertation finds it by driving a model over many simulated roads; here it is computed, because the mean square of
the response of a linear car to a random road is an integral:

    a_rms^2 = integral of |H(n v)|^2 |R(n v)|^2 Gd(n) dn,   n from 0.011 to 2.83 cycle/m,

with H the car's body acceleration per elevation, R what the recorder's filters leave of it, and Gd the spectrum of
ISO 8608; with IRI = 0.5386 Gd(n0)^0.5 (Eq 4.39) that is the ratio.

The ratio is right on the average of a long road of that shape. One window of 7.62 m is a short look: at 31 m/s it lasts
a quarter of a second, less than one swing of the body, and the estimate scatters by a fifth to a third about the exact
IRI. ``estimation.streaming`` does better.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import overload

import numpy as np
import numpy.typing as npt

from logger.estimation.road_spectrum import COMMON_ROAD
from logger.roads import iso8608
from logger.vehicle.linearise import KnownCar

Array = npt.NDArray[np.float64]

SPEEDS_MPS = (*np.arange(3.0, 6.0, 0.25).tolist(), *np.arange(6.0, 46.0).tolist())

_WAVE_NUMBERS = 400  # log-spaced; 5000 of them change no ratio by more than 0.01 %


@dataclass(frozen=True)
class RmsRelation:
    """IRI per r.m.s. acceleration of one vehicle and recorder, by speed.

    speeds_mps           (s,) increasing [m/s]
    iri_per_accel_rms    (s,) [m/km per m/s2]
    """

    speeds_mps: Array
    iri_per_accel_rms: Array

    @overload
    def iri(self, accel_rms_mps2: float, speed_mps: float) -> float: ...
    @overload
    def iri(self, accel_rms_mps2: Array, speed_mps: Array | float) -> Array: ...
    def iri(self, accel_rms_mps2: float | Array, speed_mps: float | Array) -> float | Array:
        """IRI [m/km] of a road that shakes the car this much [m/s2] at this speed; NaN outside the table's speeds."""
        return accel_rms_mps2 * self._ratio(speed_mps)

    def _ratio(self, speed_mps: float | Array) -> Array:
        return np.asarray(np.interp(speed_mps, self.speeds_mps, self.iri_per_accel_rms, left=np.nan, right=np.nan))


def rms_relation(
    car: KnownCar,
    recorder_gain: Callable[[Array], Array] | None = None,
    speeds_mps: npt.ArrayLike = SPEEDS_MPS,
) -> RmsRelation:
    """The relation of a car (Fig 6.6), computed; of one whose laws are not linear, as it is on a common road.

    recorder_gain    magnitude of the recorder's whole response at frequencies [Hz]; None: it leaves all as it is
    speeds_mps       where to compute it, increasing [m/s]; between them a straight line is taken
    """
    speeds = np.asarray(speeds_mps, dtype=float)
    wave_number = np.geomspace(iso8608.LOWEST_CPM, iso8608.HIGHEST_CPM, _WAVE_NUMBERS)
    f_hz = speeds[:, None] * wave_number
    psd = COMMON_ROAD.psd(wave_number)
    gain = np.array([np.abs(car.at(float(speed), wave_number, psd).response(row, speed))
                     for row, speed in zip(f_hz, speeds, strict=True)])
    if recorder_gain is not None:
        gain = gain * recorder_gain(f_hz)
    trapezoid = wave_number * np.log(wave_number[1] / wave_number[0])  # dn of a log-spaced grid
    trapezoid[[0, -1]] *= 0.5
    accel_rms = np.sqrt(gain**2 @ (iso8608.displacement_psd(wave_number, 1.0) * trapezoid))
    return RmsRelation(speeds, iso8608.iri_from_gd_n0(1.0) / accel_rms)
