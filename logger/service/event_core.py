"""Bytes in, rows in the log out: what the live service and a replay have in common.

Events are taken in order of time. The pipeline is stepped on a fixed lattice of event time, before the first
event that lies beyond the next lattice point; so the rows depend on the events alone, not on how many came at a
time, how long the process slept or how fast a recording is played.
"""

import logging
from dataclasses import replace
from typing import Protocol

from drivers.accelerometers.accelerometer import Decoder
from drivers.dump import Event
from drivers.errors import BadReply
from drivers.nmea import NmeaDecoder
from drivers.readings import GPS, AccelerationBlock, Fix
from logger.records import WindowRecord
from logger.service.doubted_spans import Repetition, SpeedCheck
from logger.service.timebase import JUMP_US, Timebase
from logger.store.log.sidecar import ClockMap
from logger.units import US_PER_S

STEP_US = 500_000
IDLE_US = 120_000_000
STEP_BYTES = 1_000_000
"""More than any instrument sends in a step; the rest of what claims to be of one moment is skipped."""

log = logging.getLogger(__name__)


class RowSink(Protocol):
    """Where rows go: the segment log."""

    def append(self, record: WindowRecord) -> None: ...
    def rotate(self) -> None: ...
    def set_clock_map(self, clock_map: ClockMap) -> None: ...
    def close(self) -> None: ...


class KeptRows:
    """A log that is kept in memory."""

    def __init__(self) -> None:
        self._records: list[WindowRecord] = []
        self._clock: ClockMap | None = None

    def append(self, record: WindowRecord) -> None:
        self._records.append(record)

    def rotate(self) -> None:
        """There is but one."""

    def set_clock_map(self, clock_map: ClockMap) -> None:
        self._clock = clock_map

    def close(self) -> None:
        """Nothing to finish."""

    def dated(self) -> list[WindowRecord]:
        """The rows; those made before UTC was known get it, as in the files."""
        clock = self._clock
        if clock is None:
            return self._records
        return [record if record.utc_us is not None else replace(record, utc_us=record.t_us + clock.offset_us)
                for record in self._records]


class Stepped(Protocol):
    """What readings and fixes go to: the pipeline, or what stands in its place."""

    drive: int
    timebase: Timebase
    repetition: Repetition
    speed_check: SpeedCheck

    def step(self, now_us: int, block: AccelerationBlock, fixes: list[Fix]) -> list[WindowRecord]: ...
    def is_settled(self, stepped_us: int, heard_us: int) -> bool: ...
    def skip_to(self, t_us: int) -> None: ...
    def finish(self) -> list[WindowRecord]: ...


