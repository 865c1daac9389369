"""Disks that fail: one that refuses, and one whose power is cut at any instant.

``RefusingFiles`` raises what a full, dying or read-only disk raises, at a chosen change or for as long as it is set to.

``RecordingFiles`` does what it is asked and keeps a journal of it. ``CrashModel`` is what the disk knows after the
first changes of a journal, and gives the folders that it may show when everything ends there:

* what was synced is there. Of each later write every sector of 512 bytes is there or is not, in any combination, the
  last one perhaps up to some byte; where the size of a file ran ahead of its content there are zeros or garbage; or
  some of its bytes are others;
* names that were not synced (new, renamed, removed) are there up to some point in their order, as in a journal, or
  each by itself; a rename happens or does not;
* when only the process is killed, everything is there.
"""

from __future__ import annotations

import errno
import os
import random
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path

from drivers.disk import FileSystem

SECTOR = 512


class Refusing(FileSystem):
    """A disk that refuses changes with ``error`` while ``refuses`` says so of their kind (``write``, ``sync`` ...).

    A write that is refused has left its first half.
    """

    error = errno.EIO
    refused = 0
    refuses: Callable[[str], bool] = staticmethod(lambda kind: False)

    def _ask(self, kind: str) -> None:
        if self.refuses(kind):
            self.refused += 1
            raise OSError(self.error, os.strerror(self.error))

    def create(self, path: Path, new: bool = False) -> int:
        self._ask("create")
        return super().create(path, new)

    def write(self, descriptor: int, data: bytes) -> None:
        try:
            self._ask("write")
        except OSError:
            super().write(descriptor, data[: len(data) // 2])
            raise
        super().write(descriptor, data)

    def sync(self, descriptor: int) -> None:
        self._ask("sync")
        super().sync(descriptor)

    def rename(self, source: Path, target: Path) -> None:
        self._ask("rename")
        super().rename(source, target)

    def remove(self, path: Path) -> None:
        self._ask("remove")
        super().remove(path)

    def sync_directory(self, directory: Path) -> None:
        self._ask("sync_directory")
        super().sync_directory(directory)


class RefusingFiles(Refusing):
    """The same, which refuses to close and to cut as well. Nothing waits for the disk."""

    def sync(self, descriptor: int) -> None:
        self._ask("sync")

    def close(self, descriptor: int) -> None:
        super().close(descriptor)
        self._ask("close")

    def cut(self, path: Path, size: int) -> None:
        self._ask("cut")
        os.truncate(path, size)

    def sync_directory(self, directory: Path) -> None:
        self._ask("sync_directory")


@dataclass(frozen=True)
class Change:
    """One entry of the journal. ``kind`` is that of the method; ``note`` what was promised when it was made."""

    kind: str
    file: int = -1
    data: bytes = b""
    size: int = 0
    names: tuple[tuple[str, int | None], ...] = ()
    note: object = None


class RecordingFiles(FileSystem):
    """The disk as it is, with a journal instead of waiting for it. One folder; ``before`` is what the disk knew of the
    files that are there, None: everything."""

    def __init__(self, folder: Path, before: CrashModel | None = None) -> None:
        self.journal: list[Change] = []
        self.before = before or CrashModel.of(folder)
        self._names = dict(self.before.names())
        self._count = max(self.before.inodes, default=-1) + 1
        self._open: dict[int, int] = {}
        self.note: Callable[[], object] = lambda: None

    def _log(self, kind: str, file: int = -1, data: bytes = b"", size: int = 0,
             names: tuple[tuple[str, int | None], ...] = ()) -> None:
        self.journal.append(Change(kind, file, data, size, names, self.note()))

    def create(self, path: Path, new: bool = False) -> int:
        descriptor = super().create(path, new)
        if path.name in self._names:
            self._log("cut", self._names[path.name])
        else:
            self._names[path.name] = self._count
            self._log("names", names=((path.name, self._count),))
            self._count += 1
        self._open[descriptor] = self._names[path.name]
        return descriptor

    def write(self, descriptor: int, data: bytes) -> None:
        super().write(descriptor, data)
        self._log("write", self._open[descriptor], bytes(data))

    def sync(self, descriptor: int) -> None:
        self._log("sync", self._open[descriptor])

    def close(self, descriptor: int) -> None:
        super().close(descriptor)
        del self._open[descriptor]

    def cut(self, path: Path, size: int) -> None:
        os.truncate(path, size)
        self._log("cut", self._names[path.name], size=size)
        self._log("sync", self._names[path.name])

    def rename(self, source: Path, target: Path) -> None:
        super().rename(source, target)
        file = self._names.pop(source.name)
        self._names[target.name] = file
        self._log("names", names=((source.name, None), (target.name, file)))

    def remove(self, path: Path) -> None:
        super().remove(path)
        if self._names.pop(path.name, None) is not None:
            self._log("names", names=((path.name, None),))

    def sync_directory(self, directory: Path) -> None:
        self._log("sync_names")


class RefusingJournal(Refusing, RecordingFiles):
    """A disk with a journal that refuses changes. Half of a write that is refused is done all the same."""


@dataclass
class _Inode:
    """Content that is on the disk for sure, and the content that the system shows."""

    sure: bytes = b""
    whole: bytes = b""


@dataclass
class CrashModel:
    """What a disk knows: its files, the names that are there for sure, and the changes of names since."""

    inodes: dict[int, _Inode]
    sure_names: dict[str, int]
    later_names: list[tuple[tuple[str, int | None], ...]]

    @classmethod
    def of(cls, folder: Path) -> CrashModel:
        """Everything in the folder is on the disk."""
        contents = {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
        names = {name: number for number, name in enumerate(contents)}
        return cls({names[name]: _Inode(data, data) for name, data in contents.items()}, names, [])

    @classmethod
    def after(cls, files: RecordingFiles, count: int) -> CrashModel:
        """The state after ``count`` changes."""
        model = deepcopy(files.before)
        for change in files.journal[:count]:
            model._take(change)
        return model

    def names(self) -> dict[str, int]:
        """The names as the system shows them."""
        names = dict(self.sure_names)
        for change in self.later_names:
            _apply(names, change)
        return names

    def _take(self, change: Change) -> None:
        if change.kind == "names":
            self.later_names.append(change.names)
            for _, number in change.names:
                if number is not None:
                    self.inodes.setdefault(number, _Inode())
        elif change.kind == "sync_names":
            self.sure_names = self.names()
            self.later_names.clear()
        else:
            inode = self.inodes[change.file]
            if change.kind == "write":
                inode.whole += change.data
            elif change.kind == "cut":
                inode.whole = inode.whole[: change.size]
                inode.sure = inode.sure[: change.size]  # what is cut off is never needed again
            else:
                inode.sure = inode.whole

    def killed(self) -> dict[str, bytes]:
        """The folder when only the process ended: everything is there."""
        return {name: self.inodes[number].whole for name, number in self.names().items()}

    def powerless(self, rng: random.Random) -> dict[str, bytes]:
        """One of the folders that may be there after the power went."""
        names = dict(self.sure_names)
        in_order = rng.random() < 0.6
        upto = rng.randint(0, len(self.later_names))
        for place, change in enumerate(self.later_names):
            if place < upto if in_order else rng.random() < 0.5:
                _apply(names, change)
        contents = {number: _torn(self.inodes[number], rng) for number in set(names.values())}
        return {name: contents[number] for name, number in names.items()}


def _apply(names: dict[str, int], change: tuple[tuple[str, int | None], ...]) -> None:
    for name, number in change:
        if number is None:
            names.pop(name, None)
        else:
            names[name] = number


def _torn(inode: _Inode, rng: random.Random) -> bytes:
    """The synced content, with some of what came later."""
    whole, sure = inode.whole, inode.sure
    fate = rng.randrange(7)
    if fate == 0 or len(whole) <= len(sure):
        return sure
    if fate == 1:
        return whole
    if fate == 2:  # the size reached the disk up to some byte, and the content with it
        return whole[: rng.randint(len(sure), len(whole))]
    if fate == 3:  # a digit here and there came out as another one
        late = bytearray(whole)
        for place in rng.choices(range(len(sure), len(whole)), k=3):
            late[place] = rng.choice(b"0123456789")
        return bytes(late)
    length = len(whole) if fate < 6 else rng.randint(len(sure), len(whole))
    filler = bytes(length) if fate != 5 else rng.randbytes(length)
    content = bytearray(sure + filler[len(sure):])
    for sector in range(len(sure) // SECTOR, (length + SECTOR - 1) // SECTOR):
        if rng.random() < 0.5:
            begin, end = max(sector * SECTOR, len(sure)), min((sector + 1) * SECTOR, length)
            content[begin:end] = whole[begin:end]
    return bytes(content)


def lay_out(folder: Path, image: dict[str, bytes]) -> Path:
    """Make a new folder with these files."""
    folder.mkdir()
    for name, data in image.items():
        (folder / name).write_bytes(data)
    return folder
