"""From the r.m.s. of a car's vertical acceleration to the roughness of the road under it.

At a given speed the response of a linear car is proportional to the height of the road's waves, and so is the IRI.
For roads of one spectral shape their ratio is therefore a number per speed (6.3 and Fig 6.6 of Blum 2015). The
dissertation finds it by driving a model over many simulated roads; here it is computed, because the mean square of
the response of a linear car to a random road is an integral:

    a_rms^2 = integral of |H(n v)|^2 |R(n v)|^2 Gd(n) dn,   n from 0.011 to 2.83 cycle/m,

with H the car's body acceleration per elevation, R what the recorder's filters leave of it, and Gd the spectrum of
ISO 8608; with IRI = 0.5386 Gd(n0)^0.5 (Eq 4.39) that is the ratio.

The ratio is right on the average of a long road of that shape. One window of 7.62 m is a short look: at 31 m/s it lasts
a quarter of a second, less than one swing of the body. ``RmsRelation.iri_std`` says how far such an estimate is from
the exact IRI of the same window.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import overload

import numpy as np
import numpy.typing as npt

from logger.roads import iso8608
from logger.units import WINDOW_M
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_acceleration_response
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

SPEEDS_MPS = (*np.arange(3.0, 6.0, 0.25).tolist(), *np.arange(6.0, 46.0).tolist())

_WAVE_NUMBERS = 400  # log-spaced; 5000 of them change no ratio by more than 0.01 %

# Lower limits of IRI [m/km] of classes B to E (Table 4.3), then doubling as the degree of roughness quadruples.
_CLASS_LIMITS = ((3.05, "B"), (6.09, "C"), (12.19, "D"), (24.37, "E"), (48.74, "F"), (97.48, "G"), (194.96, "H"))

# Relative error of a window's estimate, by speed. Found by driving the RAV4 of Table 4.2 at steady speeds over 80 km
# of random ISO roads each and comparing windows of 7.62 m with their exact IRI: the scatter is the 68 % quantile of
# |estimate - exact| / estimate, or the 95 % quantile over 2.35 where the tails make that the larger (from 25 m/s on).
# Over 15 to 100 m it falls with the square root of the length. The shape row is computed: what a road of waviness
# 1.75 or 2.25 in place of 2 does to the ratio, which no window length averages out.
_ERROR_SPEEDS_MPS = (4.5, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0, 25.0, 31.3, 38.0, 45.0)
_SCATTER = (0.202, 0.203, 0.215, 0.220, 0.221, 0.228, 0.221, 0.257, 0.326, 0.371, 0.433)
_SHAPE = (0.091, 0.111, 0.098, 0.067, 0.020, 0.010, 0.057, 0.082, 0.100, 0.135, 0.179)

# A coarse sensor's noise is step / sqrt(12) only while the signal crosses many steps. Resting on the edge of a step it
# toggles with up to sqrt(3) times that, in the middle of a step it shows nothing. With this margin windows of smooth
# and of rough roads, read by a BMA220 at +-2 g with any offset, are covered at 7, 15 and 25 m/s.
_NOISE_MARGIN = 1.35


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

    @overload
    def iri_std(
        self, iri_m_per_km: float, speed_mps: float, window_m: float, noise_rms_mps2: float = 0.0
    ) -> float: ...
    @overload
    def iri_std(
        self, iri_m_per_km: Array, speed_mps: Array | float, window_m: float, noise_rms_mps2: float = 0.0
    ) -> Array: ...
    def iri_std(
        self, iri_m_per_km: float | Array, speed_mps: float | Array, window_m: float, noise_rms_mps2: float = 0.0
    ) -> float | Array:
        """Standard error [m/km] of an estimate that ``iri`` gave for one window; NaN outside the table's speeds.

        iri_m_per_km      the estimate [m/km]
        window_m          length of the window [m]
        noise_rms_mps2    r.m.s. noise of the accelerometer in the band that is used, quantising noise included [m/s2]

        Three errors are added in squares. Scatter, because a window is short, and shape, because a road's spectrum is
        not exactly that of ISO 8608, are shares of the estimate. Noise raises the r.m.s.: the estimate is too high
        by what vanishes when the noise, with a margin, is taken out of it in squares. An estimate no higher than the
        noise may be nothing but noise, and a coarse sensor may hide a road as rough as its noise.

        About 68 to 75 in 100 exact values lie within one standard error and 90 to 98 within two; where noise rules, up
        to all of them, because its bias is counted as an error. The errors are not Gaussian:
        a rough window that happens to shake the car little gets a small estimate with a small standard error, so there
        are more far misses on the high side of the estimate than on the low. Found for a half car of common size; a
        road whose waviness is far from 2, a vehicle file that does not fit the car, or clipping can cost more.
        """
        scatter = np.interp(speed_mps, _ERROR_SPEEDS_MPS, _SCATTER) * np.sqrt(WINDOW_M / window_m)
        shape = np.interp(speed_mps, _ERROR_SPEEDS_MPS, _SHAPE)
        noise_iri = noise_rms_mps2 * self._ratio(speed_mps)
        without_noise = np.sqrt(np.maximum(np.square(iri_m_per_km) - np.square(_NOISE_MARGIN * noise_iri), 0.0))
        excess = np.where(without_noise > 0, iri_m_per_km - without_noise, np.maximum(iri_m_per_km, noise_iri))
        total = np.sqrt(np.square(iri_m_per_km) * (scatter**2 + shape**2) + excess**2)
        return total if total.ndim else float(total)

    def _ratio(self, speed_mps: float | Array) -> Array:
        return np.asarray(np.interp(speed_mps, self.speeds_mps, self.iri_per_accel_rms, left=np.nan, right=np.nan))


def rms_relation(
    vehicle: Vehicle,
    recorder_gain: Callable[[Array], Array] | None = None,
    speeds_mps: npt.ArrayLike = SPEEDS_MPS,
) -> RmsRelation:
    """The relation of a vehicle (Fig 6.6), computed.

    recorder_gain    magnitude of the recorder's whole response at frequencies [Hz]; None: it leaves all as it is
    speeds_mps       where to compute it, increasing [m/s]; between them a straight line is taken
    """
    structure = structure_of(vehicle)
    speeds = np.asarray(speeds_mps, dtype=float)
    wave_number = np.geomspace(iso8608.LOWEST_CPM, iso8608.HIGHEST_CPM, _WAVE_NUMBERS)
    f_hz = speeds[:, None] * wave_number
    gain = np.abs(body_acceleration_response(structure, f_hz, speeds[:, None], vehicle.sensor))
    if recorder_gain is not None:
        gain = gain * recorder_gain(f_hz)
    trapezoid = wave_number * np.log(wave_number[1] / wave_number[0])  # dn of a log-spaced grid
    trapezoid[[0, -1]] *= 0.5
    accel_rms = np.sqrt(gain**2 @ (iso8608.displacement_psd(wave_number, 1.0) * trapezoid))
    return RmsRelation(speeds, iso8608.iri_from_gd_n0(1.0) / accel_rms)


def iri_class(iri_m_per_km: float) -> str:
    """ISO 8608 letter of a road with this IRI [m/km], after Table 4.3; a limit belongs to the rougher class."""
    letter = "A"
    for limit, rougher in _CLASS_LIMITS:
        if iri_m_per_km >= limit:
            letter = rougher
    return letter
