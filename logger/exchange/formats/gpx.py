"""GPX 1.1: a track a drive, a segment a stretch without a gap, a point a row, with its values as extensions; places to
go to are waypoints.

A point's time is that of the row's middle, where the point lies.
"""

from collections.abc import Iterable, Iterator
from itertools import groupby
from xml.sax.saxutils import escape

from logger.exchange.layer import DECIMALS, Feature, Format, Layer, Place

_SPACE = "urn:x-ridelog:values:1"
_IN_THE_POINT = {"lat_deg", "lon_deg", "t_utc"}


class Gpx(Format):
    """Tracks."""

    name = "gpx"
    title = "tracks, for navigation devices and programs"

    def content(self, layer: Layer, file: str) -> Iterator[bytes]:
        return map(str.encode, _lines(layer))


def _lines(layer: Layer) -> Iterator[str]:
    yield ('<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="ridelog" '
           f'xmlns="http://www.topografix.com/GPX/1/1" xmlns:ridelog="{_SPACE}">\n')
    if layer.points:
        yield from (_point("wpt", row, row.middle, layer.names, f"<name>{escape(row.title)}</name>")
                    for row in layer.features if row.middle)
    for group, rows in () if layer.points else groupby(layer.features, lambda row: row.group):
        yield f"<trk><name>{escape(group)}</name>\n"
        yield from _segments(rows, layer.names)
        yield "</trk>\n"
    yield "</gpx>\n"


def _segments(rows: Iterable[Feature], names: tuple[str, ...]) -> Iterator[str]:
    is_open = False
    for row in rows:
        if is_open and not row.joins:
            yield "</trkseg>\n"
        if row.middle is not None:
            yield ("" if is_open and row.joins else "<trkseg>\n") + _point("trkpt", row, row.middle, names)
        is_open = row.middle is not None
    if is_open:
        yield "</trkseg>\n"


def _point(kind: str, row: Feature, middle: Place, names: tuple[str, ...], name: str = "") -> str:
    lon_deg, lat_deg = middle
    time = "" if row.time_utc is None else f"<time>{row.time_utc}</time>"
    values = "".join(f"<ridelog:{name}>{escape(str(value))}</ridelog:{name}>"
                     for name, value in zip(names, row.values, strict=True)
                     if name not in _IN_THE_POINT and value not in (None, ""))
    return (f'<{kind} lat="{lat_deg:.{DECIMALS}f}" lon="{lon_deg:.{DECIMALS}f}">{time}{name}'
            f"<extensions>{values}</extensions></{kind}>\n")


FORMAT = Gpx()
