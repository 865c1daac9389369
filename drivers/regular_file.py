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

_READ = os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC


def open_regular(path: str | os.PathLike[str]) -> BufferedReader:
    """A regular file, open for reading bytes. Raises ``OSError`` for what cannot be opened or is something else."""
    descriptor = os.open(path, _READ)
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(Path(path)))
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "not a regular file", str(Path(path)))
        return os.fdopen(descriptor, "rb")
    except OSError:
        os.close(descriptor)
        raise
