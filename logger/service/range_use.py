"""How a drive fills the sensor's range, and which other setting would suit it better.

Problem: a range that is too small cuts off what is rough, and one that is too large has steps in which smooth roads
hide. Solution: count both, and compare with what was measured of a BMA220 with 4 reads per sample on roads of IRI 2 to
45 at 20 to 60 mph (``tests/benchmarks/ranges.py``). Cut readings are bounds, so a smaller range stays the better one
for long: with 8 % of windows clipped R2 was 0.972 at 2 g and 0.959 at 4 g, with 25 % it was 0.934 and 0.970. Without
any clipped window the smaller range was better by 0.01 to 0.1 of R2 at every speed. Where windows hid below a step, the
next finer setting gave more of them and 0.05 to 0.06 more of R2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivers.accelerometers.accelerometer import OtherSettings
from drivers.readings import AccelerationBlock, Fix
from logger.records import WindowRecord
from logger.service.frozen_sensor import MOVING_MPS

CLIPPED_SHARE = 0.2
"""Of windows: from here on a larger range is better; between 8 and 25 %, and at 14 % of another drive it was not."""
HIDDEN_SHARE = 0.03
"""So few hid on a drive at 2 g and one read (R2 0.838) that had 0.905 with 4 reads."""
FEWEST_WINDOWS = 400
"""Before these nothing is said: a share of 0.2 is known to 0.02, one of 0.03 to 0.01."""


class RangeUse:
    """Follows readings, fixes and rows, each in order of time. ``others``: what could be set instead."""

    def __init__(self, others: OtherSettings) -> None:
        self._others = others
        self._moves = False
        self._ends_mps2 = np.array([end_mps2 for _, end_mps2 in others.finer])
        self._blocks, self._beyond = 0, np.zeros(len(others.finer))
        self._windows = self._clipped = self._hidden = 0

    def take(self, block: AccelerationBlock, fixes: Sequence[Fix]) -> None:
        """More readings and fixes."""
        for fix in fixes:
            if fix.valid and fix.speed_mps is not None:
                self._moves = fix.speed_mps > MOVING_MPS
        if self._moves and len(block):
            self._blocks += 1
            self._beyond += np.abs(block.accel_mps2).max() >= self._ends_mps2

    def count(self, records: Sequence[WindowRecord]) -> None:
        """More rows; those count that have an IRI, or would have one if it did not hide."""
        for record in records:
            hides = "faint" in record.flags
            if hides or record.iri_m_per_km is not None:
                self._windows += 1
                self._clipped += record.clipped_samples > 0
                self._hidden += hides

    @property
    def advice(self) -> str:
        """What to set, and why; empty: nothing better is known."""
        if self._windows < FEWEST_WINDOWS:
            return ""
        clipped, hidden = self._clipped / self._windows, self._hidden / self._windows
        if clipped > CLIPPED_SHARE:
            return self._said(f"in {clipped:.0%} of this drive's windows it stood at an end of its range",
                              self._others.wider)
        for (setting, _), beyond in zip(self._others.finer, self._beyond / max(self._blocks, 1), strict=True):
            if beyond < CLIPPED_SHARE:
                seldom = f"only {beyond:.1%} of this drive" if beyond else "nothing of this drive"
                return self._said(f"{seldom} would have been beyond a smaller range, and its steps are finer", setting)
        if hidden > HIDDEN_SHARE:
            return self._said(f"{hidden:.0%} of this drive's windows hide below one of its steps", self._others.oftener)
        return ""

    @staticmethod
    def _said(why: str, setting: str) -> str:
        return setting and f"{why}: set {setting}"
