"""A drive that never took place, as the bytes a recorder would have written.

``python -m tests.support.drives.simulated_drive FILE`` makes the one that ships with ridelog (``PLAN``): not quite six
minutes and 4.5 km in a 2009 RAV4 near College Park, Maryland: town streets, a red light, a fast smooth road with a long
loss of GPS, a rough lane with a speed bump, and home.

The logger needs drives whose truth is known: to show itself without hardware, and to be measured. A plan (speeds,
roughness, bumps, lost fixes) becomes motion; the road moves a half car; its body acceleration and its position pass
through models of the instruments and come out as the events of a recorded dump. One plan is one drive, byte for byte.

What is modelled: gravity on +Z, braking on X and cornering on Y; sensor offset and noise, the steps and limits of the
BMA220 at +-2 g; a host that reads a little late and now and then a millisecond or two; a GPS receiver with noise, slow
position error, latency, cold start, lost fixes, and a serial line whose reads split and join sentences.
What is not: rolling of the body, pitch at the sensor, engine and console vibration, a sensor away from the centre
of gravity.
"""

from __future__ import annotations

import os
import struct
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import reduce
from heapq import merge
from operator import xor
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.signal import resample_poly

from drivers.accelerometers import DEFAULT, accelerometers, line_reader
from drivers.accelerometers.accelerometer import Accelerometer, SerialAccelerometer
from drivers.dump import DumpHeader, DumpWriter, Event
from drivers.readings import GPS
from logger.profiles.track import Track
from logger.roads import iri, iso8608
from logger.roads.obstacles import speed_bump
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.units import KMH_MPS, KNOT_MPS, STANDARD_GRAVITY_MPS2, US_PER_S
from logger.vehicle.compose import Car, compose, recorded
from logger.vehicle.effect import Chosen
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


# Errors of a good receiver in the open: speed [m/s], and a slow walk of the position [m] over a minute.
SPEED_NOISE_MPS = 0.05
POSITION_ERROR_M, POSITION_MEMORY_S = 0.8, 60.0
LATENCY_JITTER_S = 0.010
COURSE_FROM_MPS = 1.0

_DEG_PER_M = 1 / 111_195.0


@dataclass(frozen=True)
class Reception:
    """When the receiver has a fix, and what goes wrong on its line.

    first_fix_s    cold start: no fix and no time before this [s from the start of the drive]
    lost           (from, to) stretches without a fix [s]
    corrupted_s    the RMC of the epoch nearest to this arrives with a wrong character; None: all arrive well
    latency_s      from the instant of a fix to its first byte [s]
    """

    first_fix_s: float = 0.0
    lost: Sequence[tuple[float, float]] = ()
    corrupted_s: float | None = None
    latency_s: float = 0.15

    def has_fix(self, time_s: float) -> bool:
        """Tell whether there is a fix at this time [s]."""
        return time_s >= self.first_fix_s and not any(begin <= time_s < end for begin, end in self.lost)


def transmit(
    motion: DriveMotion, start_utc: datetime, reception: Reception, baud: int, rng: np.random.Generator
) -> tuple[bytes, Array]:
    """Everything the receiver sends during a drive, and when each byte has arrived [s from the start of the drive].

    One epoch at every whole second of UTC: RMC, VTG, GGA, GSA, every tenth second ZDA, every seventh a UBX frame.
    """
    first_s = (-start_utc.microsecond % 1_000_000) / 1e6
    epochs = np.arange(first_s, motion.time_s[-1], 1.0)
    shown = _observed(motion, epochs, rng)
    data, arrivals = [], []
    for index, time_s in enumerate(epochs):
        utc = start_utc + timedelta(seconds=float(time_s))
        message = _epoch(utc, index, shown(index) if reception.has_fix(time_s) else None,
                         knows_time=bool(time_s >= reception.first_fix_s))
        if reception.corrupted_s is not None and abs(time_s - reception.corrupted_s) <= 0.5:
            message = message[:20] + bytes([message[20] ^ 0x04]) + message[21:]
        begin_s = time_s + reception.latency_s + LATENCY_JITTER_S * rng.standard_normal()
        data.append(message)
        arrivals.append(begin_s + np.arange(1, len(message) + 1) * 10 / baud)
    return b"".join(data), np.concatenate(arrivals)


@dataclass(frozen=True)
class _Seen:
    lat_deg: float
    lon_deg: float
    speed_mps: float
    course_deg: float
    altitude_m: float


