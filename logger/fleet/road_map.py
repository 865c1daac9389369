"""Integers for pieces of road: by cells of the ground or by lines of a map, and by the direction driven.

Problem: rows of many drives over one place have to meet in a grouping, which is quick by an integer and slow by
geometry. Solution without a map: the ground in cells of 0.1 mi / 8 = 66 ft, eight directions in each. A key reads from
its highest bits: row and column of a block of 64 x 64 cells, row and column inside it, direction. So a block, or a
section of 8 x 8 cells, is found by leaving bits away. Rows of blocks are even in latitude; each is cut into as many
columns as make its blocks about square.

With a map: candidates are pieces of 66 ft near a place (P. Newson and J. Krumm, Hidden Markov map matching through
noise and sparseness, 2009: a receiver's errors as a normal distribution across the road). A road is chosen by distance
and direction, of the row itself and of its neighbours along the drive, so that one bad fix does not jump to the
parallel road. Rows near no road get the key of their cell.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Indices, Whole
from logger.geodesy import EARTH_RADIUS_M
from logger.roads.road_matching import SEARCH_M, on_sphere
from logger.units import MILE_M

Keys = Whole

SEGMENT_M = MILE_M / 80  # Side of a cell, and length of a segment: eight make the 0.1 mi of 23 CFR 490
DIRECTIONS = 8
_BLOCK_CELLS = 64
_FINE_BITS, _DIRECTION_BITS, _COLUMN_BITS = 6, 3, 15
_CELL_BITS = 2 * _FINE_BITS + _DIRECTION_BITS
_BLOCK_DEG = float(np.degrees(_BLOCK_CELLS * SEGMENT_M / EARTH_RADIUS_M))
ON_MAP = np.int64(1) << 62  # This bit is set in keys of segments of a map (``road_map``), never in those of cells


@dataclass(frozen=True, eq=False)
class Cells:
    """Where cells lie (n,): their middles [degrees], and the direction's middle, clockwise from north [degrees]."""

    lat_deg: Array
    lon_deg: Array
    heading_deg: Array


def cell_keys(lat_deg: Array, lon_deg: Array, heading_deg: Array) -> Keys:
    """The keys (n,) of places [degrees], driven through in a direction, clockwise from north [degrees]."""
    rows = (np.clip(lat_deg, -90.0, 90.0) + 90.0) / _BLOCK_DEG
    row = np.floor(rows).astype(np.int64)
    columns = ((lon_deg + 180.0) % 360.0) / 360.0 * _columns(row)
    column = np.floor(columns).astype(np.int64)
    fine_row = np.floor((rows - row) * _BLOCK_CELLS).astype(np.int64)
    fine_column = np.floor((columns - column) * _BLOCK_CELLS).astype(np.int64)
    direction = np.floor((heading_deg % 360.0) / (360.0 / DIRECTIONS) + 0.5).astype(np.int64) % DIRECTIONS
    block = (row << _COLUMN_BITS) | column
    return (block << _CELL_BITS) | (((fine_row << _FINE_BITS) | fine_column) << _DIRECTION_BITS) | direction


def cells(keys: Keys) -> Cells:
    """Where the cells of keys (n,) lie."""
    fine_row, fine_column = _fine(keys)
    block = keys >> _CELL_BITS
    row, column = block >> _COLUMN_BITS, block & ((1 << _COLUMN_BITS) - 1)
    lat_deg = (row + (fine_row + 0.5) / _BLOCK_CELLS) * _BLOCK_DEG - 90.0
    lon_deg = (column + (fine_column + 0.5) / _BLOCK_CELLS) / _columns(row) * 360.0 - 180.0
    return Cells(lat_deg, lon_deg, np.asarray((keys & (DIRECTIONS - 1)) * (360.0 / DIRECTIONS), np.float64))


def block_of(keys: Keys) -> Keys:
    """The blocks, 0.8 mi wide, that keys of cells (n,) lie in."""
    return keys >> _CELL_BITS


