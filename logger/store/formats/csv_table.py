"""Tables of numbers as text, from many hands: the one reader of profiles, records, drives and phones.

Problem: a table is hundreds of thousands of lines; its fields stand between commas, semicolons or tabs, its numbers may
have decimal commas, its header may stand below lines of other words, or be missing. Reading it line by line is slow,
reading it at once says nothing about the one line that is wrong, and a comma that is taken for another one gives
numbers that look like any others.

Solution: the header is the first line, among those at the beginning, that has the names that are looked for. A comma
inside a number is decimal only where the file shows it: ``1,234`` alone may be a thousand, ``0,5`` cannot. NumPy reads
the table at once, and only when that fails are the lines looked at one by one to name the one at fault. No line may be
longer than ``LINE_BYTES``: a million columns, or a line without an end, would take many times the memory of the file.
"""

import csv
import io
import re
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from math import isfinite, nan

import numpy as np

from drivers.errors import SHOWN, shortened
from logger.arrays import Array
from logger.bounds import Quantity
from logger.errors import BadInput

Names = tuple[str, ...]

LINE_BYTES = 64 * 1024
_HEAD_LINES, HEAD_BYTES = 200, 1024 * 1024
"""A header is looked for in so much of a file: the longest block of words above one is a page or two."""
_DELIMITERS = ("\t", ";", ",", "|")
_BLANKS = " "
_COMMENT = ("#", "%", "//")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2}(?:,[0-9]{3})+")
"""What may be a whole number with a comma after each three digits, and is no proof of a decimal comma."""
_EMPTY = frozenset(("", "nan", "null", "none", "na", "n/a", "-"))
_KINDS = ((b"PK\x03\x04", "a workbook (.xlsx, .ods) or another zip archive: save the sheet as CSV, or unpack it"),
          (b"\xd0\xcf\x11\xe0", "an Excel workbook (.xls): save the sheet as CSV"),
          (b"\x1f\x8b", "a file packed with gzip: unpack it"), (b"PAR1", "a Parquet file: save the table as CSV"),
          (b"SQLite format 3", "a database (SQLite): save the table as CSV"), (b"%PDF", "a PDF: save the table as CSV"),
          (b"\x89HDF", "an HDF5 file: save the table as CSV"), (b"MATLAB ", "a MATLAB file: save the table as CSV"))
"""First bytes of files that are no text but might be given for one, and what to do with them."""
_TAKEN_BY = (({"t_s", "accel_z_mps2", "speed_mps", "distance_m"}, "a drive: ridelog estimate"),
             ({"t_s", "accel_z_mps2"}, "an acceleration record: ridelog comfort"))
"""All columns of the files of the desk that a command takes alone, what such a file is, and the command."""
_PROFILE = ("distance_m", "elevation_m")


class FileOfRows(str):
    """The name of a table's file, which knows the lines in which the rows stand."""

    lines: Sequence[int] = ()


def place(file: str, row: int) -> str:
    """``file:line`` of a row of a table, counted from 0; of a bare name, as if its header were the first line."""
    lines = file.lines if isinstance(file, FileOfRows) else ()
    if not len(lines):
        return f"{file}:{row + 2}"
    return f"{file}:{lines[row] if row < len(lines) else lines[-1] + row + 1 - len(lines)}"


def taken(quantity: Quantity, name: str, values: Array, file: str) -> Array:
    """A column (n,) of a table, or of a stretch of it, within its bounds, as ``Quantity.taken``."""
    return quantity.taken(name, values, partial(place, file))


@dataclass(frozen=True, eq=False)
class CsvTable:
    """A table in a file, found but not read yet.

    line         of the header; 0: there is none, and ``names`` is empty
    found        the line that stands where a header should, to be shown
    units        of a line below the header, by column; empty where there is no such line
    delimiter    between fields; a blank: one blank or more
    body, body_line    what lies below, and the number of its first line
    """

    file: str
    line: int
    found: str
    names: Names
    units: Names
    delimiter: str
    body: bytes
    body_line: int

    def no_header(self, wanted: str, option: str = "") -> BadInput:
        """The complaint about a file whose first line has numbers where names should stand, and the ``option`` to give
        with it when it has them."""
        return BadInput(f"{self.file}:{self.body_line}: expected {wanted}, found numbers: no line names the columns; "
                        f"put one above them{option and f', and give {option}'}")


