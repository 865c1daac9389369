"""The Golden Car's sections, in floating point and in integers, and its slope cut into windows of one length."""

import numpy as np
import pytest

from logger.dsp.filters import frequency_response
from logger.dsp.fixed_point import FULL_SCALE_SLOPE, FixedFilter, fixed_cascade
from logger.roads import iso8608
from logger.roads.iri import golden_car_sections, rectified_slope, window_iri, windows_of

SLOPE = {spacing_m: rectified_slope(iso8608.generate(100.0, 60.0, spacing_m, 2), spacing_m)
         for spacing_m in (0.05, 0.25)}


def test_windows_are_those_between_their_edges_and_the_last_is_marked() -> None:
    windows = windows_of(SLOPE[0.05], 0.05, 7.62)
    edges = [7.62 * number for number in range(8)]
    assert [window.distance_start_m for window in windows] == edges
    assert [window.partial for window in windows] == [False] * 7 + [True]
    assert windows[-1].distance_end_m == pytest.approx(len(SLOPE[0.05]) * 0.05)
    expected = window_iri(SLOPE[0.05], 0.05, [*edges, windows[-1].distance_end_m])
    assert [window.iri_m_per_km for window in windows] == pytest.approx(expected, rel=1e-12)


def test_a_profile_that_ends_with_a_window_has_no_partial_one() -> None:
    windows = windows_of(SLOPE[0.25][:80], 0.25, 10.0)
    assert [(window.distance_start_m, window.distance_end_m) for window in windows] == [(0, 10), (10, 20)]
    assert windows[0].iri_m_per_km == pytest.approx(1000 * SLOPE[0.25][:40].mean(), rel=1e-13)


def test_windows_shorter_than_a_step_are_refused() -> None:
    for window_m in (0.0, 0.249, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match=r"at least the 0.25 m"):
            windows_of(SLOPE[0.25], 0.25, window_m)


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
    fixed = FixedFilter(fixed_cascade(golden_car_sections(0.25), FULL_SCALE_SLOPE))
    fixed.reset((elevation[44] - elevation[0]) / 11.0)
    in_integers = np.abs(fixed.process(np.diff(elevation) / 0.25))
    assert abs(in_integers.mean() / rectified_slope(elevation, 0.25).mean() - 1) < 1e-6
