"""An accelerometer that drives and says nothing new.

Problem: a chip that has frozen goes on giving the reading it had, and a road of no roughness at all is what comes out.
But with steps of 0.6 m/s2 a car that is parked gives one and the same reading for hours too, and nothing is wrong.

Solution: the receiver shows which of the two it is. Only time counts through which every fix said that the car moved,
and not one axis of one reading changed. After ``FROZEN_S`` of it the sensor is frozen until a reading changes, with a
fix or without, and its windows are flagged and left without figures: from where it began, as far as they have not been
written yet. Before that nothing is said. A sensor without any noise, at an even speed on a perfect road, can be silent
for half a minute too; what it says then is too little to judge a road by.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivers.readings import AccelerationBlock, Fix
from logger.service.doubted_spans import DoubtedSpans
from logger.units import US_PER_S

FROZEN_S = 30.0
MOVING_MPS = 3.0
LONGEST_BETWEEN_FIXES_US = 3 * US_PER_S


class Stillness:
    """Follows readings and fixes, each in order of time.

    spans    in which the sensor was frozen
    """

    def __init__(self) -> None:
        self._last: tuple[float, ...] | None = None
        self._changed_us = 0
        self._heard_us = 0
        self._moving_us: int | None = None
        self._fix_us = 0
        self.spans = DoubtedSpans()
        self._lasting = False

    def take(self, block: AccelerationBlock, fixes: Sequence[Fix]) -> None:
        """More of both."""
        for fix in fixes:
            self._take_fix(fix)
        if len(block):
            self._take_block(block)
        if not self._lasting and self.frozen_s:
            self._lasting = True
            self.spans.begin(self._span_us()[0], self._heard_us)

    @property
    def frozen_s(self) -> float:
        """For how long the car has been driving on one reading [s]; 0 while that is no longer than it may be."""
        begin_us, end_us = self._span_us()
        still_s = (end_us - begin_us) / US_PER_S
        return still_s if still_s >= FROZEN_S else 0.0

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
        is_new = np.ones(len(block), dtype=np.bool_)
        is_new[1:] = (readings[1:] != readings[:-1]).any(axis=1)
        was_silent = int(block.t_us[0]) - self._heard_us > LONGEST_BETWEEN_FIXES_US
        is_new[0] = self._last != tuple(readings[0]) or (was_silent and not self._lasting)
        changes_us = block.t_us[is_new]
        self._last = tuple(readings[-1])
        self._heard_us = int(block.t_us[-1])
        if self._lasting:
            self.spans.end_at(int(changes_us[0]) - 1 if len(changes_us) else self._heard_us)
        if len(changes_us):
            self._changed_us = int(changes_us[-1])
            self._lasting = False
