"""The rows of a session as they are filed: with a direction, a road key, and the passes they make.

A pass is a car once over a piece of road; its windows share the car's track, so passes, not windows, are what a
standard error counts. The row in the middle of a pass carries its mean, so that a summary needs one grouping, not
two.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.fleet.road_cells import SEGMENT_M
from logger.geodesy import EARTH_RADIUS_M
from logger.report.summary import NOT_COUNTED
from logger.roads.window_errors import WindowErrors, errors_of_means

Array = npt.NDArray[np.float64]
Columns = dict[str, npt.NDArray[Any]]
Keyed = Callable[[Array, Array, Array, npt.NDArray[np.intp]], npt.NDArray[np.int64]]
"""Latitudes, longitudes, directions (n,) [degrees] and numbers of drives, to keys of roads (n,)."""

ERRORS = ("iri_std_m_per_km", "iri_level_std_m_per_km", "iri_common_std_m_per_km", "iri_place_std_m_per_km")
"""Columns of the IRI's standard error and its parts."""
_LEAST_MOVE_M = 1.0
_AGAIN_M = 5 * SEGMENT_M


@dataclass(frozen=True, eq=False)
class Filed:
    """Rows (n,) to file, and how many were left out: without a date, without a place or direction, cut at the ends."""

    columns: Columns
    undated: int
    unplaced: int
    trimmed: int


def filed_rows(session: Mapping[str, npt.NDArray[Any]], keyed: Keyed, trim_m: float) -> Filed:
    """The rows of one session, all its logs together.

    keyed     makes the keys of roads
    trim_m    how much of each drive's start and end is left out [m]
    """
    order = np.argsort(session["segment"], kind="stable")
    rows = {name: values[order] for name, values in session.items()}
    drive = np.cumsum(np.diff(rows["drive"], prepend=rows["drive"][:1]) != 0)
    kept = _inside(rows, drive, trim_m)
    trimmed = int(len(kept) - kept.sum())
    heading_deg = headings(rows["lat_deg"], rows["lon_deg"], drive)
    dated, placed = rows["utc_us"] > 0, np.isfinite(heading_deg)
    chosen = kept & dated & placed
    out: Columns = {name: values[chosen] for name, values in rows.items()}
    out["heading_deg"], drive = heading_deg[chosen], drive[chosen]
    out["road"] = keyed(out["lat_deg"], out["lon_deg"], out["heading_deg"], drive)
    out["length_m"] = out["distance_end_m"] - out["distance_start_m"]
    out |= _passes(out, drive)
    return Filed(out, int((kept & ~dated).sum()), int((kept & dated & ~placed).sum()), trimmed)


def headings(lat_deg: Array, lon_deg: Array, drive: npt.NDArray[np.intp]) -> Array:
    """Directions (n,) from the row before to the row after, clockwise from north [degrees]; NaN where no neighbour of
    the same drive has another place."""
    count = len(lat_deg)
    before, after = np.maximum(np.arange(count) - 1, 0), np.minimum(np.arange(count) + 1, count - 1)
    before = np.where((drive[before] == drive) & np.isfinite(lat_deg[before]), before, np.arange(count))
    after = np.where((drive[after] == drive) & np.isfinite(lat_deg[after]), after, np.arange(count))
    north = lat_deg[after] - lat_deg[before]
    east = (lon_deg[after] - lon_deg[before] + 180.0) % 360.0 - 180.0
    east = east * np.cos(np.radians(lat_deg))
    moved_m = np.hypot(north, east) * (np.pi / 180.0 * EARTH_RADIUS_M)
    return np.where(moved_m >= _LEAST_MOVE_M, np.degrees(np.arctan2(east, north)) % 360.0, np.nan)


def _inside(rows: Mapping[str, npt.NDArray[Any]], drive: npt.NDArray[np.intp], trim_m: float
            ) -> npt.NDArray[np.bool_]:
    """Which rows lie farther from the ends of their drive than is cut; rows without a distance count as none."""
    if not trim_m:
        return np.ones(len(drive), dtype=np.bool_)
    length_m = np.nan_to_num(rows["distance_end_m"] - rows["distance_start_m"])
    end_m = np.cumsum(length_m)
    first, last = np.searchsorted(drive, drive, side="left"), np.searchsorted(drive, drive, side="right") - 1
    from_start_m, to_end_m = end_m - length_m - (end_m - length_m)[first], end_m[last] - end_m
    return np.asarray((from_start_m >= trim_m) & (to_end_m >= trim_m))


def _passes(rows: Columns, drive: npt.NDArray[np.intp]) -> Columns:
    """Means over each pass, at the row in its middle; nothing at the others."""
    count = len(drive)
    known = np.isfinite(rows["iri_m_per_km"]) & np.isfinite(rows["iri_std_m_per_km"])
    counted = {text: NOT_COUNTED.isdisjoint((text or "").split("|")) for text in set(rows["flags"].tolist())}
    known &= np.array([counted[text] for text in rows["flags"].tolist()], dtype=bool)
    found = {name: np.full(count, np.nan) for name in ("pass_iri_m_per_km", "pass_iri_std_m_per_km", "pass_a_w_mps2")}
    windows = np.zeros(count, dtype=np.int64)
    row = np.flatnonzero(known)
    if not len(row):
        return {**found, "pass_windows": windows}
    along_m = np.cumsum(np.nan_to_num(rows["length_m"]))
    row = row[np.lexsort((row, rows["road"][row], drive[row]))]
    new = (np.diff(rows["road"][row]) != 0) | (np.diff(drive[row]) != 0) | (np.diff(along_m[row]) > _AGAIN_M)
    number = np.cumsum(np.concatenate([[0], new]))
    size = np.bincount(number)
    middle = row[np.cumsum(size) - size + size // 2]

    def total(values: Array) -> Array:
        return np.asarray(np.bincount(number, values[row]), dtype=np.float64)

    windows[middle] = size
    found["pass_iri_m_per_km"][middle] = total(rows["iri_m_per_km"]) / size
    length_m = rows["length_m"]
    errors = errors_of_means(WindowErrors(*(rows[name] for name in ERRORS)), rows["iri_m_per_km"],
                             along_m - length_m / 2, length_m, row, length_m[row], number, len(size))
    found["pass_iri_std_m_per_km"][middle] = errors.std
    felt = total(np.isfinite(rows["a_w_mps2"]).astype(np.float64))
    square = total(np.nan_to_num(rows["a_w_mps2"]) ** 2)
    found["pass_a_w_mps2"][middle] = np.sqrt(np.divide(square, felt, out=np.full(len(size), np.nan), where=felt > 0))
    return {**found, "pass_windows": windows}
