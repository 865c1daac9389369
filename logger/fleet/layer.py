"""Figures of roads as a layer for the formats of other programs: a line each, or a point for what has no direction."""

from __future__ import annotations

from math import cos, degrees, isfinite, radians, sin

from logger.exchange.geometry import Geometry, cut
from logger.exchange.layer import Feature, Field, Kind, Layer
from logger.exchange.windows import iri_title
from logger.fleet.dataset import DAY_US
from logger.fleet.road_cells import SEGMENT_M
from logger.fleet.summary import SECTION_M, RoadTable
from logger.geodesy import EARTH_RADIUS_M
from logger.roads.sections import federal_condition
from logger.store.log.log_reader import iso_utc

_NUMBERS = ("lat_deg", "lon_deg", "heading_deg", "length_m", "passes", "iri_m_per_km", "iri_std_m_per_km",
            "trend_m_per_km_per_year", "trend_std_m_per_km_per_year", "p_value", "a_w_mps2", "speed_mps")
FIELDS = (Field("key", Kind.COUNT), Field("cars", Kind.COUNT), *(Field(name, Kind.NUMBER) for name in _NUMBERS),
          Field("condition", Kind.WORDS), Field("last_utc", Kind.TIME), Field("visit", Kind.WORDS))
_DRAWN_M = {"segment": SEGMENT_M, "section": SECTION_M}


def roads_layer(roads: RoadTable) -> Layer:
    """The rows of a table, in its order."""
    columns = [getattr(roads, name).tolist() for name in ("key", "cars", *_NUMBERS)]
    features = []
    for values, last_us, visit in zip(zip(*columns, strict=True), roads.last_us.tolist(), roads.visit.tolist(),
                                      strict=True):
        row = dict(zip(("key", "cars", *_NUMBERS), values, strict=True))
        known = [value if not isinstance(value, float) or isfinite(value) else None for value in values]
        condition = federal_condition(row["iri_m_per_km"]) if isfinite(row["iri_m_per_km"]) else None
        last_utc = iso_utc(last_us // DAY_US * DAY_US)  # a time of day would tell whose drive it was
        features.append(Feature(
            roads.by, iri_title(row["iri_m_per_km"]), (*known, condition, last_utc, visit or None),
            _line(row["lat_deg"], row["lon_deg"], row["heading_deg"], _DRAWN_M.get(roads.by, 0.0)),
            (row["lon_deg"], row["lat_deg"]), last_utc, False, ""))
    return Layer(f"{roads.by}s", FIELDS, tuple(features))


def _line(lat_deg: float, lon_deg: float, heading_deg: float, length_m: float) -> Geometry:
    """A line of a length through a place along its direction; the place alone where there is none."""
    if not length_m or not isfinite(heading_deg):
        return (((lon_deg, lat_deg),),)
    half_deg = degrees(length_m / 2 / EARTH_RADIUS_M)
    north = half_deg * cos(radians(heading_deg))
    east = half_deg * sin(radians(heading_deg)) / cos(radians(lat_deg))
    return cut(((lon_deg - east, lat_deg - north), (lon_deg + east, lat_deg + north)))
