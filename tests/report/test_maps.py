"""The map: shapes keep their proportions, gaps stay gaps, and thinning changes nothing one can see."""

import re
from math import cos, hypot, radians
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from logger.report.maps import Colouring, simplified, track_map
from logger.report.summary import summarise

BY_CLASS = Colouring("by-iri", lambda record: f"s{'ABCDEFGH'.find(record.iri_class or '?')}")


def lines(picture: str, name: str = "casing") -> list[list[tuple[float, float]]]:
    return [[(float(x), float(y)) for x, y in re.findall(r"([\d.]+) ([\d.]+)", part)]
            for found in re.findall(rf'<path class="{name}" d="([^"]*)"', picture) for part in found.split("M")[1:]]


@pytest.mark.parametrize(("lat_deg", "lon_deg"), [(0.0, 10.0), (60.0, -120.0), (-45.0, 180.0), (69.0, -179.999)])
def test_a_square_on_the_ground_is_a_square_in_the_picture(drive, lat_deg: float, lon_deg: float) -> None:
    side_deg = 0.01
    corners = [(0, 0), (0, 1), (1, 1), (1, 0)]
    changes = {index: {
        "lat_deg": lat_deg + north * side_deg,
        "lon_deg": (lon_deg + east * side_deg / cos(radians(lat_deg + side_deg / 2)) + 180) % 360 - 180,
        "distance_start_m": index * 1112.0, "distance_end_m": index * 1112.0 + 1112.0}
        for index, (north, east) in enumerate(corners)}
    (points,) = lines(track_map(drive(4, changes), (BY_CLASS,), ()))
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = points
    assert (y0, x1, y2, x3) == pytest.approx((y1, x2, y3, x0), abs=0.2)
    assert x1 - x0 == pytest.approx(y1 - y2, abs=0.5)
    assert x1 > x0
    assert y2 < y1


def test_the_scale_bar_is_as_long_as_it_says(drive) -> None:
    picture = track_map(drive(400), (BY_CLASS,), ())
    ((_, top), (_, bottom)), = ((line[0], line[-1]) for line in lines(picture))
    bar = re.search(r'M16 [\d.]+v5h([\d.]+)v-5"/><text [^>]*>(\d+) (m|km)<', picture)
    assert bar
    said_m = int(bar[2]) * (1000 if bar[3] == "km" else 1)
    assert float(bar[1]) / said_m == pytest.approx(abs(bottom - top) / 3990.0, rel=0.005)


@pytest.mark.parametrize(("changes", "pieces"), [({}, 1), ({7: {"lat_deg": None}}, 2)])
def test_gaps_are_not_drawn(drive, changes, pieces: int) -> None:
    assert len(lines(track_map(drive(20, changes), (BY_CLASS,), ()))) == pieces


def test_each_row_has_the_colour_of_its_class(drive) -> None:
    rows = drive(30, {index: {"iri_class": "C"} for index in range(10, 20)} | {25: {"iri_class": ""}})
    picture = track_map(rows, (BY_CLASS,), ())
    good, average, none = (lines(picture, name) for name in ("s0", "s2", "s-1"))
    assert [len(good), len(average), len(none)] == [3, 1, 1]
    per_row = abs(good[0][0][1] - average[0][-1][1]) / 19.5
    assert abs(average[0][0][1] - average[0][-1][1]) == pytest.approx(10 * per_row, abs=0.3)
    assert good[0][-1] == average[0][0]


def test_rough_places_are_numbered_where_they_are(drive) -> None:
    rows = drive(100, {50: {"iri_m_per_km": 20.0}})
    picture = track_map(rows, (BY_CLASS,), summarise(rows).roughest[:1])
    mark = re.search(r'class="mark"><circle cx="([\d.]+)" cy="([\d.]+)"', picture)
    ((top, bottom),) = ((line[0], line[-1]) for line in lines(picture))
    assert mark
    assert float(mark[2]) == pytest.approx(top[1] + (bottom[1] - top[1]) * 50 / 99, abs=0.3)


@pytest.mark.parametrize("rows", [0, 1, 2])
def test_small_maps_are_well_formed(drive, rows: int) -> None:
    ElementTree.fromstring(track_map(drive(rows), (BY_CLASS,), ()))
    assert "no map" in track_map(drive(rows, {i: {"lat_deg": None} for i in range(rows)}), (BY_CLASS,), ())


@example([(0.0, 1e-303), (0.0, 0.0), (0.0, 0.0)], 1.0)
@settings(max_examples=50)
@given(st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100)), min_size=1, max_size=40), st.floats(0.1, 20))
def test_what_is_left_out_lies_on_the_line(points: list[tuple[float, float]], tolerance: float) -> None:
    kept = simplified(points, tolerance)
    assert (kept[0], kept[-1]) == (points[0], points[-1])
    assert set(kept) <= set(points)
    for point in points:
        near = [off(point, one, other) for one, other in zip(kept, kept[1:] or kept, strict=False)]
        assert min(near) <= tolerance + 1e-6


def off(point: tuple[float, float], one: tuple[float, float], other: tuple[float, float]) -> float:
    """Distance of a point from a stretch, by trying points of it."""
    shares = np.linspace(0, 1, 2001)
    spacing = hypot(other[0] - one[0], other[1] - one[1]) / 2000
    x, y = one[0] + shares * (other[0] - one[0]), one[1] + shares * (other[1] - one[1])
    return float(np.hypot(x - point[0], y - point[1]).min()) - spacing
