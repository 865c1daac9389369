"""A folder that somebody else may have prepared, or may pull out, worked on through its descriptor.

Problem. A stick comes from outside. A name on it may be a link to a file of this machine, a pipe that never answers, or
a folder where a file belongs; and it may be gone at any call. A path would be looked up, and followed, each time.

Solution. The folder is opened once, and every name in it is reached from its descriptor and never followed. Files are
read when they are regular files and not else, and written under a new name that nobody could have guessed. What the
folder's disk refuses is ``OSError`` at the call that it refused.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
import re
import secrets
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

from drivers.disk import check_regular
from logger.store.log.atomic_file import ENDING, numbered

BLOCK_BYTES = 1 << 18
LOCK_NAME = "exported.lock"  # In a folder of logs: who changes what it remembers of its exports holds this file
_TEMPORARY = re.compile(r"[0-9a-f]{16}\.ridelog-tmp")
_DIRECTORY = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
_READ = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
_WRITE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC


class OpenFile:
    """A regular file, open for reading. ``stat`` is what it was when it was opened."""

    def __init__(self, folder: int, name: str) -> None:
        self._descriptor = check_regular(name, os.open(name, _READ, dir_fd=folder))
        try:
            self.stat = os.fstat(self._descriptor)
            # What is read is to come from the medium, not from what this machine remembers of it.
            os.posix_fadvise(self._descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
        except OSError:
            self.close()
            raise

    def blocks(self) -> Iterator[bytes]:
        """The bytes of the file, in blocks."""
        while block := os.read(self._descriptor, BLOCK_BYTES):
            yield block

    def close(self) -> None:
        os.close(self._descriptor)

    def __enter__(self) -> OpenFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


class DirectoryHandle:
    """A folder, held open. The path given first is the caller's own and may be anything; names inside are not
    followed. A context manager that closes it."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    @classmethod
    def at(cls, path: Path) -> DirectoryHandle:
        return cls(os.open(path, _DIRECTORY))

    def inside(self, name: str, make: bool = True) -> DirectoryHandle:
        """The folder of that name in this one, made if ``make``. Raises ``OSError`` for a link or a file."""
        try:
            return DirectoryHandle(os.open(name, _DIRECTORY | os.O_NOFOLLOW, dir_fd=self._descriptor))
        except FileNotFoundError:
            if not make:
                raise
            os.mkdir(name, 0o755, dir_fd=self._descriptor)
            self.sync()
            return DirectoryHandle(os.open(name, _DIRECTORY | os.O_NOFOLLOW, dir_fd=self._descriptor))

    def __enter__(self) -> DirectoryHandle:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        os.close(self._descriptor)

    def lock(self) -> bool:
        """Hold the folder against others who ask for it so, until it is closed; False when another holds it."""
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Wait for others that change what the folder remembers, for the moment that takes them."""
        descriptor = self.open_lock_file(LOCK_NAME)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield
        finally:
            os.close(descriptor)

    def open_lock_file(self, name: str) -> int:
        """Descriptor of a file to lock, made when it is not there; readable is enough, of any owner."""
        self._make_way(name)
        return os.open(name, _READ | os.O_CREAT, 0o644, dir_fd=self._descriptor)

    def _make_way(self, name: str) -> None:
        """Put aside what has the name of a file and is none: a link, a pipe, a folder."""
        found = self.find(name)
        if found is not None and not stat.S_ISREG(found.st_mode):
            free = next(aside.name for aside in numbered(Path(name + ENDING)) if self.find(aside.name) is None)
            os.rename(name, free, src_dir_fd=self._descriptor, dst_dir_fd=self._descriptor)

    def each_name(self) -> Iterator[str]:
        """The names in it, one at a time: a stick may hold more of them than fit the memory. One such walk at once."""
        with os.scandir(self._descriptor) as entries:
            for entry in entries:
                yield entry.name

    def names(self) -> list[str]:
        """The names in it, of a folder that is our own."""
        return list(self.each_name())

    def find(self, name: str) -> os.stat_result | None:
        """What stands under a name, link or not; None: nothing."""
        try:
            return os.stat(name, dir_fd=self._descriptor, follow_symlinks=False)
        except FileNotFoundError:
            return None

    def open(self, name: str) -> OpenFile:
        """A regular file, for reading. Raises ``OSError`` for anything else."""
        return OpenFile(self._descriptor, name)

    def read(self, name: str, max_bytes: int) -> bytes:
        """All bytes of a regular file. Raises ``OSError`` (EFBIG) when there are more than that."""
        data = bytearray()
        with self.open(name) as file:
            for block in file.blocks():
                data += block
                if len(data) > max_bytes:
                    raise OSError(errno.EFBIG, f"longer than {max_bytes} bytes", name)
        return bytes(data)

    def sha256(self, name: str) -> str:
        """Checksum of a regular file, 64 hex digits."""
        digest = hashlib.sha256()
        with self.open(name) as file:
            for block in file.blocks():
                digest.update(block)
        return digest.hexdigest()

    def write(self, blocks: Iterable[bytes]) -> tuple[str, str]:
        """Write a new file and wait until it is on the disk; give its temporary name and its SHA-256.

        Raises ``OSError``, and what ``blocks`` raises, then with nothing left behind if the disk allows.
        """
        name = f"{secrets.token_hex(8)}.ridelog-tmp"
        digest = hashlib.sha256()
        descriptor = os.open(name, _WRITE, 0o644, dir_fd=self._descriptor)
        try:
            try:
                for block in blocks:
                    digest.update(block)
                    rest = memoryview(block)
                    while rest:
                        rest = rest[os.write(descriptor, rest):]
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        except BaseException:
            self.discard(name)
            raise
        return name, digest.hexdigest()

    def discard(self, temporary: str) -> None:
        """Remove a file that ``write`` made; one that cannot be removed now is by ``clean``, another time."""
        try:
            os.unlink(temporary, dir_fd=self._descriptor)
        except OSError:
            return

    def clean(self) -> None:
        """Remove what a ``write`` that was cut short has left."""
        for name in self.each_name():
            if _TEMPORARY.fullmatch(name):
                self.discard(name)

    def rename(self, name: str, new_name: str) -> None:
        """Give a file its name, in place of the file that had it, and wait until this is on the disk.

        On FAT the new name comes without size and blocks, which follow when the file is flushed again: else it is empty
        after a pull (Linux, fs/fat/namei_vfat.c, vfat_rename).
        """
        os.rename(name, new_name, src_dir_fd=self._descriptor, dst_dir_fd=self._descriptor)
        found = self.find(new_name)
        if found is not None and stat.S_ISREG(found.st_mode):
            descriptor = os.open(new_name, _READ, dir_fd=self._descriptor)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        self.sync()

    def replace(self, name: str, blocks: Iterable[bytes]) -> None:
        """Write a file whole, in place of the old one, or not at all. What has its name and is no file is put aside."""
        temporary, _ = self.write(blocks)
        try:
            self._make_way(name)
            self.rename(temporary, name)
        except OSError:
            self.discard(temporary)
            raise

    def sync(self) -> None:
        """Wait until the names are on the disk."""
        os.fsync(self._descriptor)

    def free_bytes(self) -> tuple[int, int]:
        """Room for files of ours, and the size of the units it is given out in."""
        system = os.fstatvfs(self._descriptor)
        return system.f_bavail * system.f_frsize, max(system.f_bsize, system.f_frsize, 1)
