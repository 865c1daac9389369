"""The time and the way of a drive: seconds by the receiver, metres by its speed."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from drivers.readings import Fix
from logger.arrays import Array, Bools, Whole
from logger.geodesy import ground_distance_m
from logger.units import DAY_US, US_PER_S

_INTERVALS_KEPT = 16


class Rhythm:
    """usual_us   interval between two of its times [us]; None: not known yet

    Problem: one fix a second is usual, but receivers send from ten times a second to once in five seconds, and one that
    sends each two seconds has lost nothing between two of its fixes. Solution: the rhythm is learned as it comes.
    Losses make intervals longer, never shorter, so it is the lower quartile of the last ones.
    """

    def __init__(self) -> None:
        self._intervals_us: deque[int] = deque(maxlen=_INTERVALS_KEPT)
        self._last_us: int | None = None
        self.usual_us: int | None = None

    def take(self, t_us: int) -> None:
        """The next time [us]. One that is not later than the last begins anew."""
        if self._last_us is not None and t_us > self._last_us:
            self._intervals_us.append(t_us - self._last_us)
            self.usual_us = sorted(self._intervals_us)[len(self._intervals_us) // 4]
        self._last_us = t_us


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

    A Pi has no clock at boot and its system clock may jump, so ridelog never asks it. A receiver gives the UTC of a
    fix, but the sentence arrives late, by an amount that wobbles, or that grows for minutes where the line is too slow
    for what is sent. It never arrives early: arrival minus fix time has a floor, which is the clock difference plus the
    shortest latency, and the shortest latency is a setting (only a pulse-per-second wire could measure it). The floor
    is the lowest that was seen, raised by no more than two clocks drift apart (the lower envelope of one-way delays
    [1]); by it each fix is placed at the time that it names, however late it comes.

    The receiver's own clock may jump (leap seconds that it learns late): then arrivals keep the rhythm and its times do
    not. Where a fix is late its times keep the rhythm and the arrivals do not. A jump that lasts for some fixes is
    taken over. After a loss of fix neither shows; then what lasts for half a minute is a jump, unless the line is full.
    A fix that comes earlier than the floor shows a jump, or that all before were late.

    A line that has been full since the start has not shown its floor: until it pauses the times are not certain.

    Two facts are kept apart because receivers learn them apart: the time of day (known with the first fix) and the
    date. UTC is given out only after some fixes in a row agree on the date; one that disagrees is outvoted. A change of
    the date (a receiver that jumps by a week, or corrects one) is taken over after half a minute: nobody drives into
    another week, and most such jumps are soon taken back.

    [1] S. B. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay measurements, INFOCOM
        1999.

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


NORMAL_INTERVAL_US = 1_500_000
"""What is known as well between fixes of a receiver that sends more often: one of five a second may be missing."""
NORMAL_SHARE = 1.5  # Of a receiver's rhythm: half of it is more than any wait, and less than a lost fix
SLOWEST_RHYTHM_US = 5_000_000
ACCELERATION_LIMIT_MPS2 = 15.0
PLACE_JUMP_M = 80.0
REJECTED_IN_A_ROW = 3


@dataclass(frozen=True)
class Travel:
    """The car's motion at some instants: all arrays (n,).

    known           the speed is known (False: before the first fix, or in a loss too long to bridge)
    bridged         known only by bridging a loss of fix
    """

    distance_m: Array
    speed_mps: Array
    known: Bools
    bridged: Bools
    leg: Whole


class Odometer:
    """Collects timed fixes as knots of a piecewise linear speed.

    A fix says where the car was and how fast, once a second or so. Between two fixes the speed is a straight line, so
    the distance is its integral. A short loss of fix is bridged the same way and marked; a long one is not bridged:
    what lies in it has no distance. Lost is what the receiver's own rhythm would have brought. Below a threshold speed
    the car counts as standing, so that the noise of a receiver at rest does not make distance.

    The distance counts what was travelled with known speed; after a long loss it goes on from where it stopped, and
    `legs` distinguishes such stretches.
    """

    def __init__(self, bridge_s: float, stationary_mps: float) -> None:
        self._bridge_us = round(bridge_s * US_PER_S)
        self._stationary_mps = stationary_mps
        self._t_us: list[int] = []
        self._speed_mps: list[float] = []
        self._distance_m: list[float] = []
        self._lat_deg: list[float] = []
        self._lon_deg: list[float] = []
        self._leg: list[int] = []
        self._rejected = 0
        self._rhythm = Rhythm()
        self.rejected_fixes = 0
        self.fixes_without_speed = 0

    @property
    def last_t_us(self) -> int | None:
        """Time of the newest knot: up to here the motion is settled."""
        return self._t_us[-1] if self._t_us else None

    @property
    def _normal_us(self) -> float:
        """The longest interval between two fixes in which none was lost [us]."""
        rhythm_us = min(self._rhythm.usual_us or 0, SLOWEST_RHYTHM_US)
        return max(NORMAL_INTERVAL_US, NORMAL_SHARE * rhythm_us)

    @property
    def total_m(self) -> float:
        """Distance travelled with known speed so far [m]."""
        return self._distance_m[-1] if self._distance_m else 0.0

    def add(self, timed: TimedFix) -> None:
        """Take a fix. Invalid ones, ones without a speed and wild ones are passed over."""
        fix = timed.fix
        is_placed = fix.valid and fix.lat_deg is not None and fix.lon_deg is not None
        if is_placed and fix.speed_mps is None:
            self.fixes_without_speed += 1
            return
        self._rhythm.take(timed.t_us)
        if not is_placed or fix.speed_mps is None or fix.lat_deg is None or fix.lon_deg is None:
            return
        if self._t_us and timed.t_us <= self._t_us[-1]:
            return
        speed_mps = fix.speed_mps if fix.speed_mps >= self._stationary_mps else 0.0
        plausible = self._plausible(timed.t_us, speed_mps, fix.lat_deg, fix.lon_deg)
        if not plausible and self._rejected < REJECTED_IN_A_ROW:
            self._rejected += 1
            self.rejected_fixes += 1
            return
        self._rejected = 0
        # The last two knots stand, and so does the new one: one knot is enough for hours of parking.
        if (plausible and speed_mps == 0.0 and self._speed_mps[-2:] == [0.0, 0.0] and self._leg[-2] == self._leg[-1]):
            self._t_us[-1], self._lat_deg[-1], self._lon_deg[-1] = timed.t_us, fix.lat_deg, fix.lon_deg
            return
        distance_m, leg = self._extend(timed.t_us, speed_mps, plausible)
        self._t_us.append(timed.t_us)
        self._speed_mps.append(speed_mps)
        self._distance_m.append(distance_m)
        self._lat_deg.append(fix.lat_deg)
        self._lon_deg.append(fix.lon_deg)
        self._leg.append(leg)

    def travel(self, t_us: Whole) -> Travel:
        """Motion at the instants ``t_us`` (n,), none of them after the newest knot."""
        if not self._t_us:
            return _unknown(len(t_us))
        knots_us = np.array(self._t_us, dtype=np.int64)
        leg = np.array(self._leg, dtype=np.int64)
        i = np.searchsorted(knots_us, t_us, side="right") - 1
        at_last = i == len(knots_us) - 1
        low = np.clip(i, 0, len(knots_us) - 1)
        high = np.minimum(low + 1, len(knots_us) - 1)
        same_leg = leg[low] == leg[high]
        known = (i >= 0) & same_leg & (~at_last | (t_us == knots_us[-1]))
        speeds = np.array(self._speed_mps)
        span_us = np.maximum(knots_us[high] - knots_us[low], 1)
        into_s = np.where(known, t_us - knots_us[low], 0) / US_PER_S
        slope_mps2 = (speeds[high] - speeds[low]) / (span_us / US_PER_S)
        distance_m = np.array(self._distance_m)[low] + into_s * (speeds[low] + 0.5 * slope_mps2 * into_s)
        speed_mps = np.where(known, speeds[low] + slope_mps2 * into_s, np.nan)
        return Travel(distance_m, speed_mps, known, known & (span_us > self._normal_us), leg[low])

    def place(self, distance_m: float, leg: int) -> tuple[float, float] | None:
        """Latitude and longitude [deg] at a travelled distance of a leg; None when it is not between knots."""
        first = next((k for k, knot_leg in enumerate(self._leg) if knot_leg == leg), None)
        if first is None:
            return None
        last = len(self._leg) - 1 - self._leg[::-1].index(leg)
        distances = self._distance_m[first : last + 1]
        if not distances[0] - 1e-6 <= distance_m <= distances[-1] + 1e-6:
            return None
        lat_deg = float(np.interp(distance_m, distances, self._lat_deg[first : last + 1]))
        lon_deg = float(np.interp(distance_m, distances, np.unwrap(self._lon_deg[first : last + 1], period=360.0)))
        return lat_deg, (lon_deg + 180.0) % 360.0 - 180.0

    def forget_before(self, t_us: int, distance_m: float) -> None:
        """Drop knots that neither instants from ``t_us`` on nor places from ``distance_m`` on will need."""
        keep = 0
        while (keep + 2 < len(self._t_us) and self._t_us[keep + 1] <= t_us
               and self._distance_m[keep + 1] <= distance_m):
            keep += 1
        if keep:
            for knots in (self._t_us, self._speed_mps, self._distance_m, self._lat_deg, self._lon_deg, self._leg):
                del knots[:keep]

    def _extend(self, t_us: int, speed_mps: float, plausible: bool) -> tuple[float, int]:
        """Distance at the next knot, and its leg: a new one after a long loss and where the knots contradict."""
        if not self._t_us:
            return 0.0, 0
        gap_us = t_us - self._t_us[-1]
        if gap_us > max(self._bridge_us, self._normal_us) or not plausible:
            return self._distance_m[-1], self._leg[-1] + 1
        mean_mps = 0.5 * (self._speed_mps[-1] + speed_mps)
        return self._distance_m[-1] + mean_mps * gap_us / US_PER_S, self._leg[-1]

    def _plausible(self, t_us: int, speed_mps: float, lat_deg: float, lon_deg: float) -> bool:
        """False for a fix that no car can reach from the last one: a damaged line passes an 8-bit check about once in
        256. A lone one is skipped; after some in a row it is the old knot that is no longer believed."""
        if not self._t_us:
            return True
        gap_s = (t_us - self._t_us[-1]) / US_PER_S
        if gap_s * US_PER_S > self._bridge_us:
            return True
        if abs(speed_mps - self._speed_mps[-1]) > ACCELERATION_LIMIT_MPS2 * max(gap_s, 0.2):
            return False
        reach_m = PLACE_JUMP_M + 1.5 * max(speed_mps, self._speed_mps[-1]) * gap_s
        return ground_distance_m(self._lat_deg[-1], self._lon_deg[-1], lat_deg, lon_deg) <= reach_m


def _unknown(count: int) -> Travel:
    none = np.zeros(count, dtype=np.bool_)
    return Travel(np.zeros(count), np.full(count, np.nan), none, none, np.zeros(count, dtype=np.int64))
