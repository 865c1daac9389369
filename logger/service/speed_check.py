"""A receiver whose speed and places say different things.

Problem: the road's roughness is read by the speed, and a receiver may tell a wrong one: none at all while it holds its
speed back at low signal, twice the true one in another unit, that of a simulator. Nothing in a fix shows it. Solution:
the places tell the speed too. Over a stretch of fixes the way by the speed is held against that by the places: the
straight line between first and last place cannot be longer than the way, and the sum of all steps not much shorter.

How far they may differ is what receivers do that are well. Reflected signals move the places of a standing car by some
tens of metres, and a fix after a tunnel is put right by as much (``JUMP_M``); a speed is late by a second of braking
(``LATE_M``); and each may be a few per cent off (``SHARE``). A stretch in which they disagree is doubtful, and so is
what follows until they have been seen to agree. Twice the speed shows after 5 s; less than half of it after 100 m of
difference, by when rows may have been written.
"""

from __future__ import annotations

from collections import deque

import numpy as np
import numpy.typing as npt

from logger.geodesy import ground_distance_m
from logger.service.timebase import TimedFix
from logger.units import US_PER_S

SHARE = 0.15
JUMP_M = 100.0
LATE_M = 25.0
SHORTEST_US = 4 * US_PER_S
LONGEST_US = 60 * US_PER_S
LONGEST_M = 500.0
LONGEST_BETWEEN_FIXES_US = 3 * US_PER_S
LASTING_US = 60 * US_PER_S
_SPANS_KEPT = 64


class SpeedCheck:
    """Follows fixes in order of time, and tells which stretches are doubtful."""

    def __init__(self) -> None:
        self._first: TimedFix | None = None
        self._last: TimedFix | None = None
        self._by_speed_m = 0.0
        self._by_places_m = 0.0
        self._doubtful: deque[tuple[int, int]] = deque(maxlen=_SPANS_KEPT)
        self._lasts = False
        self._said = ""

    def take(self, timed: TimedFix) -> None:
        """The next fix. One without place or speed, or after a loss, ends the stretch."""
        fix, last = timed.fix, self._last
        if not fix.valid or fix.lat_deg is None or fix.lon_deg is None or fix.speed_mps is None:
            self._first = self._last = None
            self._lasts = False
            return
        if self._first is None or last is None or not 0 < timed.t_us - last.t_us <= LONGEST_BETWEEN_FIXES_US:
            self._begin(timed)
            return
        between_s = (timed.t_us - last.t_us) / US_PER_S
        self._by_speed_m += 0.5 * (fix.speed_mps + (last.fix.speed_mps or 0.0)) * between_s
        self._by_places_m += _apart_m(last, timed)
        self._last = timed
        lasted_us = timed.t_us - self._first.t_us
        if self._lasts:
            self._doubtful[-1] = (self._doubtful[-1][0], timed.t_us)
        if lasted_us >= SHORTEST_US:
            self._compare(self._first, timed, lasted_us)

    def _compare(self, first: TimedFix, timed: TimedFix, lasted_us: int) -> None:
        straight_m = _apart_m(first, timed)
        too_small = straight_m > (1 + SHARE) * self._by_speed_m + JUMP_M
        too_large = self._by_places_m < (1 - SHARE) * self._by_speed_m - LATE_M
        if too_small or too_large:
            if not self._lasts:
                self._doubtful.append((first.t_us, timed.t_us))
            self._lasts = True
            way_m = straight_m if too_small else self._by_places_m
            self._said = (f"its speed and its places disagree: over {lasted_us / US_PER_S:.0f} s the speed makes "
                          f"{self._by_speed_m:.0f} m, the places {way_m:.0f} m. Such rows have no IRI. Check what the "
                          "receiver is set to (static navigation, simulator, the sentences it sends), or replace it")
            self._begin(timed)
            return
        longer_m = max(self._by_speed_m, straight_m)
        agrees = abs(self._by_places_m - self._by_speed_m) <= SHARE * self._by_speed_m + LATE_M
        if lasted_us >= LONGEST_US or longer_m >= (JUMP_M if self._lasts and agrees else LONGEST_M):
            self._lasts = False
            self._begin(timed)

    @property
    def doubt(self) -> str:
        """What is wrong with the receiver, while it lasted until a minute ago; empty: nothing."""
        if not self._doubtful or self._last is None or self._last.t_us - self._doubtful[-1][1] > LASTING_US:
            return ""
        return self._said

    def covers(self, begin_us: int, end_us: int) -> bool:
        """Tell whether some of [begin, end) is doubtful."""
        return any(begin_us < last_us and first_us < end_us for first_us, last_us in self._doubtful)

    def during(self, t_us: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Tell of instants (n,) [us] whether they are doubtful."""
        doubtful = np.zeros(len(t_us), dtype=np.bool_)
        for first_us, last_us in self._doubtful:
            doubtful |= (first_us <= t_us) & (t_us <= last_us)
        return doubtful

    def _begin(self, timed: TimedFix) -> None:
        self._first = self._last = timed
        self._by_speed_m = self._by_places_m = 0.0


def _apart_m(one: TimedFix, other: TimedFix) -> float:
    a, b = one.fix, other.fix
    if a.lat_deg is None or a.lon_deg is None or b.lat_deg is None or b.lon_deg is None:
        return 0.0
    return ground_distance_m(a.lat_deg, a.lon_deg, b.lat_deg, b.lon_deg)
