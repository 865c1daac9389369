"""What a folder of logs remembers of its exports: who it is, and which of its files lie on a stick already.

Problem. Room on the card may be made by removing what has been exported, and nothing else: so the memory must never
say yes too early, nor of a file that has changed since, as a log does that learns its UTC after it was exported.
Solution. A mark carries size, time of change and SHA-256 of what was exported; it counts while the file still has that
size and time. The marks are one file with a checksum over itself, replaced in one step; one that is damaged is as good
as none, and the files are marked again by the next export that finds them on its stick. Exports to two sticks at once
take turns.

The identity is a random number made at the first export. It names the logger's folder on every stick, so that the logs
of two cars, which have the same names, never meet. A card that has gone read-only or is full can still be emptied: then
the number comes from the machine's own.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import json
import os
import re
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from logger.store.open_folder import OpenFolder

MARKS_NAME = "exported.json"
LOCK_NAME = "exported.lock"
IDENTITY_NAME = "logger-id"
MACHINE_ID = Path("/etc/machine-id")
MAX_BYTES = 64_000_000

_IDENTITY = re.compile(rb"([0-9a-f]{12})\n")
_FORMAT = 1
_CARD_FAULTS = {errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EIO}


@dataclass(frozen=True)
class Mark:
    """What was exported under a name."""

    size_bytes: int
    mtime_ns: int
    sha256: str

    def is_of(self, found: os.stat_result) -> bool:
        """True when the file has not changed since."""
        return found.st_size == self.size_bytes and found.st_mtime_ns == self.mtime_ns


def exported_names(log_folder: Path) -> set[str]:
    """Names of the files in this folder that lie, as they are now, on a stick: copied, read back, in its manifest.

    Anything in doubt is left out. Raises ``OSError`` for a folder that cannot be read.
    """
    with OpenFolder.at(log_folder) as folder:
        marks = read_marks(folder)
        return {name for name, mark in marks.items()
                if (found := folder.find(name)) is not None and mark.is_of(found)}


def read_marks(log_folder: OpenFolder) -> dict[str, Mark]:
    """All marks by name; none where the file of marks is missing or not whole."""
    try:
        content = json.loads(log_folder.read(MARKS_NAME, MAX_BYTES))
        if content["format"] != _FORMAT or content["sha256"] != _digest(content["files"]):
            return {}
        return {name: Mark(**mark) for name, mark in content["files"].items()}
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return {}


def mark_exported(log_folder: OpenFolder, new: Mapping[str, Mark]) -> None:
    """Remember files that lie on a stick; forget those that the folder no longer has. Raises ``OSError``."""
    with _turn(log_folder):
        marks = read_marks(log_folder) | dict(new)
        present = set(log_folder.names())
        files = {name: asdict(mark) for name, mark in sorted(marks.items()) if name in present}
        content = {"format": _FORMAT, "sha256": _digest(files), "files": files}
        log_folder.replace(MARKS_NAME, [(json.dumps(content, indent=0) + "\n").encode("ascii")])


def logger_identity(log_folder: OpenFolder) -> str:
    """The logger's 12 hex digits, made when there are none. Raises ``OSError`` when there can be none."""
    known = _read_identity(log_folder)
    if known is not None:
        return known
    try:
        return _make_identity(log_folder)
    except OSError as error:
        if error.errno not in _CARD_FAULTS:
            raise
        return hashlib.sha256(b"ridelog " + MACHINE_ID.read_bytes()).hexdigest()[:12]


def _make_identity(log_folder: OpenFolder) -> str:
    with _turn(log_folder):
        known = _read_identity(log_folder)
        if known is None:
            known = secrets.token_hex(6)
            log_folder.replace(IDENTITY_NAME, [f"{known}\n".encode("ascii")])
    return known


def _read_identity(log_folder: OpenFolder) -> str | None:
    try:
        match = _IDENTITY.fullmatch(log_folder.read(IDENTITY_NAME, 64))
    except OSError:
        return None
    return match[1].decode("ascii") if match else None


@contextmanager
def _turn(log_folder: OpenFolder) -> Iterator[None]:
    """Wait for other exports that change the same file, for the moment that takes them."""
    descriptor = log_folder.open_lock_file(LOCK_NAME)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _digest(files: Mapping[str, object]) -> str:
    return hashlib.sha256(json.dumps(files, sort_keys=True, separators=(",", ":")).encode("ascii")).hexdigest()
