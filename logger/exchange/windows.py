"""Rows of logs as a layer: the columns of the log by their names there, and the file that the row is from.

Problem: a row has one place, its middle; a map wants the stretch of road that the row is about. Solution: a row's line
runs from half-way to the row before, through its middle, half-way to the next; where a neighbour does not join (a gap,
lost GPS) it ends at the middle, and a row without neighbours is a point. Nothing is drawn where nothing was measured.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from logger.exchange.geometry import Geometry, Place, cut, half_way
from logger.exchange.layer import Feature, Field, Kind, Layer, Value
from logger.records import WindowRecord
from logger.store.log.log_reader import LoggedFile, iso_utc, joined, split_drives
from logger.store.log.row_format import COLUMNS
from logger.units import US_PER_S

LAYER = "windows"
_KINDS = {"t_utc": Kind.TIME, "segment": Kind.COUNT, "drive": Kind.COUNT, "samples": Kind.COUNT,
          "clipped_samples": Kind.COUNT, "comfort": Kind.WORDS, "iri_class": Kind.WORDS, "flags": Kind.WORDS}
FIELDS = (Field("log", Kind.WORDS),
          *(Field(column.name, _KINDS.get(column.name, Kind.NUMBER)) for column in COLUMNS))


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
