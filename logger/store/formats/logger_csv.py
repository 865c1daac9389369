"""CSV files of phones and other loggers as columns by role.

Problem: such files have columns of many names and units, cells that are empty where a sensor said nothing, times in
units that nobody wrote down. Solution: the table is read as any other (``csv_table``); its columns are recognised or
named (``logger_columns``); what is empty is NaN, and a time shows its unit by its size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.bounds import TIME
from logger.errors import BadInput
from logger.files import read_bounded
from logger.store.formats.csv_table import CsvTable, Names, find_table, read_rows, shown
from logger.store.formats.logger_columns import Named, Recognised, plain, recognise, unit_of_cell
from logger.store.formats.logger_layouts import TIME_UNITS, units_of
from logger.store.formats.record_file import MAX_BYTES

Array = npt.NDArray[np.float64]

_EPOCHS = (("ns", 1e17), ("us", 1e14), ("ms", 1e11), ("s", 1e9))
"""Seconds since 1970 are 1e9 from 2001 to beyond 2200, and no time that begins at zero comes to that."""
_RATES_HZ = (4.0, 4000.0)
"""Of accelerometers in loggers: a thousand wide, so that one unit of time fits and no second one."""


@dataclass(frozen=True, eq=False)
class Header:
    """A file's table, of which the names are known; none where no line has them."""

    path: Path
    table: CsvTable

    @property
    def names(self) -> Names:
        """Of the columns."""
        return self.table.names

    @property
    def line(self) -> int:
        """In which they stand."""
        return self.table.line


@dataclass(frozen=True, eq=False)
class LoggerTable:
    """The columns (n,) of a file by role, as they are written but for NaN where a cell is empty; times of the unit
    "iso" are seconds since 1970. ``lines`` (n,) in which they stand; ``is_torn``: the last line was cut short, and is
    left out."""

    header: Header
    known: Recognised
    columns: Mapping[str, Array]
    lines: Sequence[int]
    is_torn: bool = False

    def unit(self, role: str) -> str | None:
        """The unit of a column, where it is known."""
        return self.known.columns[role].unit

    def wrong(self, row: int, words: str) -> BadInput:
        """A complaint about a row."""
        return BadInput(f"{self.header.path}:{self.lines[row]}: {words}")


def read_header(path: Path, named: Named | None = None) -> Header:
    """The header of a file: the first line whose names are known or ``named``, else the most likely one. Raises
    BadInput for a file that cannot be read as text, or has no such line."""

    def fits(names: Names) -> bool:
        try:
            return len(names) > 1 and recognise(names, path.stem, named) is not None
        except BadInput:
            return True  # some name is there twice, which is said when the columns are recognised

    table = find_table(read_bounded(path, MAX_BYTES), str(path), fits, unit_of_cell)
    if len(table.names) == 1:
        raise BadInput(f"{path}:{table.line}: expected a header with names of columns between commas, semicolons or "
                       f"tabs, found {shown(table.found)}")
    return Header(path, table)


def recognised(header: Header, named: Named | None) -> Recognised | None:
    """What is known to be in a file, by its header and name. Errors as ``logger_columns.recognise``."""
    try:
        known = recognise(header.names, header.path.stem, named)
    except BadInput as error:
        raise BadInput(f"{header.path}:{header.line}: {error}") from None
    if known is None or not header.table.units:
        return known
    below = dict(zip(map(plain, header.names), map(unit_of_cell, header.table.units), strict=True))
    return replace(known, columns={
        role: replace(column, unit=unit) if column.unit is None and unit in units_of(role) else column
        for role, column in known.columns.items() for unit in [below[plain(column.header)]]})


def read_table(header: Header, known: Recognised) -> LoggerTable:
    """The columns that are known. Raises BadInput ("file:line: expected ..., found ...") for a cell that is no number,
    and for a file without rows."""
    there, roles = [plain(name) for name in header.names], tuple(known.columns)
    places = [there.index(plain(column.header)) for column in known.columns.values()]
    rows = read_rows(header.table, places, roles, gaps=True, time=roles.index("t") if "t" in roles else None)
    return LoggerTable(header, known, dict(zip(roles, rows.values.T.copy(), strict=True)), rows.lines, rows.is_torn)


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
    if (far := np.abs(times_s) > TIME.largest).any():
        raise table.wrong(int(np.argmax(far)), f"expected times within {TIME.largest:g} s, found "
                          f"{times_s[np.argmax(far)]:.4g} s: is the unit {unit} right?")
    return np.where(np.abs(times_s) < TIME.least, 0.0, times_s)


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
