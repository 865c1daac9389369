"""The intact rows of a log as arrays, for logs by the thousand.

Problem: the reader of logs makes a record of each row, some 50 us; a year of a fleet would take days. Solution: the
check values are compared line by line, and where all fit, Arrow reads the numbers. Where a line does not fit, or
holds what no column may, the reader of logs judges the file row by row, so that both give the same rows; but a number
that fits its check value and is spelt otherwise than a logger does (1e3) is taken here.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drivers.disk import open_regular
from logger.errors import BadInput
from logger.store.log.row_format import COLUMNS, FLAGS, HEADERS, LATEST_US, scan
from logger.units import US_PER_S

_COUNTS = ("segment", "drive")
_NUMBERS = ("distance_start_m", "distance_end_m", "lat_deg", "lon_deg", "speed_mps", "iri_m_per_km",
            "iri_std_m_per_km", "a_w_mps2", "duration_s", "iri_level_std_m_per_km", "iri_common_std_m_per_km",
            "iri_place_std_m_per_km")
_LARGEST_COUNT = 2**31 - 1
"""Of a dataset's column; no logger counts so far."""
_HEADERS = tuple(one.encode() for one in HEADERS)
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


def columns_of(logs: Sequence[tuple[bytes, str]]) -> list[LogColumns]:
    """The rows of logs, damaged or not, each given as its bytes and their digest."""
    headers = {data[:data.find(b"\n")] for data, _ in logs} & set(_HEADERS)
    if len(headers) > 1:
        return [one for log in logs for one in columns_of([log])]
    header = headers.pop() if headers else _HEADERS[0]
    checked = [_checks(data, header) for data, _ in logs]
    sizes = [0 if one is None else len(one) for one in checked]
    whole = _quick(header, [data for (data, _), one in zip(logs, checked, strict=True) if one is not None],
                   np.concatenate([one for one in checked if one is not None] or [np.zeros(0, np.int64)]))
    if whole is None and len(logs) > 1:
        return [one for log in logs for one in columns_of([log])]
    end = np.cumsum(sizes)
    return [LogColumns({name: values[last - size : last] for name, values in whole.items()}, 0, digest)
            if whole is not None and one is not None else LogColumns(*_row_by_row(data), digest)
            for (data, digest), one, size, last in zip(logs, checked, sizes, end.tolist(), strict=True)]


def _checks(data: bytes, wanted: bytes) -> npt.NDArray[np.int64] | None:
    """The check values of all lines; None where a line does not fit its own, or the header is another."""
    header, _, body = data.partition(b"\n")
    if header != wanted or not body.endswith(b"\n"):
        return None
    lines, crc32 = body.splitlines(), zlib.crc32
    checks = [crc32(line[:-9]) for line in lines]
    if any(b",%08x" % check != line[-9:] for check, line in zip(checks, lines, strict=True)):
        return None
    return np.array(checks, dtype=np.int64)


def _quick(header: bytes, logs: Sequence[bytes], checks: npt.NDArray[np.int64]
           ) -> dict[str, npt.NDArray[Any]] | None:
    """All rows of intact logs, read at once: a reading has a cost of its own; None where a row is not what Arrow
    reads."""
    import pyarrow
    from pyarrow import csv

    types = {name: pyarrow.int64() for name in _COUNTS} | {name: pyarrow.float64() for name in (*_NUMBERS, "t_s")}
    types |= {"t_utc": pyarrow.timestamp("us", "UTC"), "flags": pyarrow.string()}
    start = len(header) + 1
    data = b"".join([header, b"\n", *(memoryview(log)[start:] for log in logs)])
    try:
        table = csv.read_csv(
            io.BytesIO(data), csv.ReadOptions(use_threads=False, block_size=min(max(len(data), 1 << 20), 1 << 30)),
            csv.ParseOptions(quote_char=False, ignore_empty_lines=False),
            csv.ConvertOptions(include_columns=list(types), column_types=types, null_values=[""],
                               include_missing_columns=True))
    except pyarrow.ArrowInvalid:
        return None
    if len(table) != len(checks) or any(table[name].null_count for name in (*_COUNTS, "t_s", "duration_s")):
        return None
    columns: dict[str, npt.NDArray[Any]] = {name: table[name].to_numpy() for name in _COUNTS}
    if any((np.abs(columns[name]) > _LARGEST_COUNT).any() for name in _COUNTS):
        return None
    for name in (*_NUMBERS, "t_s"):
        nulls = table[name].null_count
        values = table[name].to_numpy()
        if np.isfinite(values).sum() != len(values) - nulls or (np.abs(values) > (_LARGEST[name] or 1e10)).any():
            return None
        columns[name] = values
    columns["t_us"] = np.round(columns.pop("t_s") * US_PER_S).astype(np.int64)
    columns["utc_us"] = table["t_utc"].cast(pyarrow.int64()).fill_null(0).to_numpy()
    if ((columns["utc_us"] < 0) | (columns["utc_us"] >= LATEST_US)).any():
        return None
    if not all(FLAGS.fullmatch(flags or "none") for flags in table["flags"].unique().to_pylist()):
        return None
    columns["flags"] = table["flags"].to_numpy(zero_copy_only=False)
    columns["crc32"] = checks
    return columns


def _row_by_row(data: bytes) -> tuple[dict[str, npt.NDArray[Any]], int]:
    records, checks, damaged = [], [], 0
    for row in scan(io.BytesIO(data)):
        if row.record is None or any(abs(getattr(row.record, name)) > _LARGEST_COUNT for name in _COUNTS):
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