def section_of(keys: Keys) -> Keys:
    """The sections, 0.1 mi wide and of one direction, that keys of cells (n,) lie in."""
    section_bits = 3
    fine_row, fine_column = _fine(keys)
    inside = ((fine_row >> section_bits) << _FINE_BITS) | (fine_column >> section_bits)
    return ((keys >> _CELL_BITS) << _CELL_BITS) | (inside << _DIRECTION_BITS) | (keys & (DIRECTIONS - 1))


def region_of(lat_deg: Array, lon_deg: Array) -> Keys:
    """The coarse cell, 6.4 mi wide, that rows (n,) at these places are filed under."""
    region_bits = 3
    block = block_of(cell_keys(lat_deg, lon_deg, np.zeros(len(lat_deg))))
    row, column = block >> _COLUMN_BITS, block & ((1 << _COLUMN_BITS) - 1)
    return ((row >> region_bits) << (_COLUMN_BITS - region_bits)) | (column >> region_bits)


def _columns(row: Keys) -> Array:
    middle_rad = np.radians((row + 0.5) * _BLOCK_DEG - 90.0)
    return np.maximum(np.round(360.0 / _BLOCK_DEG * np.cos(middle_rad)), 1.0)


def _fine(keys: Keys) -> tuple[Keys, Keys]:
    inside = keys >> _DIRECTION_BITS
    return (inside >> _FINE_BITS) & (_BLOCK_CELLS - 1), inside & (_BLOCK_CELLS - 1)


_PLACE_STD_M = 4.07  # Of a receiver across the road (Newson and Krumm 2009, section 4)
_HEADING_STD_DEG = 20.0  # Of the direction between windows 50 ft apart with fixes some metres off
_CANDIDATES = 12


@dataclass(frozen=True, eq=False)
class RoadPieces:
    """Pieces of roads (k,), as long as ``SEGMENT_M`` or, at the end of a road, shorter.

    road               its line in the file, from 0
    start_m            along the line [m]
    lat_deg, lon_deg   of its two ends (k, 2) [degrees]
    """

    road: Indices
    start_m: Array
    length_m: Array
    lat_deg: Array
    lon_deg: Array

    @property
    def heading_deg(self) -> Array:
        """Of each, from its start to its end, clockwise from north [degrees]."""
        middle_rad = np.radians(self.lat_deg.mean(axis=1))
        east = ((np.diff(self.lon_deg)[:, 0] + 180.0) % 360.0 - 180.0) * np.cos(middle_rad)
        return np.degrees(np.arctan2(east, np.diff(self.lat_deg)[:, 0])) % 360.0


def pieces_of(lines: Sequence[tuple[Array, Array]]) -> RoadPieces:
    """Lines of latitudes and longitudes (n,) [degrees] in pieces; a line without length has none.
    ValueError where no line has a length."""
    found: list[tuple[Array, ...]] = []
    for road, (lat_deg, lon_deg) in enumerate(lines):
        east = np.diff(lon_deg) * np.cos(np.radians((lat_deg[1:] + lat_deg[:-1]) / 2))
        step_m = np.hypot(np.diff(lat_deg), east) * (np.pi / 180.0 * EARTH_RADIUS_M)
        along_m = np.concatenate([[0.0], np.cumsum(step_m)])
        if along_m[-1] <= 0:
            continue
        cut_m = np.append(np.arange(int(np.ceil(along_m[-1] / SEGMENT_M - 1e-9))) * SEGMENT_M, along_m[-1])
        lat, lon = (np.interp(cut_m, along_m, degrees) for degrees in (lat_deg, lon_deg))
        count = len(cut_m) - 1
        found.append((np.full(count, float(road)), cut_m[:-1], np.diff(cut_m),
                      np.stack([lat[:-1], lat[1:]], axis=1), np.stack([lon[:-1], lon[1:]], axis=1)))
    if not found:
        raise ValueError("expected a line with a length")
    columns = [np.concatenate(column) for column in zip(*found, strict=True)]
    return RoadPieces(columns[0].astype(np.intp), *columns[1:])


