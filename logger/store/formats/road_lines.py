"""GeoJSON files (RFC 7946): roads as lines, as an extract of OpenStreetMap gives them, and a route: a line with
measures, as road agencies keep it, or with kilometre posts beside it."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from logger.arrays import Array
from logger.bounds import DISTANCE
from logger.errors import BadInput
from logger.files import MAP_BYTES, read_bounded


def read_geojson(path: Path | str) -> dict[str, Any]:
    """A file's object, which has a type. BadInput for a file that cannot be read or is not GeoJSON."""
    try:
        content = json.loads(read_bounded(path, MAP_BYTES))
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: expected GeoJSON, found text that is not JSON ({error})") from None
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


@dataclass(frozen=True, eq=False)
class Route:
    """A line and what is measured along it.

    lat_deg, lon_deg      (n,) of its corners [degrees]
    begin_m, end_m        measures of its ends; None: 0, and its length
    post_lat_deg, post_lon_deg, post_m    (p,) places and measures of kilometre posts
    """

    lat_deg: Array
    lon_deg: Array
    begin_m: float | None
    end_m: float | None
    post_lat_deg: Array
    post_lon_deg: Array
    post_m: Array


def read_route(path: Path | str) -> Route:
    """Read a file with one LineString. Its feature may have the properties ``begin_km`` and ``end_km``; points with a
    property ``km`` are kilometre posts.

    Raises BadInput for a file that cannot be read, is not GeoJSON, or holds another number of lines.
    """
    content = read_geojson(path)
    lines = road_lines_of(content, path)
    if len(lines) != 1:
        raise BadInput(f"{path}: expected one LineString, the route, found {len(lines)} lines")
    features: Any = content.get("features") if content.get("type") == "FeatureCollection" else [content]
    features = [one for one in features if isinstance(one, dict)] if isinstance(features, list) else []
    posts: list[tuple[float, float, float]] = []
    begin_m = end_m = None
    for one in features:
        geometry, named = one.get("geometry"), one.get("properties")
        named = named if isinstance(named, dict) else {}
        kind = geometry.get("type") if isinstance(geometry, dict) else None
        if kind == "LineString":
            begin_m, end_m = _metres(path, named, "begin_km"), _metres(path, named, "end_km")
        elif kind == "Point" and "km" in named:
            posts.append(_post(path, geometry, _metres(path, named, "km")))
    if begin_m is not None and end_m is not None and not begin_m < end_m:
        raise BadInput(f"{path}: expected end_km above begin_km, found {begin_m / 1000:g} to {end_m / 1000:g}")
    places = np.array(posts, dtype=np.float64).reshape(-1, 3)
    return Route(*lines[0], begin_m, end_m, places[:, 1], places[:, 0], places[:, 2])


def _metres(path: Path | str, named: dict[str, Any], key: str) -> float | None:
    value = named.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not (abs(value) <= DISTANCE.largest / 1000):
        raise BadInput(f"{path}: {key}: expected a number of kilometres, found {json.dumps(value)[:40]}")
    return 1000.0 * value


def _post(path: Path | str, geometry: dict[str, Any], at_m: float | None) -> tuple[float, float, float]:
    place = geometry.get("coordinates")
    try:
        lon_deg, lat_deg = (float(one) for one in place[:2])  # type: ignore[index]
    except (TypeError, ValueError, OverflowError):
        lon_deg, lat_deg = np.nan, np.nan
    if at_m is None or not (abs(lat_deg) <= 90 and abs(lon_deg) <= 360):
        raise BadInput(f"{path}: expected kilometre posts as points [longitude, latitude] with a number km, found "
                       f"{json.dumps(place)[:40]}")
    return lon_deg, lat_deg, at_m
