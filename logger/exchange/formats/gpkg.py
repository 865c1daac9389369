"""GeoPackage (OGC 12-128), the file of QGIS and most GIS programs, written by GDAL through pyogrio."""

from collections.abc import Iterator
from io import BytesIO

from logger.errors import BadInput
from logger.exchange.layer import EXTRA, GEOMETRY, Format, Layer, arrow_table


class GeoPackage(Format):
    """A map in a data base."""

    name = "gpkg"
    title = "GeoPackage, for GIS programs (needs the 'maps' extra)"

    def content(self, layer: Layer, file: str) -> Iterator[bytes]:
        try:
            from pyogrio import write_arrow
        except ImportError as error:
            raise BadInput(EXTRA.format(file, error)) from None
        made = BytesIO()  # GDAL would leave files of its own beside one on a full disk
        write_arrow(arrow_table(layer, file), made, driver="GPKG", layer=layer.name, geometry_name=GEOMETRY,
                    geometry_type="Unknown", crs="EPSG:4326")
        yield made.getvalue()


FORMAT = GeoPackage()
