"""Lines of a map: thinning changes nothing one can see."""

from math import hypot

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from logger.report.maps import simplified


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
