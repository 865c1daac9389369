"""Opening a file that somebody named, which has to be one.

Problem. The name may be that of a pipe, where to open it already waits until somebody writes, or of a device. Solution:
it is opened without waiting, and what is no regular file is refused.
"""

from __future__ import annotations

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path

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
