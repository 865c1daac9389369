"""Readings of several even pieces on the one grid of a run.

Problem: after a hole a recorder's readings go on at instants of their own, up to half a step beside those before it;
a run, whose times lie on one grid, could not be read again. To interpolate them would smooth what a coarse sensor read.
Solution: a reading keeps its value and the instant at which it was taken, where the car is looked up, and gets the
nearest number on the grid that is free.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_OFF = 0.1
"""Of a step, by which one between two readings of the same piece may differ: times are written in microseconds."""


@dataclass(frozen=True, eq=False)
class RunGrid:
    """Samples (m,) of a run, made of readings (n,).

    time_s     evenly spaced, from the first reading on [s]
    taken_s    the instants that they stand for, growing, within a step of ``time_s`` [s]
    row        number of the reading; -1: none
    """

    time_s: Array
    taken_s: Array
    row: npt.NDArray[np.int64]

    def laid(self, values: Array) -> Array:
        """Values of readings (n,) as samples (m,), on straight lines where there was no reading."""
        known = self.row >= 0
        return np.interp(np.arange(len(self.row)), np.flatnonzero(known), values[self.row[known]])


def run_grid(time_s: Array, rate_hz: float) -> RunGrid:
    """Lay readings at growing times (n,) [s], even but for jumps, on a grid; without readings it is empty."""
    if not len(time_s):
        return RunGrid(time_s, time_s, np.empty(0, dtype=np.int64))
    place = (time_s - time_s[0]) * rate_hz
    begins = [0, *(np.flatnonzero(np.abs(np.diff(place) - 1.0) > _OFF) + 1), len(place)]
    number = np.empty(len(place), dtype=np.int64)
    for begin, end in pairwise(begins):
        free = number[begin - 1] + 1 if begin else 0
        number[begin:end] = max(free, round(place[begin])) + np.arange(end - begin)
    row = np.full(number[-1] + 1, -1, dtype=np.int64)
    row[number] = np.arange(len(number))
    count = np.arange(len(row))
    return RunGrid(time_s[0] + count / rate_hz, np.interp(count, number, time_s), row)
