"""When fixes were true, by a receiver's clock and a recorder's, over a whole drive.

Problem: a fix arrives late by an amount that wobbles, and the recorder's clock drifts against GPS time by some
milliseconds a minute. Solution: arrival minus the time that the fix names scatters above a floor; the floor of the
minutes before and after an instant is the difference of the clocks there plus the receiver's shortest delay, which is
known from elsewhere (``receiver_delay``).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

DAY_S = 86_400.0
_NEAR_FIXES = 60
"""To either side: of so many fixes one came with hardly any wait; a clock drifts by a millisecond or two meanwhile."""
_STRAY_S = 0.7
"""A time that is farther off than this is wrong: below the second of a leap second."""


def fix_times_s(arrival_s: Array, time_of_day_s: Array, delay_s: float) -> Array:
    """Times (k,) of fixes on the recorder's clock [s].

    arrival_s        (k,) growing [s]
    time_of_day_s    (k,) as the fixes name it [s]; NaN where they do not: these are placed by their arrival
    delay_s          from the instant of a fix to its arrival, at least [s]
    """
    from scipy.ndimage import minimum_filter1d

    times_s = arrival_s - delay_s
    named = np.flatnonzero(np.isfinite(time_of_day_s))
    if not len(named):
        return times_s
    lag_s = arrival_s[named] - time_of_day_s[named]
    lag_s = lag_s - DAY_S * np.round((lag_s - lag_s[0]) / DAY_S)
    about_s = _running_median(lag_s)
    true = np.abs(lag_s - about_s) <= _STRAY_S
    named, lag_s = named[true], lag_s[true]
    if not len(named):
        return times_s
    floor_s = minimum_filter1d(lag_s, 2 * _NEAR_FIXES + 1, mode="nearest")
    times_s[named] = arrival_s[named] - (lag_s - floor_s) - delay_s
    return times_s


def _running_median(values: Array) -> Array:
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, 2 * _NEAR_FIXES + 1, mode="nearest"))
