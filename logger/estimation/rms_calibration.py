"""A vehicle's relations between roughness and vibration, found by driving its model over many random roads.

Problem: what a road of a given roughness does to a car depends on the car and on its speed, and one road of a class is
not like the next. The dissertation drives a half car over generated roads at 10 to 70 mph and lays lines through the
results (Fig 6.3 to 6.8, 6.16, 6.17 of Blum 2015): IRI against r.m.s. acceleration, r.m.s. against Gd(n0), comfort
against IRI. How far one road, or one window of it, lies off the line takes many roads.

Solution: a road that repeats after its own length is a sum of waves, and a linear car at steady speed answers each wave
with a factor. So a drive is one multiplication and one Fourier transform, exact, with no time steps and no start. The
Golden Car of the IRI is a factor too, for the profile as it is sampled. The roads are Gaussian: Eq 4.2 gives the mean
square of a wave, and its two parts are drawn from a normal distribution. With the amplitudes of Eq 4.2 to the last
bit every road of a class would shake the car alike, and the scatter would come out too small.

A linear car makes every relation a line through the origin: r.m.s. and IRI both grow with the root of Gd(n0).

The first relation is computed on board, for a common road; the mean square of the response of a linear car to a random
road is an integral (``rms_relation``):

    a_rms^2 = integral of |H(n v)|^2 |R(n v)|^2 Gd(n) dn,   n from 0.011 to 2.83 cycle/m,

with H the car's body acceleration per elevation, R what the recorder's filters leave of it, and Gd the spectrum of ISO
8608; with IRI = 0.5386 Gd(n0)^0.5 (Eq 4.39) that is their ratio (Fig 6.6). It is right on the average of a long road of
that shape. One window of 7.62 m is a short look: at 31 m/s it lasts a quarter of a second, less than one swing of the
body, and the estimate scatters by a fifth to a third about the exact IRI. ``estimation.streaming`` does better.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Complex
from logger.dsp.filters import frequency_response
from logger.dsp.weightings.wk import WEIGHTING
from logger.estimation.error_bound import FINE_M
from logger.estimation.road_spectrum import COMMON_ROAD
from logger.roads import iso8608
from logger.roads.iri import PER_KM, TIRE_BASE_M, golden_car_sections
from logger.units import MPH_MPS, WINDOW_M
from logger.vehicle.linearise import KnownCar
from logger.vehicle.vehicle import Vehicle, with_load

SPEEDS_MPH = tuple(range(10, 71, 10))
SPEEDS_MPS = tuple(mph * MPH_MPS for mph in SPEEDS_MPH)
LEVELS_IRI = tuple(float(iri) for iri in range(1, 11))  # the roads of 6.4 [m/km]
ROADS = 120
PASSENGER_KG = 75.0
LEAST_WINDOW_M, MOST_WINDOW_M = 2.0, 200.0

_ROAD_M = 1000.0
# Of a road, log-spaced; 5000 of them change no ratio by more than 0.01 %.
_EVEN_CPM = np.geomspace(iso8608.LOWEST_CPM, iso8608.HIGHEST_CPM, 400)
_Values = TypeVar("_Values", float, Array)
_WITHIN = 68.0  # percentage of roads within one standard error
# A quarter car has one of four wheels under it, a half car one side of the body.
_SHARE_OF_LOAD = {"quarter_car": 0.25, "half_car": 0.5, "full_car": 1.0}
TABLE_SPEEDS_MPS = (*np.arange(3.0, 6.0, 0.25).tolist(), *np.arange(6.0, 46.0).tolist())


@dataclass(frozen=True)
class CalibrationSettings:
    """What a calibration depends on besides vehicle and recorder.

    speeds_mps    steady speeds (10, 20 ... 70 mph as in 6.3) [m/s]
    window_m      length of a window [m], 2 to 200
    roads         number of roads, each about 1 km long
    seed          another number, other roads
    """

    speeds_mps: tuple[float, ...] = SPEEDS_MPS
    window_m: float = WINDOW_M
    roads: int = ROADS
    seed: int = 1

    def __post_init__(self) -> None:
        if not LEAST_WINDOW_M <= self.window_m <= MOST_WINDOW_M:
            raise ValueError(f"window of {self.window_m:g} m: expected {LEAST_WINDOW_M:g} to {MOST_WINDOW_M:g} m")

    @property
    def road_m(self) -> float:
        """Length of a road [m]: the number of whole windows nearest to 1 km."""
        return self.window_m * round(_ROAD_M / self.window_m)


@dataclass(frozen=True)
class RmsLine:
    """A line through the origin, y = slope x, for points whose scatter grows with the roughness of their road.

    standard_error    of the slope, from how the roads differ among themselves
    spread            68 of 100 points lie within this share of the line
    r2                share of the variance of y, over all points of all roads, that the line explains
    """

    slope: float
    standard_error: float
    spread: float
    r2: float


@dataclass(frozen=True)
class SpeedCalibration:
    """The lines of one speed.

    iri_per_accel_rms           whole roads: IRI per r.m.s. acceleration [m/km per m/s2] (Fig 6.3, 6.6)
    window_iri_per_accel_rms    the same for windows: their own IRI and their own r.m.s.
    accel_rms_per_root_gd       whole roads: r.m.s. per root of Gd(n0) [m/s2 per cm^1.5] (Fig 6.4, 6.5)
    a_w_per_iri                 whole roads: Wk-weighted r.m.s. per IRI [m/s2 per m/km] (Fig 6.16, 6.17)
    """

    speed_mps: float
    iri_per_accel_rms: RmsLine
    window_iri_per_accel_rms: RmsLine
    accel_rms_per_root_gd: RmsLine
    a_w_per_iri: RmsLine


def loaded(vehicle: Vehicle, passengers: int = 0, sprung_mass_factor: float = 1.0) -> Vehicle:
    """The car with people of 75 kg in it, its body being so many times as heavy as it was (Fig 6.7, 6.8).

    The mass is added at the centre of gravity; inertias, springs and dampers stay. A model of one side of the car gets
    half of the people's mass, that of one wheel a quarter.
    """
    people_kg = passengers * PASSENGER_KG * _SHARE_OF_LOAD[vehicle.model]
    return with_load(vehicle, people_kg + (sprung_mass_factor - 1.0) * vehicle.sprung_mass_kg)


def calibrate(
    car: KnownCar, recorder_gain: Callable[[Array], Array] | None = None, settings: CalibrationSettings | None = None
) -> tuple[SpeedCalibration, ...]:
    """Drive the car over random ISO 8608 roads of IRI 1 to 10 m/km; the lines of each speed.

    recorder_gain    magnitude of the recorder's whole response at frequencies [Hz]; None: it leaves all as it is

    The acceleration belongs to the stretch under the front wheel, as in the logs. IRI is the exact one of each road,
    on the average 0.8 % above Eq 4.39 (``elevation_spectrum``), so the slopes lie that much above ``rms_relation``.
    A car whose laws are not linear is another one on each level of road; its lines go through the middle of them.
    """
    settings = settings or CalibrationSettings()
    roads = _Roads(settings)
    levels = LEVELS_IRI if car.depends_on_motion else LEVELS_IRI[:1]
    responses = [_responses(car, recorder_gain, roads.wave_number, settings.speeds_mps, level) for level in levels]
    iri, accel, weighted = (
        np.array(values) for values in zip(
            *(roads.drive(number, responses[number % len(levels)]) for number in range(settings.roads)), strict=True))
    root_gd = roads.root_gd
    whole_iri = iri.mean(axis=-1)
    rms, a_w = (np.sqrt(squares.mean(axis=-1)) for squares in (accel, weighted))
    return tuple(
        SpeedCalibration(
            speed_mps,
            fit(rms[:, i], whole_iri, root_gd),
            fit(np.sqrt(accel[:, i]), iri, root_gd),
            fit(root_gd, rms[:, i], root_gd),
            fit(whole_iri, a_w[:, i], root_gd),
        )
        for i, speed_mps in enumerate(settings.speeds_mps)
    )


def fit(x: Array, y: Array, level: Array) -> RmsLine:
    """The line through the origin of points (roads,) or (roads, windows) on roads of a ``level`` (roads,).

    Scatter is taken as proportional to the level, so the slope is the ratio of the sums of y and x per level: no bias
    from scatter in x, and a smooth road counts as much as a rough one. Its standard error is that of a ratio estimator
    with whole roads as its independent parts, for windows of one road are alike (Cochran, Sampling Techniques,
    Eq 6.13).
    """
    roads = len(level)
    x_relative, y_relative = (values.reshape(roads, -1) / level[:, None] for values in (x, y))
    slope = float(y_relative.sum() / x_relative.sum())
    off = y_relative - slope * x_relative
    standard_error = np.sqrt(roads / (roads - 1) * np.sum(off.sum(axis=1) ** 2)) / x_relative.sum()
    spread = np.percentile(np.abs(off) / (slope * x_relative), _WITHIN)
    r2 = 1 - np.sum((y - slope * x) ** 2) / np.sum((y - y.mean()) ** 2)
    return RmsLine(slope, float(standard_error), float(spread), float(r2))


def _responses(car: KnownCar, recorder_gain: Callable[[Array], Array] | None, wave_number: Array,
               speeds_mps: tuple[float, ...], level_m_per_km: float) -> Complex:
    """Recorded acceleration, and the same weighted with Wk, per elevation (2, speeds, waves), on roads of this IRI. No
    delay of filters."""
    psd = iso8608.displacement_psd(_EVEN_CPM, iso8608.gd_n0_from_iri(level_m_per_km))
    body = _recorded(car, recorder_gain, np.array(speeds_mps), wave_number, psd)
    return np.stack([body, body * np.abs(WEIGHTING.response(np.array(speeds_mps)[:, None] * wave_number))])


def _recorded(car: KnownCar, recorder_gain: Callable[[Array], Array] | None, speeds_mps: Array, wave_number: Array,
              psd: Array) -> Complex:
    """Recorded acceleration per elevation (speeds, waves), on roads of a spectrum at ``_EVEN_CPM``."""
    f_hz = speeds_mps[:, None] * wave_number
    body: Complex = np.array([car.at(speed, _EVEN_CPM, psd).response(row, speed)
                              for row, speed in zip(f_hz, speeds_mps.tolist(), strict=True)])
    return body if recorder_gain is None else np.asarray(body * recorder_gain(f_hz), np.complex128)


class _Roads:
    """Random roads, each the same number of windows long and repeating after that, and drives over them.

    root_gd        (roads,) root of the degree of roughness of each road [cm^1.5]
    wave_number    (waves,) of all roads [cycle/m]
    """

    def __init__(self, settings: CalibrationSettings) -> None:
        per_window = round(settings.window_m / FINE_M)
        self._windows = round(settings.road_m / settings.window_m)
        self._samples = self._windows * per_window
        spacing_m = settings.window_m / per_window
        step_cpm = 1 / settings.road_m
        self._waves = np.arange(int(np.ceil(iso8608.LOWEST_CPM / step_cpm)), int(iso8608.HIGHEST_CPM / step_cpm) + 1)
        self.wave_number = np.asarray(step_cpm * self._waves, dtype=float)
        levels = np.resize(LEVELS_IRI, settings.roads)
        self.root_gd = np.sqrt([iso8608.gd_n0_from_iri(level) for level in levels])
        self._amplitude_m = np.sqrt(step_cpm * iso8608.displacement_psd(self.wave_number, 1.0))
        self._slope = _golden_car_response(self.wave_number, spacing_m)
        self._random = np.random.default_rng(settings.seed)

    def drive(self, number: int, responses: Complex) -> tuple[Array, Array, Array]:
        """Of the next road, per window: IRI (windows,) [m/km], mean square acceleration and mean square weighted
        acceleration (speeds, windows) [m2/s4]."""
        parts = self._random.standard_normal((2, len(self._waves)))
        road = self.root_gd[number] * self._amplitude_m * (parts[0] + 1j * parts[1])
        iri = PER_KM * self._in_windows(np.abs(self._along(road * self._slope)))
        accel, weighted = self._in_windows(np.square(self._along(road * responses)))
        return iri, accel, weighted

    def _along(self, waves: Complex) -> Array:
        """Sum of waves (..., waves) at every sample of the road (..., samples)."""
        spectrum = np.zeros((*waves.shape[:-1], self._samples // 2 + 1), dtype=complex)
        spectrum[..., self._waves] = waves * (self._samples / 2)
        return np.fft.irfft(spectrum, self._samples)

    def _in_windows(self, values: Array) -> Array:
        return values.reshape(*values.shape[:-1], self._windows, -1).mean(axis=-1)


def _golden_car_response(wave_number: Array, spacing_m: float) -> Complex:
    """Slope of the suspension per elevation [1/m] of the IRI's car on a profile of samples: see ``rectified_slope``."""
    base_m = round(TIRE_BASE_M / spacing_m) * spacing_m
    slope = (np.exp(2j * np.pi * wave_number * base_m) - 1) / base_m
    return slope * frequency_response(golden_car_sections(spacing_m), wave_number, 1 / spacing_m)


