"""The disk as recordings and logs use it: opening what somebody named, and every change.

A name may be that of a pipe, where to open it already waits until somebody writes, or of a device: a file is opened
without waiting, and what is no regular file is refused. What happens to a file when the power goes, the card is full or
dies can only be tested if every change to the disk can be watched, cut off or refused: whoever writes in the car does
so through a ``FileSystem``, and a test hands in one that fails. Every method raises ``OSError`` for what the system
refuses.
"""

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path
from typing import BinaryIO

NO_WAIT = os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
"""Flags with which the opening of a pipe or a terminal does not wait, nor makes the terminal this process's own."""


def open_regular(path: str | os.PathLike[str]) -> BufferedReader:
    """A regular file, open for reading bytes. Raises ``OSError`` for what cannot be opened or is something else."""
    return os.fdopen(check_regular(path, os.open(path, os.O_RDONLY | NO_WAIT)), "rb")


def check_regular(path: str | os.PathLike[str], descriptor: int) -> int:
    """The descriptor of a regular file. Raises ``OSError`` for anything else, and closes it."""
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return descriptor
    os.close(descriptor)
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(Path(path)))
    raise OSError(errno.EINVAL, "not a regular file", str(Path(path)))


class FileSystem:
    """The disk as it is."""

    def open(self, path: Path) -> BinaryIO:
        """A regular file, for reading. Raises ``OSError`` for anything else; a pipe is never waited for."""
        return open_regular(path)

    def create(self, path: Path, new: bool = False) -> int:
        """Open an empty file for writing; give its descriptor. ``new``: raise ``FileExistsError`` where one is. A link
        is not followed, a pipe not waited for."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW | NO_WAIT | (os.O_EXCL if new else os.O_TRUNC)
        return check_regular(path, os.open(path, flags, 0o666))

    def write(self, descriptor: int, data: bytes) -> None:
        """Hand all bytes to the system."""
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(descriptor, rest):]

    def sync(self, descriptor: int) -> None:
        """Wait until the file is on the disk. After an error nobody knows what of it is: never try again."""
        os.fsync(descriptor)

    def close(self, descriptor: int) -> None:
        os.close(descriptor)

    def cut(self, path: Path, size: int) -> None:
        """Leave so many bytes of a file and wait until they are on the disk."""
        descriptor = os.open(path, os.O_WRONLY | os.O_CLOEXEC)
        try:
            os.ftruncate(descriptor, size)
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def rename(self, source: Path, target: Path) -> None:
        """Give a file another name, in place of the file that had it."""
        source.rename(target)

    def remove(self, path: Path) -> None:
        """Remove a file, if it is there."""
        path.unlink(missing_ok=True)

    def sync_directory(self, directory: Path) -> None:
        """Wait until the names in a folder are on the disk."""
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def free_bytes(self, directory: Path) -> int:
        """Room for files of this user on the disk that holds a folder."""
        there = os.statvfs(directory)
        return there.f_bavail * there.f_frsize

    def is_read_only(self, directory: Path) -> bool:
        """True for a disk that was mounted read-only, or has become so, as a failing one does."""
        return bool(os.statvfs(directory).f_flag & os.ST_RDONLY)
