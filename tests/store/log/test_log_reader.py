"""Rows of logs as drives, and as stretches without a gap."""

from __future__ import annotations

from typing import Any

import pytest

from logger.geodesy import apart_m
from logger.store.log.log_reader import along_m, iso_utc, joined, split_drives

from ...support.drives.logged_rows import rows_of_drive


@pytest.mark.parametrize(("changes", "pieces"), [
    ({}, [20]),
    ({7: {"lat_deg": None}}, [7, 12]),
    ({7: {"distance_start_m": 75.0}}, [7, 13]),
    ({7: {"distance_end_m": None, "distance_start_m": None}}, [7, 1, 12]),
    ({7: {"lon_deg": 7.5}}, [7, 1, 12]),
])
def test_gaps_are_not_joined(changes: dict[int, dict[str, Any]], pieces: list[int]) -> None:
    assert [len(piece) for piece in joined(rows_of_drive(20, changes))] == pieces


def test_another_drive_is_not_joined() -> None:
    rows = [*rows_of_drive(5), *rows_of_drive(10, number=2)[5:]]
    assert [len(piece) for piece in joined(rows)] == [5, 5]


def test_drives_are_distinguished_by_their_number_or_a_new_count() -> None:
    rows = [*rows_of_drive(3), *rows_of_drive(2, number=2), *rows_of_drive(4, number=2)]
    assert [len(drive) for drive in split_drives(rows)] == [3, 2, 4]


def test_a_window_by_time_has_no_length() -> None:
    rows = rows_of_drive(3, {1: {"distance_start_m": None, "distance_end_m": None}})
    assert along_m(rows) == [5.0, 10.0, 15.0]


def test_ground_distance_is_that_of_the_sphere() -> None:
    one, other = rows_of_drive(2, {0: {"lat_deg": 60.0, "lon_deg": 179.9}, 1: {"lat_deg": 60.0, "lon_deg": -179.9}})
    quarter_degree_m = 2 * 3.141592653589793 * 6_371_008.8 * 0.2 / 360 * 0.5
    assert apart_m(one, other) == pytest.approx(quarter_degree_m, rel=1e-5)
    assert apart_m(*rows_of_drive(2)) == pytest.approx(10.0, rel=1e-4)
    assert apart_m(one, rows_of_drive(1, {0: {"lat_deg": None}})[0]) is None


def test_instants_are_in_milliseconds() -> None:
    assert iso_utc(1_747_490_520_500_999) == "2025-05-17T14:02:00.500Z"
    assert iso_utc(None) is None
