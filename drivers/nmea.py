"""GPS receivers that speak NMEA 0183: bytes into fixes.

The problem: what receivers send differs by maker, age and setting. Fields are empty or stale, a receiver without a fix
may repeat its last position or invent a time, the date is two digits and may be 1024 weeks wrong, and the sentences of
one fix come one after the other in any order.

The solution: ``drivers.nmea_sentences`` says what one sentence says; ``NmeaDecoder`` puts sentences of one time
together into a ``Fix`` and decides what to believe:

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
rest. A receiver known to be 1024 weeks late is put right by ``week_rollovers``. Around midnight a receiver may wrap the
time before the date or after it: within a minute of midnight a date that is one day off, by the last one known and the
time passed, is put right.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass

from drivers.framing import Arrivals, NmeaFramer
from drivers.nmea_sentences import (
    EPOCH_ORDINAL,
    SECOND_US,
    Checksum,
    Gga,
    Gsa,
    MalformedError,
    Rmc,
    Sentence,
    Vtg,
    Zda,
    check,
    parse_checked,
)
from drivers.readings import Fix

MINUTE_US = 60 * SECOND_US
DAY_US = 86_400 * SECOND_US
ROLLOVER_DAYS = 1024 * 7
ROLLOVERS_MAX = 8
GPS_EPOCH_DAY = datetime.date(1980, 1, 6).toordinal() - EPOCH_ORDINAL
DAYS_OF_WEEK = 7
"""A date in the first week of a count is that of a receiver that has not heard yet which week it is."""


def midnight_utc_us(day: datetime.date) -> int:
    """When a day begins [us since 1970-01-01 UTC]."""
    return (day.toordinal() - EPOCH_ORDINAL) * DAY_US


LATEST_UTC_US = midnight_utc_us(datetime.date(2069, 1, 1))
RELEASE_UTC_US = midnight_utc_us(datetime.date(2026, 1, 1))


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
        try:
            return parse_checked(sentence) if checked is Checksum.GOOD else None
        except MalformedError:
            self._malformed += 1
            return None

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
