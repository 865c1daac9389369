"""Obstacles at places where their height is plain."""

import numpy as np
import pytest

from logger.roads.obstacles import OBSTACLES, plate, pothole, ramp, step

AT = [0.0, 9.99, 10.0, 10.5, 11.0, 12.0, 12.5, 13.0, 20.0]


def test_heights() -> None:
    assert step(AT, 10.0, 0.1) == pytest.approx([0, 0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1])
    assert ramp(AT, 10.0, -0.2, 2.0) == pytest.approx([0, 0, 0, -0.05, -0.1, -0.2, -0.2, -0.2, -0.2])
    assert plate(AT, 10.0, 0.1, 3.0) == pytest.approx([0, 0, 0.1, 0.1, 0.1, 0.1, 0.1, 0, 0])
    assert plate(AT, 10.0, 0.1, 3.0, 1.0) == pytest.approx([0, 0, 0, 0.05, 0.1, 0.1, 0.05, 0, 0], abs=1e-15)
    assert pothole(AT, 10.0, 0.1, 3.0, 1.0) == pytest.approx([0, 0, 0, -0.05, -0.1, -0.1, -0.05, 0, 0], abs=1e-15)


def test_they_add_up_to_a_table_of_steps() -> None:
    at = np.linspace(0, 30, 301)
    assert step(at, 5.0, 0.1) - step(at, 25.0, 0.1) == pytest.approx(plate(at, 5.0, 0.1, 20.0))
    table = ramp(at, 5.0, 0.1, 2.0) - ramp(at, 23.0, 0.1, 2.0)
    assert table == pytest.approx(plate(at, 5.0, 0.1, 20.0, 2.0))
    assert sorted(OBSTACLES) == ["bump", "plate", "pothole", "ramp", "step"]


@pytest.mark.parametrize(("length_m", "edge_m"), [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.6), (1.0, -0.1), (np.nan, 0.0)])
def test_impossible_lengths_are_refused(length_m: float, edge_m: float) -> None:
    for obstacle in (plate, pothole):
        with pytest.raises(ValueError, match="length above 0"):
            obstacle(AT, 1.0, 0.1, length_m, edge_m)


def test_a_ramp_needs_a_length() -> None:
    with pytest.raises(ValueError, match="length above 0"):
        ramp(AT, 1.0, 0.1, 0.0)
