"""The IRI of a stream is that of the whole profile, bit for bit, whatever the blocks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.dsp.filters import frequency_response
from logger.dsp.fixed_point import FULL_SCALE_SLOPE, FixedFilter, fixed_cascade
from logger.roads import iso8608
from logger.roads.iri import GoldenCarFilter, IriWindow, IriWindows, golden_car_sections, rectified_slope, window_iri

ROAD = {spacing_m: iso8608.generate(100.0, 60.0, spacing_m, 2) for spacing_m in (0.05, 0.25)}
SLOPE = {spacing_m: rectified_slope(elevation, spacing_m) for spacing_m, elevation in ROAD.items()}


def stream(spacing_m: float, window_m: float, sizes: list[int]) -> tuple[np.ndarray, list[IriWindow]]:
    """Slopes and windows of the road, pushed in blocks of these sizes over and over."""
    elevation, car, cutter = ROAD[spacing_m], GoldenCarFilter(spacing_m), IriWindows(spacing_m, window_m)
    slopes, windows, start, turn = [], [], 0, 0
    while start < len(elevation):
        size = sizes[turn % len(sizes)]
        slopes.append(car.push(elevation[start: start + size]))
        windows += cutter.push(slopes[-1])
        start, turn = start + size, turn + 1
    return np.concatenate(slopes), windows + cutter.finish()


@given(st.sampled_from([0.05, 0.25]), st.sampled_from([0.26, 7.62, 10.0, 100.0]),
       st.lists(st.one_of(st.integers(1, 9), st.integers(1, 700)), min_size=1, max_size=8))
@settings(max_examples=60)
def test_any_split_gives_the_same_bits(spacing_m: float, window_m: float, sizes: list[int]) -> None:
    slopes, windows = stream(spacing_m, window_m, sizes)
    assert slopes.tobytes() == SLOPE[spacing_m].tobytes()
    cutter = IriWindows(spacing_m, window_m)
    assert windows == cutter.push(SLOPE[spacing_m]) + cutter.finish()


@pytest.mark.parametrize("size", [*range(1, 70), 1201])
def test_every_block_size_gives_the_same_bits(size: int) -> None:
    slopes, windows = stream(0.05, 7.62, [size])
    assert slopes.tobytes() == SLOPE[0.05].tobytes()
    assert windows == stream(0.05, 7.62, [5000])[1]


def test_windows_are_those_of_the_batch_and_the_last_is_marked() -> None:
    _, windows = stream(0.05, 7.62, [13])
    edges = [7.62 * number for number in range(8)]
    assert [window.distance_start_m for window in windows] == edges
    assert [window.partial for window in windows] == [False] * 7 + [True]
    assert windows[-1].distance_end_m == pytest.approx(len(SLOPE[0.05]) * 0.05)
    expected = window_iri(SLOPE[0.05], 0.05, [*edges, windows[-1].distance_end_m])
    assert [window.iri_m_per_km for window in windows] == pytest.approx(expected, rel=1e-12)


def test_a_profile_that_ends_with_a_window_has_no_partial_one() -> None:
    cutter = IriWindows(0.25, 10.0)
    windows = cutter.push(SLOPE[0.25][:80]) + cutter.finish()
    assert [(window.distance_start_m, window.distance_end_m) for window in windows] == [(0, 10), (10, 20)]
    assert windows[0].iri_m_per_km == pytest.approx(1000 * SLOPE[0.25][:40].mean(), rel=1e-13)


def test_values_come_as_soon_as_their_tire_base_is_known() -> None:
    car = GoldenCarFilter(0.05)
    counts = [len(car.push(value[None])) for value in ROAD[0.05][:240]]
    assert counts == [0] * 220 + [216] + [1] * 19


def test_windows_shorter_than_a_step_are_refused() -> None:
    for window_m in (0.0, 0.249, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match=r"at least the 0.25 m"):
            IriWindows(0.25, window_m)


@pytest.mark.parametrize("spacing_m", [0.001, 0.025, 0.3])
def test_sections_are_stable_and_blind_to_a_steady_slope(spacing_m: float) -> None:
    sos = golden_car_sections(spacing_m)
    assert sos.shape == (2, 6)
    assert (np.abs([np.roots(row[3:]) for row in sos]) < 1).all()
    assert sos[0, :3].sum() == 0.0
    peak_cpm = 0.42 if spacing_m < 0.1 else 0.4
    gain = np.abs(frequency_response(sos, [0.001, peak_cpm], 1 / spacing_m))
    assert gain[0] < 0.001
    assert gain[1] > 1.0


def test_the_quarter_car_runs_in_integers_as_well() -> None:
    """IRI in 32-bit arithmetic beside floating point, on the service's kind of grid."""
    elevation = iso8608.generate(120.0, 500.0, 0.25, 6)

    def in_integers(rows: np.ndarray) -> FixedFilter:
        return FixedFilter(fixed_cascade(rows, FULL_SCALE_SLOPE))

    exact = GoldenCarFilter(0.25).push(elevation)
    fixed = GoldenCarFilter(0.25, in_integers).push(elevation)
    assert abs(fixed.mean() / exact.mean() - 1) < 1e-6
