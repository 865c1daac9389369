"""A log that the disk cannot stop.

Problem. A card fills up, dies or turns read-only while the car drives. The service must not end by that: the sensors
still work, the disk may come back, and somebody has to say what is wrong.

Solution. ``BufferedLog`` stands before a ``SegmentLog`` and never raises what the disk says. It keeps every row that is
not known to be on the disk, so many of them at most, and writes them to a new part once the disk takes them again: the
part that failed is never trusted beyond its last sync. Tries come at growing intervals. A disk that fails before there
is a log (at the start of the service) is the same case.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable

from logger.records import WindowRecord
from logger.store.log.log_writer import ClockMap, SegmentLog
from logger.store.log.quarantine import disk_words
from logger.units import US_PER_S

WAITING_ROWS = 5000
"""Most rows kept in memory, some 5 MB: 38 km of windows of 7.62 m. Of more the oldest are lost, and counted."""

FIRST_WAIT_US = US_PER_S
LONGEST_WAIT_US = 30 * US_PER_S
log = logging.getLogger(__name__)


class BufferedLog:
    """Rows in, whatever the disk does.

    begin     opens the session's log; tried again until it succeeds
    now_us    the monotonic clock

    trouble       why no rows can be written at the moment; empty: all is well
    since_us      since when
    waiting       rows in memory that are not known to be on the disk
    rows_lost     rows that were given up: memory was full of rows, or the service ended
    failures      how often the disk refused
    """

    def __init__(self, begin: Callable[[], SegmentLog], now_us: Callable[[], int]) -> None:
        self._begin = begin
        self._now_us = now_us
        self._log: SegmentLog | None = None
        self._clock: ClockMap | None = None
        self._waiting: deque[WindowRecord] = deque()
        self._on_disk = 0
        self._held = ""
        self._retry_us = 0
        self._wait_us = FIRST_WAIT_US
        self.trouble = "not open yet"
        self.since_us = now_us()
        self.rows_lost = 0
        self.failures = 0
        self.tend()

    @property
    def waiting(self) -> int:
        """Rows in memory that are not known to be on the disk."""
        return len(self._waiting)

    @property
    def file_name(self) -> str | None:
        """Name of the file that takes rows now."""
        return self._log.path.name if self._log is not None and not self.trouble else None

    @property
    def session(self) -> int | None:
        """Number of the session; None before the disk took a first file."""
        return self._log.session if self._log is not None else None

    def append(self, record: WindowRecord) -> None:
        """Write a row, or keep it until that is possible."""
        self._waiting.append(record)
        self._try(lambda segment_log: segment_log.append(record))
        if self.trouble and len(self._waiting) > WAITING_ROWS:
            self._waiting.popleft()
            self.rows_lost += 1

    def sync(self) -> None:
        """Wait until all rows are on the disk, as far as it takes them."""
        self._try(SegmentLog.sync)

    def rotate(self) -> None:
        """Begin a new file."""
        self._try(SegmentLog.rotate)

    def set_clock_map(self, clock: ClockMap) -> None:
        """Tell the session's UTC."""
        self._clock = clock
        self._try(lambda segment_log: segment_log.set_clock_map(clock))

    def hold(self, why: str) -> None:
        """Write nothing more until called with an empty ``why``: there is no room that may be used."""
        if why and not self._held:
            self.sync()
            self._fail(why)
        elif self._held and not why:
            self._retry_us = 0
        self._held = why

    def tend(self) -> None:
        """To be called now and then: tries again when it is time. What an outage has left is finished bit by bit."""
        if self._held or self._now_us() < self._retry_us:
            return
        if self.trouble:
            self._go_on()
        elif self._log is not None and self._log.is_behind:
            self._catch_up(self._log)

    def close(self) -> None:
        """Finish the file, after one more try where the disk had refused."""
        if self.trouble and not self._held:
            self._go_on()
        self._try(SegmentLog.close)
        if self._waiting:
            self.rows_lost += len(self._waiting)
            log.error("%d rows could not be written: %s", len(self._waiting), self.trouble)
            self._waiting.clear()

    def _try(self, act: Callable[[SegmentLog], None]) -> None:
        if self._log is None or self.trouble:
            return
        try:
            act(self._log)
        except OSError as error:
            self._fail(disk_words(error))
        self._let_go_of_what_is_safe()

    def _go_on(self) -> None:
        try:
            if self._log is None:
                self._log = self._begin()
                for record in self._waiting:
                    self._log.append(record)
                self._log.sync()
            else:
                self._log.go_on(self._waiting)
            if self._clock is not None:
                self._log.set_clock_map(self._clock)
        except OSError as error:
            self._fail(disk_words(error))
        else:
            log.info("logging to %s", self._log.path)
            self.trouble = ""
            self._wait_us = FIRST_WAIT_US
        self._let_go_of_what_is_safe()

    def _catch_up(self, segment_log: SegmentLog) -> None:
        try:
            segment_log.finish_left()
        except OSError as error:
            log.warning("a file that was left open cannot be finished yet: %s", disk_words(error))
            self._retry_us = self._now_us() + LONGEST_WAIT_US

    def _fail(self, why: str) -> None:
        now_us = self._now_us()
        self.failures += 1
        if not self.trouble:
            self.since_us = now_us
        if why != self.trouble:
            log.error("no row can be written: %s; %d rows wait in memory", why, len(self._waiting))
        self.trouble = why
        self._retry_us = now_us + self._wait_us
        self._wait_us = min(2 * self._wait_us, LONGEST_WAIT_US)

    def _let_go_of_what_is_safe(self) -> None:
        if self._log is not None:
            for _ in range(self._log.rows_on_disk - self._on_disk):
                self._waiting.popleft()
            self._on_disk = self._log.rows_on_disk