@dataclass(frozen=True, eq=False)
class Rows:
    """``values`` (rows, columns), the ``lines`` in which they stand, and whether the last line was cut short."""

    values: Array
    lines: Sequence[int]
    is_torn: bool = False


# --- what is in a file ---


def find_table(data: bytes, file: str, fits: Callable[[Names], bool], unit_of: Callable[[str], str | None] | None = None
               ) -> CsvTable:
    """The table below the first line that has names that fit or, where none does, below what looks like a header.

    unit_of    tells the unit in a cell, of which a line may stand below the header; None: no such line

    Raises BadInput for what is no text, and for a line that is too long.
    """
    data = _text(data, file)
    refuse_long_lines(data, file)
    head = list(_head(data))
    said = next((line[4:5] or "," for _, _, line in head if line.lower().startswith("sep=")), None)
    for number, end, line in head:
        bare = line.lstrip("".join(_COMMENT) + _BLANKS) if line.startswith(_COMMENT) else line
        for delimiter in _delimiters(bare, said):
            names = _names(bare, delimiter)
            if fits(names):
                return _below(data, file, head, number, end, line, names, delimiter, unit_of)
    return _unknown(data, file, head, said, unit_of)


def _below(data: bytes, file: str, head: Sequence[tuple[int, int, str]], number: int, end: int, line: str,
           names: Names, delimiter: str, unit_of: Callable[[str], str | None] | None) -> CsvTable:
    units: Names = ()
    after = next((one for one in head if one[0] > number), None)
    if unit_of is not None and after is not None:
        cells = _names(after[2], delimiter)
        if len(cells) == len(names) and any(map(unit_of, cells)) and not any(map(_is_value, cells)):
            units, number, end = cells, after[0], after[1]
            return CsvTable(file, number - 1, line, names, units, delimiter, data[end:], number + 1)
    return CsvTable(file, number, line, names, units, delimiter, data[end:], number + 1)


def _unknown(data: bytes, file: str, head: Sequence[tuple[int, int, str]], said: str | None,
             unit_of: Callable[[str], str | None] | None) -> CsvTable:
    """By the first line of numbers: the header is the line of as many words above it, or above a line of units."""
    above: list[tuple[int, int, str]] = []
    for number, end, line in head:
        for delimiter in _delimiters(line, said):
            cells = _names(line, delimiter)
            if len(cells) > 1 and any(map(_is_value, cells)) and all(
                    _is_value(one) or one.lower() in _EMPTY for one in cells):
                alike = [(before, names) for before in reversed(above) for names in [_names(before[2], delimiter)]
                         if len(names) == len(cells) and not any(map(_is_value, names))]
                if len(alike) > 1 and unit_of is not None and any(map(unit_of, alike[0][1])):
                    alike.pop(0)
                if alike:
                    return _below(data, file, head, *alike[0][0], alike[0][1], delimiter, unit_of)
                if not above:
                    return CsvTable(file, 0, line, (), (), delimiter, data, number)
                return _first(data, file, above, said)
        if not line.lower().startswith("sep=") and not line.startswith(_COMMENT):
            above.append((number, end, line))
    return _first(data, file, above or head, said)


def _first(data: bytes, file: str, head: Sequence[tuple[int, int, str]], said: str | None) -> CsvTable:
    """The first line as the header, whatever it is."""
    if not head:
        return CsvTable(file, 1, "", (), (), ",", b"", 2)
    delimiter = next((one for one in _delimiters(head[0][2], said) if one != _BLANKS), ",")
    return _below(data, file, head, *head[0], _names(head[0][2], delimiter), delimiter, None)


