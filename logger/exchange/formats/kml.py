"""KML 2.2 (OGC 07-147r2), for Google Earth: a folder a drive, a line a row in the colour of its class, its values in a
balloon."""

from collections.abc import Iterator
from itertools import groupby
from xml.sax.saxutils import escape

from logger.chart_data import CLASS_COLOURS, NO_CLASS_COLOUR
from logger.exchange.layer import DECIMALS, LINES, POINT, TYPE_NAMES, Feature, Format, Geometry, Layer, Line, type_of
from logger.roads.iso8608 import CLASS_GD_N0_CM3

_UNKNOWN = "unknown"


class Kml(Format):
    """A map in colours."""

    name = "kml"
    title = "lines in the colours of their classes, for Google Earth"

    def content(self, layer: Layer, file: str) -> Iterator[bytes]:
        return map(str.encode, _lines(layer))


def _lines(layer: Layer) -> Iterator[str]:
    yield ('<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"><Document>'
           "<name>ridelog</name>\n")
    yield from _styles()
    for group, rows in groupby(layer.features, lambda row: row.group):
        yield f"<Folder><name>{escape(group)}</name>\n"
        yield from (_placemark(row, layer.names) for row in rows if row.geometry)
        yield "</Folder>\n"
    yield "</Document></kml>\n"


def _styles() -> Iterator[str]:
    colours = dict(zip(CLASS_GD_N0_CM3, CLASS_COLOURS, strict=True)) | {_UNKNOWN: NO_CLASS_COLOUR}
    for name, colour in colours.items():
        # KML writes opacity first, then blue, green, red.
        turned = f"ff{colour[5:7]}{colour[3:5]}{colour[1:3]}"
        yield (f'<Style id="class-{name}"><LineStyle><color>{turned}</color><width>4</width></LineStyle>'
               f"<IconStyle><color>{turned}</color></IconStyle></Style>\n")


def _placemark(row: Feature, names: tuple[str, ...]) -> str:
    time = "" if row.time_utc is None else f"<TimeStamp><when>{row.time_utc}</when></TimeStamp>"
    values = "".join(f'<Data name="{name}"><value>{escape(str(value))}</value></Data>'
                     for name, value in zip(names, row.values, strict=True) if value not in (None, ""))
    return (f"<Placemark><name>{escape(row.title)}</name>{time}<styleUrl>#class-{row.iri_class or _UNKNOWN}</styleUrl>"
            f"<ExtendedData>{values}</ExtendedData>{_geometry(row.geometry)}</Placemark>\n")


def _geometry(geometry: Geometry) -> str:
    kind = type_of(geometry)
    if kind == LINES:
        return f"<MultiGeometry>{''.join(map(_line, geometry))}</MultiGeometry>"
    return f"<{TYPE_NAMES[kind]}>{_places(geometry[0])}</{TYPE_NAMES[kind]}>" if kind == POINT else _line(geometry[0])


def _line(line: Line) -> str:
    return f"<LineString><tessellate>1</tessellate>{_places(line)}</LineString>"


def _places(line: Line) -> str:
    return f"<coordinates>{' '.join(f'{lon:.{DECIMALS}f},{lat:.{DECIMALS}f}' for lon, lat in line)}</coordinates>"


FORMAT = Kml()
