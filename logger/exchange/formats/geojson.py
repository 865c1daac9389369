"""GeoJSON (RFC 7946): a feature a row, WGS 84, six decimals of a degree (0.1 m), lines cut at the 180th meridian."""

import json
from collections.abc import Iterator
from typing import Any

from logger.exchange.layer import DECIMALS, LINES, POINT, TYPE_NAMES, Format, Geometry, Layer, type_of


class GeoJson(Format):
    """A map."""

    name = "geojson"
    title = "a map of all rows, for GIS programs and web maps"

    def content(self, layer: Layer, file: str) -> Iterator[bytes]:
        yield b'{"type":"FeatureCollection","features":['
        for number, one in enumerate(layer.features):
            feature = {"type": "Feature", "geometry": _geometry(one.geometry),
                       "properties": dict(zip(layer.names, one.values, strict=True))}
            text = json.dumps(feature, separators=(",", ":"), allow_nan=False)
            yield f"{',' if number else ''}\n{text}".encode()
        yield b"\n]}\n"


def _geometry(geometry: Geometry) -> dict[str, Any] | None:
    if not geometry:
        return None
    kind = type_of(geometry)
    lines = [[[round(degrees, DECIMALS) for degrees in place] for place in line] for line in geometry]
    return {"type": TYPE_NAMES[kind],
            "coordinates": lines if kind == LINES else lines[0][0] if kind == POINT else lines[0]}


FORMAT = GeoJson()
