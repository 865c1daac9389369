"""Tables of numbers under a header line (CSV), quick for long files and exact about the line at fault.

Problem: a profile or a record is hundreds of thousands of lines, from many hands; reading it line by line is slow, and
reading it at once tells nothing about the one line that is wrong.

Solution: NumPy reads the table at once, and only when that fails, or a value is not finite, are the lines looked at one
by one to name the one at fault.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from math import isfinite

import numpy as np
import numpy.typing as npt

from logger.errors import BadInput

Array = npt.NDArray[np.float64]
Names = tuple[str, ...]

SHOWN = 40
_NUMBER = re.compile(rb"[ \t]*[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?[ \t]*\r?")
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def parse_columns(data: bytes, file: str, choose: Callable[[Names], Names | None], header: str) -> tuple[Names, Array]:
    """The columns of a table that ``choose`` wants, and their numbers, (rows, columns), all finite, at least one row.

    choose    gives the names to read out of those in the header, or None when the header will not do
    header    what the header should have been, for the complaint

    Raises BadInput ("file:line: expected ..., found ...").
    """
    data = data.removeprefix(_BYTE_ORDER_MARK).rstrip()
    first = data.split(b"\n", 1)[0].decode("ascii", "replace").strip()
    names = tuple(name.strip() for name in first.split(","))
    wanted = choose(names)
    if wanted is None:
        raise BadInput(f"{file}:1: expected {header}, found {shown(first)}")
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
    return repr(text if len(text) <= SHOWN else text[:SHOWN] + "...") if text else "nothing"


def _by_line(data: bytes, file: str, names: Names, wanted: Names) -> Array:
    places = {name: names.index(name) for name in wanted}
    table = []
    for line, text in enumerate(data.split(b"\n")[1:], start=2):
        fields = text.split(b",")
        if len(fields) != len(names):
            found = shown(text.decode("ascii", "replace").strip())
            raise BadInput(f"{file}:{line}: expected {len(names)} fields ({','.join(names)}), found {found}")
        for name, place in places.items():
            if not _NUMBER.fullmatch(fields[place]) or not isfinite(float(fields[place])):
                found = shown(fields[place].decode("ascii", "replace").strip())
                raise BadInput(f"{file}:{line}: expected a number for {name}, found {found}")
        table.append([float(fields[place]) for place in places.values()])
    return np.array(table)
