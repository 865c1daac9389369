"""The name of a file in the complaint about it.

Problem: what fails after a file was opened, such as a full disk, does not say which file it was. Solution: who writes
says so around it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def naming(path: Path | str) -> Iterator[None]:
    """Give an OSError that has no file's name the name of the one that is written in here."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


def write_text(path: Path | str, text: str, encoding: str = "utf-8") -> None:
    """Write a whole file of text. Raises OSError with the file's name, on a full disk too."""
    with naming(path):
        Path(path).write_text(text, encoding)