def _observed(motion: DriveMotion, epochs: Array, rng: np.random.Generator) -> Callable[[int], _Seen]:
    """The motion at the epochs as the receiver sees it."""
    kept = np.exp(-1.0 / POSITION_MEMORY_S)
    kicks = rng.standard_normal((len(epochs), 2)) * POSITION_ERROR_M
    error = np.empty_like(kicks)
    error[0] = kicks[0]
    for index in range(1, len(epochs)):
        error[index] = kept * error[index - 1] + np.sqrt(1 - kept**2) * kicks[index]
    lat = np.interp(epochs, motion.time_s, motion.lat_deg)
    lon = np.interp(epochs, motion.time_s, motion.lon_deg) + error[:, 1] * _DEG_PER_M / np.cos(np.radians(lat))
    lat = lat + error[:, 0] * _DEG_PER_M
    speed = np.interp(epochs, motion.time_s, motion.speed_mps) + SPEED_NOISE_MPS * rng.standard_normal(len(epochs))
    speed = np.abs(speed)
    course = np.interp(epochs, motion.time_s, motion.course_deg)
    altitude = 22.0 + 6.0 * np.sin(epochs / 90.0)
    return lambda i: _Seen(lat[i], lon[i], speed[i], course[i], altitude[i])


def _epoch(utc: datetime, index: int, seen: _Seen | None, knows_time: bool) -> bytes:
    clock = f"{utc:%H%M%S}.00" if knows_time else ""
    date = f"{utc:%d%m%y}" if knows_time else ""
    if seen is None:
        sentences = [
            f"GNRMC,{clock},V,,,,,,,{date},,,N", "GNVTG,,,,,,,,,N", f"GNGGA,{clock},,,,,0,00,99.99,,,,,,",
            "GNGSA,A,1,,,,,,,,,,,,,99.99,99.99,99.99",
        ]
    else:
        place = f"{_angle(seen.lat_deg, 2)},{'N' if seen.lat_deg >= 0 else 'S'}," \
                f"{_angle(seen.lon_deg, 3)},{'E' if seen.lon_deg >= 0 else 'W'}"
        course = f"{seen.course_deg:.2f}" if seen.speed_mps >= COURSE_FROM_MPS else ""
        knots = f"{seen.speed_mps / KNOT_MPS:.3f}"
        sentences = [
            f"GNRMC,{clock},A,{place},{knots},{course},{date},,,A",
            f"GNVTG,{course},T,,M,{knots},N,{seen.speed_mps / KMH_MPS:.3f},K,A",
            f"GNGGA,{clock},{place},1,11,0.82,{seen.altitude_m:.1f},M,-33.6,M,,",
            "GNGSA,A,3,02,05,12,13,15,18,20,24,25,29,31,,1.62,0.82,1.40",
        ]
        if utc.second % 10 == 0:
            sentences.append(f"GNZDA,{clock},{utc:%d,%m,%Y},00,00")
    parts = [_sentence(text) for text in sentences]
    if index % 7 == 3:
        parts.insert(2, _ubx(index))
    return b"".join(parts)


def _angle(degrees: float, digits: int) -> str:
    units = round(abs(degrees) * 60 * 100_000)  # 1e-5 minutes, rounded once
    return f"{units // 6_000_000:0{digits}d}{units % 6_000_000 / 100_000:08.5f}"


def _sentence(text: str) -> bytes:
    return f"${text}*{reduce(xor, text.encode('ascii')):02X}\r\n".encode("ascii")


def _ubx(index: int) -> bytes:
    """A UBX frame (class 1, id 0x22) whose payload holds a dollar sign and a line feed, to try the framing."""
    body = struct.pack("<BBHIiI4s4s", 0x01, 0x22, 20, index * 1000, -index, index * index, b"$GN\n", b"\xb5\x62$\r")
    first = second = 0
    for byte in body:
        first = (first + byte) & 0xFF
        second = (second + first) & 0xFF
    return b"\xb5\x62" + body + bytes([first, second])


def parse_start(start_utc: str) -> datetime:
    """ISO 8601 text to a time in UTC."""
    return datetime.fromisoformat(start_utc).astimezone(UTC)


GPS_BAUD = 9600
LINES = "lines"
LINES_BAUD = 115_200
_HEADER_KEYS = ("range_g", "profile")  # what the format asks of a header; the rest is at its default

