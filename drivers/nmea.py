"""GPS over NMEA 0183: sentences to fixes, and how full the line is, by when its bytes come.

Problem: a device that has more to send than its line carries puts the rest into a buffer, and what it sends is late by
what waits there. Solution: a buffer that is not empty leaves its line no pause. Of a line that has paused lately,
nothing waits; of one that has not, something may.

A line carries a tenth of its baud rate in bytes a second (a start and a stop bit each). Its true rate differs by what
two quartz clocks and their dividers do (``TOLERANCE``), and a look at it is late by what gathers bytes: the host's
sleep between two looks and a USB adapter (``LOOK_S``). What brings more bytes than that has no such line: a receiver on
USB.

Another problem: what receivers send differs by maker, age and setting. Fields are empty or stale, a receiver without a
fix may repeat its last position or invent a time, the date is two digits and may be 1024 weeks wrong, and the sentences
of one fix come one after the other in any order.

The solution: ``drivers.nmea_sentences`` says what one sentence says; ``NmeaDecoder`` puts sentences of one time
together into a ``Fix`` and decides what to believe:

Validity. A fix is valid when all of RMC and GGA that the epoch holds vouch for it, or GLL in one that holds neither:
RMC and GLL by status A with a mode A, D, F, P or R, or no mode letter (before NMEA 2.3, or empty), GGA by quality 1 to
5; and a position is there. Modes E (dead reckoning), S (simulator), M (manual), N, V and any other are no fix. VTG with
such a mode gives no speed. The navigation status of NMEA 4.1 says V on many receivers that have a fix; it is not
asked. From an epoch that is not valid neither position, speed nor time is taken.

Epochs. RMC, GGA and GLL with one time make an epoch, GSA joins the one that is open, and ZDA is asked for the date
alone. VTG names no time: it belongs to the epoch that it came closer to. The epoch's arrival is that of its first RMC,
GGA or GLL. It closes when an RMC or GGA of another time arrives, or a GLL of a later one. Without a time, or without a
fix, a second sentence of the same kind opens the next epoch. Of two valid sentences of one kind and one time the first
counts, where they are of several talkers: of one talker the second is another epoch, whose time stood.

Dates come from RMC, else ZDA, else from the last date known, counted on by arrival time. Illegal dates, dates before
``earliest_utc_us`` and those after the last that an RMC can name are refused: the fix has no UTC then but keeps the
rest. A receiver known to be 1024 weeks late is put right by ``week_rollovers``. Around midnight a receiver may wrap the
time before the date or after it: within a minute of midnight a date that is one day off, by the last one known and the
time passed, is put right.
"""

import datetime
from collections import deque
from dataclasses import dataclass, field
from statistics import median

from drivers.framing import Arrivals, Frame, NmeaFramer
from drivers.nmea_sentences import (
    EPOCH_ORDINAL,
    Checksum,
    Gga,
    Gll,
    Gsa,
    MalformedError,
    Rmc,
    Sentence,
    Vtg,
    Zda,
    check,
    parse_checked,
)
from drivers.readings import US_PER_S, Fix
from drivers.wire_contents import RECEIVER, RecentBytes

BITS_PER_BYTE = 10
TOLERANCE = 0.03
"""UARTs that understand each other differ by less than 0.05, half a bit in ten; most by 0.02 at the most."""
LOOK_S = 0.08  # ``SerialSource`` sleeps 0.06 s at most; FTDI adapters gather for 0.016 s
WINDOW_US = 10_000_000
_NEEDS_KEPT = 9


