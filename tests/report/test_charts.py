"""Plots: what is drawn lies where it belongs, and what is not known is not drawn."""

import re
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.report.charts import MAX_POINTS, Level, Plot, line_figure, nice_step, nice_ticks


def paths(figure: str, name: str) -> list[list[tuple[float, float]]]:
    """Points of the lines of one class."""
    found = re.search(rf'<path class="{name}" d="([^"]*)"', figure)
    assert found
    return [[tuple(map(float, point.split())) for point in re.findall(r"[\d.]+ [\d.]+", line)]
            for line in found[1].split("M")[1:]]


def test_a_straight_line_is_drawn_straight() -> None:
    plot = Plot("Speed", "km/h", [0.0, 500.0, 1000.0], [0.0, 50.0, 100.0])
    (points,) = paths(line_figure(plot), "line")
    (x0, y0), (x1, y1), (x2, y2) = points
    assert x1 - x0 == pytest.approx(x2 - x1, abs=0.11)
    assert y1 - y0 == pytest.approx(y2 - y1, abs=0.11)
    assert x0 < x2
    assert y0 > y2


def test_the_line_breaks_at_the_unknown_and_between_drives() -> None:
    plot = Plot("IRI", "m/km", [float(i) for i in range(8)], [1, 1, None, 1, 1, 1, 1, 1], errors=[0.5] * 8, breaks=[5])
    assert [len(line) for line in paths(line_figure(plot), "line")] == [2, 2, 3]
    assert [len(line) for line in paths(line_figure(plot), "band")] == [4, 4, 6]


def test_the_band_is_as_wide_as_the_error_and_ends_at_zero() -> None:
    plot = Plot("IRI", "m/km", [0.0, 100.0], [4.0, 1.0], errors=[2.0, 3.0])
    figure = line_figure(plot)
    ((_, y_four), (_, y_one)), ((_, up), _, (_, floor), (_, down)) = *paths(figure, "line"), *paths(figure, "band")
    per_unit = (y_one - y_four) / 3
    assert (up, down) == pytest.approx((y_four - 0.05 * 4 * per_unit, y_four + 2 * per_unit), abs=0.11)
    assert floor == pytest.approx(y_one + per_unit, abs=0.11)


def test_many_points_are_drawn_as_means_and_that_is_said() -> None:
    count = 3 * MAX_POINTS - 1
    plot = Plot("IRI", "m/km", [float(i) for i in range(count)], [float(i % 3) for i in range(count)])
    figure = line_figure(plot)
    (points,) = paths(figure, "line")
    assert len(points) == MAX_POINTS
    assert len({y for _, y in points[:-1]}) == 1
    assert "the mean of 3 windows" in figure


@pytest.mark.parametrize("plot", [
    Plot("a", "b", [], []), Plot("a", "b", [5.0], [0.0]), Plot("a", "b", [5.0], [None]),
    Plot("<script>", '">', [1.0, 2.0], [1.0, 2.0], errors=[None, 0.1], levels=[Level(1.5, "<b>")], breaks=[0, 1, 2],
         marks=[(1.0, 9.0, "<i>")])])
def test_any_plot_is_well_formed(plot: Plot) -> None:
    figure = ElementTree.fromstring(line_figure(plot))
    assert not [element for element in figure.iter() if element.tag in ("script", "b", "i")]


@given(st.floats(1e-6, 1e9), st.integers(3, 10))
def test_ticks_are_round_and_within(end: float, about: int) -> None:
    ticks = nice_ticks(0.0, end, about)
    assert ticks[0] == 0.0
    assert ticks[-1] <= end * (1 + 1e-9)
    assert 1 < len(ticks) <= about + 1
    assert ticks[1] == pytest.approx(nice_step(end / about))
    assert re.fullmatch(r"[125]0*(e[-+]\d+)?|0\.0*[125]", f"{ticks[1]:g}")
