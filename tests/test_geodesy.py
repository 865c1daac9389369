"""Places on the ground against the great circle, on both sides of the date line."""

from __future__ import annotations

from math import acos, cos, hypot, radians, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.geodesy import EARTH_RADIUS_M, east_and_north_m, east_deg, ground_distance_m


@given(st.floats(-70, 70), st.floats(-180, 180), st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
def test_near_places_are_as_far_apart_as_on_the_sphere(lat: float, lon: float, north: float, east: float) -> None:
    lat1, lon1 = lat + north, (lon + east + 180) % 360 - 180
    one, other, apart = radians(lat), radians(lat1), radians(east)
    exact_m = EARTH_RADIUS_M * acos(min(1.0, sin(one) * sin(other) + cos(one) * cos(other) * cos(apart)))
    assert ground_distance_m(lat, lon, lat1, lon1) == pytest.approx(exact_m, rel=2e-3, abs=0.3)
    assert hypot(*east_and_north_m(lat1, lon1, lat, lon)) == pytest.approx(ground_distance_m(lat, lon, lat1, lon1))


def test_east_is_the_short_way_round() -> None:
    assert (east_deg(179.5, -179.5), east_deg(-179.5, 179.5), east_deg(10.0, 9.0)) == (1.0, -1.0, -1.0)
    assert east_and_north_m(60.0, -179.9, 60.0, 179.9) == pytest.approx((EARTH_RADIUS_M * radians(0.1), 0.0))
