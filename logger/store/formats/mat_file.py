"""Files of MATLAB of version 5 to 7: arrays of numbers by name, and the coordinates of a ``geopoint`` object.

Problem: what MATLAB saves of an object of a class is not documented; readers give its bytes alone. Solution: those
bytes are elements of the documented format (MAT-File Format, The MathWorks, "Data Element Format" and "Subsystem
data"). They are read as any other, and the numbers in them are found by their size.

Elements are a kind and a size of 4 bytes each, or, up to 4 bytes long, of 2 bytes each; a matrix holds others: its
class, its dimensions, its name, and its numbers or further matrices. They are followed here and not by SciPy, which
follows a damaged size or class out of the file, where the process ends.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from logger.arrays import Array
from logger.errors import BadInput
from logger.files import MAP_BYTES, read_bounded
from logger.printable import printable

_ORDERS = {b"IM": "<", b"MI": ">"}
_MATRIX, _COMPRESSED = 14, 15  # kinds of elements
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_NUMERIC = range(6, 16)  # classes of matrices: double, single and whole numbers


@dataclass(frozen=True, eq=False)
class _Matrix:
    """A matrix of a file; ``numbers`` (n,) None: it holds something else, or matrices, ``inside``."""

    name: str
    numbers: Array | None
    is_floating: bool
    inside: tuple[_Matrix, ...]


def read_arrays(path: Path, names: tuple[str, ...]) -> list[Array]:
    """Arrays of these names, each as a row (n,), column by column. BadInput for what is not there or no numbers."""
    found = {one.name: one for one in _load(path)}
    arrays = []
    for name in names:
        if name not in found:
            raise BadInput(f"{path}: expected an array {name}, found {_names(found) or 'none'}")
        numbers = found[name].numbers
        if numbers is None or len(numbers) < 2:
            raise BadInput(f"{path}: expected {name} to be numbers, found "
                           f"{'something else' if numbers is None else len(numbers)}")
        arrays.append(numbers)
    return arrays


def read_geopoint(path: Path) -> tuple[Array, Array]:
    """Latitudes and longitudes (n,) [degrees] of a file with one ``geopoint``, or with arrays of the names ``lat`` and
    ``lon``. Raises BadInput where there are none.

    In an object the first row of numbers within 90 degrees is taken for the latitudes, the next as long for the
    longitudes: in that order MATLAB keeps them.
    """
    matrices = _load(path)
    found = {one.name: one for one in matrices}
    if {"lat", "lon"} <= set(found):
        lat, lon = read_arrays(path, ("lat", "lon"))
        return lat, lon
    nameless = [one.numbers for one in matrices if not one.name and one.numbers is not None]
    rows = [row for numbers in nameless for row in _subsystem(path, numbers)]
    for first, lat in enumerate(rows):
        if np.abs(lat).max() <= 90 and np.ptp(lat) > 0:
            for lon in rows[first + 1:]:
                if len(lon) == len(lat) and np.abs(lon).max() <= 180 and np.ptp(lon) > 0:
                    return lat, lon
    raise BadInput(f"{path}: expected a geopoint, or arrays lat and lon, found {_names(found) or 'nothing of that'}")


def _names(found: dict[str, _Matrix]) -> str:
    return printable(", ".join(one for one in found if one))[:160]


def _load(path: Path) -> list[_Matrix]:
    data = read_bounded(path, MAP_BYTES)
    if data.startswith(b"MATLAB 7.3"):
        raise BadInput(f"{path}: expected a .mat file up to version 7, found version 7.3: save it with -v7")
    order = _ORDERS.get(data[126:128])
    if not data.startswith(b"MATLAB") or order is None:
        raise BadInput(f"{path}: expected a .mat file of version 5 to 7, found a different file header: save it with "
                       "-v7")
    try:
        return list(_matrices(data, 128, len(data), order))
    except (ValueError, struct.error, zlib.error) as error:
        raise BadInput(f"{path}: expected a whole .mat file, found {error}") from None


def _subsystem(path: Path, held: Array) -> list[Array]:
    """Rows of numbers in the nameless variable, whose first 8 bytes repeat version and byte order."""
    data = held.astype(np.uint8).tobytes()
    try:
        return list(_rows(list(_matrices(data, 8, len(data), _ORDERS.get(data[2:4], "<")))))
    except (ValueError, struct.error, zlib.error) as error:
        raise BadInput(f"{path}: expected a whole object, found {error}") from None


def _rows(matrices: list[_Matrix] | tuple[_Matrix, ...]) -> Iterator[Array]:
    """Every row of floating numbers in nested cells, structures and objects."""
    fewest = 3
    for one in matrices:
        if one.numbers is not None and one.is_floating and len(one.numbers) >= fewest and np.isfinite(
                one.numbers).all():
            yield one.numbers
        yield from _rows(one.inside)


def _elements(data: bytes, at: int, end: int, order: str) -> Iterator[tuple[int, int, int]]:
    """Kind, begin and end of each element. ValueError for one that goes beyond what holds it."""
    while at + 8 <= end:
        kind, size = struct.unpack_from(order + "II", data, at)
        body, after = at + 8, at + 8 + size + (-size % 8 if kind != _COMPRESSED else 0)
        if kind >> 16:
            kind, size, body, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        if body + size > min(end, after):
            raise ValueError(f"an element of {size} bytes where {max(0, end - body)} are left")
        yield kind, body, body + size
        at = after


def _matrices(data: bytes, at: int, end: int, order: str, depth: int = 0) -> Iterator[_Matrix]:
    deepest = 30
    if depth > deepest:
        raise ValueError(f"more than {deepest} matrices inside each other")
    for kind, begin, stop in _elements(data, at, end, order):
        if kind == _COMPRESSED:
            engine = zlib.decompressobj()
            inside = engine.decompress(data[begin:stop], MAP_BYTES)
            if engine.unconsumed_tail:
                raise ValueError(f"a variable of more than {MAP_BYTES} bytes")
            yield from _matrices(inside, 0, len(inside), order, depth=depth + 1)
        elif kind == _MATRIX and stop > begin:
            yield _matrix(data, begin, stop, order, depth)


def _matrix(data: bytes, begin: int, stop: int, order: str, depth: int) -> _Matrix:
    floating = (6, 7)  # classes of matrices: double and single
    is_complex = 1 << 11  # of its flags
    parts = list(_elements(data, begin, stop, order))
    if not parts or parts[0][2] - parts[0][1] < 8:
        raise ValueError("a matrix without a class")
    flags, = struct.unpack_from(order + "I", data, parts[0][1])
    name = data[parts[2][1] : parts[2][2]].decode("latin-1") if len(parts) > 2 else ""
    if flags & 0xFF not in _NUMERIC:
        return _Matrix(name, None, False, tuple(_matrices(data, begin, stop, order, depth=depth + 1)))
    kind, first, last = parts[3] if len(parts) > 3 else (9, stop, stop)
    if kind not in _NUMBERS or flags & is_complex:
        raise ValueError(f"numbers of an unknown kind, {kind}, or complex ones")
    form = np.dtype(order + _NUMBERS[kind])
    with np.errstate(invalid="ignore"):  # of numbers that are none
        numbers = np.frombuffer(data, form, (last - first) // form.itemsize, first).astype(np.float64)
    return _Matrix(name, numbers, flags & 0xFF in floating, ())
