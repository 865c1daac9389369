"""What a format of files for other programs offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from logger.errors import BadInput
from logger.exchange.layer import Layer
from logger.files import write_file
from logger.plugins import catalogue


class Format(ABC):
    """A way to write a layer.

    name     as the file's of this package, and the ending of what it writes
    title    in a few words
    """

    name: str
    title: str

    @abstractmethod
    def content(self, layer: Layer, file: str) -> Iterable[bytes]:
        """A file with all rows, in pieces. BadInput, with the name of the ``file`` that it is for, where a library that
        it takes is missing."""


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


def write_layer(layer: Layer, path: Path) -> None:
    """Write a file that is there whole, in place of an old one, or not at all; its texts are words that can be seen
    (``logger.printable``). BadInput as ``format_of`` and ``Format.content``, and where it cannot be written."""
    form = format_of(path)
    try:
        write_file(path, form.content(layer.printable(), str(path)))
    except OSError as error:
        raise BadInput(f"{path}: expected a file that can be written ({error.strerror or error})") from None