class LineLoad:
    """Counts the bytes of the last ten seconds.

    bytes_per_s         what the line carries
    needs_bytes_per_s   what the device has had to send, where it said for which time that was; 0: not known
    """

    def __init__(self, baud: int) -> None:
        self.bytes_per_s = baud / BITS_PER_BYTE
        self._looks: deque[tuple[int, int]] = deque()  # time [us], bytes so far
        self._total = 0
        self._needs: deque[float] = deque(maxlen=_NEEDS_KEPT)
        self.needs_bytes_per_s = 0.0

    def begin(self, t_us: int) -> None:
        """Nothing has come up to ``t_us`` [us], the first time that is known."""
        self.note(t_us, 0)

    def note(self, t_us: int, size: int) -> None:
        """So many bytes more have come by ``t_us`` [us]."""
        self._total += size
        looks = self._looks
        if looks and looks[-1][0] == t_us:
            looks[-1] = t_us, self._total
            return
        looks.append((t_us, self._total))
        while len(looks) > 2 and looks[1][0] <= t_us - WINDOW_US:
            looks.popleft()

    def needs(self, size: int, for_us: int) -> None:
        """So many bytes were what the device had to say of ``for_us`` [us] of its own time."""
        self._needs.append(size * US_PER_S / for_us)
        if len(self._needs) == _NEEDS_KEPT:
            self.needs_bytes_per_s = max(self.needs_bytes_per_s, median(self._needs))

    @property
    def is_full(self) -> bool:
        """The line has not paused for ten seconds."""
        return self._looks[-1][0] - self._looks[0][0] >= WINDOW_US and self.may_wait

    @property
    def share(self) -> float:
        """Bytes of the last seconds over what the line carries; 1 while that is not known."""
        (begin_us, before), (end_us, total) = self._looks[0], self._looks[-1]
        return (total - before) / self.bytes_per_s * US_PER_S / (end_us - begin_us) if end_us > begin_us else 1.0

    @property
    def may_wait(self) -> bool:
        """What comes may have waited: the line has not been seen to pause in the last seconds."""
        observed_s = (self._looks[-1][0] - self._looks[0][0]) / US_PER_S
        pause_s = observed_s * (1.0 - self.share)
        return abs(pause_s) <= TOLERANCE * observed_s + LOOK_S


MINUTE_US = 60 * US_PER_S
DAY_US = 86_400 * US_PER_S
ROLLOVER_DAYS = 1024 * 7
ROLLOVERS_MAX = 8
GPS_BEGAN = datetime.date(1980, 1, 6)
DAYS_OF_WEEK = 7  # A date in the first week of a count is that of a receiver that has not heard yet which week it is


def midnight_utc_us(day: datetime.date) -> int:
    """When a day begins [us since 1970-01-01 UTC]."""
    return (day.toordinal() - EPOCH_ORDINAL) * DAY_US


LATEST_UTC_US = midnight_utc_us(datetime.date(2069, 1, 1))
USUAL_BAUD = 9600
RELEASE_UTC_US = midnight_utc_us(datetime.date(2026, 1, 1))


@dataclass
class _Epoch:
    """Sentences of one time, while they come in."""

    t_us: int
    time_of_day_us: int | None
    may_wait: bool
    rmc: Rmc | None = None
    gga: Gga | None = None
    gll: Gll | None = None
    vtg: Vtg | None = None
    gsa: Gsa | None = None
    placed_us: int = 0
    talkers: set[tuple[type[Sentence], bytes]] = field(default_factory=set)

    def takes(self, sentence: Rmc | Gga | Gll, talker: bytes) -> bool:
        """Does the sentence belong here, or does it open the next epoch?"""
        time_us = sentence.time_of_day_us
        if isinstance(sentence, Gll) and (self.rmc or self.gga):
            # Beside the others it tells nothing new, unless it comes more often; some receivers send it a time late.
            ahead_us = ((time_us or 0) - (self.time_of_day_us or 0)) % DAY_US
            return time_us is None or self.time_of_day_us is None or not 0 < ahead_us < DAY_US // 2
        if time_us != self.time_of_day_us:
            return False
        same_kind: Rmc | Gga | Gll | None = getattr(self, _place_of(sentence))
        if same_kind is None:
            return True
        return time_us is not None and same_kind.vouches and (type(sentence), talker) not in self.talkers

    def add(self, sentence: Rmc | Gga | Gll | Vtg | Gsa) -> None:
        """Of several of a kind the first counts."""
        place = _place_of(sentence)
        setattr(self, place, getattr(self, place) or sentence)

    def valid(self) -> bool:
        """The validity rule of the module."""
        asked = (self.rmc, self.gga) if self.rmc or self.gga else (self.gll,)
        return all(one.vouches and one.lat_deg is not None for one in asked if one is not None)

    def fix(self, utc_us: int | None) -> Fix:
        position = self.rmc or self.gga or self.gll
        assert position is not None
        speed_mps = self.rmc.speed_mps if self.rmc else None
        course_deg = self.rmc.course_deg if self.rmc else None
        if self.vtg is not None and self.vtg.vouches:
            speed_mps = self.vtg.speed_mps if speed_mps is None else speed_mps
            course_deg = self.vtg.course_deg if course_deg is None else course_deg
        return Fix(t_us=self.t_us, valid=True, utc_us=utc_us, time_of_day_us=self.time_of_day_us,
                   lat_deg=position.lat_deg, lon_deg=position.lon_deg, speed_mps=speed_mps, course_deg=course_deg,
                   altitude_m=self.gga.altitude_m if self.gga else None, satellites=self.satellites(), hdop=self.hdop(),
                   may_wait=self.may_wait)

    def satellites(self) -> int | None:
        return self.gga.satellites if self.gga else None

    def hdop(self) -> float | None:
        if self.gga is not None and self.gga.hdop is not None:
            return self.gga.hdop
        return self.gsa.hdop if self.gsa else None


