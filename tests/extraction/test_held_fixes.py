"""Fixes that are written again and again, and places without a speed."""

from __future__ import annotations

import numpy as np
import pytest

from logger.extraction.recorded_columns import hidden_m, new_rows, speeds_of_places, way_over_speed

DEGREE_M = 111_195.0  # of a meridian, on a sphere of 6371 km


def test_a_fix_is_new_where_it_changes() -> None:
    time_s = np.arange(0, 20, 0.01)
    speed = 10 + np.floor(time_s)
    assert set(new_rows(time_s, speed[:, None], speed)) == {*range(0, 2000, 100)}


def widest_s(held_mps: float, hides_m: float) -> float:
    """Between two fixes, of a speed that stands still for half a minute."""
    time_s = np.arange(0, 60, 0.01)
    speed = np.where((time_s > 20) & (time_s < 50), held_mps, 10 + np.floor(time_s))
    return float(np.diff(time_s[new_rows(time_s, speed[:, None], speed, hides_m)]).max())


def test_an_unchanged_speed_is_the_same_speed() -> None:
    assert widest_s(14.0, np.inf) < 1.1


def test_places_that_stand_still_while_the_car_goes_on_are_a_lost_fix() -> None:
    assert widest_s(0.0, 0.01) < 1.1
    assert widest_s(14.0, 0.01) == pytest.approx(30.0, abs=1.0)
    assert widest_s(0.1, 11.0) < 1.1  # places in ten-thousandths of a degree hide a walk


@pytest.mark.parametrize("row_s", [0.01, 0.1, 1.0])
def test_a_speed_in_whole_numbers_is_heard_all_the_time(row_s: float) -> None:
    time_s = np.arange(0, 40 + row_s / 2, row_s)
    for speed in (np.full(len(time_s), 40.0), np.floor(40 + time_s / 15)):
        rows = new_rows(time_s, speed[:, None], speed / 3.6)
        assert np.diff(time_s[rows]).max() < 1.5
        assert time_s[rows[-1]] == time_s[-1]


def test_a_step_after_a_long_hold_stays_a_step() -> None:
    time_s = np.arange(0, 40, 0.1)
    speed = np.where(time_s < 30, 40.0, 60.0)
    rows = new_rows(time_s, speed[:, None], speed)
    at = int(np.argmax(speed[rows] == 60.0))
    assert time_s[rows[at]] - time_s[rows[at - 1]] < 0.2


def test_places_show_how_much_they_hide() -> None:
    lat = 45.0 + np.arange(50) * 1e-4
    assert hidden_m(lat, np.full(50, 7.0)) == pytest.approx(11.1, abs=0.1)


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