class EventCore:
    """Decodes events, steps the pipeline, writes its rows.

    rows, samples, fixes count what has passed; last_record and last_fix are the newest of each. bad_events were
    passed over: of another accelerometer, no whole reading, or too much for their moment.
    """

    def __init__(self, accelerometer: Decoder, gps: NmeaDecoder, pipeline: Stepped, sink: RowSink) -> None:
        self.accelerometer, self.gps, self._pipeline, self._sink = accelerometer, gps, pipeline, sink
        self._fixes: list[Fix] = []
        self._next_step_us: int | None = None
        self._last_event_us = 0
        self._step_bytes = 0
        self._drive = pipeline.drive
        self._offset_us: int | None = None
        self.rows = 0
        self.samples = 0
        self.fixes = 0
        self.bad_events = 0
        self.last_block: AccelerationBlock | None = None
        self.last_record: WindowRecord | None = None
        self.last_fix: Fix | None = None

    def feed(self, event: Event) -> None:
        """Take the next event; never earlier than the one before."""
        t_us, source, data = event
        if self._next_step_us is None:
            self._next_step_us = t_us + STEP_US
            self.gps.line.begin(t_us)
        elif t_us >= self._next_step_us:
            self.advance(t_us)
        self._last_event_us = t_us
        self._step_bytes += len(data)
        if self._step_bytes > STEP_BYTES:
            self.bad_events += 1
            return
        if source == GPS:
            self._fixes += self.gps.feed(t_us, data)
            return
        if source != self.accelerometer.name:
            self.bad_events += 1
            return
        try:
            self.accelerometer.feed(t_us, data)
        except BadReply as error:
            self.bad_events += 1
            log.warning("event at %.6f s skipped: %s", t_us / 1e6, error)

    def advance(self, now_us: int) -> None:
        """Make the steps that lie at or before ``now_us``; every event before that has been fed.

        Once nothing is under way any more, the time without an event passes in one step: a recording may hold one
        event each two minutes. After two minutes without any it is left out.
        """
        while self._next_step_us is not None and self._next_step_us <= now_us:
            idle_us = self._last_event_us + IDLE_US
            if self._next_step_us > idle_us:
                self._next_step_us = self._last_step_us(now_us)
                self._pipeline.skip_to(self._next_step_us)
            elif self._pipeline.is_settled(self._next_step_us - STEP_US, self._last_event_us):
                self._next_step_us = self._last_step_us(min(now_us, idle_us))
            step_us = self._next_step_us
            self._next_step_us += STEP_US
            self._step_bytes = 0
            block = self._take_block()
            self._write(self._pipeline.step(step_us, block, self._take_fixes()))
            if self._pipeline.drive != self._drive:
                self._drive = self._pipeline.drive
                self._sink.rotate()

    def _last_step_us(self, until_us: int) -> int:
        """The last point of the lattice up to then, from the next one on."""
        assert self._next_step_us is not None
        return self._next_step_us + (until_us - self._next_step_us) // STEP_US * STEP_US

    def finish(self) -> None:
        """End of the events: what is inside comes out, the log is closed."""
        if self._next_step_us is not None:
            self._fixes += self.gps.flush()
            self.accelerometer.flush()
            self._write(self._pipeline.step(self._next_step_us, self._take_block(), self._take_fixes()))
            self._write(self._pipeline.finish())
        self._sink.close()

    @property
    def utc_known(self) -> bool:
        """True once UTC has been learned from the GPS."""
        return self._offset_us is not None

    @property
    def accelerometer_doubt(self) -> str:
        """What is wrong with the samples that come; empty: nothing."""
        return self.accelerometer.doubt or self._pipeline.repetition.doubt

    @property
    def gps_doubt(self) -> str:
        """What is wrong with the fixes that come; empty: nothing."""
        if self.last_fix is None or not self.last_fix.valid:
            return ""
        return self.gps.doubt or self._lateness() or self._pipeline.speed_check.doubt

    def _lateness(self) -> str:
        """That fixes come late, why, and what to do; empty: they do not."""
        line, timebase = self.gps.line, self._pipeline.timebase
        late = f"its fixes come {timebase.late_us / US_PER_S:.1f} s late"
        if timebase.unsure_until_us is not None:
            late = "the delay of its fixes is unknown, and their rows are flagged gps_late"
        elif timebase.late_us > JUMP_US:
            late += " (rows use the times in the sentences)"
        if line.is_full:
            needs = f", and it has {line.needs_bytes_per_s:.0f} to send" if line.needs_bytes_per_s else ""
            return (f"its line is full: it carries {line.bytes_per_s:.0f} bytes a second{needs}, so {late}. Raise the "
                    "baud rate, in the receiver and in the settings, or have it send less: RMC and GGA are enough")
        if timebase.unsure_until_us is not None or timebase.late_us <= JUMP_US:
            return ""
        return f"{late}: something delays them. Have it send less: RMC and GGA are enough"

    def _take_block(self) -> AccelerationBlock:
        block = self.accelerometer.take()
        self.samples += len(block)
        if len(block):
            self.last_block = block
        return block

    def _take_fixes(self) -> list[Fix]:
        fixes, self._fixes = self._fixes, []
        if fixes:
            self.fixes += len(fixes)
            self.last_fix = fixes[-1]
        return fixes

    def _write(self, records: list[WindowRecord]) -> None:
        offset_us = self._pipeline.timebase.utc_offset_us()
        if offset_us is not None and offset_us != self._offset_us:
            self._offset_us = offset_us
            self._sink.set_clock_map(ClockMap(offset_us))
        for record in records:
            self._sink.append(record)
        if records:
            self.rows += len(records)
            self.last_record = records[-1]
