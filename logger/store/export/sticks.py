"""Who a folder of logs belongs to, which sticks get its logs, and what a person at the car sees of them.

The number that names the logger's folder on every stick. Problem. The logs of two cars have the same names, and never
may they meet on a stick; but a card is copied whole for a second car, number and all, a folder is copied on one
machine, and one card may be read in several. Solution. The number is random, made at the first export, and kept for a
machine and a place: another machine, or a copy beside a folder that is still there, makes a number of its own. A folder
that was moved on its machine keeps it. The machine is known by its board's serial number, which no copy of a card takes
along, or else by its machine-id. A card that has gone read-only or is full can still be emptied: then the number comes
from the machine's own. ``logger-id`` holds the number of who exported last, ``logger-homes`` a line for each machine:
number, machine, place. Where there is only the former, as older versions left it, the machine that finds it takes it
over.

Which sticks get the logs. Problem. A log is a track of where somebody was. Whoever can plug a stick with the right
label into the car would get all of them, and the copy would make the owner's logs removable. Solution: a setting,
``pairing``:

off            every stick gets the logs, and every copy counts
first_stick    the first one that is plugged in gets a random number, which the card remembers; no other stick is served
key_file       sticks that hold the same key, in the file ``KEY_NAME``, as the logger in a file of its own

Number and key can be read by anyone who has such a stick in hand: it is to be kept like a key.

A note per stick, and a light for all. Problem. Somebody stands at the car with a hand on the stick. They have no
screen, or look once at ``ridelog status``; and there may be two sticks. Solution: a small file in memory each time a
stick is plugged in, empty until its export begins, written by the export and removed when the stick is; and one LED of
the board that shows what matters most of all notes: it beats while any stick must stay, blinks evenly when one of them
did not get everything, and is steady when all may be pulled. When the last stick has gone the LED does again what it
did before.
"""

import errno
import fcntl
import hashlib
import json
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from typing import Literal, get_args

from drivers.disk import open_regular
from logger.errors import CheckFailed
from logger.files import replace_bytes
from logger.store.export import manifest
from logger.store.export.directory_handle import DirectoryHandle

IDENTITY_NAME = "logger-id"
HOMES_NAME = "logger-homes"
BOARD_SERIAL = Path("/sys/firmware/devicetree/base/serial-number")
"""Of a Raspberry Pi and its like; the files of DMI on other machines are root's alone."""
MACHINE_ID = Path("/etc/machine-id")

_IDENTITY = re.compile(rb"([0-9a-f]{12})\n")
_HOME = re.compile(r'([0-9a-f]{12}) ([0-9a-f]{12}) (".*")')
_CARD_FAULTS = {errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EIO}


@dataclass(frozen=True)
class _Home:
    """A number, and the machine and folder that it was given to."""

    identity: str
    machine: str
    place: str


def logger_identity(log_folder: DirectoryHandle, place: Path) -> str:
    """The 12 hex digits of the logger whose folder this is, at ``place``, made if needed. Raises ``OSError``."""
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
    most_bytes = 65_536
    try:
        text = log_folder.read(HOMES_NAME, most_bytes).decode("ascii")
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
            return hashlib.sha256(b"ridelog " + said).hexdigest()[:12]
    return ""


OFF, FIRST_STICK, KEY_FILE = MODES = ("off", "first_stick", "key_file")

KEY_NAME = "ridelog.key"  # In the root of a stick
STICK_NAME = "stick-id"  # In the logger's own folder on a stick: the stick's number
PAIRED_NAME = "paired-stick"  # In the folder of logs: the number of the stick that was first
LEAST_KEY_BYTES, MOST_KEY_BYTES = 16, 4096
_ID_BYTES = 16
_ID = re.compile(rb"([0-9a-f]{32})\n")
_UNREADABLE = "unreadable"


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
    most_loggers = 1000  # That are looked at on a stick, which may hold names without end.
    try:
        if pairing.mode == KEY_FILE:
            return _fingerprint(root.read(KEY_NAME, MOST_KEY_BYTES))
        with root.inside(manifest.FOLDER, make=False) as common:
            first, name = _first_stick(logs), _id_in(common, identity)
            others = (_id_in(common, other) for other in islice(common.each_name(), most_loggers))
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
            raise OSError(errno.EIO, "what it reads back differs from what was written")
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


