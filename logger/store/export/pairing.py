"""Which sticks get the logs, and whose copies let a log be removed.

Problem. A log is a track of where somebody was. Whoever can plug a stick with the right label into the car would get
all of them, and the copy would make the owner's logs removable. Solution: a setting, ``pairing``:

off            every stick gets the logs, and every copy counts
first_stick    the first one that is plugged in gets a random number, which the card remembers; no other stick is served
key_file       sticks that hold the same key, in the file ``KEY_NAME``, as the logger in a file of its own

Number and key can be read by anyone who has such a stick in hand: it is to be kept like a key.
"""

from __future__ import annotations

import errno
import hashlib
import re
import secrets
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from logger.errors import CheckFailed
from logger.store.export import manifest
from logger.store.export.directory_handle import DirectoryHandle

OFF, FIRST_STICK, KEY_FILE = MODES = ("off", "first_stick", "key_file")

KEY_NAME = "ridelog.key"
"""In the root of a stick."""

STICK_NAME = "stick-id"
"""In the logger's own folder on a stick: the stick's number."""

PAIRED_NAME = "paired-stick"
"""In the folder of logs: the number of the stick that was first."""

LEAST_KEY_BYTES, MOST_KEY_BYTES = 16, 4096
_ID_BYTES = 16
_ID = re.compile(rb"([0-9a-f]{32})\n")
_UNREADABLE = "unreadable"
_MOST_LOGGERS = 1000
"""That are looked at on a stick, which may hold names without end."""


@dataclass(frozen=True)
class Pairing:
    """``mode`` is one of ``MODES``; ``key_file`` is the logger's own copy of the key."""

    mode: str = OFF
    key_file: Path = Path("/etc/ridelog/stick.key")


NOT_PAIRED = Pairing()


def trusted_sticks(pairing: Pairing, logs: DirectoryHandle) -> set[str] | None:
    """What marks call the sticks whose copies count; None: any. Empty while there is none."""
    if pairing.mode == OFF:
        return None
    name = _first_stick(logs) if pairing.mode == FIRST_STICK else _own_key(pairing.key_file)
    return {name} if name else set()


def stick_name(pairing: Pairing, root: DirectoryHandle, logs: DirectoryHandle, identity: str) -> str:
    """What marks call this stick, of which only ``root`` is open; empty where nothing is known of it. The number that
    the card remembers may also lie in the folder of another logger: the card has been put into another machine."""
    try:
        if pairing.mode == KEY_FILE:
            return _fingerprint(root.read(KEY_NAME, MOST_KEY_BYTES))
        with root.inside(manifest.FOLDER, make=False) as common:
            first, name = _first_stick(logs), _id_in(common, identity)
            others = (_id_in(common, other) for other in islice(common.each_name(), _MOST_LOGGERS))
            return first if first and name != first and first in others else name
    except OSError:
        return ""


def refuse_stranger(pairing: Pairing, logs: DirectoryHandle, logs_path: Path, stick: str) -> None:
    """Raises CheckFailed, in words for the person at the car, for a stick that gets nothing. Where none was first yet,
    none is refused."""
    trusted = trusted_sticks(pairing, logs)
    if trusted is None or stick in trusted:
        return
    if pairing.mode == FIRST_STICK:
        if trusted:
            raise CheckFailed(f"this is not the stick that the logger is paired with: nothing was copied (remove "
                              f"{logs_path / PAIRED_NAME} to pair it with the next one)")
    elif not trusted:
        raise CheckFailed(f"{pairing.key_file}: expected a file of {LEAST_KEY_BYTES} to {MOST_KEY_BYTES} bytes, the "
                          "key of this logger's sticks: nothing was copied")
    else:
        raise CheckFailed(f"this stick does not hold the key of this logger in {KEY_NAME}: nothing was copied")


def pair_first(pairing: Pairing, logs: DirectoryHandle, own: DirectoryHandle, stick: str) -> str:
    """Make this stick, whose folder ``own`` is the logger's, the first one where it is asked for and none is; give its
    name. Raises ``OSError``: then there is none still."""
    if pairing.mode != FIRST_STICK or _first_stick(logs):
        return stick
    name = stick or secrets.token_hex(_ID_BYTES)
    if not stick:
        own.replace(STICK_NAME, [f"{name}\n".encode("ascii")])
        if _read_id(own, STICK_NAME) != name:
            raise OSError(errno.EIO, "does not read back what was written")
    logs.replace(PAIRED_NAME, [f"{name}\n".encode("ascii")])
    return name


def _first_stick(logs: DirectoryHandle) -> str:
    """The number that the card remembers; empty: none yet. One that cannot be read is that of no stick."""
    return (_read_id(logs, PAIRED_NAME) or _UNREADABLE) if logs.find(PAIRED_NAME) is not None else ""


def _read_id(folder: DirectoryHandle, name: str) -> str:
    try:
        match = _ID.fullmatch(folder.read(name, 2 * _ID_BYTES + 1))
    except OSError:
        return ""
    return match[1].decode("ascii") if match else ""


def _id_in(common: DirectoryHandle, logger: str) -> str:
    try:
        with common.inside(logger, make=False) as folder:
            return _read_id(folder, STICK_NAME)
    except OSError:
        return ""


def _own_key(path: Path) -> str:
    try:
        with DirectoryHandle.at(path.parent) as folder:
            return _fingerprint(folder.read(path.name, MOST_KEY_BYTES))
    except OSError:
        return ""


def _fingerprint(key: bytes) -> str:
    """A name made from a key, which does not reveal it; empty for one that is too short to be one."""
    return hashlib.sha256(b"ridelog stick " + key).hexdigest()[:2 * _ID_BYTES] if len(key) >= LEAST_KEY_BYTES else ""
