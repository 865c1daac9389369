"""What other programs are given: layers of rows with values and places, their geometry, and the formats they go out in.

Geometries are lines on the ground in the order of maps: longitude before latitude, cut at the 180th meridian; as bytes
well-known binary (OGC 06-103r4, section 8), little-endian.

Problem: a row has one place, its middle; a map wants the stretch of road that the row is about. Solution: a row's line
runs from half-way to the row before, through its middle, half-way to the next; where a neighbour does not join (a gap,
lost GPS) it ends at the middle, and a row without neighbours is a point. Nothing is drawn where nothing was measured.
"""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import Enum
from functools import cache
from itertools import groupby, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.errors import BadInput
from logger.files import write_file
from logger.geodesy import east_deg
from logger.plugins import catalogue
from logger.printable import word
from logger.records import WindowRecord
from logger.store.log.log_reader import LoggedFile, iso_utc, joined, split_drives
from logger.store.log.row_format import COLUMNS
from logger.units import US_PER_S

if TYPE_CHECKING:
    import pyarrow


Place = tuple[float, float]  # Longitude and latitude [degrees]
Line = tuple[Place, ...]
Geometry = tuple[Line, ...]
"""Lines in the order driven; a line of one place is a point; nothing where no place is known."""


DECIMALS = 6  # Of a degree in files of text: 0.1 m (RFC 7946, section 11.2)


def half_way(one: Place, other: Place) -> Place:
    """The middle between two near places."""
    return _wrapped(one[0] + east_deg(one[0], other[0]) / 2), (one[1] + other[1]) / 2


def cut(line: Line) -> Geometry:
    """A line in two where it crosses the 180th meridian (RFC 7946, section 3.1.9)."""
    parts: list[list[Place]] = [[line[0]]]
    for (lon0, lat0), (lon1, lat1) in pairwise(line):
        if abs(lon1 - lon0) > 180.0:
            edge = 180.0 if lon0 > 0 else -180.0
            way = east_deg(lon0, lon1)
            lat = lat0 + (lat1 - lat0) * ((edge - lon0) / way if way else 0.0)
            parts[-1].append((edge, lat))
            parts.append([(-edge, lat)])
        parts[-1].append((lon1, lat1))
    lines = [tuple(place for place, _ in groupby(part)) for part in parts]  # those of a car that stands are all one
    return tuple(part for part in lines if len(part) > 1) or (lines[0],)


def chained(geometries: Sequence[Geometry]) -> Geometry:
    """One geometry of many: lines of which one begins where the one before it ends are one line."""
    lines: list[list[Place]] = []
    for line in (line for geometry in geometries for line in geometry):
        if lines and lines[-1][-1] == line[0]:
            lines[-1].extend(line[1:])
        else:
            lines.append(list(line))
    found = tuple(map(tuple, lines))
    return tuple(line for line in found if len(line) > 1) or found[:1]


def _wrapped(lon_deg: float) -> float:
    """The same meridian from -180 to 180; what is there already stays as it was written."""
    return lon_deg if -180.0 <= lon_deg <= 180.0 else (lon_deg + 180.0) % 360.0 - 180.0


Value = str | int | float | None  # None: not known


class Kind(Enum):
    """What a column holds; of times ISO 8601 with milliseconds and Z."""

    WORDS = "words"
    COUNT = "count"
    NUMBER = "number"
    TIME = "time"


@dataclass(frozen=True)
class Attribute:
    """A column; its name ends in its unit."""

    name: str
    kind: Kind


_WORDS = ("log", "direction", "condition", "comfort", "iri_class", "flags", "what", "changed", "visit", "name",
          "highway", "surface", "smoothness_tagged", "smoothness_suggested")
_COUNTS = ("segment", "drive", "drives", "samples", "clipped_samples", "cell", "cars", "key", "osm_way")


