"""Fixes that are written again and again, and places without a speed."""

from __future__ import annotations

import numpy as np
import pytest

from logger.extraction.held_fixes import new_rows, speeds_of_places, way_over_speed

DEGREE_M = 111_195.0  # of a meridian, on a sphere of 6371 km


def test_a_fix_is_new_where_it_changes() -> None:
    time_s = np.arange(0, 20, 0.01)
    speed = 10 + np.floor(time_s)
    assert (new_rows(time_s, speed[:, None], speed, 0.5) == 100 * np.arange(20)).all()


def test_standing_is_no_lost_fix_but_a_speed_that_is_held_is() -> None:
    time_s = np.arange(0, 60, 0.01)
    for held, longest_s in ((0.0, 1.5), (14.0, 30.0)):
        speed = np.where((time_s > 20) & (time_s < 50), held, 10 + np.floor(time_s))
        assert np.diff(time_s[new_rows(time_s, speed[:, None], speed, 0.5)]).max() == pytest.approx(longest_s, abs=1.0)


def test_places_tell_the_speed() -> None:
    time_s = np.arange(0, 30, 1.0)
    lat = 45.0 + 12.0 * time_s / DEGREE_M
    assert speeds_of_places(time_s, lat, np.full(30, 7.0)) == pytest.approx(np.full(30, 12.0), rel=1e-4)
    east = 179.999 + 12.0 * time_s / DEGREE_M
    east = (east + 180) % 360 - 180
    assert speeds_of_places(time_s, np.zeros(30), east) == pytest.approx(np.full(30, 12.0), rel=1e-4)


@pytest.mark.parametrize(("factor", "ratio"), [(1.0, None), (1.1, None), (3.6, 1 / 3.6), (1 / 3.6, 3.6)])
def test_a_speed_in_another_unit_is_seen(factor: float, ratio: float | None) -> None:
    time_s = np.arange(0, 60, 1.0)
    lat = 45.0 + 12.0 * time_s / DEGREE_M
    found = way_over_speed(time_s, lat, np.full(60, 7.0), np.full(60, 12.0 * factor))
    assert found == (ratio and pytest.approx(ratio, rel=1e-3))
