"""Means over sections, beside sums over a fine grid and beside the exact IRI of a profile."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ridelog
from logger.roads.iri import rectified_slope, window_iri
from logger.roads.sections import SectionWindows, WindowErrors, even_edges, federal_condition, sections

NAN = float("nan")


@st.composite
def ways(draw: st.DrawFn) -> tuple[SectionWindows, np.ndarray]:
    """Windows with gaps between them, some without values, and limits at any place: all in centimetres, so that a grid
    of them is exact."""
    lengths = draw(st.lists(st.integers(50, 900), min_size=1, max_size=12))
    gaps = draw(st.lists(st.sampled_from([0, 0, 0, 500]), min_size=len(lengths), max_size=len(lengths)))
    ends = np.cumsum(np.array(lengths) + gaps)
    values = st.one_of(st.just(NAN), st.floats(0.5, 20))
    iri, square = (np.array(draw(st.lists(values, min_size=len(lengths), max_size=len(lengths)))) for _ in range(2))
    std = np.where(np.isfinite(iri), 0.1 + 0.1 * np.nan_to_num(iri), NAN)
    cuts = sorted(draw(st.sets(st.integers(0, int(ends[-1]) + 300), min_size=2, max_size=6)))
    errors = WindowErrors(std, *np.zeros((3, len(std))))
    windows = SectionWindows((ends - lengths) / 100, ends / 100, np.array(lengths) / 1000, iri, errors, square)
    return windows, np.array(cuts) / 100


@given(ways())
@settings(max_examples=60, deadline=None)
def test_sums_over_a_grid_of_a_centimetre_agree(way: tuple[SectionWindows, np.ndarray]) -> None:
    windows, edges_m = way
    found = sections(windows, edges_m)
    grid_m = np.arange(0.005, max(edges_m[-1], windows.end_m[-1]), 0.01)
    owner = np.full(len(grid_m), -1)
    for number, (start_m, end_m) in enumerate(zip(windows.start_m, windows.end_m, strict=True)):
        owner[(grid_m > start_m) & (grid_m < end_m)] = number
    for index in range(len(edges_m) - 1):
        inside = owner[(grid_m > edges_m[index]) & (grid_m < edges_m[index + 1])]
        here = inside[inside >= 0]
        assert found.driven_m[index] == pytest.approx(0.01 * len(here), abs=1e-9)
        iri = windows.iri_m_per_km[here]
        known = np.isfinite(iri)
        assert found.known_m[index] == pytest.approx(0.01 * known.sum(), abs=1e-9)
        if not known.any():
            nothing = (found.iri_m_per_km, found.iri_std_m_per_km, found.worst_m_per_km)
            assert np.isnan([one[index] for one in nothing]).all()
            continue
        assert found.iri_m_per_km[index] == pytest.approx(iri[known].mean())
        assert np.isfinite(found.iri_std_m_per_km[index])
        assert found.worst_m_per_km[index] == np.nanmax(iri)
        seconds = (windows.duration_s / (windows.end_m - windows.start_m))[here]
        square = windows.mean_square[here]
        felt = np.isfinite(square)
        expected = np.sqrt((square * seconds)[felt].sum() / seconds[felt].sum()) if felt.any() else NAN
        assert found.a_w_mps2[index] == pytest.approx(expected, nan_ok=True)
        assert found.speed_mps[index] == pytest.approx(len(here) / seconds.sum())


def test_the_iri_of_a_section_is_the_exact_one() -> None:
    road = ridelog.random_road(iso_class="C", length_m=400.0, spacing_m=0.05, seed=5)
    slope = rectified_slope(road.elevation_m, road.spacing_m)
    edges_m = 7.62 * np.arange(52)
    iri = window_iri(slope, road.spacing_m, edges_m)
    windows = SectionWindows(edges_m[:-1], edges_m[1:], np.ones(51), iri,
                             WindowErrors(np.full(51, 0.3), *np.zeros((3, 51))), np.ones(51))
    limits_m = even_edges(300.0, 100.0)
    assert sections(windows, limits_m).iri_m_per_km == pytest.approx(window_iri(slope, 0.05, limits_m), rel=0.02)
    whole = np.array([0.0, edges_m[-1]])
    assert sections(windows, whole).iri_m_per_km == pytest.approx(window_iri(slope, 0.05, whole), rel=1e-9)
    assert sections(windows, whole).iri_std_m_per_km == pytest.approx(0.3 / np.sqrt(51))


@pytest.mark.parametrize(("in_per_mi", "word"), [(94.9, "good"), (95.1, "fair"), (169.9, "fair"), (170.1, "poor")])
def test_words_of_the_federal_limits(in_per_mi: float, word: str) -> None:
    assert federal_condition(in_per_mi * 0.0254 / 1.609344) == word
