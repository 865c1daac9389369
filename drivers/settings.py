"""What a setting may be, as data.

Problem: an instrument's settings belong into its own file, but how a settings file is read and how a wrong value is
refused with its line belongs to the program that reads it. Solution: an instrument declares for each key what may stand
there; the reader knows these few kinds. Only what fits none of them brings a function of its own (``Special``), and
that asks a ``SettingNode``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self


class SettingNode(Protocol):
    """A value of a settings file, with its line. Each asking method raises the reader's own error when the value is
    something else; ``wrong`` makes that error: file, line, what was expected, what was found."""

    @property
    def content(self) -> Any: ...
    @property
    def plain(self) -> bool: ...
    def wrong(self, expected: str) -> Exception: ...
    def mapping(self, required: Iterable[str] = (), optional: Iterable[str] = ()) -> Mapping[str, Self]: ...
    def items(self) -> Sequence[Self]: ...
    def text(self) -> str: ...
    def number(self, low: float | None = None, high: float | None = None) -> float: ...
    def integer(self, low: int | None = None, high: int | None = None) -> int: ...
    def path(self, after: str = "") -> Path: ...


@dataclass(frozen=True)
class Whole:
    """A whole number from ``low`` to ``high``."""

    low: int
    high: int


@dataclass(frozen=True)
class Decimal:
    """A number from ``low`` to ``high``."""

    low: float
    high: float


@dataclass(frozen=True)
class OneOf:
    """One of some whole numbers."""

    numbers: tuple[int, ...]


@dataclass(frozen=True)
class Flag:
    """``true`` or ``false``."""


@dataclass(frozen=True)
class Text:
    """Any text that is not empty."""


@dataclass(frozen=True)
class Special:
    """What ``read`` makes of the value. ``examples``: pieces of YAML that it takes."""

    read: Callable[[SettingNode], Any]
    examples: tuple[str, ...]


@dataclass(frozen=True)
class OrNone:
    """``word`` for None (``null``: any way YAML has to write nothing), or what ``kind`` says."""

    word: str
    kind: Whole | Decimal | OneOf | Flag | Text | Special


Kind = Whole | Decimal | OneOf | Flag | Text | Special | OrNone

BAUDS = OneOf((1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600))
