"""What a simulated GPS receiver sends: NMEA 0183 sentences and a few UBX frames, each byte at its time on the wire."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import reduce
from operator import xor

import numpy as np
import numpy.typing as npt

from logger.demo.motion import DriveMotion
from logger.units import KMH_MPS, KNOT_MPS

Array = npt.NDArray[np.float64]

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