FOLDER = Path("/run/ridelog-export")
BLOCK_DEVICES = Path("/sys/class/block")
LED_MEMORY = "led-trigger"

WAITING = "plugged in, waits for its turn"

StickState = Literal["waiting", "copying", "unmounting", "ready"]


@dataclass(frozen=True)
class StickNote:
    """One stick.

    stick    its device, such as sda1
    state    waiting; copying; unmounting; ready: it may be pulled
    ok       everything is on it, as far as is known
    text     one line for the person
    """

    stick: str
    state: StickState
    ok: bool
    text: str


def stick_of(path: Path) -> str:
    """The device whose note this is: the name without the number of its plugging in (``sda1.27.json``: sda1)."""
    return path.name.partition(".")[0]


def write_note(path: Path, note: StickNote) -> None:
    """Put a note, ``FOLDER/<stick>.<number>.json``, into place in one step. Raises ``OSError``."""
    replace_bytes(path, f"{json.dumps(asdict(note))}\n".encode())


def read_note(path: Path) -> StickNote | None:
    """A note; None where there is none that can be read. An empty one is that of a stick whose export waits."""
    largest_bytes = 10_000  # Most that is read of a note; what is cut there is none.
    try:
        with open_regular(path) as file:
            text = file.read(largest_bytes)
        note = StickNote(**json.loads(text)) if text else StickNote(stick_of(path), "waiting", True, WAITING)
    except (OSError, ValueError, TypeError, RecursionError):
        return None
    return note if note.state in get_args(StickState) else None


def read_notes(folder: Path = FOLDER) -> list[StickNote]:
    """All notes of sticks that are plugged in, by their names."""
    return [note for path in sorted(folder.glob("*.json"))
            if is_plugged_in(path) and (note := read_note(path)) is not None]


def is_plugged_in(path: Path) -> bool:
    """False for the note of a disk that has gone, or is another by now; a note without a number is somebody's own."""
    device, _, number = path.stem.partition(".")
    if not number.isdecimal():
        return True
    place = (BLOCK_DEVICES / device).resolve()
    for disk in (place, place.parent):  # a partition lies in its disk
        with suppress(OSError):
            return (disk / "diskseq").read_text("ascii").strip() == number
    return False


def show_on_led(led: Path, folder: Path) -> None:
    """Let a light, a folder such as /sys/class/leds/ACT, show the notes of a folder.

    A light that is not there, or may not be changed, shows nothing: the notes are still true. Source: Linux,
    Documentation/leds/leds-class.rst.
    """
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            _show(led, folder / LED_MEMORY, read_notes(folder))
        finally:
            os.close(descriptor)


def _show(led: Path, memory: Path, notes: list[StickNote]) -> None:
    if not notes:
        if memory.exists():
            _trigger(led, memory.read_text("ascii"))
            memory.unlink()
        return
    if not memory.exists():
        memory.write_text(_present_trigger(led), "ascii")
    if any(note.state != "ready" for note in notes):
        _trigger(led, "heartbeat")
    elif all(note.ok for note in notes):
        _trigger(led, "none")
        (led / "brightness").write_text((led / "max_brightness").read_text("ascii"), "ascii")
    else:
        _trigger(led, "timer")


def _present_trigger(led: Path) -> str:
    """The kernel lists all triggers and puts the present one into brackets."""
    listed = (led / "trigger").read_text("ascii").split()
    return next((word.strip("[]") for word in listed if word.startswith("[")), "none")


def _trigger(led: Path, name: str) -> None:
    (led / "trigger").write_text(name, "ascii")
