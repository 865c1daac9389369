"""The number of a session: never given twice, whatever is lost."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

from drivers.disk import FileSystem
from logger.store.log.atomic_file import replace_file
from logger.store.log.log_name import session_of
from logger.store.log.quarantine import (
    Warn,
    disk_words,
    file_words,
    is_taken,
    numbered,
    set_aside_if_possible,
    warn_in_journal,
)

COUNTER_NAME = "last-session"
_COUNTER_BYTES = 64
COUNTER = re.compile(COUNTER_NAME + r"(-[0-9]+)?")


def next_session(directory: Path, files: FileSystem | None = None, warn: Warn = warn_in_journal) -> int:
    """A session number that no file of the folder has or ever had, stored before it is given out.

    It counts on from the counter file and from the names that are there, whichever is higher, so that neither a
    lost counter nor logs that were moved away bring a number back. A counter that cannot be read is put aside; where it
    cannot be replaced, another is kept. Raises ``OSError``.
    """
    files = files or FileSystem()
    names = [path.name for path in directory.iterdir()]
    counted = [_read_counter(files, directory / name, warn) for name in names if COUNTER.fullmatch(name)]
    number = max([0, *counted, *(session_of(name) or 0 for name in names)]) + 1
    _store_counter(files, directory / COUNTER_NAME, number, warn)
    return number


def _store_counter(files: FileSystem, path: Path, number: int, warn: Warn) -> None:
    """Store it under the first name that takes it."""
    text = str(number)
    for counter in numbered(path):
        is_in_the_way = is_taken(counter)
        try:
            replace_file(files, counter, [f"{text} {_check(text)}\n".encode()])
        except OSError as error:
            if not is_in_the_way:
                raise
            warn(f"{counter.name}: {file_words(error)}; it cannot be replaced, and another is kept")
        else:
            return


def _read_counter(files: FileSystem, path: Path, warn: Warn) -> int:
    """The last number given out; 0 when the file is missing, damaged or cannot be read."""
    try:
        with files.open(path) as file:
            text, _, check = file.read(_COUNTER_BYTES).decode("ascii", "replace").strip().partition(" ")
    except FileNotFoundError:
        return 0
    except OSError as error:
        set_aside_if_possible(files, path, disk_words(error), warn)
        return 0
    return int(text) if check == _check(text) and text.isdecimal() else 0


def _check(text: str) -> str:
    return f"{zlib.crc32(text.encode('ascii', 'replace')):08x}"
