"""A route out of a GeoJSON file: a line with measures, as road agencies keep it, or with kilometre posts beside it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.bounds import DISTANCE
from logger.errors import BadInput
from logger.store.formats.road_lines import read_geojson, road_lines_of

Array = npt.NDArray[np.float64]


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
    if isinstance(value, bool) or not isinstance(value, int | float) or not (
            abs(value) <= DISTANCE.largest / 1000):
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
