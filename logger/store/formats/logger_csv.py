"""CSV files of phones and other loggers: known layouts, columns that are named, and the table by role."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from logger.arrays import Array
from logger.bounds import TIME
from logger.errors import BadInput
from logger.files import read_bounded
from logger.store.formats.csv_table import CsvTable, Names, find_table, read_rows, shown
from logger.store.formats.record_file import MAX_BYTES
from logger.units import KMH_MPS, KNOT_MPS, MPH_MPS, STANDARD_GRAVITY_MPS2

ROLES = ("t", "x", "y", "z", "up", "gx", "gy", "gz", "lat", "lon", "speed")
"""What a column can be: time; acceleration along the recorder's own axes, or upwards, of a recorder with one axis;
gravity as the recorder gives it, along its axes; place; speed."""
AXES, GRAVITY, PLACE = ("x", "y", "z"), ("gx", "gy", "gz"), ("lat", "lon")

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "iso": 1.0}
ACCELERATION_UNITS = {"m/s2": 1.0, "g": STANDARD_GRAVITY_MPS2, "mg": 1e-3 * STANDARD_GRAVITY_MPS2}
SPEED_UNITS = {"m/s": 1.0, "km/h": KMH_MPS, "mph": MPH_MPS, "kn": KNOT_MPS}
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
    small letters; empty: the header says it.

    Problem: a phone's recording says "Acceleration x (m/s^2)", the next one "z" in a file called TotalAcceleration.csv.
    Solution: one table of what is known, each with its source. A file is recognised by all columns that a layout needs,
    and by its name where columns alone do not distinguish an accelerometer from a gyroscope. For another recorder the
    columns are named.

    Sign: an accelerometer at rest feels gravity as a push upwards (Android), or a program writes all its axes the other
    way round (Apple's Core Motion). Both read the same along the direction in which gravity is felt, so no layout needs
    a sign.
    """

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


Named = Mapping[str, tuple[LayoutColumn, ...]]
"""Columns by role as a user names them: the header of each file has one of them at most."""

_ENTRY = re.compile(rf"\s*({'|'.join(ROLES)})\s*=")
_AT_THE_END = re.compile(r"(?:[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*:?|_([a-z0-9]+))\s*$", re.IGNORECASE)
"""A unit in brackets, or after an underscore as in ``speed_mps``."""
_LIKELY = {"t": r"t|time.*|timestamp.*|seconds.*|.*\btime",
           **{axis: rf"(.*[ _.])?acc(el\w*)?[ _.]?{axis}([ _(\[].*)?|a?{axis}" for axis in AXES},
           "lat": r".*lat(itude)?\b.*", "lon": r".*lon(g|gitude)?\b.*", "speed": r".*(speed|velocity).*|v\b.*"}


@dataclass(frozen=True)
class Recognised:
    """The columns of a file by role, and what they are called together."""

    name: str
    columns: Mapping[str, LayoutColumn]
    is_linear: bool = False  # gravity was taken out

    @property
    def is_enough(self) -> bool:
        return "t" in self.columns and (self.has_acceleration or self.has_location or self.has_gravity)

    @property
    def has_acceleration(self) -> bool:
        """Three axes, or one that points up."""
        return set(AXES) <= set(self.columns) or "up" in self.columns

    @property
    def has_location(self) -> bool:
        """Speed, or latitude and longitude."""
        return "speed" in self.columns or set(PLACE) <= set(self.columns)

    @property
    def has_gravity(self) -> bool:
        """Three axes of gravity alone."""
        return set(GRAVITY) <= set(self.columns)


def plain(header: str) -> str:
    """A column's name without what differs between versions of a program: case, spaces, the sign for a square."""
    text = header.strip().strip('"').replace("²", "^2").replace("\ufffd", "^2").lower()
    return " ".join(text.split())


def named_columns(text: str) -> Named:
    """The columns of ``--columns "t=time:ms,x=ax:g,..."``. Raises BadInput for a role or a unit that is not known."""
    starts = [found.start() for found in re.finditer(rf"(?:^|(?<=,))(?={_ENTRY.pattern})", text)]
    if not starts or starts[0] != 0:
        raise BadInput(f"--columns: expected ROLE=COLUMN[:UNIT],... with roles {', '.join(ROLES)}, found {shown(text)}")
    named: dict[str, tuple[LayoutColumn, ...]] = {}
    for start, end in zip(starts, [*starts[1:], len(text) + 1], strict=True):
        role, _, rest = text[start : end - 1].partition("=")
        column = _column(role.strip(), rest)
        named[role.strip()] = (*named.get(role.strip(), ()), column)
    return named


