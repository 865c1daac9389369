"""How a simulated car moves: its speed and way over time, the road under it, and what its body does on that road."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import resample_poly

from logger.profiles.track import Track
from logger.roads import iri, iso8608
from logger.roads.obstacles import speed_bump
from logger.vehicle.compose import Car, recorded
from logger.vehicle.models import half_car
from logger.vehicle.simulate import Passage
from logger.vehicle.structure import recursion, straight_step
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

STEP_S = 0.001
SPACING_M = 0.05
LEAD_M = 40.0
SMOOTHING_S = 1.0
TURN_M = 20.0

_EARTH_RADIUS_M = 6_371_000.0  # of the sphere that the shipped recording was made on
_START_LAT_DEG, _START_LON_DEG = 38.9897, -76.9378
# A made-up road: its heading swings by these angles [rad] over these lengths [m].
_START_HEADING_RAD = 0.9
_SWINGS = ((0.7, 2600.0, 0.0), (0.25, 900.0, 1.0))

# A recorder's samples a second, and steps of ``STEP_S`` from one to the next.
_RECORDER_HZ = 100
_FINE = round(1 / (_RECORDER_HZ * STEP_S))
# The recorder's anti-alias filter: flat to 38 Hz, shut at 50 Hz, without delay.
_CUTOFF_HZ, _TAPS, _KAISER = 44.0, 401, 5.0


@dataclass(frozen=True)
class RoadStretch:
    """A stretch of road of one roughness: length [m] and degree of roughness Gd(n0) [cm3]."""

    length_m: float
    gd_n0_cm3: float


@dataclass(frozen=True)
class SpeedBump:
    """A speed bump (Eq 4.41) that begins ``at_m`` from the start of the drive."""

    at_m: float
    height_m: float
    width_m: float


@dataclass(frozen=True)
class Road:
    """Elevations [m] at uniform spacing, the first ``LEAD_M`` before the start of the drive."""

    elevation_m: Array

    def iri(self, edges_m: npt.ArrayLike) -> Array:
        """Exact IRI [m/km] between edges, given as distances from the start of the drive [m]."""
        slope = iri.rectified_slope(self.elevation_m, SPACING_M)
        return iri.window_iri(slope, SPACING_M, np.asarray(edges_m, dtype=float) + LEAD_M)

    def under(self, distance_m: Array, patch_m: float) -> Array:
        """Elevation [m], averaged over a tire's contact patch, at distances from the start of the drive [m]."""
        total = np.concatenate([[0.0], np.cumsum(self.elevation_m)]) * SPACING_M
        edges = (np.arange(len(total)) - 0.5) * SPACING_M - LEAD_M
        half = 0.5 * max(patch_m, SPACING_M)
        return (np.interp(distance_m + half, edges, total) - np.interp(distance_m - half, edges, total)) / (2 * half)


@dataclass(frozen=True)
class DriveMotion:
    """A drive on a grid of ``STEP_S``; distance is that of the front axle, over which the GPS
    antenna sits, from the start.

    time_s, distance_m, speed_mps, lat_deg, lon_deg, course_deg    (n,)
    forward_mps2, left_mps2                                        (n,) acceleration of the car in the plane
    """

    time_s: Array
    distance_m: Array
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array
    course_deg: Array
    forward_mps2: Array
    left_mps2: Array


