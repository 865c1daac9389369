"""Places on the ground some kilometres apart at most: the sphere laid flat where the first one is."""

from math import cos, hypot, radians
from typing import Protocol

import numpy as np

from logger.arrays import Array

EARTH_RADIUS_M = 6_371_008.8
"""Mean radius of the Earth, (2 a + b) / 3 of its ellipsoid (IUGG; H. Moritz, Geodetic Reference System 1980)."""


def east_deg(from_lon_deg: float, lon_deg: float) -> float:
    """How far east one longitude lies of another, the short way round: -180 up to 180 [degrees]."""
    return (lon_deg - from_lon_deg + 180.0) % 360.0 - 180.0


def ground_distance_m(lat0_deg: float, lon0_deg: float, lat1_deg: float, lon1_deg: float) -> float:
    """Distance of two near places [m]."""
    east_rad = radians(east_deg(lon0_deg, lon1_deg)) * cos(radians(lat0_deg))
    return EARTH_RADIUS_M * hypot(radians(lat1_deg - lat0_deg), east_rad)


class Placed(Protocol):
    """Something with a position, or None for it [degrees]."""

    @property
    def lat_deg(self) -> float | None: ...

    @property
    def lon_deg(self) -> float | None: ...


def apart_m(one: Placed, other: Placed) -> float | None:
    """Distance on the ground between two places some kilometres apart at most [m]; None when one has no position."""
    if one.lat_deg is None or one.lon_deg is None or other.lat_deg is None or other.lon_deg is None:
        return None
    return ground_distance_m(one.lat_deg, one.lon_deg, other.lat_deg, other.lon_deg)


def east_and_north_m(lat_deg: Array, lon_deg: Array, lat0_deg: float, lon0_deg: float) -> tuple[Array, Array]:
    """How far east and north of a near place 0 others (n,) lie [m], (n,) each."""
    return (EARTH_RADIUS_M * np.radians((lon_deg - lon0_deg + 180.0) % 360.0 - 180.0) * cos(radians(lat0_deg)),
            EARTH_RADIUS_M * np.radians(lat_deg - lat0_deg))
