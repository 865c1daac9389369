"""Receivers on serial lines that are too slow, and their drives as recordings: positions and times known by formulae.

The car drives north-east along ``way_m``; sentences leave the receiver ``LATENCY_S`` after their instant, wait in a
buffer that drops whole sentences when it is full, and each byte takes its time on the line.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import reduce
from operator import xor

from drivers.dump import DumpHeader, Event
from drivers.readings import GPS
from logger.records import WindowRecord

LATENCY_S = 0.10
START = datetime(2026, 5, 4, 23, 58, 50, tzinfo=UTC)
LAT_DEG, LON_DEG = 12.34, 45.67
M_PER_DEG = 111_195.0
LOOK_S = 0.025

Burst = Callable[[datetime, float], list[str]]


def speed_mps(t_s: float) -> float:
    """Of the car."""
    return 15 + 5 * math.sin(t_s / 11) + 2 * math.sin(t_s / 3.1)


def way_m(t_s: float) -> float:
    """Its integral."""
    return 15 * t_s + 55 * (1 - math.cos(t_s / 11)) + 6.2 * (1 - math.cos(t_s / 3.1))


def sentence(text: str) -> bytes:
    """With its checksum."""
    return f"${text}*{reduce(xor, text.encode()):02X}\r\n".encode()


def place(t_s: float) -> str:
    """Four fields of a position."""
    along_deg = way_m(t_s) * math.sqrt(0.5) / M_PER_DEG
    return (f"{_angle(LAT_DEG + along_deg, 2)},N,"
            f"{_angle(LON_DEG + along_deg / math.cos(math.radians(LAT_DEG)), 3)},E")


def _angle(degrees: float, digits: int) -> str:
    return f"{int(degrees):0{digits}d}{degrees % 1 * 60:08.5f}"


def rmc(utc: datetime, t_s: float) -> str:
    """Time, date, place and speed."""
    return f"GNRMC,{_clock(utc)},A,{place(t_s)},{speed_mps(t_s) * 3600 / 1852:.3f},45.0,{utc:%d%m%y},,,A"


def gga(utc: datetime, t_s: float) -> str:
    """Time and place."""
    return f"GNGGA,{_clock(utc)},{place(t_s)},1,09,1.0,100.0,M,40.0,M,,"


def vtg(t_s: float) -> str:
    """Speed."""
    return f"GNVTG,45.0,T,,M,{speed_mps(t_s) * 3600 / 1852:.3f},N,{speed_mps(t_s) * 3.6:.3f},K,A"


def gll(utc: datetime, t_s: float) -> str:
    """Place and time."""
    return f"GNGLL,{place(t_s)},{_clock(utc)},A,A"


def zda(utc: datetime) -> str:
    """Time and date."""
    return f"GNZDA,{_clock(utc)},{utc:%d,%m,%Y},00,00"


def _clock(utc: datetime) -> str:
    return f"{utc:%H%M%S}.{utc.microsecond // 10_000:02d}"


SATELLITES = "GPGSV,4,1,16,01,40,083,46,02,17,308,41,12,07,344,39,14,22,228,45"


def rmc_gga_and(satellites: int) -> Burst:
    """A burst with so many sentences of 70 bytes that say nothing of the car."""
    return lambda utc, t_s: [rmc(utc, t_s), gga(utc, t_s), *[SATELLITES] * satellites]


@dataclass(frozen=True)
class Receiver:
    """What it sends each ``every_s`` [s] over a line of ``baud``, through a buffer of so many bytes.

    jumps        (from when on [s], by how much [s] its clock is wrong)
    begun_s      it was on for so long before the recording began [s]
    """

    burst: Burst
    every_s: float = 1.0
    baud: int = 9600
    buffer_bytes: int = 4096
    jumps: tuple[tuple[float, float], ...] = ()
    begun_s: float = 0.0

    def events(self, lasting_s: float) -> Iterator[Event]:
        """Chunks of bytes, by when they were read."""
        byte_s = 10 / self.baud
        sent: list[tuple[float, bytes]] = []
        free_s = -self.begun_s
        for k in range(math.ceil(-self.begun_s / self.every_s), int(lasting_s / self.every_s)):
            t_s = k * self.every_s
            wrong_s = sum(by_s for from_s, by_s in self.jumps if t_s >= from_s)
            for text in self.burst(START + timedelta(seconds=t_s + wrong_s), t_s):
                data = sentence(text)
                ready_s = t_s + LATENCY_S
                if (free_s - ready_s) / byte_s + len(data) > self.buffer_bytes:
                    continue
                begin_s = max(free_s, ready_s)
                free_s = begin_s + len(data) * byte_s
                sent += [(begin_s + (n + 1) * byte_s, data[n : n + 1]) for n in range(len(data))]
        chunk, read = b"", 0
        for at_s, byte in sent:
            look = math.ceil(at_s / LOOK_S)
            if look != read and chunk:
                if 0 <= read * LOOK_S < lasting_s:
                    yield Event(round(read * LOOK_S * 1e6), GPS, chunk)
                chunk = b""
            read, chunk = look, chunk + byte


def drive(receiver: Receiver, lasting_s: float = 75.0) -> tuple[DumpHeader, list[Event]]:
    """The drive as a recording: its header and events, with a BMA220 that feels noise."""
    rng = random.Random(1)
    readings = [Event(k * 10_000, "bma220", bytes((0, 0, (round(16 + rng.gauss(0, 0.8)) & 63) << 2)))
                for k in range(int(lasting_s * 100))]
    header = DumpHeader(None, {"driver": "bma220", "range_g": 2}, {"baud": receiver.baud}, "rav4-2009")
    return header, sorted([*readings, *receiver.events(lasting_s)], key=lambda event: event.t_us)


def off_m(row: WindowRecord) -> float:
    """How far along the road a row's place is beyond where the car was [m]."""
    assert row.lat_deg is not None
    return (row.lat_deg - LAT_DEG) * M_PER_DEG * math.sqrt(2) - way_m(row.t_us / 1e6 + row.duration_s / 2)


def off_mps(row: WindowRecord) -> float:
    """How far a row's speed is beyond that of the car [m/s]."""
    assert row.speed_mps is not None
    return row.speed_mps - speed_mps(row.t_us / 1e6 + row.duration_s / 2)


def off_s(row: WindowRecord) -> float:
    """How far a row's UTC is beyond what it was [s]."""
    assert row.utc_us is not None
    return (row.utc_us - row.t_us) / 1e6 - START.timestamp()
