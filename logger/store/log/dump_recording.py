"""The raw dumps of the service: a file per session, more only where the disk or its room interrupts.

Problem. A dump is bigger than all logs together and worth less: it must never stop the service, nor take the room of
the logs. The power ends most of them in the middle of a block.

Solution. A dump is called ``<session>[-<number>].dump.gz.part`` while it is written and loses the ``.part`` when it is
ended. ``DumpRecording`` lets go of a file that the disk refuses and begins another later; what is promised of a file is
what was flushed before. ``repair_recordings`` cuts the dumps that were left open back to the last block that fits its
check value.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from drivers.disk import FileSystem
from drivers.dump import DumpHeader, DumpWriter, Event, intact_bytes
from logger.store.log.atomic_file import Warn, disk_words, is_file, set_aside_if_possible, warn_in_journal
from logger.store.log.log_name import OwnFile
from logger.units import US_PER_S

ENDING = ".dump.gz"
RETRY_US = 60 * US_PER_S
log = logging.getLogger(__name__)


class DumpRecording:
    """Events in, whatever the disk does.

    session    number of the session, None as long as there is none; nothing is recorded before

    trouble    why nothing is recorded at the moment; empty: all is well
    """

    def __init__(self, directory: Path, header: DumpHeader, session: Callable[[], int | None],
                 now_us: Callable[[], int], files: FileSystem) -> None:
        self._directory = directory
        self._header = header
        self._session = session
        self._now_us = now_us
        self._files = files
        self._writer: DumpWriter | None = None
        self._path = directory
        self._number = 1
        self._holds_events = False
        self._held = ""
        self._retry_us = 0
        self.trouble = ""
        self.tend()

    def write(self, event: Event) -> None:
        """Add an event."""
        self._try(lambda writer: writer.write(event))

    def flush(self) -> None:
        """Wait until everything so far is on the disk."""
        self._try(lambda writer: writer.flush(sync=True))
        self._holds_events = self._writer is not None

    def hold(self, why: str) -> None:
        """Record nothing more until called with an empty ``why``: there is no room that may be used."""
        if why and not self._held:
            self.close()
            log.warning("recording stopped: %s", why)
        if why or self._held:
            self.trouble, self._retry_us = why, 0
        self._held = why

    def tend(self) -> None:
        """To be called now and then: begins a file when there is none and it is time."""
        session = self._session()
        if self._writer is not None or self._held or session is None or self._now_us() < self._retry_us:
            return
        suffix = "" if self._number == 1 else f"-{self._number:03d}"
        self._path = self._directory / f"{session:05d}{suffix}{ENDING}.part"
        self._holds_events = False
        try:
            self._writer = DumpWriter(self._path, self._header, self._files)
            self.trouble = ""
        except OSError as error:
            self._fail(error)
            self._leave()

    def close(self) -> None:
        """End the file."""
        self._try(DumpWriter.close)
        if self._writer is not None:
            self._writer = None
            self._number += 1
            try:
                _finish(self._files, self._path)
            except OSError as error:
                self._fail(error)

    def _try(self, act: Callable[[DumpWriter], None]) -> None:
        if self._writer is None:
            return
        try:
            act(self._writer)
        except OSError as error:
            self._writer.abandon()
            self._writer = None
            self._fail(error)
            self._leave()

    def _leave(self) -> None:
        """The next file gets another name. One without events goes: a disk that refuses for a day would leave a file
        for each minute of it."""
        if not self._holds_events:
            try:
                self._files.remove(self._path)
            except OSError:
                pass
            else:
                return
        self._number += 1

    def _fail(self, error: OSError) -> None:
        why = disk_words(error)
        if why != self.trouble:
            log.error("recording stopped: %s", why)
        self.trouble = why
        self._retry_us = self._now_us() + RETRY_US


def repair_recordings(directory: Path, files: FileSystem, warn: Warn = warn_in_journal) -> None:
    """End the dumps that were left open, at the last block that is intact; one without any goes.

    A file on which the disk fails is left as it is, and named.
    """
    for part in sorted(path for path in directory.iterdir()
                       if (own := OwnFile.of(path.name)) and own.is_open and own.kind == ENDING):
        try:
            size = intact_bytes(part, files)
            if size:
                files.cut(part, size)
                _finish(files, part)
            else:
                files.remove(part)
        except OSError as error:
            if not is_file(part):
                set_aside_if_possible(files, part, disk_words(error), warn)
            else:
                warn(f"{part.name}: {disk_words(error)}; it stays as it is until the next start")


def _finish(files: FileSystem, part: Path) -> None:
    files.rename(part, part.with_name(part.name.removesuffix(".part")))
    files.sync_directory(part.parent)
