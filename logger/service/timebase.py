"""Monotonic time to UTC, from GPS fixes alone.

A Pi has no clock at boot and its system clock may jump, so ridelog never asks it. A receiver gives the UTC of
a fix, but the sentence arrives late, by an amount that wobbles. Arrival minus fix time therefore scatters above
a floor; the floor over the last minutes is the clock difference plus the shortest latency, and the shortest
latency is a setting (only a pulse-per-second wire could measure it).

Two facts are kept apart because receivers learn them apart: the time of day (known with the first fix) and the
date. UTC is given out only after some fixes in a row agree on the date; one that disagrees is outvoted. A change of the
time of day that lasts (a leap second) is taken over after as many fixes, one of the date (a receiver that jumps by a
week, or corrects one) after half a minute: nobody drives into another week, and most such jumps are soon taken back.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from drivers.readings import Fix
from logger.units import US_PER_S

DAY_US = 86_400 * US_PER_S
FLOOR_FIXES = 120
AGREEING_FIXES = 3
OTHER_DATE_US = 30 * US_PER_S
JUMP_US = 700_000  # below the one second of a leap second that the receiver learns late


@dataclass(frozen=True)
class TimedFix:
    """A fix and the monotonic time at which the car was where it says [us]."""

    t_us: int
    fix: Fix


class Timebase:
    """Follows the difference between the monotonic clock and GPS time.

    latency_s    shortest delay between the instant of a fix and the arrival of its first byte [s]
    """

    def __init__(self, latency_s: float) -> None:
        self._latency_us = round(latency_s * US_PER_S)
        self._lags_us: deque[int] = deque(maxlen=FLOOR_FIXES)
        self._floor_us: int | None = None
        self._strays_us: list[int] = []
        self._date_us: int | None = None
        self._date_vote: tuple[int, int, int] | None = None
        self.time_jumps = 0

    def place(self, fix: Fix) -> TimedFix:
        """When, on the monotonic axis, the fix was true. A fix without a time is placed by its arrival."""
        if fix.time_of_day_us is None:
            return TimedFix(fix.t_us - self._latency_us, fix)
        lag_us = self._lag_us(fix.t_us, fix.time_of_day_us)
        if self._is_stray(lag_us):
            return TimedFix(fix.t_us - self._latency_us, fix)
        self._lags_us.append(lag_us)
        self._floor_us = min(self._lags_us)
        if fix.utc_us is not None and fix.valid:
            self._vote_for_date(fix.t_us, fix.t_us - lag_us, fix.utc_us)
        return TimedFix(fix.t_us - lag_us + self._floor_us - self._latency_us, fix)

    def utc_offset_us(self) -> int | None:
        """UTC minus monotonic time [us]; None while the date is unknown."""
        if self._date_us is None or self._floor_us is None:
            return None
        return self._date_us - self._floor_us + self._latency_us

    def _lag_us(self, t_us: int, time_of_day_us: int) -> int:
        """Arrival minus fix time, on the day that keeps it nearest to the floor."""
        lag_us = t_us - time_of_day_us
        if self._floor_us is None:
            return lag_us
        days = round((lag_us - self._floor_us) / DAY_US)
        return lag_us - days * DAY_US

    def _is_stray(self, lag_us: int) -> bool:
        """True for a fix whose time does not fit the others; enough strays that agree become the new floor."""
        if self._floor_us is None or abs(lag_us - self._floor_us) <= JUMP_US:
            self._strays_us.clear()
            return False
        if self._strays_us and abs(lag_us - self._strays_us[-1]) > JUMP_US:
            self._strays_us.clear()
        self._strays_us.append(lag_us)
        if len(self._strays_us) < AGREEING_FIXES:
            return True
        self._lags_us.clear()
        self._strays_us.clear()
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
        if votes + 1 < AGREEING_FIXES or (self._date_us is not None and t_us - since_us < OTHER_DATE_US):
            return
        self.time_jumps += self._date_us is not None
        self._date_us = date_us
        self._date_vote = None