@dataclass(frozen=True)
class RmsRelation:
    """IRI per r.m.s. acceleration of one vehicle and recorder, by speed.

    speeds_mps           (s,) increasing [m/s]
    iri_per_accel_rms    (s,) [m/km per m/s2]
    """

    speeds_mps: Array
    iri_per_accel_rms: Array

    def iri(self, accel_rms_mps2: _Values, speed_mps: _Values) -> _Values:
        """IRI [m/km] of a road that shakes the car this much [m/s2] at this speed; NaN outside the table's speeds."""
        ratio = np.interp(speed_mps, self.speeds_mps, self.iri_per_accel_rms, left=np.nan, right=np.nan)
        result: _Values = accel_rms_mps2 * ratio
        return result


def rms_relation(car: KnownCar, recorder_gain: Callable[[Array], Array] | None = None,
                 speeds_mps: npt.ArrayLike = TABLE_SPEEDS_MPS) -> RmsRelation:
    """The relation of a car (Fig 6.6), computed; of one whose laws are not linear, as it is on a common road.

    recorder_gain    magnitude of the recorder's whole response at frequencies [Hz]; None: it leaves all as it is
    speeds_mps       where to compute it, increasing [m/s]; between them a straight line is taken
    """
    speeds = np.asarray(speeds_mps, dtype=float)
    gain = np.abs(_recorded(car, recorder_gain, speeds, _EVEN_CPM, COMMON_ROAD.psd(_EVEN_CPM)))
    trapezoid = _EVEN_CPM * np.log(_EVEN_CPM[1] / _EVEN_CPM[0])  # dn of a log-spaced grid
    trapezoid[[0, -1]] *= 0.5
    accel_rms = np.sqrt(gain**2 @ (iso8608.displacement_psd(_EVEN_CPM, 1.0) * trapezoid))
    return RmsRelation(speeds, iso8608.iri_from_gd_n0(1.0) / accel_rms)