def attributes(*names: str) -> tuple[Attribute, ...]:
    """Columns by their names; a name that ends in ``_utc`` is that of a time, others are numbers unless listed here."""
    kinds = dict.fromkeys(_WORDS, Kind.WORDS) | dict.fromkeys(_COUNTS, Kind.COUNT)
    return tuple(Attribute(name, Kind.TIME if name.endswith("_utc") else kinds.get(name, Kind.NUMBER))
                 for name in names)


@dataclass(frozen=True)
class Feature:
    """A row.

    group       what it belongs to, such as a drive of a log
    title       in a few words
    values      in the order of the layer's fields
    geometry    where it lies
    middle      the place of its middle; None: not known
    time_utc    when that was passed, as times are; None: not known
    joins       the row before it in its group is its neighbour on the road
    iri_class   of its colour; empty: it has none
    """

    group: str
    title: str
    values: tuple[Value, ...]
    geometry: Geometry
    middle: Place | None
    time_utc: str | None
    joins: bool
    iri_class: str


@dataclass(frozen=True)
class Layer:
    """A table of rows with places; rows of a group follow each other, in the order driven. ``points``: each is a place
    to go to, and does not belong to a way."""

    name: str
    fields: tuple[Attribute, ...]
    features: tuple[Feature, ...]
    points: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(field.name for field in self.fields)

    def printable(self) -> Layer:
        """The same with every text a ``word``: whose names they are, and who opens the file, is not known."""
        return replace(self, features=tuple(
            replace(one, group=word(one.group), title=word(one.title),
                    values=tuple(word(value) if isinstance(value, str) else value for value in one.values))
            for one in self.features))

    @property
    def placed(self) -> int:
        """How many rows have a place."""
        return sum(bool(one.geometry) for one in self.features)


POINT, LINE, LINES = 1, 2, 5
TYPE_NAMES = {POINT: "Point", LINE: "LineString", LINES: "MultiLineString"}


def type_of(geometry: Geometry) -> int:
    """Its code in well-known binary."""
    if len(geometry) > 1:
        return LINES
    return LINE if len(geometry[0]) > 1 else POINT


def wkb(geometry: Geometry) -> bytes | None:
    """Its bytes; None where there is none."""
    if not geometry:
        return None
    kind = type_of(geometry)
    if kind == POINT:
        return struct.pack("<BIdd", 1, POINT, *geometry[0][0])
    if kind == LINE:
        return _line(geometry[0])
    return struct.pack("<BII", 1, LINES, len(geometry)) + b"".join(map(_line, geometry))


def _line(line: Line) -> bytes:
    flat = [degrees for place in line for degrees in place]
    return struct.pack(f"<BII{len(flat)}d", 1, LINE, len(line), *flat)


LAYER = "windows"
FIELDS = attributes("log", *(column.name for column in COLUMNS))


def windows_layer(files: Sequence[LoggedFile]) -> Layer:
    """The rows of logs as they were read, drives in the order driven."""
    return Layer(LAYER, FIELDS, tuple(
        feature for file in files for number, drive in enumerate(split_drives(file.records), start=1)
        for feature in _features(file.name, group_name(file.name, number), drive)))


def group_name(log: str, drive: int) -> str:
    """What the rows of a drive belong to; drives of a log count from 1."""
    return f"{log}, drive {drive}"


def iri_title(iri_m_per_km: float | None) -> str:
    """A row in a few words."""
    return "IRI not known" if iri_m_per_km is None else f"IRI {iri_m_per_km:.2f} m/km"


def geometries(records: Sequence[WindowRecord]) -> list[tuple[Geometry, bool]]:
    """Where the rows of a drive lie, and whether each joins the row before it."""
    found = {id(record): (geometry, number > 0) for piece in joined(records)
             for number, (record, geometry) in enumerate(zip(piece, _of_piece(piece), strict=True))}
    return [found.get(id(record), ((), False)) for record in records]


