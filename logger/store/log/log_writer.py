"""The files of a log: opened, filled, finished, put right after a power cut, and what is kept while the disk refuses
them.

Problem. The power of a car goes at any instant. Whoever looks into the folder afterwards must find every row that
had reached the disk, once, and no file that looks finished and is not. The rows written before the first GPS fix
have no UTC, and a Pi has no clock from which files could take their names.

Solution. Names come from a session number that is never used again: ``<session>-<part>.csv.part`` while open,
``.csv`` when finished, with a sidecar ``.json`` beside it. A part is only ever appended to. It is finished by a
rename: of itself, when all of it was synced and nothing in it needs to change, else of a rewritten copy (UTC filled in,
damaged lines left out) which is on the disk before it takes the name, and only then the part is removed. So at every
instant there is either the part or the finished file, and ``repair`` at the next start makes the step that was missing.
Every change to the disk goes through ``FileSystem``, so that tests can cut between any two of them.

What is promised, whatever is cut and wherever (``tests/benchmarks/faults.py`` tries it):

1. A row that ``sync`` returned for is in the folder, once, in every later instant. The service syncs each row within
   a second of handing it over; a process that is killed loses no row at all that it had handed over.
2. No damaged row is ever taken for good: a row counts only with its CRC-32.
3. After the next start every file is finished and beside its sidecar, its rows follow one another without a gap but
   where the disk itself lost them, and no session number is given twice.
4. Where the disk refuses (full, failing, read-only), what was on it stays, and rows go on in a part of their own as
   soon as it takes them: what a failed write or sync left behind is never counted as written.

The disk has to keep its side: what fsync returned for stays, and a rename happens or does not. ext4 as on a Raspberry
Pi does; FAT does not promise the second, nor that a cut leaves no old content of the disk in a new file.

A card fills up, dies or turns read-only while the car drives. The service must not end by that: the sensors still work,
the disk may come back, and somebody has to say what is wrong. ``BufferedLog`` stands before a ``SegmentLog`` and never
raises what the disk says. It keeps every row that is not known to be on the disk, so many of them at most, and writes
them to a new part once the disk takes them again: the part that failed is never trusted beyond its last sync. Tries
come at growing intervals. A disk that fails before there is a log (at the start of the service) is the same case.
"""

import logging
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from drivers.disk import FileSystem
from logger.records import WindowRecord
from logger.store.log import recovery
from logger.store.log.atomic_file import disk_words
from logger.store.log.log_name import finished_path
from logger.store.log.row_format import HEADER, format_row
from logger.store.log.sidecar import ClockMap, Tally, store_sidecar
from logger.units import US_PER_S

CLOCK_STEP_US = 100_000
"""A clock map that has moved by less than this need not reach the disk before the file is finished."""


