"""The one reader of delimited text: however a table is spelled, each of its readers reads the same, or says why not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from logger.errors import BadInput
from logger.store.formats.csv_table import columns_of, parse_columns, place
from logger.store.formats.drive_file import header_of, read_drive, read_speeds
from logger.store.formats.logger_csv import named_columns, read_header, read_table, recognised
from logger.store.formats.profile_file import read_excitation, read_places, read_profile
from logger.store.formats.record_checks import read_channels
from logger.store.formats.record_file import read_record

N = np.arange(12)
WAVE = np.round(0.5 * np.sin(N) + 0.001, 4)


def phone(path: Path) -> Any:
    named = named_columns("t=time:s,up=up (m/s^2),speed=v:km/h")
    header = read_header(path, named)
    known = recognised(header, named)
    assert known is not None
    table = read_table(header, known)
    return np.stack(list(table.columns.values())), table.unit("up")


READERS: dict[str, tuple[Callable[[Path], Any], str, tuple[np.ndarray, ...]]] = {
    "profile": (read_profile, "distance_m,elevation_m,elevation_right_m", (0.25 * N, WAVE, WAVE[::-1])),
    "places": (read_places, "distance_m,elevation_m,lat_deg,lon_deg", (0.25 * N, WAVE, 50 + WAVE, 7 + WAVE)),
    "record": (read_record, "t_s,accel_z_mps2,accel_x_mps2", (0.01 * N, WAVE, WAVE[::-1])),
    "drive": (read_drive, "t_s,accel_z_mps2,speed_mps,distance_m", (0.01 * N, WAVE, 10 + WAVE, 0.1 * N)),
    "speeds": (read_speeds, "t_s,speed_mps", (0.5 * N, 10 + WAVE)),
    "channels": (read_channels, "t_s,top,middle", (0.01 * N, WAVE, WAVE[::-1] + 2)),
    "excitation": (read_excitation, "t_s,elevation_m", (0.01 * N, WAVE)),
    "phone": (phone, "time,up (m/s^2),v", (0.01 * N, WAVE, 36 + WAVE)),
    "header": (header_of, "t_s,a,b", (0.01 * N, WAVE, WAVE)),
}


def rows_of(names: str, columns: tuple[np.ndarray, ...]) -> list[list[str]]:
    return [names.split(","), *([f"{one:.4f}" for one in row] for row in zip(*columns, strict=True))]


def joined(rows: list[list[str]], by: str = ",", end: str = "\n", comma: bool = False) -> str:
    lines = [by.join(row) for row in rows]
    return end.join([lines[0], *(one.replace(".", ",") if comma else one for one in lines[1:])]) + end


def spellings(rows: list[list[str]]) -> dict[str, bytes]:
    """The same table, as programs and countries write it."""
    plain, names = joined(rows), len(rows[0])
    wide = [[*row, "", ""] for row in rows]
    quoted = [[f'"{one}"' for one in row] for row in rows]
    text = {
        "as it is": plain, "no end": plain.rstrip(), "CRLF": joined(rows, end="\r\n"), "CR": joined(rows, end="\r"),
        "tabs": joined(rows, "\t"), "semicolons": joined(rows, ";"), "bars": joined(rows, "|"),
        "semicolons, decimal commas": joined(rows, ";", comma=True),
        "tabs, decimal commas, CRLF": joined(rows, "\t", "\r\n", comma=True),
        "quoted": joined(quoted), "quoted, decimal commas": joined([quoted[0], *([one.replace(".", ",") for one in row]
                                                                              for row in quoted[1:])]),
        "spaces around": joined(rows, " , "), "sep line": "sep=;\r\n" + joined(rows, ";", "\r\n", comma=True),
        "comments above": "# made by a program\n# 100 Hz, 12 rows\n" + plain, "header in a comment": "# " + plain,
        "comments between": plain.replace("\n", "\n# note, 1\n", 2),
        "blank lines": "\n\n" + plain.replace("\n", "\n\n"),
        "one line above": "accelerometer,maker,2020-02-15_19-30-56\n" + plain,
        "block above": "Recorder;X 1\nRate;100\nStart;2024-05-01 10:00:00\n\n" + joined(rows, ";", comma=True),
        "numbers above": "Serial,4711\n1,2,3,4,5,6,7\n" + plain,
        "fields at the end that are empty": joined(wide), "spreadsheet": "a" + "," * (names + 1) + "\n" + joined(wide),
    }
    if " " not in rows[0][1]:
        text["blanks"] = "\n".join("   ".join(row) for row in rows) + "\n"
    codes = {f"{code}, {mark!r}": (mark + joined(rows, "\t", "\r\n", comma=True)).encode(code)
             for code in ("utf-16-le", "utf-16-be") for mark in ("", "\ufeff")}
    return {**{name: one.encode() for name, one in text.items()}, **codes, "mark": plain.encode("utf-8-sig")}


def same(found: Any, expected: Any) -> None:
    if hasattr(found, "__dict__"):
        found, expected = list(vars(found).values()), list(vars(expected).values())
    if isinstance(found, list | tuple):
        assert len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            same(one, other)
    else:
        assert np.array_equal(found, expected)


@pytest.mark.parametrize("reader", READERS)
def test_however_a_table_is_spelled_the_same_is_read(reader: str, tmp_path: Path) -> None:
    read, names, columns = READERS[reader]
    path = tmp_path / "a.csv"
    rows = rows_of(names, columns)
    path.write_text(joined(rows))
    expected = read(path)
    for spelling, data in spellings(rows).items():
        path.write_bytes(data)
        try:
            same(read(path), expected)
        except (AssertionError, BadInput) as error:
            raise AssertionError(f"{spelling}: {error}") from error


def parsed(data: bytes, names: str = "a,b") -> tuple[np.ndarray, str]:
    wanted = tuple(names.split(","))
    return parse_columns(data, "f.csv", lambda there: wanted if set(wanted) <= set(there) else None, "a header")[1:]


def test_each_row_knows_its_line() -> None:
    """Not as if the header were the first line and nothing stood between."""
    rows = rows_of("a,b", (1.0 * N, WAVE))
    for spelling, data in spellings(rows).items():
        values, file = parsed(data)
        lines = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "latin-1").replace("\0", "")
        lines = ["", *lines.replace("\r\n", "\n").replace("\r", "\n").split("\n")]
        assert values[:, 0].tolist() == N.tolist(), spelling
        for row in (0, 5, 11):
            number = int(place(file, row).rpartition(":")[2])
            assert f"{N[row]}" in lines[number].replace(",", ".").replace(".0000", ""), spelling


@pytest.mark.parametrize(("data", "said"), [
    (b"0.00,1.5\n0.01,1.6\n", "f.csv:1: expected a header, found numbers: no line names the columns; put one above"),
    (b"2021-04-08 10:00:00.000,0.02\n2021-04-08 10:00:00.010,0.03\n", "f.csv:1: expected a header, found numbers"),
    (b"made by x\nc,d\n0.01,1.6\n", "f.csv:2: expected a header, found 'c,d'"),
    (b"a;b\n1,234;5\n2,345;6\n", "f.csv:2: expected numbers with a clear decimal sign, found '1,234'"),
    (b"a\tb\n1,234,567\t5\n", "f.csv:2: expected numbers with a clear decimal sign"),
    (b'a,b\n"1,234",5\n', "f.csv:2: expected numbers with a clear decimal sign"),
    (b"a;b\n0,5;1.234\n", "f.csv:2: expected a number for b, found '1.234'; this file has decimal commas"),
    (b"a;b\n1.234,5;1\n", "f.csv:2: expected a number for a, found '1.234,5'"),
    (b"a;b\n1,234.5;1\n", "f.csv:2: expected a number for a, found '1,234.5'"),
    (b"a,b\n0,5,1,5\n", "f.csv:2: expected 2 fields .a,b., found '0,5,1,5'; are there commas in the numbers"),
    (b"a,b\n1,2\n3\n4,5,6\n", "f.csv:3: expected 2 fields"),
    (b"PK\x03\x04" + bytes(40), "f.csv: expected text with a table of numbers, found a workbook"),
    (b"\x1f\x8b\x08\x00", "packed with gzip"), (b"a,b\n1,2\n\x00\x01", "f.csv:3: expected text"),
])
def test_what_cannot_be_known_is_refused_in_words(data: bytes, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        parsed(data)


def test_one_plain_decimal_comma_settles_what_the_others_are() -> None:
    values, _ = parsed(b"a;b\n1,234;0,5\n2,345;7\n")
    assert values.tolist() == [[1.234, 0.5], [2.345, 7.0]]


def test_columns_that_nobody_reads_may_hold_anything() -> None:
    data = b"a;note;b\n0,5;x, y. 1,234;1\n1,5;;2\n"
    assert [one.tolist() for one in columns_of(data, "f.csv", ("a", "b"))] == [[0.5, 1.5], [1.0, 2.0]]
    with pytest.raises(BadInput, match="expected a column c, found a; note; b"):
        columns_of(data, "f.csv", ("a", "c"))


def test_a_line_of_units_below_the_names_of_a_phone(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time;acc;v\n[ms];[g];km/h\n0,5;1,5;36\n1,5;1,5;36\n")
    named = named_columns("t=time,up=acc,speed=v:mph")
    header = read_header(path, named)
    known = recognised(header, named)
    assert known is not None
    assert {role: column.unit for role, column in known.columns.items()} == {"t": "ms", "up": "g", "speed": "mph"}
    table = read_table(header, known)
    assert (table.columns["t"].tolist(), list(table.lines)) == ([0.5, 1.5], [3, 4])


def test_units_below_names_that_nobody_knows_are_no_names(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("maker\nt,x,y,z\ns,m/s^2,m/s^2,m/s^2\n0,1,2,9.8\n0.01,1,2,9.8\n")
    header = read_header(path)
    assert (header.names, header.line) == (("t", "x", "y", "z"), 2)
    path.write_text("g,s\n1,2\n")  # alone they are names
    assert read_header(path).names == ("g", "s")
