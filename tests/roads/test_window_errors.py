"""Standard errors of means of windows, beside means of drawn errors."""

from __future__ import annotations

import numpy as np
import pytest

from logger.roads import iso8608
from logger.roads.iri import rectified_slope
from logger.roads.repeated_drives import passes_of
from logger.roads.sections import ALONG_M, SectionWindows, WindowErrors, even_edges, sections

WINDOW_M, COUNT, PARTS = 7.5, 120, 15  # of half a metre
OWN, LEVEL, COMMON, PLACE = (np.linspace(*ends, COUNT) for ends in ((0.3, 0.7), (0.5, 0.2), (0.1, 0.1), (0.4, 0.6)))
EDGES_M = WINDOW_M * np.arange(COUNT + 1)
ERRORS = WindowErrors(np.sqrt(OWN**2 + LEVEL**2 + COMMON**2 + PLACE**2), LEVEL, COMMON, PLACE)
NOTHING = np.zeros(COUNT)


def drawn_errors(count: int) -> np.ndarray:
    """Errors of pieces of half a metre (count, pieces), each part by what it is said to be."""
    rng = np.random.default_rng(5)
    level = np.empty((count, COUNT))
    level[:, 0] = rng.standard_normal(count)
    kept = np.exp(-WINDOW_M / ALONG_M)
    for number in range(1, COUNT):
        level[:, number] = kept * level[:, number - 1] + np.sqrt(1 - kept**2) * rng.standard_normal(count)
    passed = rng.standard_normal((count, COUNT + 1)) * np.append(PLACE, PLACE[-1]) / np.sqrt(2)
    own = OWN * rng.standard_normal((count, COUNT))
    whole = own + LEVEL * level + COMMON * rng.standard_normal((count, 1)) + np.diff(passed)
    return np.repeat(whole, PARTS, axis=1)


@pytest.mark.parametrize("length_m", [0.5, 5.0, 7.5, 10.0, 45.0, 150.0, 900.0])
def test_errors_of_sections_are_those_of_drawn_errors(length_m: float) -> None:
    per_section = round(2 * length_m)
    drawn = drawn_errors(4000).reshape(4000, -1, per_section).mean(axis=2)
    windows = SectionWindows(EDGES_M[:-1], EDGES_M[1:], NOTHING + 1, NOTHING + 3, ERRORS, NOTHING + 1)
    found = sections(windows, even_edges(EDGES_M[-1], length_m)).iri_std_m_per_km
    assert found == pytest.approx(drawn.std(axis=0), rel=0.06)


def test_a_row_with_holes_has_the_ends_of_its_parts() -> None:
    only_place = WindowErrors(NOTHING + 0.5, NOTHING, NOTHING, NOTHING + 0.5)
    iri = NOTHING + 3
    iri[40:50] = np.nan
    windows = SectionWindows(EDGES_M[:-1], EDGES_M[1:], NOTHING + 1, iri, only_place, NOTHING + 1)
    whole = sections(windows, EDGES_M[[0, -1]]).iri_std_m_per_km
    assert whole == pytest.approx(np.sqrt(2) * 0.5 / (COUNT - 10))


def test_a_window_that_is_cut_may_be_rougher_on_one_side() -> None:
    """Means over half metres that are drawn alike, and windows that are known exactly."""
    rough = 3 + np.random.default_rng(6).standard_normal(COUNT * PARTS)
    exact = WindowErrors(NOTHING, NOTHING, NOTHING, NOTHING)
    windows = SectionWindows(EDGES_M[:-1], EDGES_M[1:], NOTHING + 1, rough.reshape(COUNT, PARTS).mean(axis=1), exact,
                             NOTHING + 1)
    edges_m = even_edges(EDGES_M[-1], 10.0)[:-1]
    found = sections(windows, edges_m)
    true = rough[:(len(edges_m) - 1) * 20].reshape(-1, 20).mean(axis=1)
    off = (found.iri_m_per_km - true) / np.maximum(found.iri_std_m_per_km, 1e-9)
    cut = found.iri_std_m_per_km > 0
    assert 0.8 < np.sqrt(np.mean(off[cut] ** 2)) < 1.25
    assert found.iri_m_per_km[~cut] == pytest.approx(true[~cut])