def drive_along(speed_knots: Sequence[tuple[float, float]]) -> DriveMotion:
    """Motion by (time [s], speed [m/s]) knots with straight lines between them, corners rounded over a second."""
    knots = np.array(speed_knots, dtype=float)
    time = np.arange(0.0, knots[-1, 0], STEP_S)
    half = 0.5 * SMOOTHING_S
    fine = np.arange(-half, knots[-1, 0] + half, STEP_S)
    way = np.cumsum(np.interp(fine, knots[:, 0], knots[:, 1])) * STEP_S
    speed = (np.interp(time + half, fine, way) - np.interp(time - half, fine, way)) / SMOOTHING_S
    speed = np.maximum(speed, 0.0)
    distance = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * STEP_S])

    heading = _START_HEADING_RAD + sum(a * np.sin(2 * np.pi * distance / length + p) for a, length, p in _SWINGS)
    curvature = sum(a * 2 * np.pi / length * np.cos(2 * np.pi * distance / length + p) for a, length, p in _SWINGS)
    ahead = np.diff(distance, prepend=0.0)
    north, east = np.cumsum(ahead * np.cos(heading)), np.cumsum(ahead * np.sin(heading))
    lat = _START_LAT_DEG + np.degrees(north / _EARTH_RADIUS_M)
    lon = _START_LON_DEG + np.degrees(east / (_EARTH_RADIUS_M * np.cos(np.radians(_START_LAT_DEG))))
    return DriveMotion(
        time, distance, speed, lat, lon, np.degrees(heading) % 360.0,
        forward_mps2=np.gradient(speed, STEP_S), left_mps2=-(speed**2) * curvature,
    )


def build_road(stretches: Sequence[RoadStretch], bumps: Sequence[SpeedBump], length_m: float, seed: int) -> Road:
    """One random road whose roughness changes from stretch to stretch; the last stretch goes on to the end.

    The slope of a single road of Gd(n0) = 1 cm3 is scaled, over ``TURN_M`` from one roughness to the next, so that
    elevations have no jump where stretches meet.
    """
    plain = iso8608.generate(1.0, LEAD_M + length_m + LEAD_M, SPACING_M, seed)
    distance = SPACING_M * np.arange(len(plain)) - LEAD_M
    begin = np.cumsum([0.0] + [stretch.length_m for stretch in stretches[:-1]])
    places = np.concatenate([begin, begin[1:] + TURN_M])
    roots = np.sqrt([stretch.gd_n0_cm3 for stretch in stretches])
    values = np.concatenate([roots[:1], roots[:-1], roots[1:]])
    order = np.argsort(places, kind="stable")
    gain = np.interp(distance[:-1], places[order], values[order])
    elevation = np.concatenate([[0.0], np.cumsum(np.diff(plain) * gain)])
    for bump in bumps:
        elevation = elevation + speed_bump(distance, bump.at_m, bump.height_m, bump.width_m)
    return Road(elevation)


def body_acceleration(vehicle: Vehicle, road: Road, motion: DriveMotion) -> Array:
    """Vertical acceleration of the body at its centre of gravity [m/s2] on the grid of the motion, up positive.

    The half car is stepped exactly at 1 kHz with the road as it passes under each wheel, at whatever speed, and then
    band-limited as the recorder does before it samples.
    """
    structure = half_car(vehicle)
    patch_m = vehicle.contact_patch_m
    under = np.stack([road.under(motion.distance_m - behind, patch_m) for behind in structure.behind_m], axis=1)
    under = under - under[0].mean()
    a, b = structure.state_space()
    transition, at_start, at_end = straight_step(a, b, STEP_S)
    rest = np.concatenate([np.linalg.solve(structure.stiffness, structure.road @ under[0]), np.zeros(len(b) // 2)])
    later = recursion(transition, under[:-1] @ at_start.T + under[1:] @ at_end.T, rest)
    row = len(b) // 2
    accel = np.vstack([rest, later]) @ a[row] + under @ b[row]
    tap = np.arange(_TAPS) - _TAPS // 2
    kernel = np.sinc(2 * _CUTOFF_HZ * STEP_S * tap) * np.kaiser(_TAPS, _KAISER)
    return np.convolve(accel, kernel / kernel.sum(), mode="same")


def sensed_acceleration(car: Car, road: Road, motion: DriveMotion) -> Array:
    """The same for a car with effects: what its sensor would record [m/s2], between the recorder's samples as well."""
    track = Track(SPACING_M, road.elevation_m, -LEAD_M)
    samples = recorded(car, Passage(track, _RECORDER_HZ, motion.distance_m[::_FINE]))
    return np.asarray(resample_poly(samples, _FINE, 1)[: len(motion.time_s)])