def _head(data: bytes) -> Iterator[tuple[int, int, str]]:
    """The first lines that are not blank: the number, where the next one begins, the text."""
    start = number = 0
    while start < min(len(data), HEAD_BYTES) and number < _HEAD_LINES:
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        number += 1
        if line := _decoded(data[start:end]).strip(" "):
            yield number, end + 1, line
        start = end + 1


def _decoded(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")  # of programs that write the square of m/s² so


def _delimiters(line: str, said: str | None) -> list[str]:
    if said is not None:
        return [said]
    there = sorted((one for one in _DELIMITERS if one in line), key=line.count, reverse=True)
    return [*there, _BLANKS]


def _names(line: str, delimiter: str) -> Names:
    cells = [cell.strip().strip('"').strip() for cell in _cells(line, delimiter)]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return tuple(cells)


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == _BLANKS:
        return line.split()
    if '"' not in line:
        return line.split(delimiter)
    return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))


def _is_value(cell: str) -> bool:
    return bool(_NUMBER.fullmatch(cell.replace(",", "."))) or seconds_of_date(cell) is not None


def _text(data: bytes, file: str) -> bytes:
    """The same as UTF-8 or another code that writes ASCII as it is, without a mark, with line feeds."""
    kind = next((words for first, words in _KINDS if data.startswith(first)), None)
    if kind is not None:
        raise BadInput(f"{file}: expected text with a table of numbers, found {kind}")
    data = data.removeprefix(b"\xef\xbb\xbf")
    if (code := _utf16(data)) is not None:
        data = data.decode(code, "replace").encode("utf-8").removeprefix(b"\xef\xbb\xbf")
    if (zero := data.find(b"\0")) >= 0:
        line = data.count(b"\n", 0, zero) + 1
        kind = ("a PPF file: save it as ERD with ProVAL" if file.lower().endswith(".ppf") else
                "bytes that are not text")
        raise BadInput(f"{file}:{line}: expected text with a table of numbers, found {kind}")
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in data else data