def _place_of(sentence: Sentence) -> str:
    """The name of its kind, under which an epoch has it."""
    return type(sentence).__name__.lower()


SELDOM_US = 5_500_000
"""Between fixes so far apart the motion is not known (the longest rhythm that is taken is 5 s, and some jitter)."""
TELLING_INTERVALS = 3
TELLING_FIXES = 10
_MISSING = {"speed": ("no row has a distance", "RMC or VTG sentences too"),
            "date": ("no row has a time", "RMC with its date, or ZDA sentences too")}
"""What so many fixes in a row may lack, what that does, and what brings it."""


def _words_of(day: int) -> str:
    """A date for people; ``day`` counts from 1970-01-01."""
    date = datetime.date.fromordinal(EPOCH_ORDINAL + day)
    return f"{date.day} {date:%B %Y}"


class NmeaDecoder:
    """Bytes of a receiver in, fixes out. Raises nothing, whatever the bytes.

    week_rollovers     1024-week turns by which the receiver is known to be late (old firmware); 0 for a sound one
    earliest_utc_us    dates before this are refused [us since 1970-01-01]; the default is this software's release
    baud               of its line
    """

    def __init__(self, week_rollovers: int = 0, earliest_utc_us: int = RELEASE_UTC_US, baud: int = USUAL_BAUD) -> None:
        self._framer = NmeaFramer()
        self._arrivals = Arrivals()
        self._added_us = week_rollovers * ROLLOVER_DAYS * DAY_US
        self._earliest_utc_us = earliest_utc_us
        self._checks = dict.fromkeys(Checksum, 0)
        self._malformed = 0
        self._refused_dates = 0
        self._epoch: _Epoch | None = None
        self._epoch_at: tuple[int, int] | None = None
        self._loose_vtg: tuple[int, Vtg] | None = None
        self.line = LineLoad(baud)
        self._zda: tuple[int, Zda] | None = None
        self._known: tuple[int, int] | None = None
        self._too_early_us: int | None = None
        self._recent = RecentBytes()
        self._fixes_without = dict.fromkeys(_MISSING, 0)
        self._long_intervals_us: list[int] = []

    @property
    def unread(self) -> str:
        """What arrives and what to do, where nothing of it becomes a fix."""
        return self._recent.advice(RECEIVER, "NMEA sentences with a checksum ($GPRMC,...*hh) are")

    @property
    def doubt(self) -> str:
        """What is missing in the fixes that come or wrong with their dates, and what to do; empty: nothing."""
        for what, (harm, sentences) in _MISSING.items():
            if self._fixes_without[what] >= TELLING_FIXES:
                return f"it sends {self._recent.sentence_kinds()}, but no {what}, so {harm}: have it send {sentences}"
        if len(self._long_intervals_us) == TELLING_INTERVALS:
            return (f"it sends only every {min(self._long_intervals_us) / US_PER_S:.0f} s, too seldom to know the "
                    "motion in between, so rows have no position: have it send RMC every second")
        if self._too_early_us is None:
            return ""
        day = self._too_early_us // DAY_US
        turns = -(-(self._earliest_utc_us - self._too_early_us) // (ROLLOVER_DAYS * DAY_US))
        rollovers = self._added_us // (ROLLOVER_DAYS * DAY_US) + turns
        wrong = f"its date is {_words_of(day)}, before gps.earliest_date in the settings, so no row has a date"
        counted_days = day - self._added_us // DAY_US - (GPS_BEGAN.toordinal() - EPOCH_ORDINAL)
        if rollovers > ROLLOVERS_MAX or counted_days < 0 or counted_days % ROLLOVER_DAYS < DAYS_OF_WEEK:
            return f"{wrong}: give its antenna a free view of the sky, or replace it"
        return (f"{wrong}. If the date is right, change earliest_date. If today is about "
                f"{_words_of(day + turns * ROLLOVER_DAYS)}, its week counter wrapped after 1024 weeks: set "
                f"gps.week_rollovers: {rollovers}, or update its firmware")

    @property
    def counts(self) -> dict[str, int]:
        """What came in so far.

        sentences       with the right checksum, of any kind
        bad_checksum    with a wrong or damaged checksum
        no_checksum     with none
        malformed       of a kind we read, right checksum, but a field that cannot be
        ubx_frames      binary frames stepped over
        dropped_bytes   bytes that belonged to nothing
        refused_dates   dates of valid fixes that were illegal, too early or too late
        """
        return {"sentences": self._checks[Checksum.GOOD], "bad_checksum": self._checks[Checksum.BAD],
                "no_checksum": self._checks[Checksum.MISSING], "malformed": self._malformed,
                "ubx_frames": self._framer.ubx_frames, "dropped_bytes": self._framer.dropped_bytes,
                "refused_dates": self._refused_dates}

    def feed(self, t_us: int, data: bytes) -> list[Fix]:
        """Take the bytes that arrived at ``t_us`` [us, monotonic]; return the fixes that are complete."""
        self._arrivals.note(t_us, len(data))
        self.line.note(t_us, len(data))
        self._recent.note(data)
        fixes: list[Fix] = []
        for frame in self._framer.feed(data):
            sentence = self._read(frame.data)
            if sentence is not None:
                fixes += self._place(sentence, frame)
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

    def _place(self, sentence: Sentence, frame: Frame) -> list[Fix]:
        """Put a sentence where it belongs; return the fix that it closes, if any."""
        t_us, talker = self._arrivals.at(frame.start), frame.data[1:3]
        if isinstance(sentence, Zda):
            self._zda = (t_us, sentence)
            return []
        closed: list[Fix] = []
        if isinstance(sentence, Vtg):
            self._loose_vtg = t_us, sentence
        elif isinstance(sentence, Rmc | Gga | Gll):
            if self._epoch is None or not self._epoch.takes(sentence, talker):
                closed = self._open(sentence.time_of_day_us, frame.start, t_us)
            assert self._epoch is not None
            self._epoch.placed_us, self._loose_vtg = t_us, None
            self._epoch.talkers.add((type(sentence), talker))
        if self._epoch is not None:
            self._epoch.add(sentence)
        return closed

    def _open(self, time_of_day_us: int | None, at: int, t_us: int) -> list[Fix]:
        """Begin an epoch with the sentence at a stream offset; return the fix of the one before."""
        begun, before = _Epoch(t_us, time_of_day_us, self.line.may_wait), self._epoch
        if before is not None and self._loose_vtg is not None:
            vtg_us, vtg = self._loose_vtg
            if t_us - vtg_us < vtg_us - before.placed_us:
                begun.vtg, before.vtg = vtg, None if before.vtg is vtg else before.vtg
        if time_of_day_us is not None:
            if self._epoch_at is not None and 0 < (for_us := time_of_day_us - self._epoch_at[1]) < MINUTE_US:
                self.line.needs(at - self._epoch_at[0], for_us)
                longer = [*self._long_intervals_us, for_us][-TELLING_INTERVALS:]
                self._long_intervals_us = longer if for_us > SELDOM_US else []
            self._epoch_at = at, time_of_day_us
        closed = self._close()
        self._epoch = begun
        return closed

    def _close(self) -> list[Fix]:
        epoch, zda = self._epoch, self._zda
        if epoch is None:
            return []
        self._epoch, self._zda = None, None
        if not epoch.valid():  # only how well the receiver sees the sky is taken
            return [Fix(epoch.t_us, False, None, None, None, None, None, None, None, epoch.satellites(), epoch.hdop())]
        refused = self._refused_dates
        fix = epoch.fix(self._utc_us(epoch, zda))
        is_dated = fix.utc_us is not None or self._refused_dates > refused
        for what, is_there in (("speed", fix.speed_mps is not None), ("date", is_dated)):
            self._fixes_without[what] = 0 if is_there else self._fixes_without[what] + 1
        return [fix]

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
