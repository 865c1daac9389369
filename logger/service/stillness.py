"""An accelerometer that drives and says nothing new.

Problem: a chip that has frozen goes on giving the reading it had, and a road of no roughness at all is what comes out.
But with steps of 0.6 m/s2 a car that is parked gives one and the same reading for hours too, and nothing is wrong.

Solution: the receiver tells which of the two it is. Only time counts through which every fix said that the car moved,
and not one axis of one reading changed. After ``FROZEN_S`` of it the windows are flagged ``frozen``, from where it
began as far as they have not been written yet. Without a fix nothing is said. The figures stay: a sensor without any
noise, at an even speed on a perfect road, can be silent for half a minute too.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from drivers.readings import AccelerationBlock, Fix
from logger.units import US_PER_S

FROZEN_S = 30.0
MOVING_MPS = 3.0
LONGEST_BETWEEN_FIXES_US = 3 * US_PER_S
_SPANS_KEPT = 8


class Stillness:
    """Follows readings and fixes, each in order of time."""

    def __init__(self) -> None:
        self._last: tuple[float, ...] | None = None
        self._changed_us = 0
        self._heard_us = 0
        self._moving_us: int | None = None
        self._fix_us = 0
        self._frozen: deque[tuple[int, int]] = deque(maxlen=_SPANS_KEPT)

    def take(self, block: AccelerationBlock, fixes: Sequence[Fix]) -> None:
        """More of both."""
        for fix in fixes:
            self._take_fix(fix)
        if len(block):
            self._take_block(block)
        begin_us, end_us = self._span_us()
        if end_us - begin_us >= FROZEN_S * US_PER_S:
            if self._frozen and self._frozen[-1][0] == begin_us:
                self._frozen.pop()
            self._frozen.append((begin_us, end_us))

    @property
    def frozen_s(self) -> float:
        """For how long the car has been driving on one reading [s]; 0 while that is no longer than it may be."""
        begin_us, end_us = self._span_us()
        still_s = (end_us - begin_us) / US_PER_S
        return still_s if still_s >= FROZEN_S else 0.0

    def covers(self, begin_us: int, end_us: int) -> bool:
        """Tell whether the sensor was frozen in some of [begin, end)."""
        return any(begin_us < last_us and first_us < end_us for first_us, last_us in self._frozen)

    def _span_us(self) -> tuple[int, int]:
        if self._moving_us is None:
            return 0, 0
        return max(self._changed_us, self._moving_us), min(self._heard_us, self._fix_us)

    def _take_fix(self, fix: Fix) -> None:
        moves = fix.valid and fix.speed_mps is not None and fix.speed_mps >= MOVING_MPS
        if not moves:
            self._moving_us = None
        elif self._moving_us is None or fix.t_us - self._fix_us > LONGEST_BETWEEN_FIXES_US:
            self._moving_us = fix.t_us
        self._fix_us = fix.t_us

    def _take_block(self, block: AccelerationBlock) -> None:
        readings = block.accel_mps2
        if self._last != tuple(readings[0]) or int(block.t_us[0]) - self._heard_us > LONGEST_BETWEEN_FIXES_US:
            self._changed_us = int(block.t_us[0])
        changes = np.flatnonzero((readings[1:] != readings[:-1]).any(axis=1))
        if len(changes):
            self._changed_us = int(block.t_us[changes[-1] + 1])
        self._last = tuple(readings[-1])
        self._heard_us = int(block.t_us[-1])
