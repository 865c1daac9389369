"""What a disk will not read or remove is put aside under another name, so that it stops nothing and is not lost.

Problem. One file that cannot be read, or a folder under the name of a file, must not keep a service from its work at
every start. Solution. It is renamed: ``<name>.aside``, which no reader takes for a log, and somebody is warned. The
session number in the name counts as before.
"""

from __future__ import annotations

import errno
import logging
from collections.abc import Callable
from itertools import count
from pathlib import Path

from drivers.disk import FileSystem

Warn = Callable[[str], None]
"""Takes a sentence for the journal and for ``ridelog status``."""

ENDING = ".aside"
log = logging.getLogger(__name__)


def warn_in_journal(words: str) -> None:
    """A warning for the journal only."""
    log.warning("%s", words)


def disk_words(error: OSError) -> str:
    """What is wrong with the disk, for a person."""
    words = {
        errno.ENOSPC: "the disk is full",
        errno.EDQUOT: "the disk quota is used up",
        errno.EROFS: "the disk has become read-only",
        errno.EIO: "the disk fails (input/output error)",
    }
    return words.get(error.errno or 0, str(error))


def is_taken(path: Path) -> bool:
    """True when something has this name, a link to nothing too."""
    return path.is_symlink() or path.exists()


def set_aside(files: FileSystem, path: Path, why: str, warn: Warn) -> None:
    """Rename what has this name, and say so. Raises ``OSError`` when it cannot be renamed."""
    names = (path.with_name(path.name + ENDING + ("" if number == 1 else f"-{number}")) for number in count(1))
    aside = next(name for name in names if not is_taken(name))
    files.rename(path, aside)
    files.sync_directory(path.parent)
    warn(f"{path.name}: {why}; it is now called {aside.name}")
