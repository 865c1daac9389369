"""Cases of the examination as a recorder in a car would have left them: dumps, and a measured line for each road.

The motion, the road and the record without noise are those of a random case. What lies between them and the lab is a
sensor with its noise and steps, a receiver whose speeds and places are wrong and late, and ``ridelog extract``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter, resample_poly

from drivers.accelerometers import accelerometers, line_reader
from drivers.dump import DumpHeader, DumpWriter, Event
from drivers.readings import GPS

from ..simulator.recorder import Noise
from .random_case import Case, Recording

Array = NDArray[np.float64]

SENSORS = ("serial", "bma220")
_FINE = 10  # times the recorder's rate at which the record is looked up between its samples
_G_MPS2 = 9.80665
_BMA220_STEP_MPS2 = 2 * _G_MPS2 / 32
_START = datetime(2026, 6, 9, 13, 5, 20, 400_000, UTC)
START_S = 41.3
"""Of a dump, on its monotonic clock."""
_START_US = round(1e6 * START_S)
_METRES_PER_DEG = 111_195.0
_LAT_DEG, _LON_DEG = 48.137, 11.575
_PLACES_EVERY_M = 10.0


@dataclass(frozen=True)
class Receiver:
    """A GPS receiver: its rate, deviations of a speed and of a place, how long the latter's error lasts, its delay."""

    rate_hz: int
    speed_mps: float
    place_m: float
    lasts_s: float
    delay_s: float


def noise_of(sensor: str) -> Callable[[np.random.Generator], Noise]:
    """Which noise such a sensor has."""
    def draw(rng: np.random.Generator) -> Noise:
        if sensor == "bma220":
            return Noise(float(rng.uniform(0.08, 0.15)), _BMA220_STEP_MPS2)
        return Noise(float(np.exp(rng.uniform(*np.log([0.02, 0.06])))), 0.0)

    return draw


def draw_receiver(rng: np.random.Generator) -> Receiver:
    """From a cheap one to a good one."""
    return Receiver(int(rng.choice([1, 1, 5, 10])), float(rng.uniform(0.03, 0.1)), float(rng.uniform(0.7, 2.0)),
                    float(rng.uniform(20, 90)), float(rng.uniform(0.05, 0.3)))


def write_field(
    case: Case, sensor: str, vehicle: Path, folder: Path, one_road: bool = False,
) -> list[tuple[Path, Path]]:
    """Write ``run1.dump``, ``line1.csv`` ... into a folder; give the pairs. The dumps name the file of the vehicle.

    one_road    whether all drives are over one road, and not each over one elsewhere
    """
    rng = np.random.default_rng([case.seed, SENSORS.index(sensor)])
    receiver = draw_receiver(rng)
    pairs: list[tuple[Path, Path]] = []
    along = None
    for number, (drive, run, road) in enumerate(
            zip(case.scene.drives, case.recordings, case.profiles, strict=True), 1):
        if along is None or not one_road:
            along = _Path(rng.uniform(0, 2 * np.pi), rng.uniform(0.1, 0.6), rng.uniform(400, 2000))
        dump, line = folder / f"run{number}.dump", folder / f"line{number}.csv"
        _write_dump(dump, case, sensor, vehicle, run, drive.distance_m, drive.speed_at_mps, along, receiver, rng)
        tracks = [road.left_m, road.right_m] if case.both_tracks else [road.left_m]
        _write_line(line, road.distance_m, tracks, along)
        pairs.append((dump, line))
    return pairs


@dataclass(frozen=True)
class _Path:
    """A road on the ground: its heading swings by so much [rad] over a length [m] about a direction [rad]."""

    direction: float
    swing: float
    length_m: float

    def at(self, distance_m: Array) -> tuple[Array, Array]:
        """Latitudes and longitudes [degrees]."""
        way = np.arange(min(distance_m.min(), 0.0) - 5.0, distance_m.max() + 5.0, 0.5)
        heading = self.direction + self.swing * np.sin(2 * np.pi * way / self.length_m)
        north, east = np.cumsum(np.cos(heading)) * 0.5, np.cumsum(np.sin(heading)) * 0.5
        return (_LAT_DEG + np.interp(distance_m, way, north - np.interp(0.0, way, north)) / _METRES_PER_DEG,
                _LON_DEG + np.interp(distance_m, way, east - np.interp(0.0, way, east)) / _METRES_PER_DEG
                / np.cos(np.radians(_LAT_DEG)))


