"""The number of a session: never given twice, whatever is lost."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

from drivers.disk import FileSystem
from logger.store.whole_file import replace_file

COUNTER_NAME = "last-session"
_SESSION_NAME = re.compile(r"(\d{5,})[-.]")


def next_session(directory: Path, files: FileSystem | None = None) -> int:
    """A session number that no file of the folder has or ever had, stored before it is given out.

    It counts on from the counter file and from the names that are there, whichever is higher, so that neither a
    lost counter nor logs that were moved away bring a number back. Raises ``OSError``.
    """
    matches = (_SESSION_NAME.match(path.name) for path in directory.iterdir())
    number = max([_read_counter(directory / COUNTER_NAME), *(int(match[1]) for match in matches if match)]) + 1
    text = str(number)
    replace_file(files or FileSystem(), directory / COUNTER_NAME, [f"{text} {_check(text)}\n".encode()])
    return number


def _read_counter(path: Path) -> int:
    """The last number given out; 0 when the file is missing or damaged."""
    try:
        text, _, check = path.read_text("ascii", "replace").strip().partition(" ")
    except FileNotFoundError:
        return 0
    return int(text) if check == _check(text) and text.isdecimal() else 0


def _check(text: str) -> str:
    return f"{zlib.crc32(text.encode('ascii', 'replace')):08x}"
