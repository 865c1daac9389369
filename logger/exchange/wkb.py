"""Geometries as well-known binary (OGC 06-103r4, section 8): little-endian, longitude before latitude."""

from __future__ import annotations

import struct

from logger.exchange.windows import Geometry, Line

POINT, LINE, LINES = 1, 2, 5
TYPE_NAMES = {POINT: "Point", LINE: "LineString", LINES: "MultiLineString"}


def type_of(geometry: Geometry) -> int:
    """Its code in well-known binary."""
    if len(geometry) > 1:
        return LINES
    return LINE if len(geometry[0]) > 1 else POINT


def wkb(geometry: Geometry) -> bytes | None:
    """Its bytes; None where there is none."""
    if not geometry:
        return None
    kind = type_of(geometry)
    if kind == POINT:
        return struct.pack("<BIdd", 1, POINT, *geometry[0][0])
    if kind == LINE:
        return _line(geometry[0])
    return struct.pack("<BII", 1, LINES, len(geometry)) + b"".join(map(_line, geometry))


def _line(line: Line) -> bytes:
    flat = [degrees for place in line for degrees in place]
    return struct.pack(f"<BII{len(flat)}d", 1, LINE, len(line), *flat)
