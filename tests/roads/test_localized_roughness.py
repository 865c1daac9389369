"""Areas of localized roughness, beside a sliding mean that is summed sample by sample."""

from __future__ import annotations

import numpy as np
import pytest

from logger.roads.iri import areas, continuous_iri

WINDOW_M = 7.62


def test_an_area_ends_where_the_line_meets_the_limit() -> None:
    found = areas(np.array([0.0, 10.0, 20.0, 30.0]), np.array([1.0, 5.0, 3.0, 1.0]), 2.0, np.full(4, 0.3))
    assert len(found) == 1
    assert (found[0].start_m, found[0].end_m) == pytest.approx((2.5, 25.0))
    assert (found[0].worst_m_per_km, found[0].worst_std_m_per_km, found[0].worst_at_m) == (5.0, 0.3, 10.0)


def test_what_is_not_known_and_a_gap_end_an_area() -> None:
    at_m = np.array([0.0, 8.0, 16.0, 24.0, 100.0, 108.0])
    found = areas(at_m, np.array([5.0, 5.0, np.nan, 5.0, 6.0, 1.0]), 2.0, gap_m=12.0)
    assert [(one.start_m, one.end_m) for one in found] == [(0.0, 8.0), (24.0, 24.0), (100.0, pytest.approx(106.4))]
    assert areas(np.zeros(0), np.zeros(0), 2.0) == []


def test_windows_slide_as_a_road_that_is_even_inside_them() -> None:
    rng = np.random.default_rng(1)
    value, steps = rng.uniform(0.5, 6.0, 40), 254
    fine = np.repeat(value, steps)
    sums = np.concatenate([[0.0], np.cumsum(fine)])
    slides = (sums[steps:] - sums[:-steps]) / steps
    at_m = (np.arange(len(slides)) + steps / 2) * WINDOW_M / steps
    limit = 3.0
    rough = np.flatnonzero(np.diff((slides > limit).astype(int), prepend=0, append=0)).reshape(-1, 2)
    found = areas(WINDOW_M * (np.arange(40) + 0.5), value, limit)
    assert len(found) == len(rough)
    for one, (first, end) in zip(found, rough, strict=True):
        assert one.start_m == pytest.approx(at_m[first], abs=0.05)
        assert one.end_m == pytest.approx(at_m[end - 1], abs=0.05)


def test_a_step_in_a_profile_is_one_area() -> None:
    spacing_m = 0.05
    profile = np.where(np.arange(4000) * spacing_m > 100.0, 0.02, 0.0)
    middle_m, value = continuous_iri(profile, None, spacing_m, WINDOW_M)
    found = areas(middle_m, value, 3.0)
    assert len(found) == 1
    assert 94.0 < found[0].start_m < 100.0 < found[0].end_m < 115.0
    assert found[0].worst_m_per_km == pytest.approx(value.max())
