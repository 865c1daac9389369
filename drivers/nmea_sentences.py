"""NMEA 0183, sentence by sentence: bytes between ``$`` and line end into numbers.

The problem: sentences arrive damaged or run together, and what receivers put into a field differs by maker and age.
The solution: pure functions. Nothing without a right checksum gets through, whatever its talker, and field counts,
number formats and ranges must be right as well, since an 8-bit checksum passes one damaged line in 256.

Sources: NMEA 0183 as described by the gpsd project ("NMEA Revealed"), with its limits (130 characters, years below
69 are 20xx).
"""

import datetime
import re
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from drivers.framing import SENTENCE_BYTES_MAX, exclusive_or
from drivers.readings import US_PER_S

KNOT_MPS = 1852.0 / 3600.0
KMH_MPS = 1.0 / 3.6

MODES_WITH_FIX = (b"", b"A", b"D", b"F", b"P", b"R")
QUALITIES_WITH_FIX = range(1, 6)

EPOCH_ORDINAL = datetime.date(1970, 1, 1).toordinal()


class Rmc(NamedTuple):
    """Recommended minimum. ``vouches``: status and mode speak for a fix. ``day``: days since 1970-01-01.

    ``illegal_date``: something stands where the date should be, and it is none.
    """

    time_of_day_us: int | None
    vouches: bool
    lat_deg: float | None
    lon_deg: float | None
    speed_mps: float | None
    course_deg: float | None
    day: int | None
    illegal_date: bool


class Gga(NamedTuple):
    """Fix data. ``vouches``: the quality speaks for a fix."""

    time_of_day_us: int | None
    vouches: bool
    lat_deg: float | None
    lon_deg: float | None
    satellites: int | None
    hdop: float | None
    altitude_m: float | None


class Gll(NamedTuple):
    """Geographic position. ``vouches`` as in ``Rmc``."""

    time_of_day_us: int | None
    vouches: bool
    lat_deg: float | None
    lon_deg: float | None


class Vtg(NamedTuple):
    """Course and speed over ground. ``vouches``: the mode speaks for a fix."""

    vouches: bool
    course_deg: float | None
    speed_mps: float | None


class Gsa(NamedTuple):
    """Dilution of precision. ``fix_type`` 1: none, 2: two-dimensional, 3: three-dimensional."""

    fix_type: int | None
    pdop: float | None
    hdop: float | None
    vdop: float | None


class Zda(NamedTuple):
    """Time and date; ``day`` and ``illegal_date`` as in ``Rmc``."""

    time_of_day_us: int | None
    day: int | None
    illegal_date: bool


Sentence = Rmc | Gga | Gll | Vtg | Gsa | Zda


class Checksum(Enum):
    """What became of the check of a sentence."""

    GOOD = "good"
    BAD = "bad"
    MISSING = "missing"


class MalformedError(Exception):
    """A field that is not what its place says."""


_VTG_UNITS = (b"T", b"M", b"N", b"K")
_CHECKED = re.compile(rb"\$(.*)\*([0-9A-Fa-f]{2}) *")
_NUMBER = re.compile(rb"-?(?:\d+\.?\d*|\.\d+)")
_ANGLE = re.compile(rb"(\d{1,3})(\d\d(?:\.\d*)?)")
_TIME = re.compile(rb"(\d\d)(\d\d)(\d\d)(?:\.(\d*))?")
_DATE = re.compile(rb"(\d\d)(\d\d)(\d\d)")


def check(sentence: bytes) -> Checksum:
    """Compare the exclusive-or of the characters between ``$`` and the last ``*`` with the two hex digits behind.

    A sentence longer than ``SENTENCE_BYTES_MAX`` is BAD.
    """
    match = _CHECKED.fullmatch(sentence)
    if match is None or len(sentence) > SENTENCE_BYTES_MAX:
        return Checksum.BAD if b"*" in sentence else Checksum.MISSING
    return Checksum.GOOD if exclusive_or(match[1]) == int(match[2], 16) else Checksum.BAD


