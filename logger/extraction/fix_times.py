"""When fixes were true, by a receiver's clock and a recorder's, over a whole drive.

Problem: on board a fix is placed by the earliest arrival so far; what comes later in the drive may have come with less
wait, and tells of the fixes before it as well. Solution: the lowest floor of arrivals is carried back in time too,
raised by no more than the two clocks drift apart, as far back as the receiver's clock did not jump.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

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
