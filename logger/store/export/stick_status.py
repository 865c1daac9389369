"""What a person at the car sees of the sticks that are plugged in: a note per stick, and a light for all.

Problem. Somebody stands at the car with a hand on the stick. They have no screen, or look once at ``ridelog
status``; and there may be two sticks. Solution: a small file in memory each time a stick is plugged in, empty until its
export begins, written by the export and removed when the stick is; and one LED of the board that shows what matters
most of all notes: it beats while any stick must stay, blinks evenly when one of them did not get everything, and is
steady when all may be pulled. When the last stick has gone the LED does again what it did before.
"""

from __future__ import annotations

import fcntl
import json
import os
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal, get_args

from drivers.disk import open_regular
from logger.files import replace_bytes

FOLDER = Path("/run/ridelog-export")
BLOCK_DEVICES = Path("/sys/class/block")
LED_MEMORY = "led-trigger"
LARGEST_BYTES = 10_000
"""Most that is read of a note; what is cut there is none."""

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
    try:
        with open_regular(path) as file:
            text = file.read(LARGEST_BYTES)
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
