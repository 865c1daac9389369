"""Where a recorded drive can be cut into stretches that a model can be driven along.

Problem: a recording goes on while the car is parked, the receiver sees no sky, or the sensor is silent; a model needs
speed and readings without a break. Solution: a stretch ends where fixes or readings are missing for too long, or where
the car stands for long; what is shorter than that stays inside, marked.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.dsp.stretches import stretches_of

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

LONGEST_HOLE_S = 0.5
"""Over a shorter hole readings lie on a straight line: the filters of the service run on over so much as well."""
KEPT_STANDING_S = 5.0


def stretches(time_s: Array, present: Bools, fix_s: Array, speed_mps: Array, longest_gap_s: float,
              longest_standing_s: float, stationary_mps: float) -> list[tuple[float, float]]:
    """Begin and end of each [s], in order.

    time_s, present       (n,) of readings, and whether there was one
    fix_s, speed_mps      (k,) of fixes
    longest_gap_s         between two fixes of one stretch
    longest_standing_s    with a speed below ``stationary_mps``; some seconds of a longer one are kept at either end
    """
    if len(fix_s) < 2 or not present.any():
        return []
    at_s = time_s[present]
    breaks = [*_gaps(fix_s, longest_gap_s), *_gaps(at_s, LONGEST_HOLE_S)]
    for first, end in zip(*stretches_of(speed_mps < stationary_mps), strict=True):
        if fix_s[end - 1] - fix_s[first] > longest_standing_s:
            breaks.append((fix_s[first] + KEPT_STANDING_S, fix_s[end - 1] - KEPT_STANDING_S))
    begin_s, end_s = max(fix_s[0], at_s[0]), min(fix_s[-1], at_s[-1])
    found = []
    for gone_s, back_s in sorted(breaks):
        if gone_s > begin_s:
            found.append((float(begin_s), float(min(gone_s, end_s))))
        begin_s = max(begin_s, back_s)
    found.append((float(begin_s), float(end_s)))
    return [one for one in found if one[1] > one[0]]


def _gaps(time_s: Array, longest_s: float) -> list[tuple[float, float]]:
    wide = np.flatnonzero(np.diff(time_s) > longest_s)
    return [(float(time_s[index]), float(time_s[index + 1])) for index in wide]
