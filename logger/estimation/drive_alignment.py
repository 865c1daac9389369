"""A drive's readings and fixes, as they come, into what they show of the receiver's delay and the sensor's mounting.

Readings are kept for a block of ``BLOCK_S`` only; a block begins with a fix and is done once the readings are
``WAIT_S`` past its end, for fixes come late. How readings and fixes are split between calls changes nothing.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.estimation.mounting import Sitting, has_moved, sitting, tilt_complaint
from logger.estimation.receiver_delay import (
    BLOCK_S,
    DELAYS_S,
    DelayEstimate,
    DelayInformation,
    Stretch,
    block_information,
    estimate,
    forward_of,
    with_block,
)

Array = npt.NDArray[np.float64]

WAIT_S = 5.0
PART_BLOCKS = 6
"""So many blocks together are compared with what was before: four minutes of driving."""
LONGEST_READINGS = 100_000
LONGEST_SILENCE_S = 60.0
"""Of the sensor: the fixes that came in it are of no use."""
_BEFORE_S = float(DELAYS_S[-1]) + 0.1
_AFTER_S = 0.1 - float(DELAYS_S[0])


class DriveAlignment:
    """column, sign    of the sensor's axis that is set to point up

    ``moved`` says how the sensor came loose, and when; empty: it did not.
    """

    def __init__(self, column: int, sign: float) -> None:
        self._column = column
        self._sign = sign
        self._readings: list[tuple[Array, Array]] = []
        self._kept = 0
        self._fixes: list[tuple[float, float]] = []
        self._known = DelayInformation.none()
        self._part = DelayInformation.none()
        self._means: list[Array] = []
        self._before: Sitting | None = None
        self._first_s: float | None = None
        self._found: DelayEstimate | None = None
        self.moved = ""

    def take_readings(self, time_s: Array, accel: Array) -> None:
        """The next readings: times (n,) [s] and three axes (n, 3). Those that are not after the last ones, or are no
        numbers, are left out."""
        known = np.isfinite(accel).all(axis=1)
        if not known.all():
            time_s, accel = time_s[known], accel[known]
        if self._readings and len(time_s):
            later = time_s > self._readings[-1][0][-1]
            time_s, accel = time_s[later], accel[later]
        if not len(time_s):
            return
        self._readings.append((time_s, accel))
        self._kept += len(time_s)
        if not self._fixes:
            self._forget(float(time_s[-1]) - WAIT_S)
        while self._fixes and time_s[-1] >= self._fixes[0][0] + BLOCK_S + WAIT_S:
            self._end_block()
        if self._kept > LONGEST_READINGS:
            self._fixes.clear()
            self._forget(float(time_s[-1]))

    def take_fix(self, time_s: float, speed_mps: float) -> None:
        """The next fix, late by the delay that is sought [s, m/s]."""
        if self._fixes and time_s - self._fixes[0][0] > BLOCK_S + LONGEST_SILENCE_S:
            self._fixes.clear()
        if not self._fixes or time_s > self._fixes[-1][0]:
            self._fixes.append((time_s, speed_mps))

    @property
    def kept_readings(self) -> int:
        """Readings in memory."""
        return self._kept

    def estimate(self) -> DelayEstimate:
        """The delay and forward, as far as they are known by now."""
        if self._found is None:
            self._found = estimate(self._known)
        return self._found

    @property
    def complaints(self) -> tuple[str, ...]:
        """What is wrong with the mounting, in words."""
        seen = self._before or (sitting(np.array(self._means), None, None) if len(self._means) > 2 else None)
        tilted = tilt_complaint(seen, self._column, self._sign) if seen is not None else ""
        return tuple(words for words in (self.moved, tilted) if words)

    def _end_block(self) -> None:
        begin_s = self._fixes[0][0]
        end_s = begin_s + BLOCK_S
        count = sum(time_s < end_s for time_s, _ in self._fixes)
        fixes, self._fixes = np.array(self._fixes[:count]), self._fixes[count:]
        time_s = np.concatenate([part[0] for part in self._readings])
        accel = np.concatenate([part[1] for part in self._readings])
        low, high = np.searchsorted(time_s, [begin_s - _BEFORE_S, end_s + _AFTER_S])
        stretch = Stretch(time_s[low:high], accel[low:high], fixes[:, 0], fixes[:, 1])
        block = block_information(self._known, stretch)
        if block is not None:
            self._found = None
            self._known = with_block(self._known, block)
            self._part = with_block(self._part, block)
            self._means.append(block.mean)
            self._first_s = begin_s if self._first_s is None else self._first_s
            if len(self._means) == PART_BLOCKS:
                self._end_part(end_s)
        self._forget(min(end_s, float(time_s[-1]) - WAIT_S))

    def _end_part(self, end_s: float) -> None:
        """Compare a part with what was before; after a sensor has moved, start over."""
        forward, std_rad = forward_of(self._part, self._known)
        now = sitting(np.array(self._means), forward, std_rad)
        self._means, self._part = [], DelayInformation.none()
        words = has_moved(self._before, now) if self._before is not None else ""
        if words and self._first_s is not None:
            self.moved = f"{words} {(end_s - self._first_s) / 60:.0f} min after the drive began: fasten it"
            self._known, self._before = DelayInformation.none(), None
            return
        self._before = now if self._before is None else self._joined(self._before, now)

    def _joined(self, before: Sitting, now: Sitting) -> Sitting:
        """All that was before, by now: a slow drift is no jolt, so the latest counts by its share of three."""
        gravity = before.gravity + (now.gravity - before.gravity) / 3
        found = estimate(self._known)
        return Sitting(gravity, before.gravity_std_rad, found.forward, found.forward_std_rad)

    def _forget(self, until_s: float) -> None:
        while self._readings and self._readings[0][0][-1] < until_s - _BEFORE_S - 1.0:
            self._kept -= len(self._readings.pop(0)[0])
