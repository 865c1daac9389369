"""Samples that come in bursts: the times are those of a buffer that was emptied, not those at which it was filled.

Problem: a recorder that empties a sensor's buffer every now and then gives several samples one time, or nearly one.
Solution: the last sample of a burst is the newest, and is no later than the burst. A sensor with a clock of its own
takes samples evenly, so the straight line through number and time of those is the time of all.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_WITHIN = 0.2  # of the mean step: so near to the one before only in a burst
_SHARE = 0.3
_LATE = 0.5  # of the usual time between bursts


def burst_ends(t_s: Array) -> npt.NDArray[np.int64] | None:
    """Numbers of the last samples of the bursts of a record with times (n,), not decreasing [s]; None: it has none."""
    steps = np.diff(t_s)
    inside = steps < _WITHIN * (t_s[-1] - t_s[0]) / max(1, len(steps))
    if np.count_nonzero(inside) < _SHARE * len(steps):
        return None
    return np.flatnonzero(np.append(~inside, True))


def spread(t_s: Array, ends: npt.NDArray[np.int64]) -> Array:
    """Even times (n,) [s] of samples that came in bursts. ValueError where no even rate stands behind them."""
    ends = ends[1:-1]  # those that the record cuts off
    if len(ends) < 3:
        raise ValueError(f"found {len(ends)} bursts of samples and no rate")
    slope_s, start_s = np.polyfit(ends, t_s[ends], 1)
    late_s = np.abs(t_s[ends] - start_s - slope_s * ends).max()
    if slope_s <= 0 or late_s > _LATE * np.median(np.diff(t_s[ends])):
        raise ValueError(f"found bursts of samples that are up to {late_s:.3g} s off an even rate")
    return np.asarray(start_s + slope_s * np.arange(len(t_s)))
