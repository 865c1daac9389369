"""A drive that never took place, as the bytes a recorder would have written.

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
from collections.abc import Sequence
from dataclasses import dataclass, field
from heapq import merge
from typing import Any

import numpy as np
import numpy.typing as npt

from drivers.accelerometers import DEFAULT, accelerometers, line_reader
from drivers.accelerometers.accelerometer import Accelerometer, SerialAccelerometer
from drivers.dump import DumpHeader, DumpWriter, Event
from drivers.readings import GPS
from logger.demo.motion import (
    STEP_S,
    DriveMotion,
    Road,
    RoadStretch,
    SpeedBump,
    body_acceleration,
    build_road,
    drive_along,
    sensed_acceleration,
)
from logger.demo.receiver import Reception, parse_start, transmit
from logger.units import STANDARD_GRAVITY_MPS2, US_PER_S
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

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
class Drive:
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
                   ) -> Drive:
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
    return Drive(
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


def record(drive: Drive, path: str | os.PathLike[str]) -> None:
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
