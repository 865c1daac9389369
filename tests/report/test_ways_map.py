"""The map of measured lines and drives on them."""

from __future__ import annotations

import re

import numpy as np
import pytest

from logger.report.maps import MapLine, ways_map


def test_north_is_up_and_a_metre_is_as_long_in_both_directions() -> None:
    """A square of 100 m near 60 degrees north, where a degree of longitude is half as long."""
    side_deg = 100 / (60 * 1852)
    lat = 60.0 + side_deg * np.array([0, 1, 1, 0])
    lon = 10.0 + side_deg / np.cos(np.radians(60)) * np.array([0, 0, 1, 1])
    drawn = ways_map([MapLine("<line>", lat, lon)], [MapLine("a & b", lat, lon), MapLine("other", lat[:1], lon[:1])])
    dots = [(float(x), float(y)) for x, y in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="2.4"', drawn)]
    assert len(dots) == 5
    (x0, y0), (x1, y1), (x2, y2), *_ = dots
    assert y1 < y0 and x2 > x1
    assert x1 - x0 == pytest.approx(0, abs=0.2) and y2 - y1 == pytest.approx(0, abs=0.2)
    assert y0 - y1 == pytest.approx(x2 - x1, rel=0.01)
    assert "&lt;line&gt;" in drawn and "a &amp; b" in drawn and "<line>" not in drawn
