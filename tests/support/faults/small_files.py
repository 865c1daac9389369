"""Small files in the folder of logs that cannot be read, removed or renamed, or that are no files, at the start."""

from __future__ import annotations

import errno
import os
import signal
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from itertools import product
from pathlib import Path
from typing import BinaryIO, cast
from unittest.mock import patch

from drivers.disk import FileSystem
from logger.records import WindowRecord
from logger.service.storage import Storage
from logger.store.log.disk_quota import QuotaLimits
from logger.store.log.log_writer import SegmentLog
from logger.store.log.row_format import read_log
from logger.store.log.sidecar import ClockMap

from .crashes import FACTS, HEADER, OFFSET_US, event_of, problems, window
from .disk_models import RefusingFiles
from .trials import Found, Hazard, found

ROOM = QuotaLimits(10**9, 0)
SESSION = 2
ROWS = 6
OPEN_PART = f"{SESSION:05d}-002.csv.part"
NAMES = (
    "last-session", "last-session.tmp", "00002-001.json", "00002-001.json.tmp", "00002-001.csv.tmp", "00002-002.json",
    "00002-002.json.tmp", "00002-002.csv.tmp", "00002-002.csv", OPEN_PART, "00001-001.json", "00001-009.json",
    "00002.dump.gz.part", "exported-marks", "exported.lock", "logger-id",
)
"""Each small file of the folder, and files that are open."""


class DeadFile(RefusingFiles):
    """A disk that takes everything, but for one name: what is done to that fails. ``hits`` counts it."""

    def __init__(self, name: str, kinds: tuple[str, ...], error: int) -> None:
        super().__init__()
        self.name = name
        self.kinds = kinds
        self.error = error
        self.hits = 0

    def _touch(self, kind: str, *paths: Path) -> None:
        if kind in self.kinds and any(path.name == self.name and os.path.lexists(path) for path in paths):
            self.hits += 1
            first, second = (*map(str, paths), None)[:2]
            raise OSError(self.error, os.strerror(self.error), first, None, second)

    def open(self, path: Path) -> BinaryIO:
        self._touch("open", path)
        file = super().open(path)
        return cast(BinaryIO, _Unreadable(file, self, path)) if path.name == self.name else file

    def create(self, path: Path, new: bool = False) -> int:
        self._touch("create", path)
        return super().create(path, new)

    def cut(self, path: Path, size: int) -> None:
        self._touch("create", path)
        super().cut(path, size)

    def rename(self, source: Path, target: Path) -> None:
        self._touch("rename", source, target)
        super().rename(source, target)

    def remove(self, path: Path) -> None:
        self._touch("remove", path)
        super().remove(path)


class _Unreadable:
    """A file that was opened and does not give its bytes."""

    def __init__(self, file: BinaryIO, disk: DeadFile, path: Path) -> None:
        self._file, self._disk, self._path = file, disk, path

    def __enter__(self) -> _Unreadable:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def __getattr__(self, name: str) -> object:
        if name.startswith("read"):
            self._disk._touch("read", self._path)
        return getattr(self._file, name)


def left_by_a_kill(folder: Path) -> None:
    """A finished session, and one of which the second part is open; counter, a dump, what an export leaves."""
    folder.mkdir()
    files = RefusingFiles()
    first = Storage(folder, FACTS, 10**6, None, ROOM, lambda: 0, files)
    first.log.append(window(1, utc=True))
    first.close()
    killed = Storage(folder, FACTS, 10**6, HEADER, ROOM, lambda: 0, files)
    for segment in range(1, ROWS + 1):
        killed.log.append(window(segment, utc=False))
        killed.record(event_of(segment))
        if segment == 2:
            killed.log.rotate()
    killed.sync()
    part = cast(SegmentLog, killed.log._log)  # the process ends here; its clock had reached the open part alone
    part._without_utc.clear()
    part.set_clock_map(ClockMap(OFFSET_US))
    for name in NAMES:
        if not (folder / name).exists() and name not in ("00002-002.csv", "00001-009.json"):
            (folder / name).write_bytes(b"half")
    (folder / "00001-009.json").write_bytes((folder / "00002-002.json").read_bytes())


def _folder(path: Path) -> None:
    path.mkdir()
    (path / "inside").write_text("?")


THINGS: dict[str, Callable[[Path], None]] = {
    "folder": Path.mkdir,
    "full folder": _folder,
    "pipe": os.mkfifo,
    "link to nothing": lambda path: path.symlink_to("nowhere"),
    "link to itself": lambda path: path.symlink_to(path.name),
}
FAULTS: dict[str, tuple[tuple[str, ...], int]] = {
    **{f"EIO on {kind}": ((kind,), errno.EIO) for kind in ("open", "read", "remove", "rename", "create")},
    "EIO on all": (("open", "read", "remove", "rename", "create"), errno.EIO),
    "no permission": (("open", "create"), errno.EACCES),
    "dead inode": (("open", "read", "remove", "rename", "create", "stat"), errno.EUCLEAN),
}