def parse_checked(sentence: bytes) -> Sentence | None:
    """What a sentence with the right checksum says; None for one of another kind.

    Proprietary sentences (``$P...``) are of another kind whatever their last letters. What fills the fields of one
    that says itself that there is no fix is the maker's own, and may be anything. Raises ``MalformedError``.
    """
    if not sentence[1:6].isalnum() or sentence[6:7] != b"," or sentence[1:2] == b"P":
        return None
    kind = sentence[3:6]
    parser = _PARSERS.get(kind)
    if parser is None:
        return None
    fields = sentence[7 : sentence.rindex(b"*")].split(b",")
    try:
        return parser(fields)
    except MalformedError:
        place, words, nothing = _NO_FIX.get(kind, (0, (), None))
        if nothing is None or len(fields) <= place or fields[place] not in words:
            raise
        return nothing


def _rmc(fields: list[bytes]) -> Rmc:
    """time, A/V, lat, N/S, lon, E/W, knots, course, ddmmyy, magnetic variation, E/W, [mode], [navigation status]"""
    _expect(11 <= len(fields) <= 13 and fields[1] in (b"A", b"V", b""))
    mode = fields[11] if len(fields) > 11 else b""
    day, illegal = _short_date(fields[8])
    return Rmc(_time_of_day_us(fields[0]), fields[1] == b"A" and mode in MODES_WITH_FIX, *_position(fields[2:6]),
               _speed_mps(fields[6], KNOT_MPS), _course_deg(fields[7]), day, illegal)


def _gga(fields: list[bytes]) -> Gga:
    """time, lat, N/S, lon, E/W, quality, satellites, HDOP, altitude, M, geoid, M, age, station"""
    lowest_m, highest_m = -1000.0, 20_000.0
    _expect(len(fields) == 14 and fields[9] in (b"M", b""))
    return Gga(_time_of_day_us(fields[0]), (_whole(fields[5], 8) or 0) in QUALITIES_WITH_FIX, *_position(fields[1:5]),
               _whole(fields[6], 99), _dop(fields[7]), _number(fields[8], lowest_m, highest_m))


def _gll(fields: list[bytes]) -> Gll:
    """lat, N/S, lon, E/W, time, A/V, [mode]"""
    _expect(6 <= len(fields) <= 7 and fields[5] in (b"A", b"V", b""))
    mode = fields[6] if len(fields) > 6 else b""
    return Gll(_time_of_day_us(fields[4]), fields[5] == b"A" and mode in MODES_WITH_FIX, *_position(fields[0:4]))


def _vtg(fields: list[bytes]) -> Vtg:
    """course, T, magnetic course, M, knots, N, km/h, K, [mode]; or the old form of the four numbers alone"""
    mode = b""
    if len(fields) != 4:
        _expect(8 <= len(fields) <= 9)
        _expect(all(unit in (b"", letter) for unit, letter in zip(fields[1:8:2], _VTG_UNITS, strict=True)))
        mode = fields[8] if len(fields) == 9 else b""
        fields = fields[0:8:2]
    course, _, knots, kmh = fields
    speed_kmh_mps = _speed_mps(kmh, KMH_MPS)
    return Vtg(mode in MODES_WITH_FIX, _course_deg(course), _speed_mps(knots, KNOT_MPS) if knots else speed_kmh_mps)


def _gsa(fields: list[bytes]) -> Gsa:
    """M/A, fix type, 12 satellites, PDOP, HDOP, VDOP, [system]"""
    _expect(17 <= len(fields) <= 18 and fields[0] in (b"M", b"A", b"") and fields[1] in (b"1", b"2", b"3", b""))
    return Gsa(_whole(fields[1], 3), *(_dop(field) for field in fields[14:17]))


def _zda(fields: list[bytes]) -> Zda:
    """hhmmss, day, month, year of four digits, zone hours, zone minutes"""
    _expect(len(fields) == 6)
    time_of_day_us = _time_of_day_us(fields[0])
    if fields[1:4] == [b"", b"", b""]:
        return Zda(time_of_day_us, None, False)
    if not all(field.isdigit() for field in fields[1:4]) or max(map(len, fields[1:3])) > 2 or len(fields[3]) != 4:
        return Zda(time_of_day_us, None, True)
    return Zda(time_of_day_us, *_day(int(fields[3]), int(fields[2]), int(fields[1])))


