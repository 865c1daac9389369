"""What a recorded drive holds, before anything is made of it: readings on the 100 Hz grid, and fixes.

It stands where the pipeline stands in a replay (``event_core``), so that bytes become readings by the same drivers,
filters and checks; but it keeps them, where the pipeline makes rows of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drivers.readings import AccelerationBlock, Fix
from logger.dsp.windows import GridSamples, joined
from logger.estimation.drive_alignment import DriveAlignment
from logger.records import WindowRecord
from logger.service.frozen_sensor import Stillness
from logger.service.repetition import Repetition
from logger.service.signal_chain import SignalChain
from logger.service.speed_check import SpeedCheck
from logger.service.timebase import Timebase, TimedFix
from logger.units import US_PER_S

Array = npt.NDArray[np.float64]

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
    present: npt.NDArray[np.bool_]
    clipped: npt.NDArray[np.bool_]


class DriveReadings:
    """Keeps what a replay gives. ``alignment`` learns of it how late the receiver is."""

    drive = 1

    def __init__(self, chain: SignalChain, alignment: DriveAlignment, latency_s: float) -> None:
        self._chain = chain
        self._latency_s = latency_s
        self._parts: list[GridSamples] = []
        self._fresh: list[GridSamples] = []
        self._start_us: int | None = None
        self._stillness = Stillness()
        self.fixes: list[TimedFix] = []
        self.alignment = alignment
        self.repetition = Repetition()
        self.speed_check = SpeedCheck()
        self.timebase = Timebase(latency_s)

    def step(self, now_us: int, block: AccelerationBlock, fixes: list[Fix]) -> list[WindowRecord]:
        """As ``Pipeline.step``."""
        if self._start_us is None:
            self._start_us = now_us
        for fix in fixes:
            timed = self.timebase.place(fix)
            self.fixes.append(timed)
            self.speed_check.take(timed)
            if fix.valid and fix.speed_mps is not None and self.timebase.unsure_until_us is None:
                self.alignment.take_fix(timed.t_us / US_PER_S + self._latency_s, fix.speed_mps)
        self.alignment.take_readings(block.t_us / US_PER_S, block.accel_mps2)
        self._stillness.take(block, fixes)
        self.repetition.take(block)
        self._fresh += [part for part in self._chain.push(block) + self._chain.advance(self._start_us, now_us)
                        if len(part)]
        while self._fresh and self._fresh[0].t_us[-1] < now_us - _JUDGED_AFTER_US:
            self._judge(self._fresh.pop(0))
        return []

    def is_settled(self, stepped_us: int, heard_us: int) -> bool:
        """As ``Pipeline.is_settled``: what was heard is kept at once."""
        return stepped_us - heard_us > US_PER_S

    def skip_to(self, t_us: int) -> None:
        """As ``Pipeline.skip_to``."""
        self._fresh += [part for part in self._chain.skip_to(t_us) if len(part)]

    def finish(self) -> list[WindowRecord]:
        """As ``Pipeline.finish``."""
        for part in self._fresh + self._chain.flush():
            self._judge(part)
        self._fresh = []
        return []

    def readings(self) -> GridReadings:
        """All of them, once the drive is finished."""
        if not self._parts:
            nothing, nowhere = np.empty(0), np.empty(0, dtype=np.bool_)
            return GridReadings(nothing, nothing, nowhere, nowhere)
        samples = joined(self._parts)
        return GridReadings(samples.t_us / US_PER_S, samples.reading_mps2, samples.present & ~samples.interpolated,
                            samples.clipped)

    def _judge(self, part: GridSamples) -> None:
        """Keep readings, as missing where the sensor or the speed is known by now not to have been right."""
        if len(part):
            doubtful = self._stillness.spans.during(part.t_us) | self.repetition.spans.during(part.t_us)
            doubtful |= self.speed_check.spans.during(part.t_us)
            self._parts.append(replace(part, present=part.present & ~doubtful))
