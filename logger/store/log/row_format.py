"""Rows of a segment log: text <-> record, each row with its own check value.

Problem. A row is written in a car, where power fails in the middle of a write and cards lose or change bytes.
What was written whole must be read back whole, and what was not must show, row by row.

Solution. A row is one line of comma-separated text that ends in the CRC-32 of itself. ``COLUMNS`` says once, for
both directions, how each value is written: times as whole microseconds, floats with a fixed number of decimals,
unknown as nothing at all. ``scan`` reads a log that may be damaged anywhere and gives every row that is intact,
also those beside a lost newline.
"""

import re
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from math import isfinite
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from drivers.disk import open_regular
from drivers.errors import SHOWN, shortened
from logger.errors import BadInput
from logger.records import WindowRecord
from logger.units import US_PER_S

LINE_BYTES = 4096  # More than any row; a longer line is taken for several damaged ones
LARGEST = 1e9  # Beyond any quantity of a row in the unit of its column; what is larger is not known, and not read
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
LATEST_US = (datetime(2200, 1, 1, tzinfo=UTC) - EPOCH) // timedelta.resolution
"""From here on no instant is written or read [us since 1970]."""
_UTC = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z")
_SECONDS = re.compile(r"(-(?!0\.0{6}))?(0|[1-9][0-9]{0,9})\.([0-9]{6})")
_COUNT = re.compile(r"0|-?[1-9][0-9]{0,17}")
_COMFORT = re.compile("[a-z_]{0,40}")
_CLASS = re.compile("[A-H]?")
FLAGS = re.compile("[a-z_]{1,40}(?:[|][a-z_]{1,40})*")
"""Words of a row are names of our own; one of a newer logger may be another, and is none that could do harm."""
_ROW_END = re.compile(rb",[0-9a-f]{8}")


class BadRow(BadInput):
    """A line that is not an intact row. The message says what was expected."""


@dataclass(frozen=True)
class LogColumn:
    """One column: its name in the file, the record's attribute, how a value is written and read, what people read of
    it, and how large a number may be; 0: it holds no such number."""

    name: str
    attribute: str
    write: Callable[[Any], str]
    read: Callable[[str], Any]
    meaning: str
    largest: float = 0.0


def write_utc(utc_us: int | None) -> str:
    """An instant [us since 1970] as ISO 8601 with milliseconds; nothing where it is not known, or from 2200 on."""
    if utc_us is None or not 0 <= utc_us < LATEST_US:
        return ""
    return (EPOCH + timedelta(microseconds=int(utc_us))).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _read_utc(text: str) -> int | None:
    if not text:
        return None
    if not _UTC.fullmatch(text):
        raise BadRow(f"expected UTC such as 2026-07-04T10:15:00.250Z, found {shortened(text)}")
    utc_us = (datetime.fromisoformat(text) - EPOCH) // timedelta.resolution
    if not 0 <= utc_us < LATEST_US:
        raise BadRow(f"expected UTC from 1970 to 2199, found {text!a}")
    return utc_us


def _write_seconds(t_us: int) -> str:
    whole, fraction = divmod(abs(t_us), US_PER_S)
    return f"{'-' if t_us < 0 else ''}{whole}.{fraction:06d}"


def _read_seconds(text: str) -> int:
    match = _SECONDS.fullmatch(text)
    if not match:
        raise BadRow(f"expected seconds with six decimals, found {shortened(text)}")
    t_us = int(match[2]) * US_PER_S + int(match[3])
    return -t_us if match[1] else t_us


def _read_count(text: str) -> int:
    if not _COUNT.fullmatch(text):
        raise BadRow(f"expected a whole number, found {shortened(text)}")
    return int(text)


def _read_decimal(text: str, pattern: str, largest: float) -> float:
    """A number as the pattern writes it, and in no other way."""
    value = float(text)
    if not isfinite(value) or pattern % value != text:
        raise BadRow(f"expected a finite number such as {pattern % 1.5}, found {shortened(text)}")
    if abs(value) > largest:
        raise BadRow(f"expected a number up to {largest:g}, found {shortened(text)}")
    return value


def _number(name: str, decimals: int, meaning: str, largest: float = LARGEST) -> LogColumn:
    """A float that may be unknown: None, NaN and what is beyond ``largest`` are written as nothing."""
    pattern = f"%.{decimals}f"

    def write(value: float | None) -> str:
        return "" if value is None or not abs(value) <= largest else pattern % value

    def read(text: str) -> float | None:
        return _read_decimal(text, pattern, largest) if text else None

    return LogColumn(name, name, write, read, meaning, largest)


