"""Axes: their values are round, and of a map both are alike."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.chart_data import Bars, Curves, Line
from logger.geodesy import east_and_north_m
from logger.report.charts import chart, nice_step, nice_ticks


@given(st.floats(1e-6, 1e9), st.integers(3, 10))
def test_ticks_are_round_and_within(end: float, about: int) -> None:
    ticks = nice_ticks(0.0, end, about)
    assert ticks[0] == 0.0
    assert ticks[-1] <= end * (1 + 1e-9)
    assert 1 < len(ticks) <= about + 1
    assert ticks[1] == pytest.approx(nice_step(end / about))
    assert re.fullmatch(r"[125]0*(e[-+]\d+)?|0\.0*[125]", f"{ticks[1]:g}")


def test_north_is_up_and_a_metre_is_as_long_in_both_directions() -> None:
    """A square of 100 m near 60 degrees north, where a degree of longitude is half as long."""
    side_deg = 100 / (60 * 1852)
    lat = 60.0 + side_deg * np.array([0, 1, 1, 0])
    lon = 10.0 + side_deg / np.cos(np.radians(60)) * np.array([0, 0, 1, 1])
    square = east_and_north_m(lat, lon, 60.0, 10.0)
    lines = (Line("<line>", *square), Line("a & b", *square, dots=True))
    drawn = chart(Curves("Map", "east", "north", lines, equal=True))
    dots = [(float(x), float(y)) for x, y in re.findall(r'<circle class="dot" cx="([\d.]+)" cy="([\d.]+)"', drawn)]
    (x0, y0), (x1, y1), (x2, y2), _ = dots
    assert y1 < y0 and x2 > x1
    assert x1 - x0 == pytest.approx(0, abs=0.2) and y2 - y1 == pytest.approx(0, abs=0.2)
    assert y0 - y1 == pytest.approx(x2 - x1, rel=0.01)
    assert "&lt;line&gt;" in drawn and "a &amp; b" in drawn and "<line>" not in drawn


def test_bars_are_as_long_as_their_values_and_the_level_is_drawn_through_them() -> None:
    drawn = chart(Bars("Error", "error", (("as it <is>", 0.4), ("refitted", 0.2), ("with a & b", 0.1)),
                       (0.1, "noise alone")))
    wide = [float(one) for one in re.findall(r'<rect class="cell" x="[\d.]+" y="[\d.]+" width="([\d.]+)"', drawn)]
    left = float(re.findall(r'<rect class="cell" x="([\d.]+)"', drawn)[0])
    level = float(re.findall(r'<path class="level" d="M([\d.]+) ', drawn)[0])
    assert wide[0] == pytest.approx(2 * wide[1], abs=0.2) == pytest.approx(4 * wide[2], abs=0.5)
    assert left + wide[2] == pytest.approx(level, abs=0.2)
    assert "as it &lt;is&gt;" in drawn and "with a &amp; b" in drawn and "noise alone" in drawn


def test_a_long_name_of_a_line_ends_within_the_chart() -> None:
    """At 7 units a letter, beside where it begins."""
    x = np.arange(3.0)
    names = "guesses for what the vehicle's file leaves unknown", "refitted"
    drawn = chart(Curves("Force", "velocity", "force", tuple(Line(name, x, x) for name in names)))
    words = [(float(at), float(y), said) for at, y, said in re.findall(
        r'<text[^>]* x="([\d.]+)" y="([\d.]+)"[^>]*>([^<]+)</text>', drawn) if float(at) > 800]
    key = [one for one in words if one[0] == max(at for at, _, _ in words)]
    assert " ".join(said for _, _, said in key).replace("&#x27;", "'").replace("&#39;", "'") == " ".join(names)
    assert all(at + 7 * len(said) <= 1000 for at, _, said in key) and len({y for _, y, _ in key}) == len(key) > 2
