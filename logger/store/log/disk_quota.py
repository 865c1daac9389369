"""Room on the disk: what goes when it runs short, and in which order.

Problem. A card is shared with the system that runs the logger, and nobody looks at it for months. Something has to give
way before the disk is full, and what cannot be brought back must not be what goes first.

Solution. Room is what may still be written: up to the quota of the folder and down to the floor of free space. When it
falls below a reserve, in this order and only as far as needed:

1. the oldest exported files go, logs and dumps alike: a copy of them lies on a stick;
2. no new raw bytes are recorded: the reserve belongs to the logs;
3. when the reserve is used up too, the oldest dumps go that were not exported, each with a warning and counted;
4. then nothing is written any more. A log that was not exported is never removed: its drive cannot be driven again,
   while the drive that is not recorded now is reported by ``ridelog status`` and can. The reserve holds the rows of
   some 1,500 km, so a car whose logs are collected once a season never gets there.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from drivers.disk import FileSystem
from logger.store.log.dump_recording import ENDING
from logger.store.log.log_name import OwnFile
from logger.store.log.quarantine import READ_ONLY, file_size, is_file, is_taken

RESERVE_BYTES = 50_000_000
STEP_BYTES = 5_000_000
"""When the reserve is down to this, dumps go; when logs were stopped they go on above it."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class QuotaLimits:
    """quota_bytes    most bytes in the folder of the logs; None: no limit
    floor_bytes      free space on its disk that is left to others
    """

    quota_bytes: int | None = None
    floor_bytes: int = 200_000_000


@dataclass(frozen=True)
class _Kept:
    """A finished log with its sidecar, or a dump: names in the order of their removal, bytes, whether a stick holds it
    too. The log goes first: a sidecar that a cut leaves alone is exported as well, and goes when room is made again."""

    paths: tuple[Path, ...]
    size_bytes: int
    is_dump: bool
    is_exported: bool


class DiskQuota:
    """Looks after the room for one folder.

    exported     gives the names of the files that lie on a stick

    room_bytes         what may still be written, as of the last look; may be negative
    exported_removed, dumps_lost    files removed to make room: exported ones, and dumps that were not
    """

    def __init__(self, directory: Path, limits: QuotaLimits, exported: Callable[[Path], set[str]],
                 files: FileSystem) -> None:
        self._directory = directory
        self._limits = limits
        self._exported = exported
        self._files = files
        self._logs_held = False
        self._dumps_held = False
        self._read_only = False
        self.room_bytes = 0
        self.exported_removed = 0
        self.dumps_lost = 0

    def look(self) -> None:
        """Measure the room and make some where it is short. Raises ``OSError`` for a disk that fails."""
        # An emergency makes disks read-only under open files: what is written to those is taken, and kept nowhere.
        self._read_only = self._files.is_read_only(self._directory)
        self.room_bytes = self._measure()
        if self.room_bytes < RESERVE_BYTES:
            kept = self._kept()
            self._make_room(2 * RESERVE_BYTES, [file for file in kept if file.is_exported])
            if self.room_bytes < STEP_BYTES:
                self._make_room(2 * STEP_BYTES, [file for file in kept if file.is_dump and not file.is_exported])
        self._dumps_held = self.room_bytes < (2 if self._dumps_held else 1) * RESERVE_BYTES
        self._logs_held = self.room_bytes < (STEP_BYTES if self._logs_held else 0)

    @property
    def why_no_dumps(self) -> str:
        """Why no raw bytes may be recorded; empty: they may."""
        if self._read_only:
            return READ_ONLY
        return "little room is left, and it is kept for the logs" if self._dumps_held else ""

    @property
    def why_no_logs(self) -> str:
        """Why no rows may be written; empty: they may."""
        if self._read_only:
            return READ_ONLY
        return "no room is left, and nothing that could be removed" if self._logs_held else ""

    def _measure(self) -> int:
        room = self._files.free_bytes(self._directory) - self._limits.floor_bytes
        if self._limits.quota_bytes is not None:
            used = sum(file_size(path) or 0 for path in self._directory.iterdir())
            room = min(room, self._limits.quota_bytes - used)
        return room

    def _kept(self) -> list[_Kept]:
        """The finished files, oldest first."""
        exported = self._exported(self._directory)
        found = []
        for path in self._directory.iterdir():
            own = OwnFile.of(path.name)
            if own is None or own.is_open or not is_file(path) or (own.kind == ".json" and not self._is_alone(path)):
                continue
            is_dump = own.kind == ENDING
            sidecar = path.with_suffix(".json")
            paths = (path, sidecar) if own.kind == ".csv" and is_taken(sidecar) else (path,)
            size_bytes = sum(file_size(each) or 0 for each in paths)
            is_exported = all(each.name in exported for each in paths)
            found.append((own.session, own.part, _Kept(paths, size_bytes, is_dump, is_exported)))
        return [kept for *_, kept in sorted(found, key=lambda entry: entry[:2])]

    @staticmethod
    def _is_alone(sidecar: Path) -> bool:
        return not any(is_taken(sidecar.with_suffix(ending)) for ending in (".csv", ".csv.part"))

    def _make_room(self, goal_bytes: int, files: list[_Kept]) -> None:
        for kept in files:
            if self.room_bytes >= goal_bytes:
                return
            try:
                for path in kept.paths:
                    self._files.remove(path)
                    self._files.sync_directory(self._directory)
            except OSError as error:
                log.warning("%s cannot be removed to make room: %s", kept.paths[0].name, error)
                continue
            self.room_bytes += kept.size_bytes
            if kept.is_exported:
                self.exported_removed += 1
                log.info("removed %s to make room; it was exported", kept.paths[0].name)
            else:
                self.dumps_lost += 1
                log.warning("removed %s to make room for logs; it was NOT exported", kept.paths[0].name)
