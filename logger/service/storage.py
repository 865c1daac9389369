"""All that the service writes to the disk: rows, raw bytes if asked to, and the room for both.

Nothing in here raises what the disk says; ``status`` reports it and it is tried again. So the main loop goes on, and
with it the sensors, the status file and the watchdog.
"""

import logging
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from drivers.disk import FileSystem
from drivers.dump import DumpHeader, Event
from logger.service.status import StorageStatus
from logger.store.export.export import exported_names
from logger.store.export.sticks import NOT_PAIRED, Pairing
from logger.store.log.atomic_file import names_set_aside
from logger.store.log.disk_quota import DiskQuota, DumpRecording, QuotaLimits, repair_recordings
from logger.store.log.log_name import next_session
from logger.store.log.log_writer import BufferedLog, SegmentLog
from logger.store.log.recovery import repair
from logger.units import US_PER_S

LOOK_US = 10 * US_PER_S
SHOWN_NOTICES = 5  # Most notices about the folder in the status, one screen with the rest; all are in the journal
log = logging.getLogger(__name__)


class Storage:
    """The log, the recording and the room in one folder, which exists.

    facts     what lies beside each log file
    header    of the raw dump; None: none is recorded
    now_us    the monotonic clock
    pairing   on whose sticks a copy lets a file be removed
    more      what else the sidecars say by now
    """

    def __init__(self, directory: Path, facts: dict[str, Any], max_file_bytes: int, header: DumpHeader | None,
                 limits: QuotaLimits, now_us: Callable[[], int], files: FileSystem | None = None,
                 pairing: Pairing = NOT_PAIRED, more: Callable[[], dict[str, Any]] = dict) -> None:
        self._directory = directory
        self._facts, self._more = facts, more
        self._max_file_bytes = max_file_bytes
        self._now_us = now_us
        self._files = files or FileSystem()
        self._space = DiskQuota(directory, limits, partial(exported_names, pairing=pairing), self._files)
        self._notices: list[str] = []
        self._warned: set[str] = set()
        self._looked_us = now_us()
        self._look()
        self.log = BufferedLog(self._begin, now_us)
        self._recording = (DumpRecording(directory, header, lambda: self.log.session, now_us,
                                         self._files) if header else None)

    def record(self, event: Event) -> None:
        """Keep the raw bytes, if asked to."""
        if self._recording is not None:
            self._recording.write(event)

    def sync(self) -> None:
        """Wait until everything is on the disk, as far as it takes it."""
        self.log.sync()
        if self._recording is not None:
            self._recording.flush()

    def tend(self) -> None:
        """To be called now and then: makes room, and tries again what failed."""
        now_us = self._now_us()
        if now_us - self._looked_us >= LOOK_US:
            self._looked_us = now_us
            self._look()
        self.log.hold(self._space.why_no_logs)
        self.log.tend()
        if self._recording is not None:
            self._recording.hold(self._space.why_no_dumps)
            self._recording.tend()

    def close(self) -> None:
        self.log.close()
        if self._recording is not None:
            self._recording.close()

    def status(self) -> StorageStatus:
        trouble = self.log.trouble
        return StorageStatus(trouble=trouble,
                             since_s=(self._now_us() - self.log.since_us) / US_PER_S if trouble else 0.0,
                             rows_waiting=self.log.waiting if trouble else 0, rows_lost=self.log.rows_lost,
                             failures=self.log.failures,
                             recording_trouble=self._recording.trouble if self._recording is not None else "",
                             room_bytes=self._space.room_bytes, exported_removed=self._space.exported_removed,
                             dumps_lost=self._space.dumps_lost, notices=self._shown_notices())

    def _begin(self) -> SegmentLog:
        self._notices.clear()
        put_aside_before = names_set_aside(self._directory)
        for repaired in repair(self._directory, self._files, self._warn):
            if repaired.problem:
                self._warn(f"{repaired.words}; it stays as it is until the next start")
            else:
                log.info("%s", repaired.words)
        repair_recordings(self._directory, self._files, self._warn)
        session = next_session(self._directory, self._files, self._warn)
        if put_aside_before:
            self._notices.append(f"put aside at an earlier start: {', '.join(put_aside_before[:SHOWN_NOTICES])}")
        return SegmentLog(self._directory, session, self._facts, self._max_file_bytes, self._files, self._more)

    def _warn(self, words: str) -> None:
        """For the status, and once for the journal: while no session can begin it is tried over and over."""
        self._notices.append(words)
        if words not in self._warned:
            self._warned.add(words)
            log.warning("%s", words)

    def _shown_notices(self) -> tuple[str, ...]:
        more = len(self._notices) - SHOWN_NOTICES
        rest = (f"and {more} more, see journalctl -u ridelog",) if more > 0 else ()
        return (*self._notices[:SHOWN_NOTICES], *rest)

    def _look(self) -> None:
        try:
            self._space.look()
        except OSError as error:
            log.warning("room for logs: %s", error)
