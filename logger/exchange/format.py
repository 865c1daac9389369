"""What a format of files for other programs offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cache
from pathlib import Path

from logger.errors import BadInput
from logger.exchange.windows import Windows
from logger.plugins import catalogue


class Format(ABC):
    """A way to write windows.

    name     as the file's of this package, and the ending of what it writes
    title    in a few words
    """

    name: str
    title: str

    @abstractmethod
    def write(self, windows: Windows, path: Path) -> None:
        """Write all windows into a file that is not there yet. BadInput where a library that it takes is missing;
        OSError where the file cannot be written."""


@cache
def formats() -> dict[str, Format]:
    """All there are, by the ending of their files."""
    return catalogue("logger.exchange.formats", "FORMAT")


def format_of(path: Path) -> Format:
    """The format that a file's ending asks for. BadInput for one that there is not."""
    known = formats()
    ending = path.suffix.removeprefix(".").lower()
    if ending not in known:
        expected = ", ".join(f".{name}" for name in known)
        raise BadInput(f"{path}: expected a file that ends in one of {expected}")
    return known[ending]
