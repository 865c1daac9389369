"""Files of MATLAB up to version 7: plain arrays by name, and the coordinates of a ``geopoint`` object.

Problem: what MATLAB saves of an object of a class is not documented; readers give its bytes alone. Solution: those
bytes are a variable of the documented format without a name (MAT-File Format, The MathWorks, "Subsystem data"). Given a
name, they are read as any other, and the numbers in it are found by their size.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.errors import BadInput
from logger.files import read_bounded

Array = npt.NDArray[np.float64]

_MOST_BYTES = 1 << 30
_HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
_SUBSYSTEM = "__function_workspace__"
_NAME_AT = 40  # after the tag of the matrix (8 bytes), its flags (16) and its two dimensions (16)
_NO_NAME, _A_NAME = b"\x01\0\0\0\0\0\0\0", b"\x01\0\x01\0w\0\0\0"  # of 8-bit letters: none; one, in the short form
_FEWEST = 3


def read_arrays(path: Path, names: tuple[str, ...]) -> list[Array]:
    """Arrays of these names, each as one row of numbers (n,). Raises BadInput for what is not there or no numbers."""
    found = _load(path, read_bounded(path, _MOST_BYTES))
    arrays = []
    for name in names:
        if name not in found:
            there = ", ".join(one for one in found if not one.startswith("__"))
            raise BadInput(f"{path}: expected an array {name}, found {there[:160] or 'none'}")
        value = np.asarray(found[name])
        if value.dtype.kind not in "fiu" or value.size < 2:
            raise BadInput(f"{path}: expected {name} to be numbers, found {value.dtype} of size {value.size}")
        arrays.append(value.ravel().astype(np.float64))
    return arrays


def read_geopoint(path: Path) -> tuple[Array, Array]:
    """Latitudes and longitudes (n,) [degrees] of a file with one ``geopoint``, or with arrays of the names ``lat`` and
    ``lon``. Raises BadInput where there are none.

    In an object the first row of numbers within 90 degrees is taken for the latitudes, the next as long for the
    longitudes: in that order MATLAB keeps them.
    """
    found = _load(path, read_bounded(path, _MOST_BYTES))
    if {"lat", "lon"} <= set(found):
        lat, lon = read_arrays(path, ("lat", "lon"))
        return lat, lon
    rows = list(_rows(_subsystem(path, found))) if _SUBSYSTEM in found else []
    for first, lat in enumerate(rows):
        if np.abs(lat).max() <= 90 and np.ptp(lat) > 0:
            for lon in rows[first + 1:]:
                if len(lon) == len(lat) and np.abs(lon).max() <= 180 and np.ptp(lon) > 0:
                    return lat, lon
    there = ", ".join(one for one in found if not one.startswith("__"))
    raise BadInput(f"{path}: expected a geopoint, or arrays lat and lon, found {there[:160] or 'nothing of that'}")


def _load(path: Path, data: bytes) -> dict[str, Any]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        read: dict[str, Any] = loadmat(io.BytesIO(data))
    except NotImplementedError:
        raise BadInput(f"{path}: expected a .mat file up to version 7, found version 7.3: save it with -v7") from None
    except (ValueError, TypeError, KeyError, IndexError, OSError, MemoryError, MatReadError, zlib.error) as error:
        raise BadInput(f"{path}: expected a .mat file, found {str(error)[:120]}") from None
    return read


def _subsystem(path: Path, found: dict[str, Any]) -> Any:
    """What lies in the nameless variable: the first 8 bytes repeat version and byte order."""
    held = np.asarray(found[_SUBSYSTEM]).tobytes()[8:]
    if held[_NAME_AT: _NAME_AT + 8] == _NO_NAME:
        held = held[:_NAME_AT] + _A_NAME + held[_NAME_AT + 8:]
    kind, size = struct.unpack("<II", held[:8]) if len(held) >= 8 else (0, 0)
    return _load(path, _HEADER + held[: 8 + size]) if kind == 14 else {}


def _rows(value: Any) -> Iterator[Array]:
    """Every row of numbers in nested cells, structures and objects."""
    if isinstance(value, dict):
        for name, one in value.items():
            if not name.startswith("__"):
                yield from _rows(one)
    elif isinstance(value, np.ndarray) and value.dtype.names:
        for name in value.dtype.names:
            for one in value[name].ravel():
                yield from _rows(one)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        for one in value.ravel():
            yield from _rows(one)
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f" and value.size >= _FEWEST:
        yield value.ravel().astype(np.float64)
