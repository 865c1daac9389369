"""Lines on the ground, in the order of maps: longitude before latitude, cut at the 180th meridian."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from logger.geodesy import east_deg

Place = tuple[float, float]
"""Longitude and latitude [degrees]."""
Line = tuple[Place, ...]
Geometry = tuple[Line, ...]
"""Lines in the order driven; a line of one place is a point; nothing where no place is known."""


DECIMALS = 6
"""Of a degree in files of text: 0.1 m (RFC 7946, section 11.2)."""


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
    lines = [tuple(_without_repeats(part)) for part in parts]
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


def _without_repeats(places: Sequence[Place]) -> Iterator[Place]:
    """Those of a car that stands are all the same."""
    return (place for index, place in enumerate(places) if not index or place != places[index - 1])


def _wrapped(lon_deg: float) -> float:
    """The same meridian from -180 to 180; what is there already stays as it was written."""
    return lon_deg if -180.0 <= lon_deg <= 180.0 else (lon_deg + 180.0) % 360.0 - 180.0