@pytest.mark.parametrize("part", range(5))
def test_a_piece_of_a_window_has_the_error_of_the_window(part: int) -> None:
    """Its mean is that of the window, so it is off by as much; here the road is alike everywhere."""
    parts = 0.5 * np.eye(3, 4)[:, [part % 4]]  # none of the three, where the error is the window's own
    errors = WindowErrors(np.array([0.5]), *(parts if part < 4 else np.full((3, 1), np.nan)))
    for piece_m in (WINDOW_M, WINDOW_M / 2, 0.1, 1e-6):
        windows = SectionWindows(np.zeros(1), np.array([WINDOW_M]), np.ones(1), np.array([3.0]), errors, np.ones(1))
        assert sections(windows, np.array([0.0, piece_m])).iri_std_m_per_km == pytest.approx(0.5)


@pytest.mark.parametrize("piece_m", [0.1, 0.5, 1.0, 2.0, 4.0])
def test_a_piece_of_a_road_differs_from_its_window_by_its_standard_error(piece_m: float) -> None:
    """Roads of ISO 8608 whose windows are known exactly."""
    spacing_m, off = 0.05, []
    for seed in range(3):
        slope = rectified_slope(iso8608.generate(iso8608.gd_n0_from_iri(3.0), 2000, spacing_m, seed), spacing_m)
        slope = slope[1000:1000 + 240 * 150].reshape(240, 150)
        iri, nothing, start_m = slope.mean(axis=1), np.zeros(240), WINDOW_M * np.arange(240)
        windows = SectionWindows(start_m, start_m + WINDOW_M, nothing + 1, iri, WindowErrors(*[nothing] * 4),
                                 nothing + 1)
        found = sections(windows, np.sort(np.append(start_m, start_m + piece_m)))
        true = slope[:, :round(piece_m / spacing_m)].mean(axis=1)
        off.append((iri - true) / found.iri_std_m_per_km[::2])
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.15)


def test_a_sliver_by_rounding_is_no_cell_and_no_part_of_a_section() -> None:
    start_m, end_m = np.array([25.0 - 1e-14, 50.0]), np.array([50.0, 75.0 + 1e-13])
    one = WindowErrors.undivided(np.ones(2))
    passes = passes_of(np.zeros(2, np.intp), start_m, end_m, np.zeros(2, np.intp), np.zeros(2), np.ones(2), one, 25.0)
    assert passes.known_m == pytest.approx([25.0, 25.0])
    found = sections(SectionWindows(start_m, end_m, np.ones(2), np.ones(2), one, np.ones(2)), 25.0 * np.arange(5))
    assert np.isfinite(found.iri_m_per_km).tolist() == [False, True, True, False]


@pytest.mark.parametrize("parts", [(-1.0, 0.1, 0.1), (0.1, 999999999.0, 0.1), (0.1, 0.1, 1e300), (0.4, 0.3, 0.1),
                                   (0.1, np.nan, 0.1), (0.1, 0.1, np.inf)])
def test_parts_that_cannot_be_count_as_not_known(parts: tuple[float, float, float]) -> None:
    std = np.array([0.5])
    errors = WindowErrors(std, *(np.array([one]) for one in parts))
    assert [one.item() for one in errors.parts()] == [0.5, 0.0, 0.0]


def test_parts_may_exceed_the_whole_by_what_was_rounded() -> None:
    level, common, place = parts = np.random.default_rng(7).uniform(0.0, 1.0, (3, 1000))
    written = np.round([np.sqrt(level**2 + common**2 + place**2), *parts], 3)
    assert np.array_equal(WindowErrors(*written).parts(), written[1:])


def test_errors_of_which_the_whole_alone_is_known_count_as_shared_by_neighbours() -> None:
    old = WindowErrors.undivided(NOTHING + 0.5)
    windows = SectionWindows(EDGES_M[:-1], EDGES_M[1:], NOTHING + 1, NOTHING + 3, old, NOTHING + 1)
    two = sections(windows, EDGES_M[[0, 2]]).iri_std_m_per_km
    assert two == pytest.approx(0.5 * np.sqrt((1 + np.exp(-WINDOW_M / ALONG_M)) / 2))


def test_a_pass_against_the_way_has_the_same_error_as_along_it() -> None:
    way, drive, edges_m = np.zeros(COUNT, np.intp), np.zeros(COUNT, np.intp), EDGES_M
    there = passes_of(way, edges_m[:-1], edges_m[1:], drive, NOTHING, NOTHING + 3, ERRORS, 150.0)
    back = passes_of(way, *(edges_m[-1] - edges_m[one] for one in (slice(1, None), slice(None, -1))), drive, NOTHING,
                     NOTHING + 3, ERRORS, 150.0)
    assert back.iri_errors.std[::-1] == pytest.approx(there.iri_errors.std)
