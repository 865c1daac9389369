"""CSV files of phones and other loggers as columns of numbers, whatever separates their fields.

Problem: such files have quoted names, semicolons and decimal commas, cells that are empty where a sensor said nothing,
dates in place of seconds. Solution: a plain table is read at once; any other one line by line, so that a bad cell is
named with its line. What is empty is NaN.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.errors import BadInput
from logger.files import read_bounded
from logger.store.formats.csv_table import refuse_long_lines, shown
from logger.store.formats.logger_columns import Named, Recognised, plain, recognise
from logger.store.formats.logger_layouts import TIME_UNITS
from logger.store.formats.record_file import MAX_BYTES, MAX_TIME_S

Array = npt.NDArray[np.float64]

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_EMPTY = {"", "nan", "null", "none", "na", "n/a", "-"}
_EPOCHS = (("ns", 1e17), ("us", 1e14), ("ms", 1e11), ("s", 1e9))
"""Seconds since 1970 are 1e9 from 2001 to beyond 2200, and no time that begins at zero comes to that."""
_RATES_HZ = (4.0, 4000.0)
"""Of accelerometers in loggers: a thousand wide, so that one unit of time fits and no second one."""


@dataclass(frozen=True, eq=False)
class Header:
    """A file's first line with names: its number, the names, and what separates them."""

    path: Path
    line: int
    names: tuple[str, ...]
    delimiter: str
    text: str


@dataclass(frozen=True, eq=False)
class LoggerTable:
    """The columns (n,) of a file by role, as they are written but for NaN where a cell is empty; times of the unit
    "iso" are seconds since 1970. ``lines`` (n,) in which they stand; ``is_torn``: the last line was cut short, and is
    left out."""

    header: Header
    known: Recognised
    columns: Mapping[str, Array]
    lines: npt.NDArray[np.int64]
    is_torn: bool = False

    def unit(self, role: str) -> str | None:
        """The unit of a column, where it is known."""
        return self.known.columns[role].unit

    def wrong(self, row: int, words: str) -> BadInput:
        """A complaint about a row."""
        return BadInput(f"{self.header.path}:{self.lines[row]}: {words}")


def read_header(path: Path) -> Header:
    """The header of a file. Raises BadInput for one that cannot be read or has none."""
    text = _text(path)
    for number, line in enumerate(io.StringIO(text), start=1):
        if line.strip() and not line.lower().startswith("sep="):
            delimiter = max(",;\t", key=line.count)
            names = tuple(name.strip() for name in next(csv.reader([line.strip()], delimiter=delimiter)))
            if len(names) < 2:
                break
            return Header(path, number, names, delimiter, text)
    raise BadInput(f"{path}:1: expected a header with names of columns between commas, semicolons or tabs, found "
                   f"{shown(text[:80].strip())}")


def recognised(header: Header, named: Named | None) -> Recognised | None:
    """What is known to be in a file, by its header and name. Errors as ``logger_columns.recognise``."""
    try:
        return recognise(header.names, header.path.stem, named)
    except BadInput as error:
        raise BadInput(f"{header.path}:{header.line}: {error}") from None


def read_table(header: Header, known: Recognised) -> LoggerTable:
    """The columns that are known. Raises BadInput ("file:line: expected ..., found ...") for a cell that is no number,
    and for a file without rows."""
    there = [plain(name) for name in header.names]
    places = {role: there.index(plain(column.header)) for role, column in known.columns.items()}
    body = header.text.split("\n", header.line)[header.line] if header.text.count("\n") >= header.line else ""
    if not body.strip():
        raise BadInput(f"{header.path}:{header.line + 1}: expected numbers below the header, found nothing")
    table = _at_once(body, header, list(places.values()))
    if table is not None:
        lines, is_torn = header.line + 1 + np.arange(len(table)), False
    else:
        table, lines, is_torn = _by_line(body, header, places)
    return LoggerTable(header, known, dict(zip(places, table.T.copy(), strict=True)), lines, is_torn)