def _known_number(name: str, decimals: int, meaning: str) -> LogColumn:
    """A float that is always known. Writing NaN or one beyond ``LARGEST`` raises ``ValueError``."""
    pattern = f"%.{decimals}f"

    def write(value: float) -> str:
        if not abs(value) <= LARGEST:
            raise ValueError(f"{name} is {value}, expected a finite number up to {LARGEST:g}")
        return pattern % value

    return LogColumn(name, name, write, lambda text: _read_decimal(text, pattern, LARGEST), meaning, LARGEST)


def _count(name: str, meaning: str) -> LogColumn:
    return LogColumn(name, name, lambda value: f"{value:d}", _read_count, meaning)


def _word(name: str, known: re.Pattern[str], meaning: str) -> LogColumn:
    return LogColumn(name, name, str, lambda text: _read_word(text, known), meaning)


def _read_word(text: str, known: re.Pattern[str]) -> str:
    if not known.fullmatch(text):
        raise BadRow(f"expected a word that a logger writes, found {shortened(text)}")
    return text


COLUMNS = (
    _count("segment", "number of the window since the service started"),
    LogColumn("t_utc", "utc_us", write_utc, _read_utc, "start of the window, UTC from the GPS"),
    LogColumn("t_s", "t_us", _write_seconds, _read_seconds, "start of the window, seconds of the monotonic clock"),
    _number("distance_start_m", 3, "distance travelled at known speed, at the window's start"),
    _number("distance_end_m", 3, "the same at its end"),
    _number("lat_deg", 7, "latitude of its middle", 90.0),
    _number("lon_deg", 7, "longitude of its middle", 180.0),
    _number("speed_mps", 3, "mean speed"),
    _number("iri_m_per_km", 3, "best estimate of the IRI"),
    _number("iri_std_m_per_km", 3, "its standard error"),
    _number("iri_rms_m_per_km", 3, "IRI by the relation of r.m.s. acceleration and speed (Blum 2015, 6.3)"),
    _number("a_w_mps2", 4,
            "ISO 2631-1, weighting Wk: r.m.s. of the weighted acceleration of the ride, without the sensor's noise"),
    _number("mtvv_mps2", 4, "the same: maximum transient vibration value, the largest running r.m.s. over 1 s"),
    _number("vdv_mps175", 4, "the same: vibration dose value"),
    _number("crest_factor", 3, "largest weighted reading over a_w_raw_mps2"),
    _word("comfort", _COMFORT, "words of ISO 2631-1; where its ranges overlap, the more severe one"),
    _word("iri_class", _CLASS,
          "ISO 8608 class with the same IRI: A below 3.05, B below 6.09, C below 12.19, D below 24.37 m/km"),
    LogColumn("flags", "flags", "|".join, lambda text: tuple(_read_word(text, FLAGS).split("|")) if text else (),
              "words joined by a bar: why something is empty or doubtful"),
    _count("drive", "number of the drive since the service started"),
    _known_number("duration_s", 6, "time from the window's start to its end"),
    _number("accel_rms_mps2", 4, "r.m.s. of the vertical acceleration, without its mean"),
    _count("samples", "how many samples the window holds"),
    _count("clipped_samples", "how many of them were at the end of the sensor's range"),
    _number("a_w_std_mps2", 4, "standard error of a_w_mps2"),
    _number("mtvv_std_mps2", 4, "standard error of mtvv_mps2"),
    _number("vdv_std_mps175", 4, "standard error of vdv_mps175"),
    _number("a_w_raw_mps2", 4, "as a_w_mps2, of the readings as they are: with noise and rounding"),
    _number("mtvv_raw_mps2", 4, "as mtvv_mps2, of the readings as they are"),
    _number("vdv_raw_mps175", 4, "as vdv_mps175, of the readings as they are"),
    _number("iri_level_std_m_per_km", 3,
            "part of iri_std_m_per_km from the road's level, shared by neighbours: it fades along the road as "
            "exp(-d / 30 m)"),
    _number("iri_common_std_m_per_km", 3,
            "part of it from the vehicle's and the sensor's parameters, shared by all windows and drives of a car"),
    _number("iri_place_std_m_per_km", 3,
            "part of it from the position: what a window gains at its end, its neighbour loses"),
)
COLUMN_MEANINGS = {**{column.name: column.meaning for column in COLUMNS}, "crc32": "check value of the row"}
"""What people read of each; the last one ends each line, and is no field of a record."""
HEADER = ",".join(COLUMN_MEANINGS)
SHORTEST_ROW_BYTES = len("1,,0.000000,,,,,,,,,,,,,,,,1,0.000000,,0,0,,,,,,,,,,00000000\n")
"""A row of which nothing is known but what always is."""