def _column(role: str, text: str) -> LayoutColumn:
    header, colon, word = text.rpartition(":")
    unit = _unit(word)
    if colon and unit in units_of(role):
        return LayoutColumn(header.strip(), unit)
    if colon and re.fullmatch(r"[\w/^²°µ]{1,12}", word.strip()) and header.strip():
        raise BadInput(f"--columns: expected {role}={header.strip()}:UNIT with one of {', '.join(units_of(role))}, "
                       f"found {shown(word.strip())}")
    if not text.strip():
        raise BadInput(f"--columns: expected the name of a column after {role}=, found nothing")
    return LayoutColumn(text.strip())


def _unit(word: str) -> str:
    word = word.strip().replace("²", "2").replace("\ufffd", "2")
    word = word if word in SPELLINGS else word.lower()
    return SPELLINGS.get(word, word)


def unit_of_cell(text: str) -> str | None:
    """The unit that a cell below a column's name says, in brackets or without; None: it is none."""
    unit = _unit(text.strip().strip("[]()"))
    return unit if unit and any(unit in units_of(role) for role in ROLES) else None


def unit_in(header: str, role: str) -> str | None:
    """The unit at the end of a column's name, if it is one of the role's."""
    found = _AT_THE_END.search(header)
    unit = _unit(found[1] or found[2]) if found else None
    return unit if unit in units_of(role) else None


def recognise(names: Sequence[str], stem: str, named: Named | None) -> Recognised | None:
    """What is in a file with this header and name: the columns that are named and, where these are not enough for
    anything, those of a known layout in the roles that nobody named; None: nothing that is enough. BadInput for a
    column that is there twice or named twice.

    Problem: a column that is taken for another one, or a unit for another, gives runs that look like any others.
    Solution: only layouts that are known are recognised, and only if one fits; all else has to be named, and the
    complaint shows how.
    """
    there = [plain(one) for one in names]
    by_name, by_layout = _by_name(there, named or {}), _by_layout(there, stem)
    if by_name is None or by_name.is_enough or by_layout is None:
        return by_layout if by_name is None else by_name if by_name.is_enough else None
    others = {role: column for role, column in by_layout.columns.items() if role not in (named or {})}
    both = Recognised(f"{by_layout.name} and columns as named", others | dict(by_name.columns),
                      by_layout.is_linear or by_name.is_linear)
    return both if both.is_enough else None


def _by_layout(there: list[str], stem: str) -> Recognised | None:
    fitting = []
    for layout in LAYOUTS:
        wanted = {role: plain(column.header) for role, column in layout.columns.items()}
        if all(there.count(one) == 1 for one in wanted.values()) and (layout.stem in ("", stem.lower())):
            fitting.append(layout)
    if not fitting:
        return None
    if len({plain(layout.columns["t"].header) for layout in fitting}) > 1:
        return None
    columns: dict[str, LayoutColumn] = {}
    names_of: list[str] = []
    for layout in fitting:
        new = {role: column for role, column in layout.columns.items()
               if role not in columns and not (role == "up" and "z" in columns)}
        names_of += [layout.name] if new else []
        columns |= new
    return Recognised(" and ".join(names_of), columns, any("linear" in one for one in names_of))


def _by_name(there: list[str], named: Named) -> Recognised | None:
    columns = {}
    for role, choices in named.items():
        found = [one for one in choices if plain(one.header) in there]
        if len(found) > 1 or any(there.count(plain(one.header)) > 1 for one in found):
            raise BadInput(f"--columns: expected one column for {role} in a file, found several: "
                           f"{' and '.join(one.header for one in found)}")
        if found:
            unit = found[0].unit or unit_in(found[0].header, role)
            columns[role] = LayoutColumn(found[0].header, unit)
    linear = any("linear" in plain(columns[axis].header) for axis in AXES if axis in columns)
    return Recognised("columns as named", columns, linear) if columns else None


def advice(names: Sequence[str]) -> str:
    """What to give for a header that is not known: the option, filled in as well as names allow."""
    fits = {role: [name for name in names if re.fullmatch(likely, plain(name))] for role, likely in _LIKELY.items()}
    alone = not fits["x"] and not fits["y"]  # the axis of a record of one axis is up
    chosen = [f"{'up' if alone and role == 'z' else role}={found[0].strip()}"
              + ("" if unit_in(found[0], role) or role in PLACE else ":UNIT") for role, found in fits.items() if found]
    example = ",".join(chosen) if len(chosen) > 1 else "t=TIME:ms,x=X:g,y=Y:g,z=Z:g,lat=LAT,lon=LON,speed=SPEED:km/h"
    return f'--columns "{example}"'


@dataclass(frozen=True, eq=False)
class Header:
    """A file's table, of which the names are known; none where no line has them."""

    path: Path
    table: CsvTable

    @property
    def names(self) -> Names:
        return self.table.names

    @property
    def line(self) -> int:
        return self.table.line


