"""A drive's road from its acceleration, compared with the exact IRI where it is known, and with the limit.

Problem: a record may be in other units, its distance may jump or go back, and an estimate alone does not say how good
it is or could be. Solution: ``estimable`` refuses what cannot be meant, ``assess`` estimates and sets beside it what an
estimator could reach that knew the road's spectrum, the sensor's noise and the car exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.bounds import time_hint
from logger.estimation.batch import (
    RoadProfile,
    Windows,
    estimated,
    exact_iri,
    learnt_noise,
    least_errors,
    local_level,
    monotonic_distance,
    on_grid,
    score,
)
from logger.estimation.error_bound import ErrorBound, pooled_r2
from logger.estimation.road_spectrum import RoadSpectrum
from logger.estimation.sensor_noise import NoiseBelief, Sensor
from logger.estimation.time_grid import RATE_HZ
from logger.profiles.track import Track
from logger.roads.iri import likely_unit
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, RoadEffect
from logger.vehicle.linearise import known_car
from logger.vehicle.uncertain import NumberErrors, cars_off
from logger.vehicle.vehicle import GENERIC, Vehicle

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MIX_IRI = tuple(range(1, 11))
"""Roads over which the limit's R2 is computed, as many of each [m/km]."""
BACK_M = 1.0
"""A distance may go back so far, as one that is corrected by GPS does."""
SPEED_CLASS_MPS = 5.0
_SLOWEST_RATE_HZ = 80.0
_NEARLY = 1e-6
_WAYS_DIFFER = 0.1
_LEAST_WAY_M = 10.0  # over less, a distance from GPS may well differ from the integral of the speed


class Unusable(ValueError):
    """A record that nothing can be estimated from; ``sample``: the number of the first that is wrong, None: all."""

    def __init__(self, message: str, sample: int | None = None) -> None:
        super().__init__(message)
        self.sample = sample


@dataclass(frozen=True)
class Estimable:
    """A drive ready for the estimator, arrays (n,): samples at ``rate_hz``, distances that do not decrease.

    moved_m    the farthest that a distance was moved to make them so [m]; 0 where they are the file's
    """

    rate_hz: float
    accel_z_mps2: Array
    distance_m: Array
    moved_m: float


def estimable(
    rate_hz: float, accel_z_mps2: Array, speed_mps: Array, distance_m: Array, fastest_mps: float
) -> Estimable:
    """A drive of samples (n,) at an even rate, made ready. ``Unusable`` for one too slow, for a distance that jumps
    (faster than ``fastest_mps``) or goes back farther than a correction, and for a speed that does not go with it."""
    if rate_hz < _SLOWEST_RATE_HZ * (1 - 1e-3):
        raise Unusable(f"expected at least {_SLOWEST_RATE_HZ:g} samples a second, found {rate_hz:.4g}"
                       f"{time_hint(rate_hz)}")
    _check_way(distance_m, fastest_mps / rate_hz)
    _check_speed(rate_hz, speed_mps, distance_m)
    if (np.diff(distance_m) >= 0).all():
        return Estimable(rate_hz, accel_z_mps2, distance_m, 0.0)
    monotonic_m = monotonic_distance(distance_m, speed_mps, rate_hz)
    return Estimable(rate_hz, accel_z_mps2, monotonic_m, float(np.abs(monotonic_m - distance_m).max()))


def _check_way(distance_m: Array, longest_m: float) -> None:
    """Refuse a distance that jumps, or goes back farther than a correction would take it."""
    back = distance_m < np.maximum.accumulate(distance_m) - BACK_M
    jump = np.diff(distance_m, prepend=distance_m[0]) > longest_m + BACK_M
    if (wrong := back | jump).any():
        row = int(np.argmax(wrong))
        limit = (f"at most {BACK_M:g} m before the farthest yet, {distance_m[:row].max():.10g} m" if back[row]
                 else f"at most {longest_m + BACK_M:.4g} m after {distance_m[row - 1]:.10g} m")
        raise Unusable(f"expected a distance {limit}, found {distance_m[row]:.10g}", row)


def _check_speed(rate_hz: float, speed_mps: Array, distance_m: Array) -> None:
    """Refuse a speed that does not go with the distance, such as one in km/h."""
    speed = np.abs(speed_mps)
    way_m = float(distance_m[-1] - distance_m[0])
    integral_m = float(np.sum(speed[1:] + speed[:-1])) / 2 / rate_hz
    larger_m = max(way_m, integral_m)
    if larger_m > _LEAST_WAY_M and abs(way_m - integral_m) > _WAYS_DIFFER * larger_m:
        factor = f"{integral_m / way_m:.3g}" if way_m > 0 else "infinitely many"
        raise Unusable(f"expected speed_mps and distance_m to agree within {_WAYS_DIFFER:.0%}, found "
                       f"{integral_m:.4g} m by speed_mps, {factor} times the {way_m:.4g} m of distance_m "
                       f"({likely_unit(integral_m, way_m)})")


