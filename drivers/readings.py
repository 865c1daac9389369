"""What goes between a wire and a user: bytes, readings, words of recordings that are believed, and kinds of settings,
each of which reads its value from a node of a settings file (``drivers.plain_yaml``)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.errors import SettingsError, shortened

if TYPE_CHECKING:
    from drivers.plain_yaml import Node


class Event(NamedTuple):
    """Bytes from one source at one time.

    t_us      monotonic time [us]: when the read was made, or when the bytes arrived
    source    name of an accelerometer, or ``GPS``
    data      at least one byte
    """

    t_us: int
    source: str
    data: bytes


GPS = "nmea"


STANDARD_GRAVITY_MPS2 = 9.80665
US_PER_S = 1_000_000

UNREAD_CHIP = "readings arrive, but none that can be used: check the wires of its bus, and its supply"
"""What to do where a chip's bytes become no samples: there is no other language that they could be in."""


@dataclass(frozen=True)
class AccelerationBlock:
    """Some consecutive samples of a three-axis accelerometer, oldest first.

    t_us          (n,) int64, monotonic time of each sample [us]
    accel_mps2    (n, 3) float64, specific force along the sensor's X, Y, Z [m/s2]; gravity is in it
    clipped       (n,) bool, an axis stood at the end of its range in that sample
    rate_hz       samples per second, where the instrument finds it out [Hz]; None: as the settings say
    """

    t_us: npt.NDArray[np.int64]
    accel_mps2: npt.NDArray[np.float64]
    clipped: npt.NDArray[np.bool_]
    rate_hz: float | None = None

    def __len__(self) -> int:
        return len(self.t_us)


@dataclass(frozen=True)
class Fix:
    """One epoch of a GPS receiver. What the receiver did not say is None, never zero.

    Times are integer microseconds of the monotonic clock (``t_us``): the resolution of a recorded dump,
    so that a drive that was recorded and one that is replayed carry the very same times.

    t_us              monotonic arrival of the first byte of the epoch's first sentence [us]
    valid             the receiver vouches for position and speed (rule in ``drivers.nmea``)
    utc_us            time of the fix, microseconds since 1970-01-01 UTC; None while the date is unknown or refused
    time_of_day_us    time of the fix within its UTC day [us]; None when not said
    may_wait          its line has not paused in the seconds before: it may come late by what waits to be sent
    """

    t_us: int
    valid: bool
    utc_us: int | None
    time_of_day_us: int | None
    lat_deg: float | None
    lon_deg: float | None
    speed_mps: float | None
    course_deg: float | None
    altitude_m: float | None
    satellites: int | None
    hdop: float | None
    may_wait: bool = False


ANYTHING = object()


class RecordedWords:
    """What a recording says about itself, by key. Each asking method gives ``usual`` for what it does not say, and
    raises SettingsError for what cannot be.

    Problem. A recording comes from anybody. A word in it that is taken for a path would have a file of this machine
    read, written or, where it is Python, run. Solution. What a recording says is asked for here and nowhere else, and
    comes back as a plain number, as yes or no, or as one of the names that are registered on this machine; anything
    else is refused. No string of a recording is given out as it stands. What a recording is called may become the name
    of a folder, and never leads out of the folder that it is put into.
    """

    def __init__(self, said: Mapping[str, Any]) -> None:
        self._said = said

    def says(self, key: str, value: object = ANYTHING) -> bool:
        """Whether it says this value, or anything, under a key."""
        return key in self._said and (value is ANYTHING or self._said[key] == value)

    def number(self, key: str, usual: float, least: float, most: float) -> float:
        """A number from ``least`` to ``most``."""
        value = self._said.get(key, usual)
        if type(value) not in (int, float) or not least <= value <= most:
            raise self._wrong(key, f"a number from {least:g} to {most:g}".replace("e+0", "e"))
        return float(value)

    def number_or_none(self, key: str, usual: float | None, least: float, most: float) -> float | None:
        """The same, or nothing, where it says ``null``."""
        value = self._said.get(key, usual)
        return None if value is None else self.number(key, value, least, most)

    def whole(self, key: str, usual: int, least: float = -inf) -> int:
        """A whole number of at least ``least``."""
        value = self._said.get(key, usual)
        if type(value) is not int or value < least:
            limit = f" of at least {least:g}" if least > -inf else ""
            raise self._wrong(key, f"a whole number{limit}")
        return value

    def flag(self, key: str) -> bool:
        """Yes or no; no where nothing is said."""
        value = self._said.get(key, False)
        if type(value) is not bool:
            raise self._wrong(key, "true or false")
        return value

    def name(self, key: str, usual: str, registered: Collection[str], otherwise: str = "") -> str:
        """One of the names that are registered here. ``otherwise``: what a person can do about another one."""
        value = self._said.get(key, usual)
        for one in registered:
            if one == value:
                return one
        raise self._wrong(key, f"{otherwise}{'one of ' if len(registered) > 1 else ''}{', '.join(registered)}")

    def group(self, key: str) -> RecordedWords:
        """An object, whose own words are asked for likewise; an empty one where nothing is said."""
        value = self._said.get(key, {})
        if not isinstance(value, Mapping):
            raise self._wrong(key, "an object")
        return RecordedWords(value)

    def _wrong(self, key: str, expected: str) -> SettingsError:
        return SettingsError(f"expected {expected} for {key!r}, found {shortened(str(self._said.get(key)))}")


def folder_name(word: str) -> str:
    """What a recording is called, as the name of a folder. SettingsError for one that would lead elsewhere or can be
    no name: ``..``, nothing, anything with a / in it."""
    if word in ("", ".", "..") or "/" in word or "\0" in word:
        raise SettingsError(f"expected a recording whose name can be that of a folder, found {shortened(word)}: rename "
                            "it")
    return word


@dataclass(frozen=True)
class Whole:
    """A whole number from ``low`` to ``high``."""

    low: int
    high: int

    def read(self, node: Node) -> int:
        return node.integer(self.low, self.high)


@dataclass(frozen=True)
class Decimal:
    """A number from ``low`` to ``high``."""

    low: float
    high: float

    def read(self, node: Node) -> float:
        return node.number(self.low, self.high)


@dataclass(frozen=True)
class OneOf:
    """One of some whole numbers."""

    numbers: tuple[int, ...]

    def read(self, node: Node) -> int:
        return int(node.choice(*map(str, self.numbers)))


@dataclass(frozen=True)
class Flag:
    """``true`` or ``false``."""

    def read(self, node: Node) -> bool:
        return node.boolean()


@dataclass(frozen=True)
class Text:
    """Any text that is not empty."""

    def read(self, node: Node) -> str:
        return node.text()


@dataclass(frozen=True)
class Special:
    """What ``read`` makes of the value. ``examples``: pieces of YAML that it takes."""

    read: Callable[[Node], Any]
    examples: tuple[str, ...]


@dataclass(frozen=True)
class OrNone:
    """``word`` for None (``null``: any way YAML has to write nothing), or what ``kind`` says."""

    word: str
    kind: Whole | Decimal | OneOf | Flag | Text | Special

    def read(self, node: Node) -> Any:
        if node.is_null() if self.word == "null" else node.content == self.word:
            return None
        return self.kind.read(replace(node, otherwise=self.word))


Kind = Whole | Decimal | OneOf | Flag | Text | Special | OrNone

BAUDS = OneOf((1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600))