@dataclass(frozen=True, eq=False)
class LoggerTable:
    """The columns (n,) of a file by role, as they are written but for NaN where a cell is empty; times of the unit
    "iso" are seconds since 1970. ``lines`` (n,) in which they stand; ``is_torn``: the last line was cut short, and is
    left out.

    Problem: such files have columns of many names and units, cells that are empty where a sensor said nothing, times in
    units that nobody wrote down. Solution: the table is read as any other (``csv_table``); its columns are recognised
    or named; what is empty is NaN, and a time shows its unit by its size.
    """

    header: Header
    known: Recognised
    columns: Mapping[str, Array]
    lines: Sequence[int]
    is_torn: bool = False

    def unit(self, role: str) -> str | None:
        """The unit of a column, where it is known."""
        return self.known.columns[role].unit

    def wrong(self, row: int, words: str) -> BadInput:
        """A complaint about a row."""
        return BadInput(f"{self.header.path}:{self.lines[row]}: {words}")


def read_header(path: Path, named: Named | None = None) -> Header:
    """The header of a file: the first line whose names are known or ``named``, else the most likely one. Raises
    BadInput for a file that cannot be read as text, or has no such line."""

    def fits(names: Names) -> bool:
        try:
            return len(names) > 1 and recognise(names, path.stem, named) is not None
        except BadInput:
            return True  # some name is there twice, which is said when the columns are recognised

    table = find_table(read_bounded(path, MAX_BYTES), str(path), fits, unit_of_cell)
    if len(table.names) == 1:
        raise BadInput(f"{path}:{table.line}: expected a header with names of columns between commas, semicolons or "
                       f"tabs, found {shown(table.found)}")
    return Header(path, table)


def recognised(header: Header, named: Named | None) -> Recognised | None:
    """What is known to be in a file, by its header and name. Errors as ``logger_columns.recognise``."""
    try:
        known = recognise(header.names, header.path.stem, named)
    except BadInput as error:
        raise BadInput(f"{header.path}:{header.line}: {error}") from None
    if known is None or not header.table.units:
        return known
    below = dict(zip(map(plain, header.names), map(unit_of_cell, header.table.units), strict=True))
    return replace(known, columns={
        role: replace(column, unit=unit) if column.unit is None and unit in units_of(role) else column
        for role, column in known.columns.items() for unit in [below[plain(column.header)]]})


def read_table(header: Header, known: Recognised) -> LoggerTable:
    """The columns that are known. Raises BadInput ("file:line: expected ..., found ...") for a cell that is no number,
    and for a file without rows."""
    there, roles = [plain(name) for name in header.names], tuple(known.columns)
    places = [there.index(plain(column.header)) for column in known.columns.values()]
    rows = read_rows(header.table, places, roles, gaps=True, time=roles.index("t") if "t" in roles else None)
    return LoggerTable(header, known, dict(zip(roles, rows.values.T.copy(), strict=True)), rows.lines, rows.is_torn)


def seconds(table: LoggerTable, same_as: LoggerTable | None = None) -> Array:
    """The times (n,) of a table [s]. A unit that is not known is taken from the size of the numbers, or is that of
    another table with the same column. BadInput where neither can be."""
    times, unit = table.columns["t"], table.unit("t")
    if unit is None and same_as is None:
        unit = _stepping_unit(times)
    elif unit is None and same_as is not None and _time_of(same_as) == _time_of(table):
        unit = same_as.unit("t") or _stepping_unit(same_as.columns["t"])
    unit = unit or _epoch_unit(times)
    if unit is None:
        raise BadInput(f"{table.header.path}: expected a unit of the time {table.known.columns['t'].header}, "
                       f"found none: give t={table.known.columns['t'].header}:UNIT in --columns, one of "
                       f"{', '.join(TIME_UNITS)}")
    times_s = np.asarray(times * TIME_UNITS[unit])
    if (far := np.abs(times_s) > TIME.largest).any():
        raise table.wrong(int(np.argmax(far)), f"expected times within {TIME.largest:g} s, found "
                          f"{times_s[np.argmax(far)]:.4g} s: is the unit {unit} right?")
    return np.where(np.abs(times_s) < TIME.least, 0.0, times_s)


def _time_of(table: LoggerTable) -> str:
    return plain(table.known.columns["t"].header)


def _epoch_unit(times: Array) -> str | None:
    # Seconds since 1970 are 1e9 from 2001 to beyond 2200, and no time that begins at zero comes to that.
    epochs = (("ns", 1e17), ("us", 1e14), ("ms", 1e11), ("s", 1e9))
    known = times[np.isfinite(times)]
    first = float(known[0]) if len(known) else 0.0
    return next((unit for unit, least in epochs if first >= least), None)


def _stepping_unit(times: Array) -> str | None:
    # Of accelerometers in loggers: a thousand wide, so that one unit of time fits and no second one.
    rates_hz = (4.0, 4000.0)
    steps = np.diff(np.unique(times[np.isfinite(times)]))
    step = float(np.median(steps)) if len(steps) else 0.0
    low, high = rates_hz
    return next((unit for unit in ("s", "ms", "us", "ns") if step > 0 and low <= 1 / (step * TIME_UNITS[unit]) < high),
                None)
