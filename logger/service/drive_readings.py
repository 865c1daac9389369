"""Readings of a drive as they come, how they fill the sensor's range, and which other setting would suit it better.

Problem: a range that is too small cuts off what is rough, and one that is too large has steps in which smooth roads
hide. Solution: count both, and compare with what was measured of a BMA220 with 4 reads per sample on roads of IRI 2 to
45 at 20 to 60 mph (``tests/benchmarks/ranges.py``). Cut readings are bounds, so a smaller range stays the better one
for long: with 8 % of windows clipped R2 was 0.972 at 2 g and 0.959 at 4 g, with 25 % it was 0.934 and 0.970. Without
any clipped window the smaller range was better by 0.01 to 0.1 of R2 at every speed. Where windows hid below a step, the
next finer setting gave more of them and 0.05 to 0.06 more of R2.

What a recorded drive holds, before anything is made of it, are readings on the 100 Hz grid, and fixes. What reads it
stands where the pipeline stands in a replay (``event_core``), so that bytes become readings by the same drivers,
filters and checks; but it keeps them, where the pipeline makes rows of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivers.accelerometers.accelerometer import OtherSettings
from drivers.readings import AccelerationBlock, Fix
from logger.arrays import Array, Bools
from logger.bounds import MOVING_MPS
from logger.dsp.windows import GridSamples
from logger.estimation.drive_alignment import DriveAlignment
from logger.records import WindowRecord
from logger.service.doubted_spans import JudgedDrive
from logger.service.signal_chain import SignalChain
from logger.service.timebase import TimedFix
from logger.units import US_PER_S

CLIPPED_SHARE = 0.2
"""Of windows: from here on a larger range is better; between 8 and 25 %, and at 14 % of another drive it was not."""
HIDDEN_SHARE = 0.03  # So few hid on a drive at 2 g and one read (R2 0.838) that had 0.905 with 4 reads
FEWEST_WINDOWS = 400  # Before these nothing is said: a share of 0.2 is known to 0.02, one of 0.03 to 0.01


class RangeUse:
    """Follows readings, fixes and rows, each in order of time. ``others``: what could be set instead."""

    def __init__(self, others: OtherSettings) -> None:
        self._others = others
        self._moves = False
        self._ends_mps2 = np.array([end_mps2 for _, end_mps2 in others.finer])
        self._blocks, self._beyond = 0, np.zeros(len(others.finer))
        self._windows = self._clipped = self._hidden = 0

    def take(self, block: AccelerationBlock, fixes: Sequence[Fix]) -> None:
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
            return self._said(f"it clipped in {clipped:.0%} of this drive's windows", self._others.wider)
        for (setting, _), beyond in zip(self._others.finer, self._beyond / max(self._blocks, 1), strict=True):
            if beyond < CLIPPED_SHARE:
                seldom = f"only {beyond:.1%} of this drive" if beyond else "nothing of this drive"
                return self._said(f"{seldom} would have exceeded a smaller range, which has finer steps", setting)
        if hidden > HIDDEN_SHARE:
            return self._said(f"{hidden:.0%} of this drive's windows move by less than one of its steps",
                              self._others.oftener)
        return ""

    @staticmethod
    def _said(why: str, setting: str) -> str:
        return setting and f"{why}: set {setting}"


_JUDGED_AFTER_US = 120 * US_PER_S
"""A sensor that is frozen or repeats itself is known to be after half a minute, a wrong speed after one or two."""


@dataclass(frozen=True, eq=False)
class GridReadings:
    """Readings (n,) 10 ms apart, but where ``time_s`` jumps, since nothing at all was heard in between.

    time_s        monotonic [s]
    accel_mps2    along the axis that points up, gravity and offset in it; a straight line where there was none
    present       there was a reading, and the sensor was well
    clipped       the sensor stood at the end of its range
    """

    time_s: Array
    accel_mps2: Array
    present: Bools
    clipped: Bools


class DriveReadings(JudgedDrive):
    """Keeps what a replay gives. ``alignment`` learns of it how late the receiver is."""

    drive = 1

    def __init__(self, chain: SignalChain, alignment: DriveAlignment, latency_s: float) -> None:
        super().__init__(alignment, latency_s)
        self._chain = chain
        self._parts: list[GridSamples] = []
        self._fresh: list[GridSamples] = []
        self._start_us: int | None = None
        self.fixes: list[TimedFix] = []

    def step(self, now_us: int, block: AccelerationBlock, fixes: list[Fix]) -> list[WindowRecord]:
        if self._start_us is None:
            self._start_us = now_us
        self.fixes += self.judge(block, fixes)
        self._fresh += [part for part in self._chain.push(block) + self._chain.advance(self._start_us, now_us)
                        if len(part)]
        while self._fresh and self._fresh[0].t_us[-1] < now_us - _JUDGED_AFTER_US:
            self._keep(self._fresh.pop(0))
        return []

    def is_settled(self, stepped_us: int, heard_us: int) -> bool:
        """As ``Pipeline.is_settled``: what was heard is kept at once."""
        return stepped_us - heard_us > US_PER_S

    def skip_to(self, t_us: int) -> None:
        self._fresh += [part for part in self._chain.skip_to(t_us) if len(part)]

    def finish(self) -> list[WindowRecord]:
        for part in self._fresh + self._chain.flush():
            self._keep(part)
        self._fresh = []
        return []

    def readings(self) -> GridReadings:
        """All of them, once the drive is finished."""
        if not self._parts:
            nothing, nowhere = np.empty(0), np.empty(0, dtype=np.bool_)
            return GridReadings(nothing, nothing, nowhere, nowhere)
        samples = GridSamples.joined(self._parts)
        return GridReadings(samples.t_us / US_PER_S, samples.reading_mps2, samples.present & ~samples.interpolated,
                            samples.clipped)

    def _keep(self, part: GridSamples) -> None:
        """Keep readings, as missing where the sensor or the speed is known by now not to have been right."""
        if len(part):
            self._parts.append(replace(part, present=part.present & ~self.doubted(part.t_us)))