def format_row(record: WindowRecord) -> str:
    """The row of a record, without a newline.

    Raises ``ValueError`` for a duration that is not finite. What no column can hold is written as not known.
    """
    text = ",".join([column.write(getattr(record, column.attribute)) for column in COLUMNS])
    return f"{text},{zlib.crc32(text.encode()):08x}"


def parse_row(text: str) -> WindowRecord:
    """The record of a row. UTC comes back in whole milliseconds, floats with the decimals of their column.

    Raises ``BadRow`` when the check value or any field is not as it should be.
    """
    body, _, check = text.rpartition(",")
    if f"{zlib.crc32(body.encode('utf-8', 'replace')):08x}" != check:
        raise BadRow("expected a row that matches its crc32")
    fields = body.split(",")
    if len(fields) != len(COLUMNS):
        raise BadRow(f"expected {len(COLUMNS) + 1} columns, found {len(fields) + 1}")
    try:
        return WindowRecord(**{column.attribute: column.read(field)
                               for column, field in zip(COLUMNS, fields, strict=True)})
    except ValueError as error:  # a number or a date that is none
        raise BadRow(str(error)[:SHOWN]) from None


class Row(NamedTuple):
    """What one line of a log holds. A damaged line gives a ``Row`` without a record, after any intact rows in it.

    number     line number, from 1
    text       the row as it stands, when it is intact
    record     its record; None: the line is damaged
    problem    what was expected, when the line is damaged
    torn       the file ends in this line, without a newline
    size       bytes of the line, when it is damaged
    """

    number: int
    text: str
    record: WindowRecord | None
    problem: str
    torn: bool
    size: int = 0


def scan(file: BinaryIO) -> Iterator[Row]:
    """Read the rows of an open log, damaged or not, in constant memory. The header, when intact, gives nothing."""
    number = 0
    while line := file.readline(LINE_BYTES):
        number += 1
        text = line.removesuffix(b"\n")
        torn = len(text) == len(line) < LINE_BYTES
        if number == 1:
            if text != HEADER.encode():
                # A row behind a header whose newline is damaged begins after that one byte.
                rest = text[len(HEADER) + 1:] if text.startswith(HEADER.encode()) else text
                yield from _salvaged(1, rest, torn)
                yield Row(1, "", None, "expected the header line of a segment log", torn, len(text))
            continue
        try:
            row = text.decode("ascii")
            yield Row(number, row, parse_row(row), "", torn)
        except (BadRow, UnicodeDecodeError) as error:
            yield from _salvaged(number, text, torn)
            problem = str(error) if isinstance(error, BadRow) else "expected ASCII text"
            yield Row(number, "", None, problem, torn, len(text))


@dataclass(frozen=True)
class LogContent:
    """The intact records of one file, in its order; how many lines were damaged, a torn last one among them."""

    records: tuple[WindowRecord, ...]
    damaged_lines: int


def read_log(path: Path) -> LogContent:
    """Read a whole log, open or finished. Raises ``OSError``; damage is counted, not raised."""
    records, damaged_lines = [], 0
    with open_regular(path) as file:
        for row in scan(file):
            if row.record is None:
                damaged_lines += 1
            else:
                records.append(row.record)
    return LogContent(tuple(records), damaged_lines)


def _salvaged(number: int, line: bytes, torn: bool) -> Iterator[Row]:
    """The intact rows inside a damaged line: those whose newline was lost."""
    start = 0
    for end in _ROW_END.finditer(line):
        if line.count(b",", start, end.end()) != len(COLUMNS):
            continue
        row = line[start:end.end()].decode("ascii", "replace")
        try:
            record = parse_row(row)
        except BadRow:
            continue
        yield Row(number, row, record, "", torn)
        start = end.end() + 1