def _write_line(path: Path, distance_m: Array, tracks: list[Array], along: _Path) -> None:
    lat, lon = along.at(distance_m)
    every = max(1, round(_PLACES_EVERY_M / (distance_m[1] - distance_m[0])))
    names = ["distance_m", "elevation_m", "elevation_right_m"][: 1 + len(tracks)]
    with path.open("w", encoding="ascii") as file:
        file.write(",".join([*names, "lat_deg", "lon_deg"]) + "\n")
        for index, place in enumerate(distance_m):
            heights = ",".join(f"{one[index]:.6f}" for one in tracks)
            where = f"{lat[index]:.8f},{lon[index]:.8f}" if index % every == 0 else ","
            file.write(f"{place:.2f},{heights},{where}\n")


def _write_dump(
    path: Path, case: Case, sensor: str, vehicle: Path, run: Recording, distance_of: Callable[[Array], Array],
    speed_of: Callable[[Array], Array], along: _Path, receiver: Receiver, rng: np.random.Generator,
) -> None:
    kind = line_reader() if sensor == "serial" else accelerometers()["bma220"]
    settings = kind.settings()
    count = len(run.t_s)
    late_s = np.abs(rng.normal(0.0, 30e-6, count))
    fine = resample_poly(run.clean_mps2, _FINE, 1)
    rate_hz = 1 / (run.t_s[1] - run.t_s[0])
    upright = np.interp(run.t_s + late_s, np.arange(len(fine)) / (_FINE * rate_hz), fine) + _G_MPS2
    values = np.stack([np.gradient(speed_of(run.t_s), run.t_s), np.zeros(count), upright], axis=1)
    values += rng.uniform(-0.3, 0.3, 3) + case.noise.white_mps2 * rng.standard_normal((count, 3))
    wire_s = 0.0 if sensor == "bma220" else 0.002
    events = [Event(_START_US + round(1e6 * (t + wire_s)), kind.name, data) for t, data in zip(
        run.t_s + late_s, kind.simulated(settings, values), strict=True)]
    events += _sentences(run.t_s, distance_of, speed_of, along, receiver, rng)
    header = {key: kind.header(settings)[key] for key in ("range_g", "profile") if key in kind.header(settings)}
    writer = DumpWriter(path, DumpHeader(_START.isoformat(), {"driver": kind.name, **header}, {"baud": 38400},
                                         str(vehicle)))
    for event in sorted(events, key=lambda one: one.t_us):
        writer.write(event)
    writer.close()


def _sentences(
    t_s: Array, distance_of: Callable[[Array], Array], speed_of: Callable[[Array], Array], along: _Path,
    receiver: Receiver, rng: np.random.Generator,
) -> list[Event]:
    """RMC sentences as they arrive."""
    step_us = 1_000_000 // receiver.rate_hz
    first_us = -_START.microsecond % step_us
    epoch_s = np.arange(first_us, 1e6 * t_s[-1], step_us) / 1e6
    lat, lon = along.at(distance_of(epoch_s))
    kept = np.exp(-1 / receiver.rate_hz / receiver.lasts_s)
    wander = receiver.place_m * np.array([_lasting(len(epoch_s), kept, rng) for _ in range(2)])
    lat = lat + wander[0] / _METRES_PER_DEG
    lon = lon + wander[1] / _METRES_PER_DEG / np.cos(np.radians(lat))
    speed = np.abs(speed_of(epoch_s) + receiver.speed_mps * rng.standard_normal(len(epoch_s)))
    arrival_s = epoch_s + receiver.delay_s + np.abs(rng.normal(0, 0.004, len(epoch_s)))
    events = []
    for at_s, heard_s, one_lat, one_lon, one_speed in zip(epoch_s, arrival_s, lat, lon, speed, strict=True):
        utc = _START + timedelta(microseconds=round(1e6 * at_s))
        events.append(Event(_START_US + round(1e6 * heard_s), GPS, _rmc(utc, one_lat, one_lon, one_speed)))
    return events


def _lasting(count: int, kept: float, rng: np.random.Generator) -> Array:
    fresh = np.sqrt(1 - kept**2) * rng.standard_normal(count)
    fresh[0] = rng.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -kept], fresh))


def _rmc(utc: datetime, lat_deg: float, lon_deg: float, speed_mps: float) -> bytes:
    place = f"{_minutes(lat_deg, 2)},N,{_minutes(lon_deg, 3)},E"
    clock = f"{utc:%H%M%S}.{utc.microsecond // 10_000:02d}"
    text = f"GNRMC,{clock},A,{place},{speed_mps / 0.514444:.3f},,{utc:%d%m%y},,,A"
    check = 0
    for byte in text.encode("ascii"):
        check ^= byte
    return f"${text}*{check:02X}\r\n".encode("ascii")


def _minutes(degrees: float, digits: int) -> str:
    whole = int(degrees)
    return f"{whole:0{digits}d}{(degrees - whole) * 60:08.5f}"