class SegmentLog:
    """The log of one session: rows in, files out.

    directory    an existing folder that one service at a time writes to
    session      a number from ``next_session``
    sidecar      what a reader needs beside the rows (configuration, versions, scales); plain JSON values
    more         what the sidecar says besides by now; written every ``ROWS_A_SIDECAR`` rows, as a car cuts the power
    max_bytes    a part is finished before a row would make its rows longer than this

    ``path`` is the open part; ``rows_on_disk`` counts the rows that were synced, in all parts. Raises ``OSError`` for
    what the disk refuses, ``FileExistsError`` also when files of this session are there already. After an ``OSError``
    the open part is not to be trusted beyond its synced rows: ``go_on`` begins another, in which the rows that were
    not synced have to be written again, and ``finish_left`` finishes the one that was left.
    """

    path: Path
    _tally: Tally
    _bytes: int

    def __init__(self, directory: Path, session: int, sidecar: dict[str, Any], max_bytes: int,
                 files: FileSystem | None = None, more: Callable[[], dict[str, Any]] = dict) -> None:
        self._directory = directory
        self.session = session
        self._given, self._more = sidecar, more
        self._rows_said = 0
        self._max_bytes = max_bytes
        self._files = files or FileSystem()
        self._clock: ClockMap | None = None
        self._stored_clock: ClockMap | None = None
        self._without_utc: list[tuple[Path, Tally]] = []
        self._left: list[Path] = []
        self._is_retry = False  # the part was opened by ``go_on``, and nothing in it has been synced yet
        self._part = 0
        self._descriptor: int | None = None
        self._dirty = False
        self._rows_synced = 0
        self.rows_on_disk = 0
        self._open_next()

    def append(self, record: WindowRecord) -> None:
        """Write one row. It is handed to the system at once and is safe from a power cut after ``sync``."""
        row = f"{format_row(record)}\n".encode()
        if self._bytes and self._bytes + len(row) > self._max_bytes:
            self.rotate()
        self._dirty = True
        self._do(self._files.write, row)
        self._bytes += len(row)
        self._tally = replace(self._tally, rows=self._tally.rows + 1, unset=self._tally.unset + (record.utc_us is None))

    def sync(self) -> None:
        """Wait until all rows are on the disk."""
        if self._dirty:
            self._do(self._files.sync)
            self._dirty = self._is_retry = False
            self.rows_on_disk += self._tally.rows - self._rows_synced
            self._rows_synced = self._tally.rows
            if self._tally.rows - self._rows_said >= ROWS_A_SIDECAR:
                self._rows_said = self._tally.rows
                if more := self._more():
                    self._given = self._given | more
                    self._write_sidecar("open")

    def rotate(self) -> None:
        """Finish the part and open the next; a part without rows stays open."""
        if self._tally.rows:
            self._finish()
            self._open_next()

    def set_clock_map(self, clock: ClockMap) -> None:
        """Tell the session's UTC, or a better one. Rows written without it get it when their file is finished;
        in files that are finished already they get it now."""
        self._clock = clock
        if self._stored_clock is None or abs(clock.offset_us - self._stored_clock.offset_us) >= CLOCK_STEP_US:
            self._write_sidecar("open")
        self._fill_earlier()

    def go_on(self, unsynced: Iterable[WindowRecord]) -> None:
        """After an ``OSError``: leave the part as it stands, open the next, and put the rows there that were not
        synced. A part that was opened here and has taken no row is begun again: a disk that refuses for a day leaves
        no more files than one that refuses once. Raises ``OSError``: not yet."""
        self._let_go()
        if self._is_retry:
            self._part -= 1
        self._is_retry = True
        self._open_next()
        for record in unsynced:
            self.append(record)
        self.sync()

    @property
    def is_behind(self) -> bool:
        """True while there is something for ``finish_left`` to do."""
        return bool(self._left or (self._without_utc and self._clock is not None))

    def finish_left(self) -> None:
        """Finish one of the parts that were left. Raises ``OSError``: not yet; else ``repair`` does it one day."""
        if self._left:
            part = self._left[0]
            finished: Path | None = finished_path(part)
            if part.exists():
                limit = recovery.first_segments_later(self._files, recovery.logs_of_session(part))[part]
                finished = recovery.repair_part(self._files, part, limit, self._clock).finished
            if finished is not None and finished.exists():
                self._without_utc.append((finished, recovery.tally_of(self._files, finished)))
            self._left.pop(0)
        self._fill_earlier()

    def close(self) -> None:
        """Finish the last part, or remove it when it has no rows, and what was left as far as the disk lets us.
        Closing twice does nothing."""
        if self._descriptor is None:
            return
        with suppress(OSError):
            while self.is_behind:
                self.finish_left()
        if self._tally.rows:
            self._finish()
        else:
            self._close_file()
            recovery.remove_part(self._files, self.path)

    def _open_next(self) -> None:
        self._part += 1
        self.path = self._directory / f"{self.session:05d}-{self._part:03d}.csv.part"
        for taken in (self.path, finished_path(self.path)):
            if taken.exists() and not self._is_retry:
                raise FileExistsError(f"{taken}: this session has been logged before")
        self._tally = Tally()
        self._bytes = 0
        self._rows_synced = self._rows_said = 0
        self._descriptor = self._files.create(self.path)
        self._files.write(self._descriptor, f"{HEADER}\n".encode())
        self._dirty = True
        self._write_sidecar("open")

    def _finish(self) -> None:
        self.sync()
        self._close_file()
        finished = recovery.finish_part(self._files, self.path, self._given | self._more(), self._tally, self._clock)
        if self._clock is None and self._tally.unset:
            self._without_utc.append((finished, self._tally))

    def _fill_earlier(self) -> None:
        while self._clock is not None and self._without_utc:
            recovery.fill_finished(self._files, *self._without_utc[0], self._clock)
            self._without_utc.pop(0)

    def _let_go(self) -> None:
        if not self._is_retry and self.path not in self._left:
            self._left.append(self.path)
        with suppress(OSError):
            self._close_file()

    def _close_file(self) -> None:
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            self._files.close(descriptor)

    def _do(self, act: Callable[..., None], *what: bytes) -> None:
        """Write to or sync the part. One that failed at it is never tried again: the system may by then have thrown
        away what it could not write, and report success."""
        if self._descriptor is None:
            raise ValueError("expected an open log: go_on() after an error, and nothing after close()")
        try:
            act(self._descriptor, *what)
        except OSError:
            self._let_go()
            raise

    def _write_sidecar(self, state: str) -> None:
        store_sidecar(self._files, self.path, self._given, state, self._tally, self._clock)
        self._stored_clock = self._clock


ROWS_A_SIDECAR = 500  # Rows after which the sidecar of an open part is written again: 4 km, some minutes
WAITING_ROWS = 5000
"""Most rows kept in memory, some 5 MB: 38 km of windows of 7.62 m. Of more the oldest are lost, and counted."""

FIRST_WAIT_US = US_PER_S
LONGEST_WAIT_US = 30 * US_PER_S
"""After so long at the latest what has failed is tried again: a disk, a sensor, a receiver."""
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
        self._try(SegmentLog.rotate)

    def set_clock_map(self, clock: ClockMap) -> None:
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