# A host that sleeps until a deadline wakes late by tens of microseconds, and one time in a hundred by a millisecond.
_LATE_US, _RARE_SHARE, _RARE_LATE_US = 30.0, 0.01, (800.0, 2000.0)
# A serial adapter hands over what has arrived some milliseconds after the first byte.
_HELD_BACK_US = (8_000, 16_000)


@dataclass(frozen=True)
class DrivePlan:
    """Everything that makes a drive.

    speed_knots    (time [s], speed [m/s]) from time 0; straight lines between them, corners rounded over a second
    stretches      roughness along the road, where it is the plan's own; the last one goes on
    bumps          speed bumps
    reception      what the GPS receiver sees
    sensor         ``DEFAULT``, the accelerometer that settings mean when they name none (a BMA220: register bytes), or
                   "lines", a serial sensor that sends ``x,y,z`` in g per line
    rate_hz        samples per second
    noise_mps2     r.m.s. noise of the sensor on each axis, before it quantises [m/s2]
    offset_mps2    zero offset of X, Y, Z [m/s2]
    start_utc      ISO 8601 time of the start of the recording
    start_us       monotonic time of the start [us]
    seed           of everything random
    """

    speed_knots: Sequence[tuple[float, float]]
    stretches: Sequence[RoadStretch]
    bumps: Sequence[SpeedBump] = ()
    reception: Reception = field(default_factory=Reception)
    sensor: str = DEFAULT
    rate_hz: int = 100
    noise_mps2: float = 0.1
    offset_mps2: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_utc: str = "2026-06-09T13:05:20.400+00:00"
    start_us: int = 41_300_000
    seed: int = 1


@dataclass(frozen=True)
class DemoDrive:
    """A drive as bytes, and its truth.

    header, events    of the recorded dump
    start_us          monotonic time of ``motion.time_s`` zero [us]
    utc_offset_us     add it to a monotonic time to get UTC [us since 1970]
    motion            where the car was, on a grid of 1 ms
    accel_mps2        what moved the sensor up and down, without gravity, offset and noise, on the same grid [m/s2]
    road              the road; ``road.iri(edges_m)`` is the exact IRI between distances of the drive
    """

    header: DumpHeader
    events: list[Event]
    start_us: int
    utc_offset_us: int
    motion: DriveMotion
    accel_mps2: Array
    road: Road


def simulate_drive(plan: DrivePlan, vehicle: Vehicle, effects: Sequence[Chosen] = (), road: Road | None = None
                   ) -> DemoDrive:
    """Drive a half car along the plan. ValueError for a sensor that is not known.

    effects    physical effects of the car
    road       one that other drives share, at least as long as the drive; None: one of the plan's own
    """
    if plan.sensor not in (DEFAULT, LINES):
        raise ValueError(f"expected the sensor {DEFAULT} or {LINES}, found {plan.sensor!r}")
    kind = line_reader() if plan.sensor == LINES else accelerometers()[plan.sensor]
    sensor_rng, wire_rng, receiver_rng = (np.random.default_rng([plan.seed, part]) for part in range(3))
    motion = drive_along(plan.speed_knots)
    if road is None:
        road = build_road(plan.stretches, plan.bumps, motion.distance_m[-1], plan.seed)
    accel = (sensed_acceleration(compose(vehicle, effects), road, motion) if effects else
             body_acceleration(vehicle, road, motion))

    start_utc = parse_start(plan.start_utc)
    data, arrival_s = transmit(motion, start_utc, plan.reception, GPS_BAUD, receiver_rng)
    end_us = plan.start_us + round(motion.time_s[-1] * US_PER_S)
    gps_events = _read_in_chunks(GPS, data, plan.start_us + arrival_s * US_PER_S, wire_rng)
    sensor_events = _sensor_events(plan, kind, *_sampled(plan, motion, accel, sensor_rng), wire_rng)
    return DemoDrive(
        header=DumpHeader(
            start_utc=plan.start_utc,
            accelerometer={"driver": kind.name, **_header(kind)},
            gps={"baud": GPS_BAUD},
            vehicle=vehicle.name,
        ),
        events=[event for event in merge(sensor_events, gps_events, key=lambda event: event.t_us)
                if event.t_us <= end_us],
        start_us=plan.start_us,
        utc_offset_us=round(start_utc.timestamp() * US_PER_S) - plan.start_us,
        motion=motion, accel_mps2=accel, road=road,
    )