class RoadMap:
    """Finds the roads of a map. ``keys`` is what ``filed_rows`` wants."""

    def __init__(self, pieces: RoadPieces) -> None:
        from scipy.spatial import cKDTree

        self.pieces = pieces
        self._heading_deg = pieces.heading_deg
        self._tree = cKDTree(on_sphere(pieces.lat_deg.mean(axis=1), pieces.lon_deg.mean(axis=1)))

    def keys(self, lat_deg: Array, lon_deg: Array, heading_deg: Array, drive: Indices) -> Keys:
        """Keys (n,) of places and directions [degrees], in the order driven; ``drive`` distinguishes drives."""
        out = cell_keys(lat_deg, lon_deg, heading_deg)
        if not len(out):
            return out
        piece, cost, forward = self._candidates(lat_deg, lon_deg, heading_deg)
        way = np.where(np.isfinite(cost), 2 * self.pieces.road[piece] + forward, -1 - np.arange(piece.shape[1]))
        total = cost + _of_neighbours(way, cost, drive)
        best = np.argmin(total, axis=1)
        row = np.arange(len(out))
        found = np.isfinite(total[row, best])
        chosen = ON_MAP | (2 * piece[row, best].astype(np.int64) + forward[row, best])
        return np.where(found, chosen, out)

    def _candidates(self, lat_deg: Array, lon_deg: Array, heading_deg: Array
                    ) -> tuple[Indices, Array, Whole]:
        """Pieces (n, k) near places, what speaks against them (infinity: too far), and 1 where driven forwards."""
        count = min(_CANDIDATES, len(self.pieces.road))
        _, piece = self._tree.query(on_sphere(lat_deg, lon_deg), k=list(range(1, count + 1)))
        scale = np.pi / 180.0 * EARTH_RADIUS_M
        shrink = np.cos(np.radians(lat_deg))[:, None]

        def from_place(end: int) -> tuple[Array, Array]:
            east = (self.pieces.lon_deg[piece, end] - lon_deg[:, None] + 180.0) % 360.0 - 180.0
            return east * shrink * scale, (self.pieces.lat_deg[piece, end] - lat_deg[:, None]) * scale

        (x0, y0), (x1, y1) = from_place(0), from_place(1)
        dx, dy = x1 - x0, y1 - y0
        along = np.clip(-(x0 * dx + y0 * dy) / (dx**2 + dy**2), 0.0, 1.0)
        off_m = np.hypot(x0 + along * dx, y0 + along * dy)
        turn_deg = (heading_deg[:, None] - self._heading_deg[piece] + 180.0) % 360.0 - 180.0
        forward = (np.abs(turn_deg) <= 90.0).astype(np.int64)
        turn_deg = np.minimum(np.abs(turn_deg), 180.0 - np.abs(turn_deg))
        cost = (off_m / _PLACE_STD_M) ** 2 + (turn_deg / _HEADING_STD_DEG) ** 2
        return piece, np.where(off_m <= SEARCH_M, cost, np.inf), forward


def _of_neighbours(way: Whole, cost: Array, drive: Indices) -> Array:
    """What neighbours along the drive say of each candidate's road (n, k): the mean of their costs for it."""
    # Rows each way that vote: 30 m, over which a receiver's error has not changed but a junction is passed.
    neighbours = 4
    far = 25.0  # Cost of a road that is not among a neighbour's candidates: five standard deviations.
    said, votes = np.zeros(way.shape), np.zeros((len(way), 1))
    for shift in (*range(-neighbours, 0), *range(1, neighbours + 1)):
        other = np.arange(len(way)) + shift
        there = (other >= 0) & (other < len(way))
        other = np.where(there, other, 0)
        there &= drive[other] == drive
        same = way[:, :, None] == way[other][:, None, :]
        theirs = np.minimum(np.where(same, cost[other][:, None, :], np.inf).min(axis=2), far)
        said += np.where(there[:, None], theirs, 0.0)
        votes += there[:, None]
    return said / np.maximum(votes, 1.0)
