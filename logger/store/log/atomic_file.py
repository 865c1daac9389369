"""Files of the logs' folder as a whole: replaced in one step, set aside, and held by one writer.

One file that cannot be read, or a folder under the name of a file, must not keep a service from its work at every
start: it is renamed ``<name>.aside``, which no reader takes for a log, and somebody is warned. The session number in
the name counts as before.

One writer to a folder of logs. A second service, or a replay into the same folder, would finish the open files of
the first; so a process that writes holds a lock on the folder for as long as the process lives. The kernel lets go of
it when the process ends, however it ends.

A new content is written to a temporary file, waited for, and renamed into place: it is there whole or not at all,
whenever the power goes.
"""

import errno
import fcntl
import logging
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import count
from pathlib import Path
from types import TracebackType

from drivers.disk import FileSystem
from logger.errors import BadInput

Warn = Callable[[str], None]  # Takes a sentence for the journal and for ``ridelog status``
ENDING = ".aside"
_ASIDE = re.compile(re.escape(ENDING) + r"(-[0-9]+)?\Z")
READ_ONLY = "the disk has become read-only"
log = logging.getLogger(__name__)


def warn_in_journal(words: str) -> None:
    """A warning for the journal only."""
    log.warning("%s", words)


def disk_words(error: OSError) -> str:
    """What is wrong with the disk, for a person."""
    words = {
        errno.ENOSPC: "the disk is full",
        errno.EDQUOT: "the disk quota is used up",
        errno.EROFS: READ_ONLY,
        errno.EIO: "the disk fails (input/output error)",
    }
    return words.get(error.errno or 0, error.strerror or str(error))


def file_words(error: OSError) -> str:
    """The same, and at which file, where the system says it."""
    names = [Path(str(name)).name for name in (error.filename, error.filename2) if name is not None]
    return f"{disk_words(error)}{' at ' if names else ''}{' and '.join(names)}"


def is_taken(path: Path) -> bool:
    """True when something has this name, a link to nothing too, or what cannot even be looked at."""
    try:
        path.lstat()
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return True


def file_size(path: Path) -> int | None:
    """Bytes of a regular file; None for anything else, and for what cannot even be looked at."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_size if stat.S_ISREG(found.st_mode) else None


def is_file(path: Path) -> bool:
    """True for a regular file that can be looked at."""
    return file_size(path) is not None


def numbered(path: Path) -> Iterator[Path]:
    """A name and, without end, others for where it is taken: ``x``, ``x-2``, ``x-3``."""
    yield path
    for number in count(2):
        yield path.with_name(f"{path.name}-{number}")


def set_aside(files: FileSystem, path: Path, why: str, warn: Warn) -> None:
    """Rename what has this name, and say so. Raises ``OSError`` when it cannot be renamed."""
    aside = next(name for name in numbered(path.with_name(path.name + ENDING)) if not is_taken(name))
    files.rename(path, aside)
    files.sync_directory(path.parent)
    warn(f"{path.name}: {why}; it is now called {aside.name}")


def set_aside_if_possible(files: FileSystem, path: Path, why: str, warn: Warn) -> None:
    """The same; what cannot be renamed stays, and that is said."""
    try:
        set_aside(files, path, why, warn)
    except OSError as error:
        warn(f"{path.name}: {why}; it cannot be renamed either ({disk_words(error)}) and is skipped")


def names_set_aside(directory: Path) -> list[str]:
    """What was put aside in a folder and is still there."""
    return sorted(path.name for path in directory.iterdir() if _ASIDE.search(path.name))


class FolderLock:
    """Holds ``folder``, which exists, until the end of the ``with`` block. Raises BadInput when another holds it."""

    def __init__(self, folder: Path) -> None:
        self._descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._descriptor)
            raise BadInput(
                f"{folder}: another ridelog is writing here (see ridelog status); give each its own folder") from None

    def __enter__(self) -> "FolderLock":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        os.close(self._descriptor)


_TEMPORARY = re.compile(r"(.+)\.tmp(-[0-9]+)?")


def replace_file(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> None:
    """Write a file that is there whole, in place of the old one, or not at all. Raises ``OSError``."""
    files.rename(write_temporary(files, path, blocks), path)
    files.sync_directory(path.parent)


def write_temporary(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> Path:
    """Write what is to have a name, under another one, and wait until it is on the disk; give that name. What cannot be
    written whole is removed: it may fill the disk. Raises ``OSError``."""
    temporary, descriptor = _created(files, path)
    try:
        try:
            for block in blocks:
                files.write(descriptor, block)
            files.sync(descriptor)
        finally:
            files.close(descriptor)
    except OSError:
        with suppress(OSError):
            files.remove(temporary)
        raise
    return temporary


def name_of_temporary(path: Path) -> str | None:
    """The name that a temporary file was to have; None for a file that is none."""
    match = _TEMPORARY.fullmatch(path.name)
    return match[1] if match else None


def _created(files: FileSystem, path: Path) -> tuple[Path, int]:
    """An empty temporary file and its descriptor. Names that something has which takes no bytes are passed over."""
    for temporary in numbered(path.with_name(f"{path.name}.tmp")):
        is_in_the_way = is_taken(temporary)
        try:
            return temporary, files.create(temporary)
        except OSError:
            if not is_in_the_way:
                raise
    raise AssertionError("names never end")
