"""What a folder of logs remembers of its exports: which of its files lie on a stick already.

Problem. Room on the card may be made by removing what has been exported, and nothing else: so the memory must never
say yes too early, nor of a file that has changed since, as a log does that learns its UTC after it was exported.
Solution. A mark carries size, time of change and SHA-256 of what was exported; it counts while the file still has that
size and time. The marks are one list with a checksum over itself, replaced in one step; one that is damaged is as good
as none, and the files are marked again by the next export that finds them on its stick. Exports to two sticks at once
take turns.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from logger.store.export.checked_list import list_blocks, list_lines
from logger.store.export.directory_handle import DirectoryHandle
from logger.store.export.pairing import NOT_PAIRED, Pairing, trusted_sticks

MARKS_NAME = "exported-marks"

_FIRST = "# ridelog-exported 1"
_NO_STICK = "-"
_ENTRY = re.compile(r"([0-9a-f]{64}) (\d{1,15}) (-?\d{1,19}) ([0-9a-f]{32}|-) ([0-9][0-9A-Za-z._-]{0,63})")


@dataclass(frozen=True, slots=True)
class Mark:
    """What was exported under a name, and to which stick (``pairing.stick_name``; empty: unknown)."""

    size_bytes: int
    mtime_ns: int
    sha256: str
    stick: str = ""

    def is_of(self, found: os.stat_result) -> bool:
        """True when the file has not changed since."""
        return found.st_size == self.size_bytes and found.st_mtime_ns == self.mtime_ns


def exported_names(log_folder: Path, pairing: Pairing = NOT_PAIRED) -> set[str]:
    """Names of the files in this folder that lie, as they are now, on a stick whose copies count: copied, read back, in
    its manifest.

    Anything in doubt is left out. Raises ``OSError`` for a folder that cannot be read.
    """
    with DirectoryHandle.at(log_folder) as folder:
        sticks = trusted_sticks(pairing, folder)
        return {name for name, mark in read_marks(folder).items() if sticks is None or mark.stick in sticks
                if (found := folder.find(name)) is not None and mark.is_of(found)}


def read_marks(log_folder: DirectoryHandle) -> dict[str, Mark]:
    """All marks by name; none where the file of marks is missing or not whole."""
    try:
        return dict(_stored(log_folder))
    except ValueError:
        return {}


def mark_exported(log_folder: DirectoryHandle, new: Mapping[str, Mark]) -> None:
    """Remember files that lie on a stick; forget those that the folder no longer has. Raises ``OSError``."""
    with log_folder.turn():
        present = set(log_folder.names())
        fresh = [(name, mark) for name, mark in new.items() if name in present]
        kept = ((name, mark) for name, mark in _stored(log_folder) if name in present and name not in new)
        try:
            log_folder.replace(MARKS_NAME, list_blocks(_FIRST, map(_line, chain(kept, fresh))))
        except ValueError:
            log_folder.replace(MARKS_NAME, list_blocks(_FIRST, map(_line, fresh)))


def _line(named: tuple[str, Mark]) -> str:
    name, mark = named
    return f"{mark.sha256} {mark.size_bytes} {mark.mtime_ns} {mark.stick or _NO_STICK} {name}"


def _stored(log_folder: DirectoryHandle) -> Iterator[tuple[str, Mark]]:
    """The marks, one at a time; they are true once all have come. Raises ValueError where their file is not there,
    cannot be read, or is not whole."""
    try:
        with log_folder.open(MARKS_NAME) as file:
            lines = list_lines(file.blocks())
            if next(lines, "") != _FIRST:
                raise ValueError(f"line 1: expected '{_FIRST}'")
            for line in lines:
                entry = _ENTRY.fullmatch(line)
                if entry is None:
                    raise ValueError("expected 'SHA-256 SIZE TIME STICK NAME'")
                stick = "" if entry[4] == _NO_STICK else sys.intern(entry[4])
                yield entry[5], Mark(int(entry[2]), int(entry[3]), entry[1], stick)
    except OSError as error:
        raise ValueError(f"expected a readable file ({error.strerror})") from None
