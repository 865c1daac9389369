"""Fixes of a receiver: which are new, and when they were true.

When fixes were true, by a receiver's clock and a recorder's, over a whole drive.

Problem: on board a fix is placed by the earliest arrival so far; what comes later in the drive may have come with less
wait, and tells of the fixes before it as well. Solution: the lowest floor of arrivals is carried back in time too,
raised by no more than the two clocks drift apart, as far back as the receiver's clock did not jump.

Fixes out of columns beside an accelerometer: which rows are new, and what speed they give.

Problem: many programs write the last fix again in every row, and some write places but no speed. But an unchanged row
is no lost fix by itself: a car that stands, or goes at a steady speed that is written in whole km/h, gives the same
numbers again. Solution: a fix is new where something of it changes. An unchanged one counts at the usual pace until it
says that the car went farther than its places would hide; beyond that the receiver only repeats what it had. Places
alone give the speed from each to the next.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.dsp.repeated_samples import fresh_samples, resolution
from logger.geodesy import EARTH_RADIUS_M

Array = npt.NDArray[np.float64]

DAY_S = 86_400.0
_DRIFT = 1e-4
_JUMP_S = 0.7
"""Both as on board (``service/timebase``)."""


def fix_times_s(placed_s: Array, time_of_day_s: Array) -> Array:
    """Times (k,) of fixes on the recorder's clock [s].

    placed_s         (k,) as they were placed on board [s], growing but for single ones
    time_of_day_s    (k,) as the fixes name it [s]; NaN where they do not: these stay where they were placed
    """
    times_s = placed_s.copy()
    named = np.flatnonzero(np.isfinite(time_of_day_s))
    if not len(named):
        return times_s
    floor_s = placed_s[named] - time_of_day_s[named]
    floor_s = floor_s - DAY_S * np.round((floor_s - floor_s[0]) / DAY_S)
    jumps = np.flatnonzero(np.abs(np.diff(floor_s)) > _JUMP_S) + 1
    for part in np.split(np.arange(len(named)), jumps):
        drifted_s = _DRIFT * placed_s[named[part]]
        lowest_s = np.minimum.accumulate((floor_s[part] + drifted_s)[::-1])[::-1] - drifted_s
        times_s[named[part]] += lowest_s - floor_s[part]
    return times_s


Ints = npt.NDArray[np.int64]

_LATE = 1.5  # of the usual pace
_SLOWEST_S, _USUAL_S = 5.0, 1.0
"""Receivers and on-board diagnosis send once a second at least, the slowest receivers once in five."""
_ALIKE = (0.7, 1.4)
"""Places lie on the way: no detour, and no rounding of a unit, makes so much of it."""
_LEAST_M = 50.0
_MOVING = 0.3  # of the fastest


def new_rows(time_s: Array, columns: Array, speed_mps: Array, hides_m: float = np.inf) -> Ints:
    """Rows with a fix that counts, of columns (n, c) at growing times (n,) [s]: those that are new, and of those that
    repeat one before some, as long as the car went no farther since, at its speed (n,), than ``hides_m``."""
    fresh = np.flatnonzero(fresh_samples(columns))
    if not len(fresh):
        return fresh
    usual_s = float(np.median(np.diff(time_s[fresh]))) if len(fresh) > 1 else _SLOWEST_S
    pace_s = min(usual_s, _USUAL_S)
    kept = [fresh]
    for first, last in zip(fresh, np.append(fresh[1:], len(time_s)), strict=True):
        may_s = hides_m / speed_mps[first] if speed_mps[first] > 0 else np.inf
        end_s = min(time_s[last - 1], time_s[first] + may_s)
        late_s = _LATE * (min(usual_s, _SLOWEST_S) if last < len(time_s) else pace_s)
        if time_s[last - 1] - time_s[first] > late_s:
            rows = np.searchsorted(time_s, np.append(np.arange(time_s[first] + pace_s, end_s, pace_s), end_s), "right")
            kept.append(rows - 1)
    return np.unique(np.concatenate(kept)).astype(np.int64)


def hidden_m(lat_deg: Array, lon_deg: Array) -> float:
    """How far a car can go while its places (k,) [degrees] do not change: the step in which they are written [m]."""
    step_deg = np.array([resolution(lat_deg), resolution(lon_deg) * np.cos(np.radians(lat_deg.mean()))])
    return float(EARTH_RADIUS_M * np.radians(step_deg.max()))


def speeds_of_places(time_s: Array, lat_deg: Array, lon_deg: Array) -> Array:
    """Speeds (k,) [m/s] at fixes with places (k,) [degrees], k at least 2: over the steps before and after each."""
    step_m, step_s = ways_m(lat_deg, lon_deg), np.diff(time_s)
    middle = (step_m[:-1] + step_m[1:]) / (step_s[:-1] + step_s[1:])
    return np.concatenate([step_m[:1] / step_s[:1], middle, step_m[-1:] / step_s[-1:]])


def ways_m(lat_deg: Array, lon_deg: Array) -> Array:
    """From each place (k,) to the next, (k - 1,) [m]."""
    east_deg = (np.diff(lon_deg) + 180.0) % 360.0 - 180.0
    across = np.cos(np.radians(lat_deg[:-1]))
    return np.asarray(EARTH_RADIUS_M * np.radians(np.hypot(np.diff(lat_deg), east_deg * across)))


def way_over_speed(time_s: Array, lat_deg: Array, lon_deg: Array, speed_mps: Array) -> float | None:
    """How far the places (k,) lie apart, over the way by the speeds (k,), where it is no usual error: a speed in
    another unit than was said. None: they agree, or the way is too short to decide."""
    middle_mps = 0.5 * (speed_mps[1:] + speed_mps[:-1])
    moving = middle_mps > _MOVING * middle_mps.max()  # a standing car's places wander
    by_speed_m = float((middle_mps * np.diff(time_s))[moving].sum())
    by_place_m = float(ways_m(lat_deg, lon_deg)[moving].sum())
    if max(by_speed_m, by_place_m) < _LEAST_M:
        return None
    ratio = by_place_m / max(by_speed_m, 1e-9)
    return None if _ALIKE[0] <= ratio <= _ALIKE[1] else ratio