def seconds(table: LoggerTable, same_as: LoggerTable | None = None) -> Array:
    """The times (n,) of a table [s]. A unit that is not known is taken from the size of the numbers, or is that of
    another table with the same column. BadInput where neither can be."""
    times, unit = table.columns["t"], table.unit("t")
    if unit is None and same_as is None:
        unit = _stepping_unit(times)
    elif unit is None and same_as is not None and _time_of(same_as) == _time_of(table):
        unit = same_as.unit("t") or _stepping_unit(same_as.columns["t"])
    unit = unit or _epoch_unit(times)
    if unit is None:
        raise BadInput(f"{table.header.path}: expected to know the unit of the time {table.known.columns['t'].header}: "
                       f"give t={table.known.columns['t'].header}:UNIT in --columns, one of {', '.join(TIME_UNITS)}")
    times_s = np.asarray(times * TIME_UNITS[unit])
    if (far := np.abs(times_s) > MAX_TIME_S).any():
        raise table.wrong(int(np.argmax(far)), f"expected times within {MAX_TIME_S:g} s, found "
                          f"{times_s[np.argmax(far)]:.4g} s: is the unit {unit} right?")
    return times_s


def _time_of(table: LoggerTable) -> str:
    return plain(table.known.columns["t"].header)


def _epoch_unit(times: Array) -> str | None:
    known = times[np.isfinite(times)]
    first = float(known[0]) if len(known) else 0.0
    return next((unit for unit, least in _EPOCHS if first >= least), None)


def _stepping_unit(times: Array) -> str | None:
    steps = np.diff(np.unique(times[np.isfinite(times)]))
    step = float(np.median(steps)) if len(steps) else 0.0
    low, high = _RATES_HZ
    return next((unit for unit in ("s", "ms", "us", "ns") if step > 0 and low <= 1 / (step * TIME_UNITS[unit]) < high),
                None)


def _text(path: Path) -> str:
    data = read_bounded(path, MAX_BYTES).removeprefix(_BYTE_ORDER_MARK)
    refuse_long_lines(data, str(path))
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # of programs that write the square of m/s² so
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _at_once(body: str, header: Header, places: list[int]) -> Array | None:
    """All rows of a plain table; None where some cell is none of a plain one."""
    if header.delimiter != "," and "," in body:
        body = body.replace(",", ".")
    if '"' in body or "\n\n" in body.rstrip():
        return None
    try:
        table = np.loadtxt(io.StringIO(body), delimiter=header.delimiter, comments=None, usecols=places, ndmin=2)
    except ValueError:
        return None
    same = all(line.count(header.delimiter) == len(header.names) - 1 for line in body.rstrip("\n").split("\n"))
    return table if same and np.isfinite(table).all() else None


def _by_line(body: str, header: Header, places: Mapping[str, int]) -> tuple[Array, npt.NDArray[np.int64], bool]:
    rows, lines, is_torn = [], [], False
    for number, cells in _rows(body, header):
        if is_torn := len(cells) < len(header.names) and number == header.line + 1 + body.count("\n"):
            break  # without an end of its line: the recorder was stopped while it wrote
        if len(cells) != len(header.names):
            raise BadInput(f"{header.path}:{number}: expected {len(header.names)} fields, found "
                           f"{shown(header.delimiter.join(cells).strip())}")
        rows.append([_number(cells[place], role, header, number) for role, place in places.items()])
        lines.append(number)
    if not rows:
        raise BadInput(f"{header.path}:{header.line + 1}: expected numbers below the header, found nothing")
    return np.array(rows, dtype=float), np.array(lines, dtype=np.int64), is_torn


def _rows(body: str, header: Header) -> Iterator[tuple[int, list[str]]]:
    for number, line in enumerate(body.split("\n"), start=header.line + 1):
        if not line.strip():
            continue
        cells = next(csv.reader([line], delimiter=header.delimiter))
        if len(cells) == len(header.names) + 1 and not cells[-1].strip():
            cells.pop()  # some programs end each line with a separator
        yield number, cells


def _number(cell: str, role: str, header: Header, line: int) -> float:
    text = cell.strip().replace("−", "-")
    if text.lower() in _EMPTY:
        return float("nan")
    if header.delimiter != ",":
        text = text.replace(",", ".")
    try:
        number = float(text)
    except ValueError:
        if role == "t" and (time := _iso(text)) is not None:
            return time
        wanted = "a time" if role == "t" else "a number"
        raise BadInput(f"{header.path}:{line}: expected {wanted} for {role}, found {shown(text)}") from None
    if not isfinite(number):
        raise BadInput(f"{header.path}:{line}: expected a number for {role}, found {shown(text)}")
    return number


def _iso(text: str) -> float | None:
    """Seconds since 1970 of a date and time by ISO 8601; without a zone it is taken as UTC."""
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        return None
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()
