"""Rows of logs with their places on the ground as geometries.

Problem: a row has one place, its middle; a map wants the stretch of road that the row is about. Solution: a row's line
runs from half-way to the row before, through its middle, half-way to the next; where a neighbour does not join (a gap,
lost GPS) it ends at the middle, and a row without neighbours is a point. Nothing is drawn where nothing was measured.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from logger.geodesy import east_deg
from logger.records import WindowRecord
from logger.store.log.log_reader import LoggedFile, joined, split_drives

Place = tuple[float, float]
"""Longitude and latitude [degrees], in the order of maps."""
Line = tuple[Place, ...]
Geometry = tuple[Line, ...]
"""Lines of a row, in the order driven: one, two where it crosses the 180th meridian; a line of one place is a point;
nothing where no place is known."""


@dataclass(frozen=True)
class Window:
    """A row of a log.

    log         the file that it is from
    drive       counts the drives of the file, from 1
    geometry    where it lies
    """

    log: str
    drive: int
    record: WindowRecord
    geometry: Geometry


@dataclass(frozen=True)
class Windows:
    """Rows of some logs, in the order driven: drives, each in stretches that join, rows without a place alone."""

    rows: tuple[Window, ...]

    @property
    def placed(self) -> int:
        """How many have a place."""
        return sum(bool(row.geometry) for row in self.rows)


def windows_of(files: Sequence[LoggedFile]) -> Windows:
    """The rows of logs as they were read."""
    return Windows(tuple(window for file in files
                         for number, drive in enumerate(split_drives(file.records), start=1)
                         for window in _windows(file.name, number, drive)))


def _windows(log: str, drive: int, records: Sequence[WindowRecord]) -> Iterator[Window]:
    geometry = {id(record): found for piece in joined(records)
                for record, found in zip(piece, _geometries(piece), strict=True)}
    for record in records:
        yield Window(log, drive, record, geometry.get(id(record), ()))


def _geometries(piece: Sequence[WindowRecord]) -> Iterator[Geometry]:
    places = [(record.lon_deg or 0.0, record.lat_deg or 0.0) for record in piece]
    ends = [_half_way(one, next_) for one, next_ in itertools.pairwise(places)]
    for index, place in enumerate(places):
        yield _cut(tuple(_without_repeats([*ends[max(index - 1, 0) : index], place, *ends[index : index + 1]])))


def _without_repeats(places: Sequence[Place]) -> Iterator[Place]:
    """Those of a car that stands are all the same."""
    return (place for index, place in enumerate(places) if not index or place != places[index - 1])


def _half_way(one: Place, other: Place) -> Place:
    return _wrapped(one[0] + east_deg(one[0], other[0]) / 2), (one[1] + other[1]) / 2


def _wrapped(lon_deg: float) -> float:
    """The same meridian from -180 to 180; what is there already stays as it was written."""
    return lon_deg if -180.0 <= lon_deg <= 180.0 else (lon_deg + 180.0) % 360.0 - 180.0


def _cut(line: Line) -> Geometry:
    """A line in two where it crosses the 180th meridian (RFC 7946, section 3.1.9)."""
    parts: list[list[Place]] = [[line[0]]]
    for (lon0, lat0), (lon1, lat1) in itertools.pairwise(line):
        if abs(lon1 - lon0) > 180.0:
            edge = 180.0 if lon0 > 0 else -180.0
            way = east_deg(lon0, lon1)
            lat = lat0 + (lat1 - lat0) * ((edge - lon0) / way if way else 0.0)
            parts[-1].append((edge, lat))
            parts.append([(-edge, lat)])
        parts[-1].append((lon1, lat1))
    lines = [tuple(_without_repeats(part)) for part in parts]
    return tuple(part for part in lines if len(part) > 1) or (lines[0],)
