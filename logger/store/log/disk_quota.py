"""The disk under a folder of logs: which one it is, recordings on it, and what goes when room runs short."""

import logging
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from drivers.disk import FileSystem
from drivers.dump import DumpHeader, DumpWriter, Event, intact_bytes
from logger.store.log import atomic_file
from logger.store.log.log_name import OwnFile
from logger.store.log.log_writer import LONGEST_WAIT_US

ENDING = ".dump.gz"
log = logging.getLogger(__name__)


class DumpRecording:
    """Events in, whatever the disk does.

    Problem. A dump is bigger than all logs together and worth less: it must never stop the service, nor take the room
    of the logs. The power ends most of them in the middle of a block.

    Solution. A dump is called ``<session>[-<number>].dump.gz.part`` while it is written and loses the ``.part`` when it
    is ended. ``DumpRecording`` lets go of a file that the disk refuses and begins another later; what is promised of a
    file is what was flushed before. ``repair_recordings`` cuts the dumps that were left open back to the last block
    that fits its check value.

    session    number of the session, None as long as there is none; nothing is recorded before

    trouble    why nothing is recorded at the moment; empty: all is well
    """

    def __init__(self, directory: Path, header: DumpHeader, session: Callable[[], int | None],
                 now_us: Callable[[], int], files: FileSystem) -> None:
        self._directory, self._header, self._session, self._now_us = directory, header, session, now_us
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
        """The next file gets another name. One without events goes: a disk may refuse each minute for a day."""
        if not self._holds_events:
            try:
                self._files.remove(self._path)
            except OSError:
                pass
            else:
                return
        self._number += 1

    def _fail(self, error: OSError) -> None:
        why = atomic_file.disk_words(error)
        if why != self.trouble:
            log.error("recording stopped: %s", why)
        self.trouble = why
        self._retry_us = self._now_us() + LONGEST_WAIT_US


def repair_recordings(directory: Path, files: FileSystem, warn: atomic_file.Warn = atomic_file.warn_in_journal) -> None:
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
            if not atomic_file.is_file(part):
                atomic_file.set_aside_if_possible(files, part, atomic_file.disk_words(error), warn)
            else:
                warn(f"{part.name}: {atomic_file.disk_words(error)}; it stays as it is until the next start")


def _finish(files: FileSystem, part: Path) -> None:
    files.rename(part, part.with_name(part.name.removesuffix(".part")))
    files.sync_directory(part.parent)


MOUNTS = Path("/proc/self/mountinfo")
BLOCK_DEVICES = Path("/sys/dev/block")
_IN_MEMORY = ("tmpfs", "ramfs", "rootfs")
_OVERLAYS = ("overlay", "overlayfs", "fuse.fuse-overlayfs")
_MEMORY_DISK = re.compile(r"(zram|ram)\d+")
_OCTAL = re.compile(r"\\([0-7]{3})")


@dataclass(frozen=True)
class Mount:
    """A line of the table: where it is mounted, the kind of file system, its device or name, and its upper folder where
    it is an overlay; empty: it has none."""

    point: Path
    kind: str
    source: str
    upper: str


def all_mounts() -> list[Mount]:
    """The table, in the order of mounting; empty where it cannot be read."""
    try:
        lines = MOUNTS.read_text("utf-8", "surrogateescape").splitlines()
    except OSError:
        return []
    return [mount for line in lines if (mount := _mount(line)) is not None]


def mount_of(folder: Path, mounts: Sequence[Mount]) -> Mount | None:
    """The mount that holds a folder, or would if it were made; None where the table does not say it."""
    place = folder.resolve()
    holding = [mount for mount in mounts if place.is_relative_to(mount.point)]
    longest = max((len(mount.point.parts) for mount in holding), default=0)
    return next((mount for mount in reversed(holding) if len(mount.point.parts) == longest), None)


def are_on_one_disk(one: Path, other: Path) -> bool:
    """Whether two folders lie on one file system, by whatever path, or on one disk. Raises ``OSError``."""
    devices = [folder.stat().st_dev for folder in (one, other)]
    if devices[0] == devices[1]:
        return True
    mounts = all_mounts()
    disks = [_disk(device, mount_of(folder, mounts)) for device, folder in zip(devices, (one, other), strict=True)]
    return disks[0] is not None and disks[0] == disks[1]


def why_in_memory(folder: Path) -> str:
    """In words, why what lies in a folder is lost with the power; empty: it lies on a disk, as far as is known.

    Problem. What is written to memory is gone with the power, and a copy on the disk that holds the original saves
    nothing; neither shows in a path. Solution. The kernel's table of mounts and its tree of block devices are asked.

    Sources: Linux, Documentation/filesystems/proc.rst (3.5, mountinfo), overlayfs.rst (statfs and options),
    Documentation/ABI/testing/sysfs-block.
    """
    mounts = all_mounts()
    mount = mount_of(folder, mounts)
    return _why(mount, mounts) if mount is not None else ""


def memory_notice(folder: Path) -> str:
    """The same for a person, with what to do about it; empty: nothing has to be done."""
    if not (why := why_in_memory(folder)):
        return ""
    return (f"logs: {folder} lies in memory ({why}): every drive is lost when the power goes. Name a folder on a disk "
            "in log.directory, or switch the Overlay File System off (sudo raspi-config, Performance Options)")


