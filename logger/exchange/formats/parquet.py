"""GeoParquet 1.1: Apache Parquet whose geometry column says what it is, for pandas, DuckDB, Spark and GIS programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from logger.exchange.arrow_table import GEOMETRY, arrow_table
from logger.exchange.format import Format
from logger.exchange.windows import Windows
from logger.exchange.wkb import TYPE_NAMES, type_of


class GeoParquet(Format):
    """A table with geometries."""

    name = "parquet"
    title = "GeoParquet, for data programs (needs the 'maps' extra)"

    def write(self, windows: Windows, path: Path) -> None:
        table = arrow_table(windows, str(path))
        from pyarrow.parquet import write_table

        metadata = {**(table.schema.metadata or {}), b"geo": json.dumps(_metadata(windows)).encode()}
        write_table(table.replace_schema_metadata(metadata), path)


def _metadata(windows: Windows) -> dict[str, Any]:
    """Without a name of its own the reference system is WGS 84 with longitude first (OGC:CRS84)."""
    placed = [window.geometry for window in windows.rows if window.geometry]
    column: dict[str, Any] = {"encoding": "WKB",
                              "geometry_types": sorted({TYPE_NAMES[type_of(geometry)] for geometry in placed})}
    if placed:
        lons, lats = zip(*(place for geometry in placed for line in geometry for place in line), strict=True)
        column["bbox"] = [min(lons), min(lats), max(lons), max(lats)]
    return {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}


FORMAT = GeoParquet()
