"""Speed, travelled distance and place of the car between GPS fixes.

A fix says where the car was and how fast, once a second or so. Between two fixes the speed is a straight line, so the
distance is its integral. A short loss of fix is bridged the same way and marked; a long one is not bridged: what lies
in it has no distance. Lost is what the receiver's own rhythm would have brought. Below a threshold speed the car counts
as standing, so that the noise of a receiver at rest does not make distance.

The distance counts what was travelled with known speed; after a long loss it goes on from where it stopped, and `legs`
distinguishes such stretches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.geodesy import ground_distance_m
from logger.service.rhythm import Rhythm
from logger.service.timebase import TimedFix
from logger.units import US_PER_S

NORMAL_INTERVAL_US = 1_500_000
"""What is known as well between fixes of a receiver that sends more often: one of five a second may be missing."""
NORMAL_SHARE = 1.5
"""Of a receiver's rhythm: half of it is more than any wait, and less than a lost fix."""
SLOWEST_RHYTHM_US = 5_000_000
ACCELERATION_LIMIT_MPS2 = 15.0
PLACE_JUMP_M = 80.0
REJECTED_IN_A_ROW = 3

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Travel:
    """The car's motion at some instants: all arrays (n,).

    known           the speed is known (False: before the first fix, or in a loss too long to bridge)
    bridged         known only by bridging a loss of fix
    """

    distance_m: Floats
    speed_mps: Floats
    known: npt.NDArray[np.bool_]
    bridged: npt.NDArray[np.bool_]
    leg: npt.NDArray[np.int64]


class Odometer:
    """Collects timed fixes as knots of a piecewise linear speed."""

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
        if self._still_standing(speed_mps, plausible):
            self._move_last(timed.t_us, fix.lat_deg, fix.lon_deg)
            return
        distance_m, leg = self._extend(timed.t_us, speed_mps, plausible)
        self._t_us.append(timed.t_us)
        self._speed_mps.append(speed_mps)
        self._distance_m.append(distance_m)
        self._lat_deg.append(fix.lat_deg)
        self._lon_deg.append(fix.lon_deg)
        self._leg.append(leg)

    def travel(self, t_us: npt.NDArray[np.int64]) -> Travel:
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
        while (
            keep + 2 < len(self._t_us) and self._t_us[keep + 1] <= t_us and self._distance_m[keep + 1] <= distance_m
        ):
            keep += 1
        if keep:
            for knots in (self._t_us, self._speed_mps, self._distance_m, self._lat_deg, self._lon_deg, self._leg):
                del knots[:keep]

    def _still_standing(self, speed_mps: float, plausible: bool) -> bool:
        """The last two knots stand, and so does the new one: one knot is enough for hours of parking."""
        return plausible and speed_mps == 0.0 and self._speed_mps[-2:] == [0.0, 0.0] and self._leg[-2] == self._leg[-1]

    def _move_last(self, t_us: int, lat_deg: float, lon_deg: float) -> None:
        self._t_us[-1] = t_us
        self._lat_deg[-1] = lat_deg
        self._lon_deg[-1] = lon_deg

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
        256. A lone one is passed over; after some in a row it is the old knot that is no longer believed."""
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
