"""GeoPackage (OGC 12-128), the file of QGIS and most GIS programs, written by GDAL through pyogrio."""

from __future__ import annotations

from pathlib import Path

from logger.errors import BadInput
from logger.exchange.arrow_table import EXTRA, GEOMETRY, arrow_table
from logger.exchange.format import Format
from logger.exchange.windows import Windows

_LAYER = "windows"


class GeoPackage(Format):
    """A map in a data base."""

    name = "gpkg"
    title = "GeoPackage, for GIS programs (needs the 'maps' extra)"

    def write(self, windows: Windows, path: Path) -> None:
        try:
            from pyogrio import write_arrow
            from pyogrio.errors import DataSourceError
        except ImportError as error:
            raise BadInput(EXTRA.format(path, error)) from None
        table = arrow_table(windows, str(path))
        try:
            write_arrow(table, str(path), driver="GPKG", layer=_LAYER, geometry_name=GEOMETRY,
                        geometry_type="Unknown", crs="EPSG:4326")
        except DataSourceError as error:
            raise OSError(None, str(error), str(path)) from None


FORMAT = GeoPackage()
