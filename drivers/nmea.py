"""GPS receivers that speak NMEA 0183: bytes into fixes.

The problem: what receivers send differs by maker, age and setting. Sentences arrive damaged or run together, fields
are empty or stale, a receiver without a fix may repeat its last position or invent a time, the date is two digits
and may be 1024 weeks wrong, and the sentences of one fix come one after the other in any order.

The solution, in two steps. ``parse_sentence`` says what one sentence says, or None: a pure function. Nothing without
a right checksum gets through, whoever the talker is, and field counts, number formats and ranges must be right as
well, since an 8-bit checksum passes one damaged line in 256. ``NmeaDecoder`` puts sentences of one time together
into a ``Fix`` and decides what to believe:

Validity. A fix is valid when all of RMC and GGA that the epoch holds, at least one of them, vouch for it:
RMC by status A with a mode A, D, F, P or R, or no mode letter (before NMEA 2.3, or empty), GGA by quality 1 to 5;
and a position is there. Modes E (dead reckoning), S (simulator), M (manual), N, V and any other are no fix. VTG with
such a mode gives no speed. The navigation status of NMEA 4.1 says V on many receivers that have a fix; it is not
asked. From an epoch that is not valid neither position, speed nor time is taken.

Epochs. RMC and GGA with one time make an epoch, VTG and GSA join the one that is open, and ZDA is asked for the date
alone. The epoch's arrival is that of its first RMC or GGA. It closes when an RMC or GGA of another time arrives.
Without a time, or without a fix, a second sentence of the same kind opens the next epoch. Of two valid sentences of
one kind and one time (several talkers) the first counts.

Dates come from RMC, else ZDA, else from the last date known, counted on by arrival time. Illegal dates, dates before
``earliest_utc_us`` and those after the last that an RMC can name are refused: the fix has no UTC then but keeps the
rest. A receiver known to be 1024 weeks
late is put right by ``week_rollovers``. Around midnight a receiver may wrap the time before the date or after it:
within a minute of midnight a date that is one day off, by the last one known and the time passed, is put right.

Sources: NMEA 0183 as described by the gpsd project ("NMEA Revealed"), with its limits (130 characters, years below
69 are 20xx).
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from drivers.framing import SENTENCE_BYTES_MAX, Arrivals, NmeaFramer, exclusive_or
from drivers.readings import Fix

KNOT_MPS = 1852.0 / 3600.0
KMH_MPS = 1.0 / 3.6

SPEED_MPS_MAX = 150.0
ALTITUDE_M_MIN, ALTITUDE_M_MAX = -1000.0, 20000.0
DOP_UNKNOWN = 99.0

MODES_WITH_FIX = (b"", b"A", b"D", b"F", b"P", b"R")
QUALITIES_WITH_FIX = range(1, 6)

SECOND_US = 1_000_000
MINUTE_US = 60 * SECOND_US
DAY_US = 86_400 * SECOND_US
ROLLOVER_DAYS = 1024 * 7
ROLLOVERS_MAX = 8
EPOCH_ORDINAL = datetime.date(1970, 1, 1).toordinal()
GPS_EPOCH_DAY = datetime.date(1980, 1, 6).toordinal() - EPOCH_ORDINAL
DAYS_OF_WEEK = 7
"""A date in the first week of a count is that of a receiver that has not heard yet which week it is."""

LATEST_UTC_US = (datetime.date(2069, 1, 1).toordinal() - EPOCH_ORDINAL) * DAY_US
RELEASE_UTC_US = (datetime.date(2026, 1, 1).toordinal() - EPOCH_ORDINAL) * DAY_US


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


Sentence = Rmc | Gga | Vtg | Gsa | Zda


class Checksum(Enum):
    """What became of the check of a sentence."""

    GOOD = "good"
    BAD = "bad"
    MISSING = "missing"


class _MalformedError(Exception):
    """A field that is not what its place says. Never leaves this file."""


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


def parse_sentence(sentence: bytes) -> Sentence | None:
    """What a sentence says, from its ``$`` to its checksum, without the line end.

    None when the checksum is wrong or missing, for sentences of other kinds, and when a field is not what it should
    be. Proprietary sentences (``$P...``) are of another kind whatever their last letters.
    """
    if check(sentence) is not Checksum.GOOD:
        return None
    parser = _parser(sentence)
    return None if parser is None else _parsed(parser, sentence)


def _parser(sentence: bytes) -> Callable[[list[bytes]], Sentence] | None:
    if not sentence[1:6].isalnum() or sentence[6:7] != b"," or sentence[1:2] == b"P":
        return None
    return _PARSERS.get(sentence[3:6])


def _parsed(parser: Callable[[list[bytes]], Sentence], sentence: bytes) -> Sentence | None:
    try:
        return parser(sentence[7 : sentence.rindex(b"*")].split(b","))
    except _MalformedError:
        return None


def _rmc(fields: list[bytes]) -> Rmc:
    """time, A/V, lat, N/S, lon, E/W, knots, course, ddmmyy, magnetic variation, E/W, [mode], [navigation status]"""
    _expect(11 <= len(fields) <= 13 and fields[1] in (b"A", b"V", b""))
    mode = fields[11] if len(fields) > 11 else b""
    day, illegal = _short_date(fields[8])
    return Rmc(
        _time_of_day_us(fields[0]),
        fields[1] == b"A" and mode in MODES_WITH_FIX,
        *_position(fields[2:6]),
        _speed_mps(fields[6], KNOT_MPS),
        _course_deg(fields[7]),
        day,
        illegal,
    )


def _gga(fields: list[bytes]) -> Gga:
    """time, lat, N/S, lon, E/W, quality, satellites, HDOP, altitude, M, geoid, M, age, station"""
    _expect(len(fields) == 14 and fields[9] in (b"M", b""))
    return Gga(
        _time_of_day_us(fields[0]),
        (_whole(fields[5], 8) or 0) in QUALITIES_WITH_FIX,
        *_position(fields[1:5]),
        _whole(fields[6], 99),
        _dop(fields[7]),
        _number(fields[8], ALTITUDE_M_MIN, ALTITUDE_M_MAX),
    )


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
    b"VTG": _vtg,
    b"GSA": _gsa,
    b"ZDA": _zda,
}


def _expect(right: bool) -> None:
    if not right:
        raise _MalformedError


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
    return None if value is None or value == 0.0 or value >= DOP_UNKNOWN else value


def _speed_mps(field: bytes, unit_mps: float) -> float | None:
    speed = _number(field, 0.0, SPEED_MPS_MAX / unit_mps)
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
        raise _MalformedError
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
        raise _MalformedError
    hour, minute, second = int(match[1]), int(match[2]), int(match[3])
    _expect(hour <= 23 and minute <= 59 and second <= 60)
    fraction_us = int(((match[4] or b"") + b"000000")[:6])
    return (hour * 3600 + minute * 60 + second) * SECOND_US + fraction_us


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


@dataclass(frozen=True)
class NmeaCounters:
    """What came in so far.

    sentences       with the right checksum, of any kind
    bad_checksum    with a wrong or damaged checksum
    no_checksum     with none
    malformed       of a kind we read, right checksum, but a field that cannot be
    ubx_frames      binary frames stepped over
    dropped_bytes   bytes that belonged to nothing
    refused_dates   dates of valid fixes that were illegal, too early or too late
    """

    sentences: int
    bad_checksum: int
    no_checksum: int
    malformed: int
    ubx_frames: int
    dropped_bytes: int
    refused_dates: int


@dataclass
class _Epoch:
    """Sentences of one time, while they come in."""

    t_us: int
    time_of_day_us: int | None
    rmc: Rmc | None = None
    gga: Gga | None = None
    vtg: Vtg | None = None
    gsa: Gsa | None = None

    def takes(self, sentence: Rmc | Gga) -> bool:
        """Does the sentence belong here, or does it open the next epoch?"""
        if sentence.time_of_day_us != self.time_of_day_us:
            return False
        same_kind = self.rmc if isinstance(sentence, Rmc) else self.gga
        return same_kind is None or (self.time_of_day_us is not None and same_kind.vouches)

    def add(self, sentence: Rmc | Gga | Vtg | Gsa) -> None:
        match sentence:
            case Rmc():
                self.rmc = self.rmc or sentence
            case Gga():
                self.gga = self.gga or sentence
            case Vtg():
                self.vtg = self.vtg or sentence
            case Gsa():
                self.gsa = self.gsa or sentence

    def valid(self) -> bool:
        """The validity rule of the module."""
        return all(s.vouches and s.lat_deg is not None for s in (self.rmc, self.gga) if s is not None)

    def fix(self, utc_us: int | None) -> Fix:
        """The epoch as a valid fix."""
        position = self.rmc or self.gga
        assert position is not None
        speed_mps = self.rmc.speed_mps if self.rmc else None
        course_deg = self.rmc.course_deg if self.rmc else None
        if self.vtg is not None and self.vtg.vouches:
            speed_mps = self.vtg.speed_mps if speed_mps is None else speed_mps
            course_deg = self.vtg.course_deg if course_deg is None else course_deg
        return Fix(
            t_us=self.t_us,
            valid=True,
            utc_us=utc_us,
            time_of_day_us=self.time_of_day_us,
            lat_deg=position.lat_deg,
            lon_deg=position.lon_deg,
            speed_mps=speed_mps,
            course_deg=course_deg,
            altitude_m=self.gga.altitude_m if self.gga else None,
            satellites=self.satellites(),
            hdop=self.hdop(),
        )

    def no_fix(self) -> Fix:
        """The epoch when nobody vouches for it: only how well the receiver sees the sky."""
        return Fix(self.t_us, False, None, None, None, None, None, None, None, self.satellites(), self.hdop())

    def satellites(self) -> int | None:
        return self.gga.satellites if self.gga else None

    def hdop(self) -> float | None:
        if self.gga is not None and self.gga.hdop is not None:
            return self.gga.hdop
        return self.gsa.hdop if self.gsa else None


def _words_of(day: int) -> str:
    """A date for people; ``day`` counts from 1970-01-01."""
    date = datetime.date.fromordinal(EPOCH_ORDINAL + day)
    return f"{date.day} {date:%B %Y}"


class NmeaDecoder:
    """Bytes of a receiver in, fixes out. Raises nothing, whatever the bytes.

    week_rollovers     1024-week turns by which the receiver is known to be late (old firmware); 0 for a sound one
    earliest_utc_us    dates before this are refused [us since 1970-01-01]; the default is this software's release
    """

    def __init__(self, week_rollovers: int = 0, earliest_utc_us: int = RELEASE_UTC_US) -> None:
        self._framer = NmeaFramer()
        self._arrivals = Arrivals()
        self._added_us = week_rollovers * ROLLOVER_DAYS * DAY_US
        self._earliest_utc_us = earliest_utc_us
        self._checks = dict.fromkeys(Checksum, 0)
        self._malformed = 0
        self._refused_dates = 0
        self._epoch: _Epoch | None = None
        self._zda: tuple[int, Zda] | None = None
        self._known: tuple[int, int] | None = None
        self._too_early_us: int | None = None

    @property
    def doubt(self) -> str:
        """What is wrong with the dates, and what to do; empty: nothing."""
        if self._too_early_us is None:
            return ""
        day = self._too_early_us // DAY_US
        turns = -(-(self._earliest_utc_us - self._too_early_us) // (ROLLOVER_DAYS * DAY_US))
        rollovers = self._added_us // (ROLLOVER_DAYS * DAY_US) + turns
        wrong = f"it says that it is {_words_of(day)}, which cannot be, so no row has a date"
        counted_days = day - self._added_us // DAY_US - GPS_EPOCH_DAY
        if rollovers > ROLLOVERS_MAX or counted_days < 0 or counted_days % ROLLOVER_DAYS < DAYS_OF_WEEK:
            return f"{wrong}: give its antenna a free view of the sky, or replace it"
        return (f"{wrong}: a receiver counts 1024 weeks and begins again. Set week_rollovers: {rollovers}, if today is "
                f"about {_words_of(day + turns * ROLLOVER_DAYS)}, under gps in the settings, or renew its firmware")

    @property
    def counters(self) -> NmeaCounters:
        """What came in so far."""
        return NmeaCounters(
            sentences=self._checks[Checksum.GOOD],
            bad_checksum=self._checks[Checksum.BAD],
            no_checksum=self._checks[Checksum.MISSING],
            malformed=self._malformed,
            ubx_frames=self._framer.ubx_frames,
            dropped_bytes=self._framer.dropped_bytes,
            refused_dates=self._refused_dates,
        )

    def feed(self, t_us: int, data: bytes) -> list[Fix]:
        """Take the bytes that arrived at ``t_us`` [us, monotonic]; return the fixes that are complete."""
        self._arrivals.note(t_us, len(data))
        fixes: list[Fix] = []
        for frame in self._framer.feed(data):
            sentence = self._read(frame.data)
            if sentence is not None:
                fixes += self._place(sentence, self._arrivals.at(frame.start))
        self._arrivals.forget(self._framer.position)
        return fixes

    def flush(self) -> list[Fix]:
        """Close the open epoch: nothing more will come for it."""
        return self._close()

    def _read(self, sentence: bytes) -> Sentence | None:
        checked = check(sentence)
        self._checks[checked] += 1
        parser = _parser(sentence)
        if checked is not Checksum.GOOD or parser is None:
            return None
        parsed = _parsed(parser, sentence)
        self._malformed += parsed is None
        return parsed

    def _place(self, sentence: Sentence, t_us: int) -> list[Fix]:
        """Put a sentence where it belongs; return the fix that it closes, if any."""
        if isinstance(sentence, Zda):
            self._zda = (t_us, sentence)
            return []
        closed: list[Fix] = []
        if isinstance(sentence, Rmc | Gga) and not (self._epoch and self._epoch.takes(sentence)):
            closed = self._close()
            self._epoch = _Epoch(t_us, sentence.time_of_day_us)
        if self._epoch is not None:
            self._epoch.add(sentence)
        return closed

    def _close(self) -> list[Fix]:
        epoch, zda = self._epoch, self._zda
        if epoch is None:
            return []
        self._epoch, self._zda = None, None
        return [epoch.fix(self._utc_us(epoch, zda))] if epoch.valid() else [epoch.no_fix()]

    def _utc_us(self, epoch: _Epoch, zda: tuple[int, Zda] | None) -> int | None:
        """UTC of a valid epoch, by the first date that is not refused, else by the last date known."""
        if epoch.time_of_day_us is None:
            return None
        stated = [(epoch.t_us, epoch.rmc)] if epoch.rmc else []
        refused = False
        for t_us, sentence in stated + ([zda] if zda else []):
            utc_us = self._stated_utc_us(sentence, t_us)
            if utc_us is not None:
                self._known = (utc_us, t_us)
                break
            refused |= sentence.day is not None or sentence.illegal_date
        else:
            if refused or self._known is None:
                return None
        known_utc_us, known_t_us = self._known
        return _nearest(epoch.time_of_day_us, known_utc_us + epoch.t_us - known_t_us)

    def _stated_utc_us(self, sentence: Rmc | Zda, t_us: int) -> int | None:
        """UTC that a sentence states; None when it names no date, or one that is refused."""
        if sentence.illegal_date:
            self._refused_dates += 1
            return None
        if sentence.day is None or sentence.time_of_day_us is None:
            return None
        utc_us = sentence.day * DAY_US + sentence.time_of_day_us + self._added_us
        self._too_early_us = utc_us if utc_us < self._earliest_utc_us else None
        if not self._earliest_utc_us <= utc_us < LATEST_UTC_US:
            self._refused_dates += 1
            return None
        if self._known is None:
            return utc_us
        ahead_us = utc_us - (self._known[0] + t_us - self._known[1])
        if sentence.time_of_day_us < MINUTE_US and abs(ahead_us + DAY_US) < MINUTE_US:
            return utc_us + DAY_US
        if sentence.time_of_day_us > DAY_US - MINUTE_US and abs(ahead_us - DAY_US) < MINUTE_US:
            return utc_us - DAY_US
        return utc_us


def _nearest(time_of_day_us: int, reference_us: int) -> int:
    """The instant with this time of day that is nearest to a reference [us since 1970-01-01]."""
    days = (reference_us - time_of_day_us + DAY_US // 2) // DAY_US
    return days * DAY_US + time_of_day_us
