"""The intact rows of a log as arrays, for logs by the thousand.

Problem: the reader of logs makes a record of each row, some 50 us; a year of a fleet would take days. Solution: the
check values are compared line by line, and where all fit, Arrow reads the numbers. Where a line does not fit, or
holds what no column may, the reader of logs judges the file row by row, so that both give the same rows.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drivers.regular_file import open_regular
from logger.errors import BadInput
from logger.store.log.row_format import COLUMNS, HEADER, scan
from logger.units import US_PER_S

_COUNTS = ("segment", "drive")
_NUMBERS = ("distance_start_m", "distance_end_m", "lat_deg", "lon_deg", "speed_mps", "iri_m_per_km",
            "iri_std_m_per_km", "a_w_mps2", "duration_s")
_LARGEST = {column.name: column.largest for column in COLUMNS}


@dataclass(frozen=True, eq=False)
class LogColumns:
    """Intact rows (n,) of one log.

    columns          by their names in the file, NaN: not known; ``utc_us`` (0: not known), ``t_us``, ``flags``,
                     ``crc32``
    damaged_lines    that were refused
    sha256           of the whole file
    """

    columns: Mapping[str, npt.NDArray[Any]]
    damaged_lines: int
    sha256: str


def read_bytes(log: Path) -> tuple[bytes, str]:
    """A log as it is, and its SHA-256. BadInput for one that cannot be opened."""
    try:
        with open_regular(log) as file:
            data = file.read()
    except OSError as error:
        raise BadInput(f"{log}: expected a segment log that can be read ({error.strerror})") from None
    return data, sha256(data).hexdigest()


def columns_of(data: bytes, digest: str) -> LogColumns:
    """The rows of a log, damaged or not."""
    columns = _quick(data)
    damaged = 0
    if columns is None:
        columns, damaged = _row_by_row(data)
    return LogColumns(columns, damaged, digest)


def _quick(data: bytes) -> dict[str, npt.NDArray[Any]] | None:
    """All rows; None where one of them is not intact, or is not what Arrow reads."""
    import pyarrow
    from pyarrow import csv

    header, _, body = data.partition(b"\n")
    if header != HEADER.encode() or not body.endswith(b"\n"):
        return None
    crc32 = zlib.crc32
    for line in body.splitlines():
        if b"%08x" % crc32(line[:-9]) != line[-8:] or line[-9:-8] != b",":
            return None
    types = {name: pyarrow.int64() for name in _COUNTS} | {name: pyarrow.float64() for name in (*_NUMBERS, "t_s")}
    types |= {"t_utc": pyarrow.timestamp("us", "UTC"), "flags": pyarrow.string(), "crc32": pyarrow.string()}
    try:
        table = csv.read_csv(
            io.BytesIO(data), csv.ReadOptions(use_threads=False),
            csv.ParseOptions(quote_char=False, ignore_empty_lines=False),
            csv.ConvertOptions(include_columns=list(types), column_types=types, null_values=[""]))
    except pyarrow.ArrowInvalid:
        return None
    if any(table[name].null_count for name in (*_COUNTS, "t_s", "duration_s")):
        return None
    columns: dict[str, npt.NDArray[Any]] = {name: table[name].to_numpy() for name in _COUNTS}
    for name in (*_NUMBERS, "t_s"):
        nulls = table[name].null_count
        values = table[name].to_numpy()
        if np.isfinite(values).sum() != len(values) - nulls or (np.abs(values) > (_LARGEST[name] or 1e10)).any():
            return None
        columns[name] = values
    columns["t_us"] = np.round(columns.pop("t_s") * US_PER_S).astype(np.int64)
    columns["utc_us"] = table["t_utc"].cast(pyarrow.int64()).fill_null(0).to_numpy()
    columns["flags"] = np.asarray(table["flags"].to_pylist(), dtype=object)
    columns["crc32"] = np.fromiter((int(one, 16) for one in table["crc32"].to_pylist()), np.int64, len(table))
    return columns


def _row_by_row(data: bytes) -> tuple[dict[str, npt.NDArray[Any]], int]:
    records, checks, damaged = [], [], 0
    for row in scan(io.BytesIO(data)):
        if row.record is None:
            damaged += 1
        else:
            records.append(row.record)
            checks.append(int(row.text[-8:], 16))
    columns: dict[str, npt.NDArray[Any]] = {
        name: np.array([getattr(one, name) for one in records], dtype=np.int64) for name in (*_COUNTS, "t_us")}
    columns |= {name: np.array([getattr(one, name) for one in records], dtype=np.float64) for name in _NUMBERS}
    columns["utc_us"] = np.array([one.utc_us or 0 for one in records], dtype=np.int64)
    columns["flags"] = np.array(["|".join(one.flags) for one in records], dtype=object)
    columns["crc32"] = np.array(checks, dtype=np.int64)
    return columns, damaged


def joined_columns(parts: list[Mapping[str, npt.NDArray[Any]]]) -> dict[str, npt.NDArray[Any]]:
    """The rows of parts, one after the other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