def start_beside(folder: Path, case: tuple[str, str]) -> Found:
    """The service starts in a folder in which one name is bad, writes, ends, and starts again on a sound disk."""
    with at_most_s(10):
        return _start_beside(folder, *case)


@contextmanager
def at_most_s(seconds: int) -> Iterator[None]:
    """What waits for longer is broken: nobody writes to the pipes of these trials."""
    def broken(*_: object) -> None:
        raise AssertionError(f"hangs for {seconds} s")

    before = signal.signal(signal.SIGALRM, broken)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def not_even_looked_at(name: str) -> Iterator[None]:
    """The system does not say what has this name."""
    look = Path.stat

    def stat(path: Path, *, follow_symlinks: bool = True) -> os.stat_result:
        if path.name == name:
            raise OSError(errno.EUCLEAN, os.strerror(errno.EUCLEAN), str(path))
        return look(path, follow_symlinks=follow_symlinks)

    with patch.object(Path, "stat", stat):
        yield


def _start_beside(folder: Path, name: str, fault: str) -> Found:
    folder = folder / "log"
    left_by_a_kill(folder)
    files: FileSystem = RefusingFiles()
    if fault in THINGS:
        replace_by(folder / name, THINGS[fault])
    else:
        if not os.path.lexists(folder / name):
            (folder / name).write_bytes(b"half")
        files = DeadFile(name, *FAULTS[fault])
    taken = {path.name[:5] for path in folder.iterdir()}
    with not_even_looked_at(name) if "stat" in FAULTS.get(fault, ((),))[0] else nullcontext():
        storage = Storage(folder, FACTS, 10**6, HEADER, ROOM, lambda: 0, files)
    status = storage.status()
    assert status.trouble == "", f"no session begins: {status.trouble}"
    assert status.room_bytes > 0
    assert storage.log.session is not None
    assert f"{storage.log.session:05d}" not in taken, "a session number was given twice"
    storage.log.append(window(1, utc=True))
    storage.sync()
    assert [record.segment for record in read_log(folder / str(storage.log.file_name)).records] == [1]
    was_hit = isinstance(files, DeadFile) and files.hits
    stays = [path.name for path in folder.iterdir() if path.name.startswith(f"{name}.aside")]
    stays += [name] if fault in THINGS and not is_file(folder / name) and os.path.lexists(folder / name) else []
    if (was_hit or stays) and not name.startswith(("exported", "logger")):  # those belong to the export
        assert any(name in words for words in status.notices), f"not named: {status.notices}"
    storage.close()
    Storage(folder, FACTS, 10**6, None, ROOM, lambda: 0, RefusingFiles()).close()
    if name != OPEN_PART or fault not in THINGS:  # there the rows themselves were replaced
        rows = rows_of(folder)
        assert [record.segment for record in rows] == list(range(1, ROWS + 1)), f"rows: {len(rows)}"
        assert all(record.utc_us in (None, record.t_us + OFFSET_US) for record in rows)
        lost = ["sidecar: expected 00001-001.json beside it; it is missing"] if name == "00001-001.json" else []
        assert problems(folder) in ([], lost), problems(folder)
    return found(asides=len(stays))


def rows_of(folder: Path) -> list[WindowRecord]:
    """The rows of the session that was killed."""
    logs = sorted(path for path in folder.glob(f"{SESSION:05d}-*.csv*") if path.suffix in (".csv", ".part"))
    return [record for log in logs if is_file(log) for record in read_log(log).records]


def replace_by(path: Path, make: Callable[[Path], None]) -> None:
    """Something else under the name of a file."""
    path.unlink(missing_ok=True)
    make(path)


def is_file(path: Path) -> bool:
    """A regular file, and no link to one."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except FileNotFoundError:
        return False


HAZARDS = (
    Hazard("small file that cannot be read, removed or replaced", f"each of {len(NAMES)} names in the folder of a "
           "killed service: EIO on opening, reading, removing, renaming or writing it, or on all; no permission; "
           "an inode that cannot even be looked at; a folder, a pipe, a link to nothing or to itself in its place",
           "a new session begins and takes rows, under a number that was not used; what is in the way gets another "
           "name or is skipped, and `status` names it; no row of the session before is lost, and on a sound disk "
           "the folder passes `ridelog verify`", "{asides.total:.0f} put aside", start_beside,
           tuple(product(NAMES, (*THINGS, *FAULTS)))),
)