def _utf16(data: bytes) -> str | None:
    """By its mark or, without one, by the zero in each second byte of ASCII."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    first, shortest = data[:256], 4
    if len(first) < shortest or 0 not in first:
        return None
    return next((code for code, zeros, others in (("utf-16-le", first[1::2], first[::2]),
                                                  ("utf-16-be", first[::2], first[1::2]))
                 if not any(zeros) and all(others)), None)


def refuse_long_lines(data: bytes, file: str, first_line: int = 1) -> None:
    """Raises BadInput for a line that fills a block of ``LINE_BYTES``, as one of twice that length does somewhere."""
    for start in range(0, len(data) - LINE_BYTES, LINE_BYTES):
        if data.find(b"\n", start, start + LINE_BYTES) < 0:
            line = first_line + data.count(b"\n", 0, start)
            raise BadInput(f"{file}:{line}: expected lines of at most {LINE_BYTES} bytes")


# --- its numbers ---


def parse_columns(data: bytes, file: str, choose: Callable[[Names], Names | None], header: str, gaps: bool = False,
                  of_samples: bool = False) -> tuple[Names, Array, FileOfRows]:
    """The columns of a table that ``choose`` wants, their numbers, (rows, columns), all finite, at least one row, and
    the file's name for ``place``.

    choose    gives the names to read out of those in the header, or None when the header will not do
    header    what the header should have been, for the complaint
    gaps      as of ``read_rows``

    Raises BadInput ("file:line: expected ..., found ...").
    """
    table = find_table(data, file, lambda names: choose(names) is not None)
    wanted = choose(table.names)
    if wanted is None and table.line == 0:
        raise table.no_header(header)
    if wanted is None:
        raise BadInput(f"{file}:{table.line}: expected {header}, found {shown(table.found)}"
                       f"{_taken_by(table.names, header)}")
    rows = read_rows(table, [table.names.index(name) for name in wanted], wanted, gaps)
    named = FileOfRows(file)
    named.lines = rows.lines
    if of_samples and len(rows.values) < 2:
        raise BadInput(f"{place(named, 1)}: expected at least two samples, found the end of the file")
    return wanted, rows.values, named


def columns_of(data: bytes, file: str, names: Names) -> list[Array]:
    """The columns (n,) of these names, NaN where a cell is empty. Raises BadInput as ``read_rows``, and for a column
    that is not there or has no number at all."""
    table = find_table(data, file, lambda there: set(names) <= set(there))
    if missing := [name for name in names if name not in table.names]:
        found = f"found {'; '.join(table.names)[:160] or 'nothing'}"
        raise BadInput(f"{file}:{table.line or 1}: expected a column {missing[0]}, {found}")
    values = read_rows(table, [table.names.index(name) for name in names], names, gaps=True).values
    for name, column in zip(names, values.T, strict=True):
        if not np.isfinite(column).any():
            raise BadInput(f"{file}:{table.body_line}: expected numbers in the column {name}, found none")
    return list(values.T.copy())


def read_rows(table: CsvTable, columns: Sequence[int], words: Sequence[str], gaps: bool = False, time: int | None = None
              ) -> Rows:
    """The numbers in some columns of a table, at least one row.

    words    what a complaint calls each column
    gaps     cells may be empty, which is NaN, and the last line may have been cut short, which is left out
    time     the column, of these, in which a date and time may stand: seconds since 1970

    Raises BadInput ("file:line: expected ..., found ...").
    """
    body = table.body.rstrip() if not gaps else table.body
    if not body.strip():
        raise BadInput(f"{table.file}:{table.body_line}: expected numbers below the header, found nothing")
    comma = b"," in body and (table.delimiter != "," or b'"' in body) and _has_decimal_commas(table, body, columns)
    values = _at_once(table, body, columns, comma)
    if values is not None:
        return Rows(values, range(table.body_line, table.body_line + len(values)))
    return _by_line(table, body, columns, words, gaps, time, comma)


def _at_once(table: CsvTable, body: bytes, columns: Sequence[int], comma: bool) -> Array | None:
    """All rows of a plain table; None where some cell is none of a plain one."""
    if comma and b"." in body:
        return None
    body = body.rstrip()
    rows, many = body.count(b"\n") + 1, len(table.names) - 1
    body = body.replace(b'"', b"") if b'"' in body else body
    if table.delimiter == _BLANKS or not _is_even(body, table.delimiter.encode(), rows, many):
        return None
    body = body.replace(b",", b".") if comma else body
    try:
        values = np.loadtxt(io.BytesIO(body), delimiter=table.delimiter, comments=None, usecols=columns, ndmin=2)
    except ValueError:
        return None
    return values if len(values) == rows and np.isfinite(values).all() else None


def _is_even(body: bytes, delimiter: bytes, rows: int, many: int) -> bool:
    """Whether each of so many rows has so many delimiters, by blocks of whole lines."""
    if body.count(delimiter) != rows * many:
        return False
    start = 0
    while start < len(body):
        end = body.find(b"\n", start + HEAD_BYTES) + 1 or len(body)
        block = np.frombuffer(body[start:end], dtype=np.uint8)
        ends = np.append(np.flatnonzero(block == ord("\n")), len(block))
        there = np.searchsorted(np.flatnonzero(block == ord(delimiter)), ends)
        counts = np.diff(there, prepend=0)
        if (counts[:-1] != many).any() or counts[-1] not in (0, many):
            return False
        start = end
    return True


def _by_line(table: CsvTable, body: bytes, columns: Sequence[int], words: Sequence[str], gaps: bool, time: int | None,
             comma: bool) -> Rows:
    values, numbers, is_torn = array("d"), array("q"), False
    last = table.body_line + body.count(b"\n")
    for number, cells in _lines(table, body):
        is_torn = gaps and len(cells) < len(table.names) and number == last
        if is_torn:
            break  # without an end of its line: the recorder was stopped while it wrote
        if len(cells) != len(table.names):
            hint = "; are there commas in the numbers? Then put semicolons between the fields" if (
                table.delimiter == "," and len(cells) > len(table.names)) else ""
            raise BadInput(f"{table.file}:{number}: expected {len(table.names)} fields ({_listed(table.names)}), found "
                           f"{shown(table.delimiter.join(cells).strip())}{hint}")
        for column, (word, at) in enumerate(zip(words, columns, strict=True)):
            values.append(_number(cells[at], word, gaps, column == time, comma, f"{table.file}:{number}"))
        numbers.append(number)
    if not numbers:
        raise BadInput(f"{table.file}:{table.body_line}: expected numbers below the header, found nothing")
    return Rows(np.frombuffer(values).reshape(-1, len(columns)), numbers, is_torn)


def _lines(table: CsvTable, body: bytes) -> Iterator[tuple[int, list[str]]]:
    start, number = 0, table.body_line
    while start <= len(body):
        end = body.find(b"\n", start)
        end = len(body) if end < 0 else end
        text = _decoded(body[start:end])
        if text.strip() and not text.startswith(_COMMENT):
            cells = _cells(text, table.delimiter)
            if not any(cell.strip() for cell in cells[len(table.names):]):
                cells = cells[: len(table.names)]  # some programs end each line with separators
            yield number, cells
        start, number = end + 1, number + 1


def _number(cell: str, word: str, gaps: bool, is_time: bool, comma: bool, where: str) -> float:
    text = cell.strip().strip('"').strip().replace("−", "-")
    if gaps and text.lower() in _EMPTY:
        return nan
    point = text.replace(",", ".") if comma and "." not in text else text
    is_doubtful = comma and "." in text and _THOUSANDS.fullmatch(text.replace(".", ","))
    if not is_doubtful and _NUMBER.fullmatch(point) and isfinite(number := float(point)):
        return number
    if is_time and (seconds := seconds_of_date(text)) is not None:
        return seconds
    hint = "; this file has decimal commas" if comma and "." in text else ""
    raise BadInput(f"{where}: expected {'a time' if is_time else 'a number'} for {word}, found {shown(text)}{hint}")


def _has_decimal_commas(table: CsvTable, body: bytes, columns: Sequence[int]) -> bool:
    """Whether commas in the numbers of these columns are decimal. BadInput where they may be either."""
    doubtful: tuple[int, str] | None = None
    for number, cells in _lines(table, body):
        for cell in (cells[at].strip() for at in columns if at < len(cells)):
            if "," not in cell:
                continue
            if not _THOUSANDS.fullmatch(cell):
                if "." not in cell and _NUMBER.fullmatch(cell.replace(",", ".")):
                    return True
                if seconds_of_date(cell) is None:
                    return False  # no number at all, which is named when the line is read
            doubtful = doubtful or (number, cell)
    if doubtful is not None and _THOUSANDS.fullmatch(doubtful[1]):
        raise BadInput(f"{table.file}:{doubtful[0]}: expected numbers with a clear decimal sign, found "
                       f"{shown(doubtful[1])}, where the comma may be a decimal sign or a thousands separator: write "
                       "numbers with a decimal point and no thousands separators")
    return False


def seconds_of_date(text: str) -> float | None:
    """Seconds since 1970 of a date and time by ISO 8601, UTC without a zone; None where it is none."""
    if len(text) > SHOWN or ("T" not in text and text.count("-") + text.count(":") < 2):
        return None
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        return None
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()


# --- words ---


def shown(text: str) -> str:
    """A piece of a bad file, short enough for a line of complaint."""
    return shortened(text) if text else "nothing"


def _taken_by(names: Names, header: str) -> str:
    """What a file is that another command takes; nothing for other files. A command refuses no file with all columns
    that it wants, so that nobody is sent to the command that has just refused, and no profile that lacks places."""
    known = "a profile: ridelog iri" * ("distance_m,lat" not in header) if names == _PROFILE else next(
        (words for columns, words in _TAKEN_BY if columns <= set(names)), "")
    if known:
        return f"; this is {known} takes it"
    return "; ridelog extract --csv makes runs of other recordings" if "accel_z_mps2,speed_mps" in header else ""


def _listed(names: Names) -> str:
    text = ",".join(names)
    return text if len(text) <= SHOWN and text.isascii() and text.isprintable() else shown(text)
