"""Fixes out of columns beside an accelerometer: which rows are new, and what speed they give.

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
