"""A simulated drive as a phone would have written it: at any angle, by any program, with an uneven clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from logger.units import STANDARD_GRAVITY_MPS2 as G

from .simulated_drive import DemoDrive


def rotation(rng: np.random.Generator) -> np.ndarray:
    """Any rotation (3, 3), all alike likely (J. Arvo, Graphics Gems III, 1992)."""
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


@dataclass(frozen=True, eq=False)
class Phone:
    """What a phone in a car feels: times (n,) from the drive's start [s], specific force (n, 3) along its own axes
    [m/s2] and what of it is gravity (n, 3); fixes once a second: (k,) times, latitude, longitude, speed."""

    time_s: np.ndarray
    force_mps2: np.ndarray
    gravity_mps2: np.ndarray
    fix_s: np.ndarray
    lat_deg: np.ndarray
    lon_deg: np.ndarray
    speed_mps: np.ndarray


def phone_in(drive: DemoDrive, rng: np.random.Generator, turned: np.ndarray, rate_hz: float = 104.0,
             jitter: float = 0.15,
             late_s: float = 0.1, step_mps2: float = 0.0024) -> Phone:
    """A phone whose axes are the car's (ahead, left, up) turned by a rotation (3, 3); fixes come so late."""
    motion = drive.motion
    end_s = motion.time_s[-1]
    time_s = np.arange(0.003, end_s, 1 / rate_hz)
    time_s = time_s + jitter / rate_hz * rng.uniform(-1, 1, len(time_s))
    time_s = time_s[(time_s > 0) & (time_s < end_s)]
    ahead, left, up = (np.interp(time_s, motion.time_s, one)
                       for one in (motion.forward_mps2, motion.left_mps2, drive.accel_mps2))
    force = np.stack([ahead, left, up + G], axis=1) @ turned.T
    force = step_mps2 * np.round((force + 0.01 * rng.standard_normal(force.shape)) / step_mps2)
    fix_s = np.arange(0.4, end_s, 1.0)
    lat, lon, speed = (np.interp(fix_s - late_s, motion.time_s, one)
                       for one in (motion.lat_deg, motion.lon_deg, motion.speed_mps))
    return Phone(time_s, force, np.outer(np.ones(len(time_s)), G * turned[:, 2]), fix_s, lat, lon,
                 np.abs(speed + 0.05 * rng.standard_normal(len(fix_s))))


def table(path: Path, header: str, *columns: np.ndarray, form: str = "%.9g", delimiter: str = ",",
          point: str = ".") -> Path:
    """Write columns (n,) below a header; a list of forms: one for each."""
    forms = form.split(",") if "," in form else [form] * len(columns)
    rows = (delimiter.join((one % value).replace(".", point) for one, value in zip(forms, row, strict=True))
            for row in zip(*columns, strict=True))
    path.write_text(header + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def phyphox(phone: Phone, folder: Path) -> list[str]:
    """Two files in a folder, semicolons and decimal commas."""
    folder.mkdir()
    axes = ";".join(f'"Acceleration {axis} (m/s^2)"' for axis in "xyz")
    table(folder / "Accelerometer.csv", f'"Time (s)";{axes}', phone.time_s, *phone.force_mps2.T, form="%.9E",
          delimiter=";", point=",")
    table(folder / "Location.csv", '"Time (s)";"Latitude (°)";"Longitude (°)";"Height (m)";"Velocity (m/s)";'
          '"Direction (°)";"Horizontal Accuracy (m)";"Vertical Accuracy (m)"', phone.fix_s, phone.lat_deg,
          phone.lon_deg, *[phone.fix_s * 0] * 1, phone.speed_mps, *[phone.fix_s * 0] * 3, form="%.9E", delimiter=";",
          point=",")
    return [str(folder)]


def sensor_logger(phone: Phone, folder: Path, sign: float = 1.0) -> list[str]:
    """Linear acceleration and gravity apart, nanoseconds since 1970; ``sign`` -1: as an iPhone counts."""
    folder.mkdir()
    epoch = 1_700_000_000_000_000_000

    def write(name: str, rows: np.ndarray) -> None:
        lines = [f"{epoch + round(t * 1e9)},{t:.7f},{z:.9f},{y:.9f},{x:.9f}"
                 for t, (x, y, z) in zip(phone.time_s, sign * rows, strict=True)]
        (folder / name).write_text("\n".join(["time,seconds_elapsed,z,y,x", *lines]) + "\n")

    write("Accelerometer.csv", phone.force_mps2 - phone.gravity_mps2)
    write("Gravity.csv", phone.gravity_mps2)
    write("Gyroscope.csv", 0 * phone.gravity_mps2)
    zero = 0 * phone.fix_s
    table(folder / "Location.csv", "time,seconds_elapsed,bearingAccuracy,speedAccuracy,verticalAccuracy,"
          "horizontalAccuracy,speed,bearing,altitude,longitude,latitude", epoch + phone.fix_s * 1e9, phone.fix_s, zero,
          zero, zero, zero, phone.speed_mps, zero, zero, phone.lon_deg, phone.lat_deg, form="%.10f")
    return [str(folder)]


def sensor_log(phone: Phone, folder: Path) -> list[str]:
    """One file, in g, all axes the other way round as Apple counts, the last fix written again in every row."""
    folder.mkdir()
    last = np.maximum(np.searchsorted(phone.fix_s, phone.time_s, side="right") - 1, 0)
    table(folder / "watch.csv", "locationLatitude(WGS84),locationLongitude(WGS84),locationSpeed(m/s),"
          "accelerometerTimestamp_sinceReboot(s),accelerometerAccelerationX(G),accelerometerAccelerationY(G),"
          "accelerometerAccelerationZ(G)", phone.lat_deg[last], phone.lon_deg[last], phone.speed_mps[last],
          62_608 + phone.time_s, *(-phone.force_mps2.T / G), form="%.10f")
    return [str(folder / "watch.csv")]


def own_names(phone: Phone, folder: Path) -> list[str]:
    """One file with names that nobody knows, milliseconds, g and km/h; fixes in rows of their own."""
    folder.mkdir()
    rows = [(t, f"{1000 * t:.3f},{x:.7f},{y:.7f},{z:.7f},,,")
            for t, (x, y, z) in zip(phone.time_s, phone.force_mps2 / G, strict=True)]
    rows += [(t, f"{1000 * t:.3f},,,,{lat:.9f},{lon:.9f},{3.6 * v:.4f}")
             for t, lat, lon, v in zip(phone.fix_s, phone.lat_deg, phone.lon_deg, phone.speed_mps, strict=True)]
    text = "\n".join(["clock,a1,a2,a3,north,east,v", *(line for _, line in sorted(rows))])
    (folder / "log.csv").write_text(text + "\n")
    return [str(folder / "log.csv"), "--columns", "t=clock:ms,x=a1:g,y=a2:g,z=a3:g,lat=north,lon=east,speed=v:km/h"]


LAYOUTS: dict[str, Callable[[Phone, Path], list[str]]] = {
    "phyphox": phyphox, "sensor_logger": sensor_logger, "iphone": lambda one, folder: sensor_logger(one, folder, -1.0),
    "sensor_log": sensor_log, "own_names": own_names,
}