def record(drive: DemoDrive, path: str | os.PathLike[str]) -> None:
    """Write a drive as a recorded dump. Errors are those of ``drivers.dump.DumpWriter``."""
    writer = DumpWriter(path, drive.header)
    try:
        for event in drive.events:
            writer.write(event)
    finally:
        writer.close()


def _sampled(
    plan: DrivePlan, motion: DriveMotion, accel: Array, rng: np.random.Generator
) -> tuple[npt.NDArray[np.int64], Array]:
    """When the sensor is read [us, monotonic] and what it feels then: (n, 3) [m/s2]."""
    count = int((motion.time_s[-1]) * plan.rate_hz)
    late_us = np.abs(rng.normal(0.0, _LATE_US, count))
    rare = rng.random(count) < _RARE_SHARE
    late_us[rare] = rng.uniform(*_RARE_LATE_US, rare.sum())
    since_us = np.round(np.arange(count) * US_PER_S / plan.rate_hz + late_us).astype(np.int64)
    since_us = np.maximum.accumulate(since_us)  # a read that is late delays those that follow at once
    felt = np.stack([motion.forward_mps2, motion.left_mps2, accel + STANDARD_GRAVITY_MPS2], axis=1)
    step = since_us / (STEP_S * US_PER_S)
    grid = np.arange(len(motion.time_s))
    values = np.stack([np.interp(step, grid, felt[:, axis]) for axis in range(3)], axis=1)
    values += np.array(plan.offset_mps2) + plan.noise_mps2 * rng.standard_normal((count, 3))
    return plan.start_us + since_us, values


def _header(kind: Accelerometer[Any]) -> dict[str, Any]:
    said = kind.header(kind.settings())
    return {key: said[key] for key in _HEADER_KEYS if key in said}


def _sensor_events(
    plan: DrivePlan, kind: Accelerometer[Any], t_us: npt.NDArray[np.int64], values: Array, rng: np.random.Generator
) -> list[Event]:
    """Readings as its source gives them: one event each, or, over a serial port, in the chunks they are read in."""
    readings = kind.simulated(kind.settings(), values)
    if not isinstance(kind, SerialAccelerometer):
        return [Event(t, kind.name, data) for t, data in zip(t_us.tolist(), readings, strict=True)]
    byte_us = 10 * US_PER_S / LINES_BAUD
    arrival = np.concatenate([
        t + byte_us * np.arange(1, len(line) + 1) for t, line in zip(t_us.tolist(), readings, strict=True)
    ])
    return _read_in_chunks(kind.name, b"".join(readings), arrival, rng)


def _read_in_chunks(source: str, data: bytes, arrival_us: Array, rng: np.random.Generator) -> list[Event]:
    """Reads of a serial line: each begins with the first byte that waits and ends a little later."""
    events = []
    begin = 0
    while begin < len(data):
        t_us = round(arrival_us[begin] + rng.uniform(*_HELD_BACK_US))
        end = int(np.searchsorted(arrival_us, t_us, side="right"))
        events.append(Event(t_us, source, data[begin:end]))
        begin = end
    return events


PLAN = DrivePlan(
    speed_knots=(
        (0, 0), (4, 0), (13, 12), (38, 13), (50, 11), (58, 11), (68, 0), (88, 0),      # town, red light for 20 s
        (99, 15), (125, 16), (137, 24.5), (205, 25), (220, 12), (245, 11), (251, 5),   # the fast road, down to the lane
        (259, 5), (264, 9), (295, 8), (302, 13), (330, 14), (340, 0), (345, 0),        # bump, rough lane, home
    ),
    stretches=(
        RoadStretch(420, 60), RoadStretch(250, 140), RoadStretch(530, 40), RoadStretch(2070, 12), RoadStretch(290, 220),
        RoadStretch(180, 120),
        RoadStretch(270, 800), RoadStretch(100, 300), RoadStretch(500, 90),
    ),
    bumps=(SpeedBump(3695, 0.08, 1.6),),
    reception=Reception(first_fix_s=8, lost=((114, 118), (165, 190)), corrupted_s=30),
    offset_mps2=(0.21, -0.13, 0.16),
    seed=2009,
)


def main() -> None:
    """Write the drive to the file named on the command line."""
    record(simulate_drive(PLAN, read_vehicle(vehicle_file("rav4-2009"))), sys.argv[1])


if __name__ == "__main__":
    main()