@dataclass(frozen=True)
class Assessment:
    """All results on a drive's road.

    exact_m_per_km          (w,) IRI of the profile in each window, NaN where it has none
    compared                whether there is a profile to compare with
    least_error_m_per_km    (w,) r.m.s. error of the best possible values
    noise                   of a reading before rounding, where it was learnt from the drive; ``sensor`` has it
    learns_noise            whether that was to be learnt
    road_effects            names of the effects that make the road that is compared with out of its profile
    """

    vehicle: Vehicle
    drive: Estimable
    sensor: Sensor
    window_m: float
    windows: Windows
    exact_m_per_km: Array
    compared: bool
    least_error_m_per_km: Array
    limits: ErrorBound
    road: RoadProfile | None
    noise: NoiseBelief | None
    learns_noise: bool = False
    road_effects: tuple[str, ...] = ()


def assess(
    drive: Estimable, vehicle: Vehicle, sensor: Sensor, window_m: float, track: Track | None,
    learns_noise: bool = False, effects: Sequence[Chosen] = (), errors: NumberErrors | None = None,
) -> Assessment:
    """Estimate a drive's road in windows [m] and compare it with the track it was driven on, if that is known.

    effects, errors    of the vehicle, and how far its numbers may be off; where an effect is of the road, the track is
                       a profile that differs from the road, and this is what is compared with

    Where the noise is to be learnt, the sensor's is a guess. ValueError if the vehicle lacks what its model or an
    effect needs.
    """
    composed = compose(vehicle, effects)
    car = known_car(composed)
    gridded, readings, distance_m = on_grid(sensor, drive.rate_hz, drive.accel_z_mps2,
                                            composed.driven(drive.distance_m))
    noise = None
    noise_log_std = 0.0
    if learns_noise:
        noise = learnt_noise(car, gridded, window_m, readings, distance_m)
    if noise is not None:
        gridded, noise_log_std = Sensor(noise.noise_rms_mps2, gridded.step_mps2), noise.log_std
        noise = noise.scaled((drive.rate_hz / RATE_HZ) ** 0.5)
        if gridded.step_mps2 != sensor.step_mps2:  # another rate has made one noise of both
            noise = noise.without_rounding(sensor.step_mps2)
        sensor = Sensor(noise.noise_rms_mps2, sensor.step_mps2)
    windows, road = estimated(car, gridded, window_m, readings, distance_m, cars_off(vehicle, effects, errors),
                              vehicle.name != GENERIC, noise_log_std)
    exact = np.full(len(windows.iri_m_per_km), np.nan)
    road_effects = tuple(one.effect.name for one in effects if isinstance(one.effect, RoadEffect))
    if track is not None:
        track = track.resurfaced(composed.structure.surface)
        exact = exact_iri(windows.edges_m, _driven(track, vehicle), track.spacing_m, track.start_m)
    limits = ErrorBound(car, gridded, window_m)
    level = local_level(np.where(np.isfinite(exact), exact, windows.iri_m_per_km), window_m)
    return Assessment(vehicle, drive, sensor, window_m, windows, exact, track is not None,
                      least_errors(limits, windows.speed_mps, level), limits, road, noise, learns_noise,
                      road_effects if track is not None else ())


def _driven(track: Track, vehicle: Vehicle) -> Array:
    """The elevations that the sensor is compared with: of two tracks their mean for a full car, else the left one."""
    if track.elevation_m.ndim == 1:
        return track.elevation_m
    return track.elevation_m.mean(axis=1) if vehicle.model == "full_car" else track.elevation_m[:, 0]


def speed_classes(windows: Windows) -> Iterator[tuple[float, Mask]]:
    """The lower end of each class of speed that was driven [m/s], and which windows (w,) are in it."""
    number = np.floor(windows.speed_mps / SPEED_CLASS_MPS + _NEARLY).astype(int)
    for one in np.unique(number).tolist():
        yield one * SPEED_CLASS_MPS, number == one


def figures(found: Assessment, which: Mask) -> dict[str, Any]:
    """Figures of the windows that are marked (w,): named, SI units in the names; those that are not known are left
    out."""
    windows = found.windows
    answered = which & np.isfinite(windows.iri_m_per_km)
    result: dict[str, Any] = {"window_count": int(which.sum()), "answered_count": int(answered.sum())}
    if not answered.any():
        return result
    iri, least = windows.iri_m_per_km[answered], found.least_error_m_per_km[answered]
    speed_mps, mean = float(windows.speed_mps[answered].mean()), float(iri.mean())
    result |= {
        "speed_mps": speed_mps, "iri_m_per_km": mean, "iri_min_m_per_km": float(iri.min()),
        "iri_max_m_per_km": float(iri.max()), "iri_std_m_per_km": _rms(windows.iri_std_m_per_km[answered]),
        "limit": {
            "std_m_per_km": _rms(least),
            "r2_this_road": found.limits.at(speed_mps, RoadSpectrum.of_iri(mean)).r2,
            "r2_iri_1_to_10": pooled_r2([found.limits.at(speed_mps, RoadSpectrum.of_iri(iri)) for iri in MIX_IRI]),
        },
    }
    compared = score(windows, found.exact_m_per_km, which)
    if compared is not None:
        known = answered & np.isfinite(found.exact_m_per_km)
        squares = np.mean(found.least_error_m_per_km[known] ** 2)
        limit_r2 = float(1 - squares / np.var(found.exact_m_per_km[known]))
        result["comparison"] = {**asdict(compared), "limit_r2": limit_r2}
    return result


def _rms(values: Array) -> float:
    return float((values**2).mean()) ** 0.5
