"""Layouts of the CSV files that known recorders write: which column is what, in which unit.

Problem: a phone's recording says "Acceleration x (m/s^2)", the next one "z" in a file called TotalAcceleration.csv.
Solution: one table of what is known, each with its source. A file is recognised by all columns that a layout needs, and
by its name where columns alone do not distinguish an accelerometer from a gyroscope. For another recorder the columns
are named (``logger_columns``).

Sign: an accelerometer at rest feels gravity as a push upwards (Android), or a program writes all its axes the other way
round (Apple's Core Motion). Both read the same along the direction in which gravity is felt, so no layout needs a sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from logger.units import STANDARD_GRAVITY_MPS2

ROLES = ("t", "x", "y", "z", "up", "gx", "gy", "gz", "lat", "lon", "speed")
"""What a column can be: time; acceleration along the recorder's own axes, or upwards, of a recorder with one axis;
gravity as the recorder gives it, along its axes; place; speed."""
AXES, GRAVITY, PLACE = ("x", "y", "z"), ("gx", "gy", "gz"), ("lat", "lon")

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "iso": 1.0}
ACCELERATION_UNITS = {"m/s2": 1.0, "g": STANDARD_GRAVITY_MPS2, "mg": 1e-3 * STANDARD_GRAVITY_MPS2}
SPEED_UNITS = {"m/s": 1.0, "km/h": 1 / 3.6, "mph": 0.44704, "kn": 1852 / 3600}
ANGLE_UNITS = {"deg": 1.0}
SPELLINGS = {"m/s^2": "m/s2", "mps2": "m/s2", "m/s/s": "m/s2", "mps": "m/s", "kmh": "km/h", "kph": "km/h",
             "km/hr": "km/h", "knots": "kn", "µs": "us", "°": "deg", "degrees": "deg", "sec": "s", "seconds": "s"}
"""Other words for a unit."""


def units_of(role: str) -> Mapping[str, float]:
    """The units of a role, and what one of each is in SI."""
    if role == "t":
        return TIME_UNITS
    if role == "speed":
        return SPEED_UNITS
    return ANGLE_UNITS if role in PLACE else ACCELERATION_UNITS


@dataclass(frozen=True)
class LayoutColumn:
    """A column: its name in the header, and its unit; None: the header or the numbers have to show it."""

    header: str
    unit: str | None = None


@dataclass(frozen=True)
class Layout:
    """``columns`` by role, all of which must be there; ``stem``: the name that the file must have, without .csv, in
    small letters; empty: the header says it."""

    name: str
    columns: Mapping[str, LayoutColumn]
    stem: str = ""


def _layout(name: str, stem: str = "", **columns: str) -> Layout:
    """Columns as ``"header|unit"``."""
    found = {role: LayoutColumn(*text.split("|")) for role, text in columns.items()}
    return Layout(name, MappingProxyType(found), stem)


def _axes(pattern: str, letters: str = "xyz") -> dict[str, str]:
    return {role: pattern.format(letter) for role, letter in zip(AXES, letters, strict=True)}


_SENSOR_LOGGER = _axes("{}|m/s2") | {"t": "seconds_elapsed|s"}
LAYOUTS = (
    # phyphox.org, data export of the experiments "Acceleration (with g)", "(without g)" and "Location (GPS)", and of
    # experiments that users put together
    _layout("phyphox acceleration", t="Time (s)|s", **_axes("Acceleration {} (m/s^2)|m/s2")),
    _layout("phyphox acceleration", t="Time (s)|s", **_axes("{} (m/s^2)|m/s2", "XYZ")),
    _layout("phyphox linear acceleration", t="Time (s)|s", **_axes("Linear Acceleration {} (m/s^2)|m/s2")),
    *(_layout("phyphox location", t="Time (s)|s", lat="Latitude (°)|deg", lon="Longitude (°)|deg", speed=speed)
      for speed in ("Velocity (m/s)|m/s", "Speed (m/s)|m/s")),
    # Sensor Logger: github.com/tszheichoi/awesome-sensor-logger, UNITS.md and COORDINATES.md
    _layout("Sensor Logger total acceleration", "totalacceleration", **_SENSOR_LOGGER),
    _layout("Sensor Logger linear acceleration", "accelerometer", **_SENSOR_LOGGER),
    _layout("Sensor Logger gravity", "gravity", t="seconds_elapsed|s", gx="x|m/s2", gy="y|m/s2", gz="z|m/s2"),
    _layout("Sensor Logger location", t="seconds_elapsed|s", lat="latitude|deg", lon="longitude|deg",
            speed="speed|m/s"),
    # SensorLog for iOS (sensorlog.berndthomas.net), form of the CSV export with units
    _layout("SensorLog", t="accelerometerTimestamp_sinceReboot(s)|s", lat="locationLatitude(WGS84)|deg",
            lon="locationLongitude(WGS84)|deg", speed="locationSpeed(m/s)|m/s",
            x="accelerometerAccelerationX(G)|g", y="accelerometerAccelerationY(G)|g",
            z="accelerometerAccelerationZ(G)|g"),
    # AndroSensor for Android (fivasim), two of its versions; the second as in the data set IO-VNBD
    _layout("AndroSensor", t="Time since start in ms|ms", lat="LOCATION Latitude :|deg", lon="LOCATION Longitude :|deg",
            speed="LOCATION Speed ( Kmh)|km/h", **_axes("ACCELEROMETER {} (m/s^2)|m/s2", "XYZ")),
    _layout("AndroSensor", t="TIME SINCE START (ms)|ms", lat="GPS LATITUDE (degrees)|deg",
            lon="GPS LONGITUDE (degrees)|deg", speed="GPS SPEED (Kmh)|km/h",
            **_axes("ACCELEROMETER {} (m/s^2)|m/s2", "XYZ")),
    # Physics Toolbox Sensor Suite (Vieyra Software), "g-Force" and "Linear Accelerometer"
    _layout("Physics Toolbox g-force", t="time|s", x="gFx|g", y="gFy|g", z="gFz|g"),
    # ridelog's own names (docs/at-the-desk.md)
    _layout("ridelog record", t="t_s|s", x="accel_x_mps2|m/s2", y="accel_y_mps2|m/s2", z="accel_z_mps2|m/s2"),
    _layout("ridelog record", t="t_s|s", up="accel_z_mps2|m/s2"),
    _layout("ridelog speed and place", t="t_s|s", lat="lat_deg|deg", lon="lon_deg|deg", speed="speed_mps|m/s"),
    *(_layout("ridelog speed", t="t_s|s", speed=speed)
      for speed in ("speed_mps|m/s", "speed_kmh|km/h", "speed_mph|mph")),
)
