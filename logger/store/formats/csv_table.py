"""Tables of numbers under a header line (CSV), quick for long files and exact about the line at fault.

Problem: a profile or a record is hundreds of thousands of lines, from many hands; reading it line by line is slow, and
reading it at once says nothing about the one line that is wrong.

Solution: NumPy reads the table at once, and only when that fails, or a value is not finite, are the lines looked at one
by one to name the one at fault. No line may be longer than ``LINE_BYTES``: a million columns, or a line without an end,
would take many times the memory of the file.
"""

from __future__ import annotations

import io
import re
from array import array
from collections.abc import Callable, Iterator
from math import isfinite

import numpy as np
import numpy.typing as npt

from drivers.errors import shortened
from logger.errors import BadInput

Array = npt.NDArray[np.float64]
Names = tuple[str, ...]

LINE_BYTES = 64 * 1024
SHOWN = 40
_NUMBER = re.compile(rb"[ \t]*[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?[ \t]*\r?")
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


_TAKEN_BY = (
    ({"t_s", "accel_z_mps2", "speed_mps", "distance_m"}, "a drive: ridelog estimate"),
    ({"t_s", "accel_z_mps2"}, "an acceleration record: ridelog comfort"),
)
"""All columns of the files of the desk that a command takes alone, what such a file is, and the command."""
_PROFILE = ("distance_m", "elevation_m")


def _taken_by(names: Names) -> str:
    """What a file is that another command takes; nothing for other files. A command refuses no file with all columns
    that it wants, so that nobody is sent to the command that has just refused."""
    known = "a profile: ridelog iri" if names == _PROFILE else next(
        (words for columns, words in _TAKEN_BY if columns <= set(names)), "")
    return f"; this is {known} takes it" if known else ""


def parse_columns(data: bytes, file: str, choose: Callable[[Names], Names | None], header: str) -> tuple[Names, Array]:
    """The columns of a table that ``choose`` wants, and their numbers, (rows, columns), all finite, at least one row.

    choose    gives the names to read out of those in the header, or None when the header will not do
    header    what the header should have been, for the complaint

    Raises BadInput ("file:line: expected ..., found ...").
    """
    data = data.removeprefix(_BYTE_ORDER_MARK).rstrip()
    refuse_long_lines(data, file)
    first = data.split(b"\n", 1)[0].decode("utf-8", "replace").strip()
    names = tuple(name.strip() for name in first.split(","))
    wanted = choose(names)
    if wanted is None:
        raise BadInput(f"{file}:1: expected {header}, found {shown(first)}{_taken_by(names)}")
    rows = data.count(b"\n")
    if rows == 0:
        raise BadInput(f"{file}:2: expected numbers below the header, found nothing")
    places = [names.index(name) for name in wanted]
    if data.count(b",") == (rows + 1) * (len(names) - 1):
        try:
            table = np.loadtxt(io.BytesIO(data), delimiter=",", comments=None, skiprows=1, usecols=places, ndmin=2)
        except ValueError:
            table = np.empty((0, 0))
        if len(table) == rows and np.isfinite(table).all():
            return wanted, table
    return wanted, _by_line(data, file, names, wanted)


def shown(text: str) -> str:
    """A piece of a bad file, short enough for a line of complaint."""
    return shortened(text, SHOWN) if text else "nothing"


def refuse_long_lines(data: bytes, file: str, first_line: int = 1) -> None:
    """Raises BadInput for a line that fills a block of ``LINE_BYTES``, as one of twice that length does somewhere."""
    for start in range(0, len(data) - LINE_BYTES, LINE_BYTES):
        if data.find(b"\n", start, start + LINE_BYTES) < 0:
            line = first_line + data.count(b"\n", 0, start)
            raise BadInput(f"{file}:{line}: expected lines of at most {LINE_BYTES} bytes")


def _by_line(data: bytes, file: str, names: Names, wanted: Names) -> Array:
    places = {name: names.index(name) for name in wanted}
    table = array("d")
    for line, text in enumerate(_lines(data), start=1):
        if line == 1:
            continue
        fields = text.split(b",")
        if len(fields) != len(names):
            found = shown(text.decode("ascii", "replace").strip())
            raise BadInput(f"{file}:{line}: expected {len(names)} fields ({_listed(names)}), found {found}")
        for name, place in places.items():
            if not _NUMBER.fullmatch(fields[place]) or not isfinite(float(fields[place])):
                found = shown(fields[place].decode("ascii", "replace").strip())
                raise BadInput(f"{file}:{line}: expected a number for {name}, found {found}")
            table.append(float(fields[place]))
    return np.frombuffer(table).reshape(-1, len(wanted))


def _lines(data: bytes) -> Iterator[bytes]:
    start = 0
    while (end := data.find(b"\n", start)) >= 0:
        yield data[start:end]
        start = end + 1
    yield data[start:]


def _listed(names: Names) -> str:
    text = ",".join(names)
    return text if len(text) <= 2 * SHOWN and text.isascii() and text.isprintable() else shown(text)