def _features(log: str, group: str, records: Sequence[WindowRecord]) -> Iterator[Feature]:
    for record, (geometry, joins) in zip(records, geometries(records), strict=True):
        middle_us = None if record.utc_us is None else record.utc_us + round(US_PER_S * record.duration_s / 2)
        yield Feature(group, iri_title(record.iri_m_per_km), (log, *_values(record)), geometry,
                      _middle(record) if geometry else None, iso_utc(middle_us), joins, record.iri_class)


def _values(record: WindowRecord) -> Iterator[Value]:
    for column in COLUMNS:
        value = getattr(record, column.attribute)
        if column.name == "t_utc":
            yield iso_utc(value)
        elif column.name == "t_s":
            yield value / US_PER_S
        elif column.name == "flags":
            yield "|".join(value)
        else:
            yield None if value == "" else value


def _middle(record: WindowRecord) -> Place:
    return record.lon_deg or 0.0, record.lat_deg or 0.0


def _of_piece(piece: Sequence[WindowRecord]) -> Iterator[Geometry]:
    places = [_middle(record) for record in piece]
    ends = [half_way(one, next_) for one, next_ in pairwise(places)]
    for index, place in enumerate(places):
        yield cut((*ends[max(index - 1, 0) : index], place, *ends[index : index + 1]))


class Format(ABC):
    """A way to write a layer.

    name     as the file's of this package, and the ending of what it writes
    title    in a few words
    """

    name: str
    title: str

    @abstractmethod
    def content(self, layer: Layer, file: str) -> Iterable[bytes]:
        """A file with all rows, in pieces. BadInput, with the name of the ``file``, where a library is missing."""


@cache
def formats() -> dict[str, Format]:
    """All there are, by the ending of their files."""
    return catalogue("logger.exchange.formats", "FORMAT")


def format_of(path: Path) -> Format:
    """The format that a file's ending asks for. BadInput for one that there is not."""
    known = formats()
    ending = path.suffix.removeprefix(".").lower()
    if ending not in known:
        expected = ", ".join(f".{name}" for name in known)
        raise BadInput(f"{path}: expected a file that ends in one of {expected}")
    return known[ending]


def write_layer(layer: Layer, path: Path) -> None:
    """Write a file that is there whole, in place of an old one, or not at all; its texts are words that can be seen
    (``logger.printable``). BadInput as ``format_of`` and ``Format.content``, and where it cannot be written."""
    form = format_of(path)
    try:
        write_file(path, form.content(layer.printable(), str(path)))
    except OSError as error:
        raise BadInput(f"{path}: expected a file that can be written ({error.strerror or error})") from None


GEOMETRY = "geometry"
EXTRA = "{}: expected the 'maps' extra: pip install 'ridelog[maps]' ({})"


def arrow_table(layer: Layer, file: str) -> pyarrow.Table:
    """One row a feature, with well-known binary as ``geometry``. BadInput (the file) where the extra is missing."""
    try:
        import pyarrow
    except ImportError as error:
        raise BadInput(EXTRA.format(file, error)) from None
    columns = list(zip(*(one.values for one in layer.features), strict=True)) or [()] * len(layer.fields)
    table = {field.name: _column(pyarrow, field, values) for field, values in zip(layer.fields, columns, strict=True)}
    table[GEOMETRY] = pyarrow.array([wkb(one.geometry) for one in layer.features], pyarrow.binary())
    return pyarrow.table(table)


def _column(pyarrow: Any, field: Attribute, values: tuple[Any, ...]) -> Any:
    if field.kind is Kind.TIME:
        times = [None if value is None else datetime.fromisoformat(value) for value in values]
        return pyarrow.array(times, pyarrow.timestamp("ms", "UTC"))
    kinds = {Kind.WORDS: pyarrow.string(), Kind.COUNT: pyarrow.int64(), Kind.NUMBER: pyarrow.float64()}
    return pyarrow.array(values, kinds[field.kind])
