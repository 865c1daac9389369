"""Who a folder of logs belongs to: the number that names its folder on every stick.

Problem. The logs of two cars have the same names, and never may they meet on a stick; but a card is copied whole for a
second car, number and all, a folder is copied on one machine, and one card may be read in several. Solution. The number
is random, made at the first export, and kept for a machine and a place: another machine, or a copy beside a folder that
is still there, makes a number of its own. A folder that was moved on its machine keeps it. The machine is known by its
board's serial number, which no copy of a card takes along, or else by its machine-id. A card that has gone read-only or
is full can still be emptied: then the number comes from the machine's own.

``logger-id`` holds the number of who exported last, ``logger-homes`` a line for each machine: number, machine, place.
Where there is only the former, as older versions left it, the machine that finds it takes it over.
"""

from __future__ import annotations

import errno
import hashlib
import json
import re
import secrets
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from logger.store.export.directory_handle import DirectoryHandle

IDENTITY_NAME = "logger-id"
HOMES_NAME = "logger-homes"
BOARD_SERIAL = Path("/sys/firmware/devicetree/base/serial-number")
"""Of a Raspberry Pi and its like; the files of DMI on other machines are root's alone."""
MACHINE_ID = Path("/etc/machine-id")

_IDENTITY = re.compile(rb"([0-9a-f]{12})\n")
_HOME = re.compile(r'([0-9a-f]{12}) ([0-9a-f]{12}) (".*")')
_MOST_BYTES = 65_536
_CARD_FAULTS = {errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EIO}


@dataclass(frozen=True)
class _Home:
    """A number, and the machine and folder that it was given to."""

    identity: str
    machine: str
    place: str


def logger_identity(log_folder: DirectoryHandle, place: Path) -> str:
    """The 12 hex digits of the logger whose folder this is, at ``place``, made when there are none. Raises ``OSError``
    when there can be none."""
    here = _Home("", _machine(), str(place.resolve()))
    known = _known(log_folder, here)
    if known is not None and known.place == here.place and _read_identity(log_folder) == known.identity:
        return known.identity
    try:
        with log_folder.turn():
            known = _known(log_folder, here)
            identity = known.identity if known is not None else secrets.token_hex(6)
            _remember(log_folder, _Home(identity, here.machine, here.place))
        return identity
    except OSError as error:
        if known is None and (error.errno not in _CARD_FAULTS or not here.machine):
            raise
        return known.identity if known is not None else here.machine


def _known(log_folder: DirectoryHandle, here: _Home) -> _Home | None:
    """What is known of this machine in this folder; None: nothing, or what belongs to another folder of it."""
    homes = list(_homes(log_folder))
    ours = next((home for home in homes if home.machine == here.machine), None)
    if ours is not None:
        return None if ours.place != here.place and _is_at(Path(ours.place), ours.identity, Path(here.place)) else ours
    identity = _read_identity(log_folder)
    if identity is None or (here.machine and any(home.identity == identity for home in homes)):
        return None
    return _Home(identity, here.machine, "")


def _is_at(place: Path, identity: str, here: Path) -> bool:
    """Whether the folder that a number was given to is still there, and is not this one by another path."""
    try:
        with DirectoryHandle.at(place) as folder:
            return _read_identity(folder) == identity and not place.samefile(here)
    except OSError:
        return False


def _remember(log_folder: DirectoryHandle, home: _Home) -> None:
    homes = [other for other in _homes(log_folder) if other.machine != home.machine]
    if home.machine:
        lines = (f"{one.identity} {one.machine} {json.dumps(one.place)}\n" for one in (home, *homes))
        log_folder.replace(HOMES_NAME, [line.encode("ascii") for line in lines])
    if _read_identity(log_folder) != home.identity:
        log_folder.replace(IDENTITY_NAME, [f"{home.identity}\n".encode("ascii")])


def _homes(log_folder: DirectoryHandle) -> Iterator[_Home]:
    """The lines that can be read."""
    try:
        text = log_folder.read(HOMES_NAME, _MOST_BYTES).decode("ascii")
    except (OSError, ValueError):
        return
    for line in text.splitlines():
        try:
            if match := _HOME.fullmatch(line):
                yield _Home(match[1], match[2], json.loads(match[3]))
        except ValueError:
            continue


def _read_identity(log_folder: DirectoryHandle) -> str | None:
    try:
        match = _IDENTITY.fullmatch(log_folder.read(IDENTITY_NAME, 64))
    except OSError:
        return None
    return match[1].decode("ascii") if match else None


def _machine() -> str:
    """12 hex digits of this machine; empty: nothing is known of it."""
    for path in (BOARD_SERIAL, MACHINE_ID):
        try:
            said = path.read_bytes().strip(b"\0 \n")
        except OSError:
            continue
        if said.strip(b"0") and said != b"uninitialized":  # as systemd says at the first boot
            return _digest(said)
    return ""


def _digest(said: bytes) -> str:
    return hashlib.sha256(b"ridelog " + said).hexdigest()[:12]
