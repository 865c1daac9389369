"""A car's day as the bytes of its sensors: now and then a drive of six minutes, and parking in between.

The drives are the demonstration drive, there and back in turn, with its red light, short and long losses of fix. Three
ways of parking follow one another: in the open, under ground without a fix, and with the sensors switched off. The
receiver tells true UTC; the host's monotonic clock goes fast by 20 ppm, as a crystal may.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from heapq import merge
from itertools import pairwise

import numpy as np

from drivers.dump import DumpHeader, Event
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from .simulated_drive import GPS_BAUD, PLAN, STEP_S, DriveMotion, Reception, simulate_drive, transmit

START_US = 41_300_000
CLOCK_RATE = 1.0 + 20e-6
MINUTE_S = 60
COLD_START_S = 8.0
READ_EVERY_S = 0.02
OPEN, UNDER_GROUND, OFF = range(3)
HEADER = DumpHeader(None, {"driver": "bma220", "range_g": 2}, {"baud": GPS_BAUD}, "rav4-2009")


@dataclass(frozen=True)
class Truth:
    """What a log of the day must say.

    known_m, blind_s    distance with known speed [m], time without [s]; both to a window per loss of fix
    drives              ended by standing in the open, or hearing nothing, for longer than five minutes
    silences            times that the sensors were off before the last event
    """

    known_m: float
    blind_s: float
    drives: int
    silences: int


class CarDay:
    """A number of drives from ``start_utc`` on, one every ``cycle_s`` [s]."""

    def __init__(self, drives: int, start_utc: datetime, cycle_s: int) -> None:
        self.cycles = drives
        self._start_utc = start_utc
        self._cycle_s = cycle_s
        drive = simulate_drive(PLAN, read_vehicle(vehicle_file("rav4-2009")))
        self._there = drive.motion
        self._driving = [(event.t_us - drive.start_us, event.data) for event in drive.events
                         if event.source == "bma220"]
        self._standing = _at_rest(len(self._driving))
        self._drive_s = round(float(drive.motion.time_s[-1]))

    def utc_us(self, t_us: int) -> float:
        """True UTC [us since 1970] when the host's monotonic clock shows ``t_us``."""
        return self._start_utc.timestamp() * 1e6 + (t_us - START_US) / CLOCK_RATE

    def truth(self) -> Truth:
        """From the plan alone."""
        motion = self._there
        (_, _), (begin_s, end_s) = PLAN.reception.lost  # the first is short enough to be bridged
        lost_m = float(np.ptp(np.interp([begin_s - 1, end_s], motion.time_s, motion.distance_m)))
        parkings = [cycle % 3 for cycle in range(self.cycles)]
        blind_s = self.cycles * (end_s - begin_s + 1) + COLD_START_S * (1 + parkings[:-1].count(OFF))
        blind_s += parkings.count(UNDER_GROUND) * (self._cycle_s - self._drive_s - MINUTE_S)
        ended = sum(parking != UNDER_GROUND for parking in parkings[:-1])
        known_m = self.cycles * (float(motion.distance_m[-1]) - lost_m)
        return Truth(known_m, blind_s, 1 + ended, parkings[:-1].count(OFF))

    def events(self) -> Iterator[Event]:
        """The bytes of both sensors, in order of time; some minutes of them in memory at a time."""
        rng = np.random.default_rng(24)
        motion = self._there
        for cycle in range(self.cycles):
            begin_s = cycle * self._cycle_s
            fresh = cycle == 0 or (cycle - 1) % 3 == OFF
            reception = replace(PLAN.reception, first_fix_s=COLD_START_S if fresh else 0.0, corrupted_s=30.0)
            yield from self._piece(begin_s, motion, self._driving, reception, rng)
            motion = _back(motion)
            if cycle % 3 == OFF:
                continue
            for minute in range((self._cycle_s - self._drive_s) // MINUTE_S + 1):
                since_s = self._drive_s + minute * MINUTE_S
                hidden = cycle % 3 == UNDER_GROUND and minute > 0
                reception = Reception(lost=((0.0, MINUTE_S),) if hidden else ())
                standing = _parked(motion, min(MINUTE_S, self._cycle_s - since_s))
                yield from self._piece(begin_s + since_s, standing, self._standing, reception, rng)

    def _piece(self, begin_s: int, motion: DriveMotion, readings: list[tuple[int, bytes]], reception: Reception,
               rng: np.random.Generator) -> Iterator[Event]:
        begin_us = START_US + round(begin_s * 1e6 * CLOCK_RATE)
        length_us = round(len(motion.time_s) * STEP_S * 1e6)
        chip = (Event(begin_us + t_us, "bma220", data) for t_us, data in readings if t_us < length_us)
        data, arrival_s = transmit(motion, self._start_utc + timedelta(seconds=begin_s), reception, GPS_BAUD, rng)
        number = np.floor(arrival_s / READ_EVERY_S)
        cuts = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), len(data)]
        reads = [Event(begin_us + round((number[low] + 1) * READ_EVERY_S * 1e6 * CLOCK_RATE), "nmea", data[low:high])
                 for low, high in pairwise(cuts) if low < high]
        last_us = begin_us + length_us - 1  # what would come after the piece's end comes at it
        sentences = (event._replace(t_us=min(event.t_us, last_us)) for event in reads)
        return merge(chip, sentences, key=lambda event: event.t_us)


def _at_rest(count: int) -> list[tuple[int, bytes]]:
    """Readings of a chip that lies still: 1 g and some noise."""
    counts = np.rint(np.random.default_rng(1).normal((0.0, 0.0, 15.6), 0.2, (count, 3))).astype(np.int8)
    registers = (counts << 2).tobytes()
    return [(10_000 * n, registers[3 * n:3 * n + 3]) for n in range(count)]


def _back(motion: DriveMotion) -> DriveMotion:
    """The same drive from where it ended, in the opposite direction."""
    return replace(motion, lat_deg=motion.lat_deg[-1] + motion.lat_deg[0] - motion.lat_deg,
                   lon_deg=motion.lon_deg[-1] + motion.lon_deg[0] - motion.lon_deg,
                   course_deg=(motion.course_deg + 180.0) % 360.0)


def _parked(motion: DriveMotion, seconds: int) -> DriveMotion:
    """Standing where ``motion`` begins."""
    time_s = np.arange(0.0, seconds, STEP_S)
    still = np.zeros_like(time_s)
    return DriveMotion(time_s, still, still, still + motion.lat_deg[0], still + motion.lon_deg[0], still, still, still)
