"""Monotonic time to UTC, from GPS fixes alone.

A Pi has no clock at boot and its system clock may jump, so ridelog never asks it. A receiver gives the UTC of a fix,
but the sentence arrives late, by an amount that wobbles, or that grows for minutes where the line is too slow for what
is sent. It never arrives early: arrival minus fix time has a floor, which is the clock difference plus the shortest
latency, and the shortest latency is a setting (only a pulse-per-second wire could measure it). The floor is the lowest
that was seen, raised by no more than two clocks drift apart (the lower envelope of one-way delays [1]); by it each fix
is placed at the time that it names, however late it comes.

The receiver's own clock may jump (leap seconds that it learns late): then arrivals keep the rhythm and its times do
not. Where a fix is late its times keep the rhythm and the arrivals do not. A jump that lasts for some fixes is taken
over. After a loss of fix neither shows; then what lasts for half a minute is a jump, unless the line is full. A fix
that comes earlier than the floor shows a jump, or that all before were late.

A line that has been full since the start has not shown its floor: until it pauses the times are not certain.

Two facts are kept apart because receivers learn them apart: the time of day (known with the first fix) and the date.
UTC is given out only after some fixes in a row agree on the date; one that disagrees is outvoted. A change of the date
(a receiver that jumps by a week, or corrects one) is taken over after half a minute: nobody drives into another week,
and most such jumps are soon taken back.

[1] S. B. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay measurements, INFOCOM
    1999.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.readings import Fix
from logger.service.rhythm import Rhythm
from logger.units import US_PER_S

DAY_US = 86_400 * US_PER_S
AGREEING_FIXES = 3
LASTING_US = 30 * US_PER_S
JUMP_US = 700_000  # below the one second of a leap second that the receiver learns late
DRIFT = 10_000
"""A part in so many: a quartz clock of a small computer is right to 50 parts in a million, warm or cold; twice that."""
NOTABLE_US = 100_000
"""What is less late than this is not worth a word; so much lower than the floor a fix has to be twice in a row: a time
with a damaged digit passes an 8-bit check now and then."""


@dataclass(frozen=True)
class TimedFix:
    """A fix and the monotonic time at which the car was where it says [us]."""

    t_us: int
    fix: Fix


@dataclass
class _Stray:
    """Fixes in a row that are as much later or earlier than the floor: since when [us], and how many.

    is_jump   the receiver's clock has jumped; else they are late, or it is not known yet
    floor_us  of arrivals less such times: by as much higher or lower as its clock has left its rhythm
    """

    lag_us: int
    since_us: int
    is_jump: bool
    floor_us: int
    fixes: int = 0


class Timebase:
    """Follows the difference between the monotonic clock and GPS time.

    latency_s       shortest delay between the instant of a fix and the arrival of its first byte [s]
    late_us         how much later than that the last fix came [us]
    unsure_until_us up to here fixes may be placed too late, as their line had not paused yet [us]; None: none is
    """

    def __init__(self, latency_s: float) -> None:
        self._latency_us = round(latency_s * US_PER_S)
        self._floor_us: int | None = None
        self._floor_t_us = 0
        self._last: tuple[int, int] | None = None
        self._rhythm = Rhythm()
        self._stray: _Stray | None = None
        self._date_us: int | None = None
        self._date_vote: tuple[int, int, int] | None = None
        self._has_paused = False
        self._was_low = self._was_late = False
        self.unsure_until_us: int | None = None
        self.late_us = 0
        self.time_jumps = 0

    def place(self, fix: Fix) -> TimedFix:
        """When, on the monotonic axis, the fix was true. A fix without a time is placed by its arrival."""
        if fix.time_of_day_us is None:
            return TimedFix(fix.t_us - self._latency_us, fix)
        lag_us = self._lag_us(fix.t_us, fix.time_of_day_us)
        jumped = self._has_jumped(fix, lag_us)
        self._last = fix.t_us, fix.t_us - lag_us
        if jumped and self._stray is not None:
            return TimedFix(fix.t_us - lag_us + self._stray.floor_us - self._latency_us, fix)
        self._lower(fix, lag_us)
        assert self._floor_us is not None
        if fix.utc_us is not None and fix.valid:
            self._vote_for_date(fix.t_us, fix.t_us - lag_us, fix.utc_us)
        self.late_us = max(0, lag_us - self._floor_us)
        t_us = fix.t_us - self.late_us - self._latency_us
        if not self._has_paused:
            self.unsure_until_us = t_us
        return TimedFix(t_us, fix)

    def utc_offset_us(self) -> int | None:
        """UTC minus monotonic time [us]; None while the date is unknown."""
        if self._date_us is None or self._floor_us is None:
            return None
        return self._date_us - self._floor_us + self._latency_us

    def _lower(self, fix: Fix, lag_us: int) -> None:
        """The floor after the next fix."""
        before_us = self._floor_us if self._floor_us is not None else lag_us
        drift_us = 0 if fix.may_wait or self._floor_us is None else (fix.t_us - self._floor_t_us) // DRIFT
        was_low, self._was_low = self._was_low, before_us - lag_us > NOTABLE_US
        self._floor_us = before_us + drift_us if self._was_low and not was_low else min(before_us + drift_us, lag_us)
        self._floor_t_us = fix.t_us
        self._was_late |= self._was_low
        if not self._has_paused and not fix.may_wait and not self._was_low:
            self._has_paused = True
            if not self._was_late:
                self.unsure_until_us = None

    def _lag_us(self, t_us: int, time_of_day_us: int) -> int:
        """Arrival minus fix time, on the day that keeps it nearest to the floor."""
        lag_us = t_us - time_of_day_us
        if self._floor_us is None:
            return lag_us
        days = round((lag_us - self._floor_us) / DAY_US)
        return lag_us - days * DAY_US

    def _has_jumped(self, fix: Fix, lag_us: int) -> bool:
        """True for a fix whose own time does not fit the others; enough that agree become the new floor."""
        floor_us, last = self._floor_us, self._last
        usual_us, own_us = self._rhythm.usual_us, fix.t_us - lag_us
        self._rhythm.take(own_us)
        if floor_us is None or last is None or abs(lag_us - floor_us) <= JUMP_US:
            self._stray = None
            return False
        passed_us, own_passed_us = fix.t_us - last[0], own_us - last[1]
        stray = self._stray
        if stray is None or abs(lag_us - stray.lag_us) > JUMP_US:
            if lag_us > floor_us and passed_us - own_passed_us <= JUMP_US:
                self._stray = None  # later by and by, or less late than before, as some were lost that waited: no jump
                return False
            stray = self._stray = _Stray(lag_us, fix.t_us, lag_us < floor_us, lag_us)
            if usual_us and abs(passed_us - usual_us) < abs(own_passed_us - usual_us):
                stray.is_jump, stray.floor_us = True, floor_us + usual_us - own_passed_us
            elif lag_us > floor_us and self.late_us > JUMP_US:
                self._stray = None  # later than it was late already
                return False
        stray.fixes += 1
        lasts = fix.t_us - stray.since_us >= LASTING_US and not fix.may_wait
        if stray.fixes < AGREEING_FIXES if stray.is_jump else not lasts:
            return stray.is_jump
        self._was_late |= stray.floor_us < floor_us
        self._floor_us, self._floor_t_us, self._stray = stray.floor_us, fix.t_us, None
        self.time_jumps += 1
        return False

    def _vote_for_date(self, t_us: int, gps_scale_us: int, utc_us: int) -> None:
        """Some fixes in a row settle the first date; a date once settled gives way only to half a minute of another."""
        date_us = utc_us - gps_scale_us
        if date_us == self._date_us:
            self._date_vote = None
            return
        voted_us, votes, since_us = self._date_vote or (date_us, 0, t_us)
        if voted_us != date_us:
            votes, since_us = 0, t_us
        self._date_vote = date_us, votes + 1, since_us
        if votes + 1 < AGREEING_FIXES or (self._date_us is not None and t_us - since_us < LASTING_US):
            return
        self.time_jumps += self._date_us is not None
        self._date_us = date_us
        self._date_vote = None
