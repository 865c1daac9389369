"""Positions on a line on the ground."""

from __future__ import annotations

import numpy as np
import pytest

from logger.extraction.along_track import MeasuredLine, passes

M_PER_DEG = 111_195.08


def line(lat_deg: float = 48.0, lon_deg: float = 11.0, length_m: float = 1000.0) -> tuple[MeasuredLine, np.ndarray]:
    """Ten metres east for each ten of distance, which begins at 500; and its longitudes."""
    along = np.arange(0, length_m + 1, 10.0)
    lon = lon_deg + along / M_PER_DEG / np.cos(np.radians(lat_deg))
    lon = (lon + 180) % 360 - 180
    return MeasuredLine.of(along + 500, np.full(len(along), lat_deg), lon), lon


@pytest.mark.parametrize(("lat_deg", "lon_deg"), [(48.0, 11.0), (-33.0, 151.0), (0.0, 0.0), (52.0, 179.995)])
def test_a_position_beside_the_line_is_laid_on_it(lat_deg: float, lon_deg: float) -> None:
    measured, lon = line(lat_deg, lon_deg)
    for place in (3, 50, 77):
        along, aside = measured.passed(np.array([lat_deg + 4 / M_PER_DEG]), lon[place : place + 1])
        assert along[0] == pytest.approx(500 + 10 * place, abs=0.2)
        assert aside[0] == pytest.approx(4.0, abs=0.6)


def test_a_drive_that_passes_twice_makes_two_passes() -> None:
    driven = np.arange(0, 3000, 10.0)
    along = np.where(driven < 1000, driven + 500, np.where(driven < 2000, 1500.0, driven - 1500))
    aside = np.where((driven >= 1000) & (driven < 2000), 300.0, 3.0)
    found = passes(driven, along, aside)
    assert [(one.first, one.last) for one in found] == [(0, 100), (200, 300)]
    assert [one.offset_m for one in found] == [500.0, -1500.0]


def test_the_other_direction_is_no_pass_and_is_recognised() -> None:
    driven = np.arange(0, 1000, 10.0)
    along, aside = 1500 - driven, np.full(100, 2.0)
    assert not passes(driven, along, aside)
    assert passes(driven, -along, aside)


def test_standing_beside_the_line_is_no_pass() -> None:
    assert not passes(np.zeros(50), np.full(50, 700.0), np.full(50, 2.0))


def test_a_line_needs_two_places() -> None:
    with pytest.raises(ValueError, match="two positions"):
        MeasuredLine.of(np.zeros(1), np.zeros(1), np.zeros(1))
