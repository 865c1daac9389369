"""Roads in tiles by zoom level, as scripts that lie beside a page.

Problem: a county has a million segments, and a page that holds them does not open. Solution: squares of Web Mercator
(EPSG:3857), as street maps have them; down to the last level but one a tile holds means over 1/64 of its side, at the
last level segments with their history. A reader loads what is in view. A page opened from a folder may not fetch, but
may load scripts: so each tile is one, which calls ``fleetTile``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.files import make_folder, write_text
from logger.fleet.dataset import DAY_US
from logger.fleet.summary import RoadTable

Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.int64]

CELLS = 64
DEEPEST = 15
"""Where a segment of 66 ft is some 6 pixels long at middle latitudes."""
_STEPS = 4096
_MOST_LAT_DEG = 85.0


@dataclass(frozen=True, eq=False)
class History:
    """Means of quarters of a year since 1970, rows by road: its place in the table of segments, quarter, IRI [m/km],
    passes.
    """

    segment: npt.NDArray[np.intp]
    quarter: Codes
    iri_m_per_km: Array
    passes: Codes


def projected(lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
    """Places [degrees] in Web Mercator, the world being 1 wide and high, y downwards."""
    lat_rad = np.radians(np.clip(lat_deg, -_MOST_LAT_DEG, _MOST_LAT_DEG))
    return lon_deg / 360.0 + 0.5, 0.5 - np.arcsinh(np.tan(lat_rad)) / (2 * np.pi)


def highest_level(x: Array, y: Array) -> int:
    """The level at which all places lie in a few tiles."""
    extent = max(float(np.ptp(x)), float(np.ptp(y)), 2.0**-DEEPEST)
    return int(np.clip(np.floor(-np.log2(extent)), 0, DEEPEST))


def write_tiles(segments: RoadTable, history: History, folder: Path) -> int:
    """Write ``folder/LEVEL/X_Y.js`` for all levels; give their number. Raises OSError."""
    x, y = projected(segments.lat_deg, segments.lon_deg)
    written = 0
    for level in range(highest_level(x, y), DEEPEST + 1):
        make_folder(folder / str(level))
        made = _of_segments(segments, history, x, y) if level == DEEPEST else _of_squares(segments, x, y, level)
        for name, content in made:
            text = json.dumps(content, separators=(",", ":"), allow_nan=False)
            write_text(folder / f"{name}.js", f'fleetTile("{name}",{text})\n')
            written += 1
    return written


def _of_squares(segments: RoadTable, x: Array, y: Array, level: int) -> Iterator[tuple[str, dict[str, Any]]]:
    column, row = _tile_of(x, y, level, CELLS)
    place, code = np.unique((column << 32) | row, return_inverse=True)
    length_m = np.bincount(code, segments.length_m)
    mean = np.bincount(code, segments.iri_m_per_km * segments.length_m) / length_m
    worst, worse = np.zeros(len(place)), np.zeros(len(place), dtype=np.int64)
    np.maximum.at(worst, code, segments.iri_m_per_km)
    np.maximum.at(worse, code, segments.worse.astype(np.int64))
    column, row = place >> 32, place & (2**32 - 1)
    quarter = 1 << (2 * column // CELLS % 2 + 2 * (2 * row // CELLS % 2))
    at = row % CELLS * CELLS + column % CELLS
    for name, rows in _by_tile(column // CELLS, row // CELLS, level):
        yield name, {"n": int(np.bitwise_or.reduce(quarter[rows])), "at": at[rows].tolist(),
                     "m": _hundredths(mean[rows]), "w": _hundredths(worst[rows]), "c": worse[rows].tolist()}


def _of_segments(segments: RoadTable, history: History, x: Array, y: Array) -> Iterator[tuple[str, dict[str, Any]]]:
    column, row = _tile_of(x, y, DEEPEST)
    order = np.lexsort((history.quarter, history.segment))
    steps = np.stack([history.quarter, np.round(history.iri_m_per_km * 100).astype(np.int64), history.passes], axis=1)
    steps = steps[order]
    first = np.searchsorted(history.segment[order], np.arange(len(x) + 1))
    for name, rows in _by_tile(column, row, DEEPEST):
        yield name, {
            "x": np.round((x[rows] * 2**DEEPEST - column[rows]) * _STEPS).astype(int).tolist(),
            "y": np.round((y[rows] * 2**DEEPEST - row[rows]) * _STEPS).astype(int).tolist(),
            "h": np.round(segments.heading_deg[rows]).astype(int).tolist(),
            "m": _hundredths(segments.iri_m_per_km[rows]), "s": _hundredths(segments.iri_std_m_per_km[rows]),
            "t": _hundredths(segments.trend_m_per_km_per_year[rows]),
            "u": _hundredths(segments.trend_std_m_per_km_per_year[rows]),
            "c": segments.worse[rows].astype(int).tolist(),
            "k": segments.cars[rows].tolist(), "n": segments.passes[rows].astype(int).tolist(),
            "d": (segments.last_us[rows] // DAY_US).tolist(),
            "q": [steps[first[one] : first[one + 1]].tolist() for one in rows.tolist()]}


def names_of(x: Array, y: Array, level: int) -> list[str]:
    """The tiles of a level, by name."""
    return [name for name, _ in _by_tile(*_tile_of(x, y, level), level)]


def _tile_of(x: Array, y: Array, level: int, parts: int = 1) -> tuple[Codes, Codes]:
    """Column and row of the tile, or of its parts, that places lie in."""
    across = 2**level * parts
    column, row = (np.clip(np.floor(one * across), 0, across - 1).astype(np.int64) for one in (x, y))
    return column, row


def _by_tile(column: Codes, row: Codes, level: int) -> Iterator[tuple[str, npt.NDArray[np.intp]]]:
    """Names of tiles, and the rows that lie in each."""
    order = np.lexsort((row, column))
    new = (np.diff(column[order]) != 0) | (np.diff(row[order]) != 0)
    for rows in np.split(order, np.flatnonzero(new) + 1):
        yield f"{level}/{int(column[rows[0]])}_{int(row[rows[0]])}", rows


def _hundredths(values: Array) -> list[int | None]:
    return [round(value * 100) if value == value else None for value in values.tolist()]
