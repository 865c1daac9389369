"""An integer for a piece of road without a map: a cell of the ground, and the direction driven.

Problem: rows of many drives over one place have to meet in a grouping, which is quick by an integer and slow by
geometry. Solution: the ground in cells of 0.1 mi / 8 = 66 ft, eight directions in each. A key reads from its highest
bits: row and column of a block of 64 x 64 cells, row and column inside it, direction. So a block, or a section of 8 x 8
cells, is found by leaving bits away. Rows of blocks are even in latitude; each is cut into as many columns as make its
blocks about square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.geodesy import EARTH_RADIUS_M
from logger.units import MILE_M

Array = npt.NDArray[np.float64]
Keys = npt.NDArray[np.int64]

SEGMENT_M = MILE_M / 80
"""Side of a cell, and length of a segment: eight make the 0.1 mi of 23 CFR 490."""

DIRECTIONS = 8
_BLOCK_CELLS = 64
_FINE_BITS, _DIRECTION_BITS, _COLUMN_BITS = 6, 3, 15
_CELL_BITS = 2 * _FINE_BITS + _DIRECTION_BITS
_SECTION_BITS = 3
_BLOCK_DEG = float(np.degrees(_BLOCK_CELLS * SEGMENT_M / EARTH_RADIUS_M))
_REGION_BITS = 3
ON_MAP = np.int64(1) << 62
"""This bit is set in keys of segments of a map (``road_map``), never in those of cells."""


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
    fine_row, fine_column = _fine(keys)
    inside = ((fine_row >> _SECTION_BITS) << _FINE_BITS) | (fine_column >> _SECTION_BITS)
    return ((keys >> _CELL_BITS) << _CELL_BITS) | (inside << _DIRECTION_BITS) | (keys & (DIRECTIONS - 1))


def region_of(lat_deg: Array, lon_deg: Array) -> Keys:
    """The coarse cell, 6.4 mi wide, that rows (n,) at these places are filed under."""
    block = block_of(cell_keys(lat_deg, lon_deg, np.zeros(len(lat_deg))))
    row, column = block >> _COLUMN_BITS, block & ((1 << _COLUMN_BITS) - 1)
    return ((row >> _REGION_BITS) << (_COLUMN_BITS - _REGION_BITS)) | (column >> _REGION_BITS)


def _columns(row: Keys) -> Array:
    middle_rad = np.radians((row + 0.5) * _BLOCK_DEG - 90.0)
    return np.maximum(np.round(360.0 / _BLOCK_DEG * np.cos(middle_rad)), 1.0)


def _fine(keys: Keys) -> tuple[Keys, Keys]:
    inside = keys >> _DIRECTION_BITS
    return (inside >> _FINE_BITS) & (_BLOCK_CELLS - 1), inside & (_BLOCK_CELLS - 1)
