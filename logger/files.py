"""Files as a whole: read up to a size that fits the machine, written with their names in every complaint.

Problem: a file that somebody else made may be of any size, and what fails after a file was opened, such as a full disk,
does not say which file it was. Solution: reading stops at a limit, and who writes says around it what is written.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from drivers.regular_file import open_regular
from logger.errors import BadInput

_GROWN_BYTES = 1 << 20


def read_bounded(path: Path | str, max_bytes: int) -> bytes:
    """All bytes of a file. Raises BadInput for one that cannot be read or is longer than ``max_bytes``."""
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            too_long = size > max_bytes
            data = b"" if too_long else file.read(size + 1)  # what is asked for is held, also where nothing comes
            while size < len(data) <= max_bytes and (more := file.read(_GROWN_BYTES)):  # it grows, or tells no size
                data += more
    except OSError as error:
        raise BadInput(f"{path}: expected a readable file ({error.strerror})") from None
    if too_long or len(data) > max_bytes:
        raise BadInput(f"{path}: expected at most {max_bytes} bytes")
    return data


def file_in(path: Path | str, name: str) -> Path:
    """A file or, of a folder, the file of that name in it. Raises BadInput for a folder without one."""
    place = Path(path)
    if not place.is_dir():
        return place
    if not (place / name).is_file():
        raise BadInput(f"{path}: expected a file, or a folder with {name}, found a folder without it")
    return place / name


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


def replace_bytes(path: Path, data: bytes) -> None:
    """Write a file that is there whole, in place of the old one, or not at all, also if the power goes or another
    process writes it too. Raises OSError, with nothing left behind."""
    new = path.with_name(f".{path.name}.{os.getpid()}")
    with naming(path):
        try:
            with new.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            new.replace(path)
        except OSError:
            new.unlink(missing_ok=True)
            raise