_PARSERS: dict[bytes, Callable[[list[bytes]], Sentence]] = {
    b"RMC": _rmc,
    b"GGA": _gga,
    b"GLL": _gll,
    b"VTG": _vtg,
    b"GSA": _gsa,
    b"ZDA": _zda,
}

_NO_FIX: dict[bytes, tuple[int, tuple[bytes, ...], Sentence]] = {
    b"RMC": (1, (b"V", b""), Rmc(None, False, None, None, None, None, None, False)),
    b"GGA": (5, (b"0", b""), Gga(None, False, None, None, None, None, None)),
    b"GLL": (5, (b"V", b""), Gll(None, False, None, None)),
}
"""The field in which such a sentence says that there is no fix, the words for it, and what it says then."""


def _expect(right: bool) -> None:
    if not right:
        raise MalformedError


def _number(field: bytes, low: float, high: float) -> float | None:
    """A decimal number in [low, high]; None when empty."""
    if not field:
        return None
    _expect(_NUMBER.fullmatch(field) is not None)
    value = float(field)
    _expect(low <= value <= high)
    return value


def _whole(field: bytes, high: int) -> int | None:
    """A whole number in [0, high]; None when empty."""
    if not field:
        return None
    _expect(field.isdigit() and int(field) <= high)
    return int(field)


def _dop(field: bytes) -> float | None:
    """A dilution of precision; 0 and 99 upwards are how receivers say that they know none."""
    value = _number(field, 0.0, 10_000.0)
    return None if value is None or value == 0.0 or value >= 99.0 else value


def _speed_mps(field: bytes, unit_mps: float) -> float | None:
    fastest_mps = 150.0
    speed = _number(field, 0.0, fastest_mps / unit_mps)
    return None if speed is None else speed * unit_mps


def _course_deg(field: bytes) -> float | None:
    course = _number(field, 0.0, 360.0)
    return 0.0 if course == 360.0 else course


def _position(fields: list[bytes]) -> tuple[float | None, float | None]:
    """Latitude and longitude [deg] of four fields: both or none."""
    if not (fields[0] or fields[2]):
        return None, None
    return _angle_deg(fields[0], fields[1], b"NS", 90.0), _angle_deg(fields[2], fields[3], b"EW", 180.0)


def _angle_deg(field: bytes, side: bytes, sides: bytes, limit_deg: float) -> float:
    """``d..dmm.m..`` and its side of the equator or meridian, the positive one first: the two digits before the point
    are whole minutes, what stands before them degrees."""
    match = _ANGLE.fullmatch(field)
    if match is None or len(side) != 1 or side not in sides:
        raise MalformedError
    minutes = float(match[2])
    angle_deg = int(match[1]) + minutes / 60.0
    _expect(minutes < 60.0 and angle_deg <= limit_deg)
    return angle_deg if side == sides[:1] else -angle_deg


def _time_of_day_us(field: bytes) -> int | None:
    """``hhmmss[.s...]`` in microseconds; a second 60 (leap second, or rounding up) is the next minute's 0."""
    if not field:
        return None
    match = _TIME.fullmatch(field)
    if match is None:
        raise MalformedError
    hour, minute, second = int(match[1]), int(match[2]), int(match[3])
    _expect(hour <= 23 and minute <= 59 and second <= 60)
    fraction_us = int(((match[4] or b"") + b"000000")[:6])
    return (hour * 3600 + minute * 60 + second) * US_PER_S + fraction_us


def _short_date(field: bytes) -> tuple[int | None, bool]:
    """``ddmmyy`` to (days since 1970-01-01 or None, illegal). Years below 69 are 20xx."""
    if not field:
        return None, False
    match = _DATE.fullmatch(field)
    if match is None:
        return None, True
    year = int(match[3])
    return _day(year + (2000 if year < 69 else 1900), int(match[2]), int(match[1]))


def _day(year: int, month: int, day: int) -> tuple[int | None, bool]:
    try:
        return datetime.date(year, month, day).toordinal() - EPOCH_ORDINAL, False
    except ValueError:
        return None, True
