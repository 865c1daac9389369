"""GeoParquet 1.1: Apache Parquet whose geometry column says what it is, for pandas, DuckDB, Spark and GIS programs."""

import json
from collections.abc import Iterator
from io import BytesIO
from typing import Any

from logger.exchange.layer import GEOMETRY, TYPE_NAMES, Format, Layer, arrow_table, type_of


class GeoParquet(Format):
    """A table with geometries."""

    name = "parquet"
    title = "GeoParquet, for data programs (needs the 'maps' extra)"

    def content(self, layer: Layer, file: str) -> Iterator[bytes]:
        table = arrow_table(layer, file)
        from pyarrow.parquet import write_table

        metadata = {**(table.schema.metadata or {}), b"geo": json.dumps(_metadata(layer)).encode()}
        made = BytesIO()
        write_table(table.replace_schema_metadata(metadata), made)
        yield made.getvalue()


def _metadata(layer: Layer) -> dict[str, Any]:
    """Without a name of its own the reference system is WGS 84 with longitude first (OGC:CRS84)."""
    placed = [one.geometry for one in layer.features if one.geometry]
    column: dict[str, Any] = {"encoding": "WKB",
                              "geometry_types": sorted({TYPE_NAMES[type_of(geometry)] for geometry in placed})}
    if placed:
        lons, lats = zip(*(place for geometry in placed for line in geometry for place in line), strict=True)
        column["bbox"] = [min(lons), min(lats), max(lons), max(lats)]
    return {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}


FORMAT = GeoParquet()
