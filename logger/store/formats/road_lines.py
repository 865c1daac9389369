"""Roads as lines out of a GeoJSON file, as an extract of OpenStreetMap gives them (RFC 7946)."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.errors import BadInput
from logger.files import read_bounded

MAX_BYTES = 256 << 20
"""A county's roads; a country's would not be read in a minute, and the page keeps only what is near."""

Array = npt.NDArray[np.float64]


def read_geojson(path: Path | str) -> dict[str, Any]:
    """A file's object, which has a type. BadInput for a file that cannot be read or is not GeoJSON."""
    try:
        content = json.loads(read_bounded(path, MAX_BYTES))
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: expected GeoJSON, found what is no JSON ({error})") from None
    if not isinstance(content, dict) or not isinstance(content.get("type"), str):
        raise BadInput(f"{path}: expected GeoJSON, an object with a type, such as a FeatureCollection")
    return content


def read_road_lines(path: Path | str) -> list[tuple[Array, Array]]:
    """Latitudes and longitudes (n,) [degrees] of each line of a file, n > 1; what is no line is left out.

    Raises BadInput for a file that cannot be read, is not GeoJSON, or holds no line.
    """
    return road_lines_of(read_geojson(path), path)


def road_lines_of(content: dict[str, Any], path: Path | str) -> list[tuple[Array, Array]]:
    """The same of an object that was read from ``path``."""
    lines = [_line(path, points) for geometry in _geometries(content) for points in _points(geometry)]
    if not lines:
        raise BadInput(f"{path}: expected roads as LineString or MultiLineString, found none")
    return lines


def _geometries(content: Any) -> Iterator[dict[str, Any]]:
    """What has coordinates, in features, in collections, or alone."""
    if not isinstance(content, dict):
        return
    for many in ("features", "geometries"):
        for one in content.get(many) or () if isinstance(content.get(many), list) else ():
            yield from _geometries(one)
    if content.get("type") == "Feature":
        yield from _geometries(content.get("geometry"))
    elif "coordinates" in content:
        yield content


def _points(geometry: dict[str, Any]) -> list[Any]:
    coordinates = geometry["coordinates"]
    if geometry.get("type") == "LineString":
        return [coordinates]
    return coordinates if geometry.get("type") == "MultiLineString" and isinstance(coordinates, list) else []


def _line(path: Path | str, points: Any) -> tuple[Array, Array]:
    try:
        degrees = np.array([point[:2] for point in points], dtype=np.float64)
    except (TypeError, ValueError, KeyError, OverflowError):
        degrees = np.zeros(0)
    if degrees.ndim != 2 or degrees.shape[0] < 2 or degrees.shape[1] != 2 or not (np.abs(degrees) <= [360, 90]).all():
        raise BadInput(f"{path}: expected lines of at least two [longitude, latitude] in degrees, found "
                       f"{json.dumps(points)[:80]}")
    return degrees[:, 1], degrees[:, 0]


CAR_ROADS = frozenset({"motorway", "trunk", "primary", "secondary", "tertiary", "unclassified", "residential",
                       "living_street", "service", "road", "track",
                       *(f"{one}_link" for one in ("motorway", "trunk", "primary", "secondary", "tertiary"))})
"""Values of OpenStreetMap's key ``highway`` on which cars drive."""


@dataclass(frozen=True, eq=False)
class MapWay:
    """A way of OpenStreetMap: its number, its tags, latitudes and longitudes (n,) [degrees]."""

    osm_id: int
    tags: dict[str, str]
    lat_deg: Array
    lon_deg: Array


def read_map_ways(path: Path | str) -> list[MapWay]:
    """Ways on which cars drive, out of an extract that names them: ``@id`` or ``osm_id`` among the properties, or an
    ``id``, such as way/4711.

    Raises BadInput for a file that cannot be read, is not GeoJSON, or holds no such way.
    """
    content = read_geojson(path)
    features = content.get("features") if content.get("type") == "FeatureCollection" else [content]
    found: list[MapWay] = []
    for one in features if isinstance(features, list) else ():
        named = one.get("properties") if isinstance(one, dict) else None
        geometry = one.get("geometry") if isinstance(one, dict) else None
        if not isinstance(named, dict) or not isinstance(geometry, dict) or geometry.get("type") != "LineString":
            continue
        number = _osm_id(one, named)
        tags = {key: value for key, value in named.items() if isinstance(value, str)}
        if number is not None and tags.get("highway") in CAR_ROADS:
            found.append(MapWay(number, tags, *_line(path, geometry.get("coordinates"))))
    if not found:
        raise BadInput(f"{path}: expected ways of OpenStreetMap for cars: LineStrings with a highway and an @id "
                       "such as way/4711, found none")
    return found


def _osm_id(feature: dict[str, Any], named: dict[str, Any]) -> int | None:
    for value in (named.get("@id"), named.get("osm_id"), feature.get("id"), named.get("id")):
        digits = re.fullmatch(r"(?:way/)?([0-9]{1,18})", str(value), re.ASCII)
        if digits:
            return int(digits[1])
    return None