def _why(mount: Mount, mounts: Sequence[Mount]) -> str:
    if mount.kind in _IN_MEMORY:
        return f"{mount.point} is a {mount.kind}, a file system in memory"
    if mount.kind in _OVERLAYS:
        in_memory = _keeps_in_memory(mount, mounts)
        return f"{mount.point} is an overlay whose changes are kept in memory" if in_memory else ""
    if _MEMORY_DISK.fullmatch(name := Path(mount.source).resolve().name):
        return f"{mount.point} is on {name}, a disk in memory"
    return ""


def _keeps_in_memory(overlay: Mount, mounts: Sequence[Mount]) -> bool:
    """Whether an overlay's upper folder lies in memory. Its path is that of whoever mounted it and may lead nowhere
    here; then the room tells, which is that of the upper folder: it is that of a file system that is known, or, as no
    disk is so small, not more than there is memory."""
    upper = Path(overlay.upper)
    if upper.is_absolute() and upper.is_dir():
        mount = mount_of(upper, mounts)
        return mount is not None and mount != overlay and bool(_why(mount, mounts))
    room = _room(overlay)
    if room is None:
        return False
    for mount in mounts:
        if mount.kind not in _OVERLAYS and _room(mount) == room:
            return bool(_why(mount, mounts))
    return room[0] * room[1] <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _room(mount: Mount) -> tuple[int, int, int] | None:
    """Size of a block, how many, and of how many files; None where it has none or cannot be asked."""
    try:
        said = os.statvfs(mount.point)
    except OSError:
        return None
    return (said.f_frsize, said.f_blocks, said.f_files) if said.f_blocks else None


def _disk(device: int, mount: Mount | None) -> Path | None:
    """The disk of a device number; of a file system of several devices, that of what is mounted."""
    for number in (device, _device_of(mount)):
        place = (BLOCK_DEVICES / f"{os.major(number)}:{os.minor(number)}").resolve()
        if place.is_dir():
            return place.parent if (place / "partition").exists() else place
    return None


def _device_of(mount: Mount | None) -> int:
    try:
        return Path(mount.source).stat().st_rdev if mount is not None and mount.source.startswith("/") else 0
    except OSError:
        return 0


def _mount(line: str) -> Mount | None:
    before, _, after = line.partition(" - ")
    fields, said = before.split(" "), after.split(" ")
    if len(fields) < 6 or len(said) < 3:
        return None
    options = dict(option.partition("=")[::2] for option in said[2].split(","))
    return Mount(Path(_plain(fields[4])), said[0], _plain(said[1]), _plain(options.get("upperdir", "")))


def _plain(text: str) -> str:
    """A field of the table, in which space, tab, line end and backslash stand as octal numbers."""
    return _OCTAL.sub(lambda match: chr(int(match[1], 8)), text)


RESERVE_BYTES = 50_000_000
STEP_BYTES = 5_000_000  # When the reserve is down to this, dumps go; when logs were stopped they go on above it



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

    Problem. A card is shared with the system that runs the logger, and nobody looks at it for months. Something has to
    give way before the disk is full, and what cannot be brought back must not be what goes first.

    Solution. Room is what may still be written: up to the quota of the folder and down to the floor of free space. When
    it falls below a reserve, in this order and only as far as needed:

    1. the oldest exported files go, logs and dumps alike: a copy of them lies on a stick;
    2. no new raw bytes are recorded: the reserve belongs to the logs;
    3. when the reserve is used up too, the oldest dumps go that were not exported, each with a warning and counted;
    4. then nothing is written any more. A log that was not exported is never removed: its drive cannot be driven again,
       while the drive that is not recorded now is reported by ``ridelog status`` and can. The reserve holds the rows of
       some 1,500 km, so a car whose logs are collected once a season never gets there.

    exported     gives the names of the files that lie on a stick

    room_bytes         what may still be written, as of the last look; may be negative
    exported_removed, dumps_lost    files removed to make room: exported ones, and dumps that were not
    """

    def __init__(self, directory: Path, limits: QuotaLimits, exported: Callable[[Path], set[str]],
                 files: FileSystem) -> None:
        self._directory, self._limits, self._exported, self._files = directory, limits, exported, files
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
            return atomic_file.READ_ONLY
        return "the little room left is kept for the logs" if self._dumps_held else ""

    @property
    def why_no_logs(self) -> str:
        """Why no rows may be written; empty: they may."""
        if self._read_only:
            return atomic_file.READ_ONLY
        return "no room is left, and nothing can be removed" if self._logs_held else ""

    def _measure(self) -> int:
        room = self._files.free_bytes(self._directory) - self._limits.floor_bytes
        if self._limits.quota_bytes is not None:
            used = sum(atomic_file.file_size(path) or 0 for path in self._directory.iterdir())
            room = min(room, self._limits.quota_bytes - used)
        return room

    def _kept(self) -> list[_Kept]:
        """The finished files, oldest first."""
        exported = self._exported(self._directory)
        found = []
        for path in self._directory.iterdir():
            own = OwnFile.of(path.name)
            if own is None or own.is_open or not atomic_file.is_file(path):
                continue
            if own.kind == ".json" and any(atomic_file.is_taken(path.with_suffix(ending))
                                           for ending in (".csv", ".csv.part")):
                continue
            is_dump = own.kind == ENDING
            sidecar = path.with_suffix(".json")
            paths = (path, sidecar) if own.kind == ".csv" and atomic_file.is_taken(sidecar) else (path,)
            size_bytes = sum(atomic_file.file_size(each) or 0 for each in paths)
            is_exported = all(each.name in exported for each in paths)
            found.append((own.session, own.part, _Kept(paths, size_bytes, is_dump, is_exported)))
        return [kept for *_, kept in sorted(found, key=lambda entry: entry[:2])]

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
