"""Digital sections of a weighting against its formula; the formula itself: ``test_weightings_catalogue``."""

from __future__ import annotations

import numpy as np
import pytest

from logger.dsp.design import design_error, design_sections
from logger.dsp.filters import frequency_response
from logger.dsp.weightings.weighting import Weighting
from logger.plugins import catalogue

BAND_HZ = np.geomspace(0.1, 40.0, 2000)

WEIGHTINGS = catalogue("logger.dsp.weightings", "WEIGHTING")
WEIGHTING, WD, WJ, WF = (WEIGHTINGS[name] for name in ("wk", "wd", "wj", "wf"))


def test_absent_parts_leave_no_trace() -> None:
    f_hz = np.array([0.5, 3.0, 30.0])
    band = (f_hz**2 / np.sqrt(f_hz**4 + 0.4**4)) * 100**2 / np.sqrt(f_hz**4 + 100**4)  # Eq 2.13, 2.14
    np.testing.assert_allclose(np.abs(Weighting("band", 0.4, 100.0).response(f_hz)), band, rtol=1e-12)
    q2 = 0.63**2
    transition = np.sqrt((f_hz**2 + 4) / 4 * 16 * q2 / (f_hz**4 * q2 + f_hz**2 * 4 * (1 - 2 * q2) + 16 * q2))
    np.testing.assert_allclose(np.abs(WD.response(f_hz)), band * transition, rtol=1e-12)  # Eq 2.15


def test_stored_sections_are_within_0_02_db_of_the_formula() -> None:
    error = design_error(WEIGHTING, WEIGHTING.sections[100], 100, BAND_HZ)
    road = design_error(WEIGHTING, WEIGHTING.sections[100], 100, np.geomspace(0.1, 20.0, 1000))
    print(f"Wk at 100 Hz: {error.magnitude_db:.4f} dB to 40 Hz; phase {road.phase_deg:.2f} deg to 20 Hz")
    assert error.magnitude_db < 0.02
    assert road.phase_deg < 0.2


@pytest.mark.slow
def test_stored_sections_are_those_of_the_design() -> None:
    again = design_sections(WEIGHTING, 100)
    stored = np.abs(frequency_response(WEIGHTING.sections[100], BAND_HZ, 100))
    assert np.abs(20 * np.log10(np.abs(frequency_response(again, BAND_HZ, 100)) / stored)).max() < 0.001


@pytest.mark.parametrize(
    ("wanted", "rate_hz"),
    [
        (WEIGHTING, 80.0),
        (WEIGHTING, 500.0),
        pytest.param(WEIGHTING, 2000.0, marks=pytest.mark.slow),
        (WD, 100.0),
        pytest.param(WJ, 128.0, marks=pytest.mark.slow),
        pytest.param(WF, 100.0, marks=pytest.mark.slow),
        pytest.param(WF, 200.0, marks=pytest.mark.slow),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_any_weighting_at_any_rate_is_within_0_02_db(wanted: Weighting, rate_hz: float) -> None:
    sections = design_sections(wanted, rate_hz)
    band_hz = np.geomspace(wanted.f1_hz / 4, min(0.4 * rate_hz, 8 * wanted.f2_hz), 1000)
    error = design_error(wanted, sections, rate_hz, band_hz)
    largest_pole = max(np.abs(np.roots(row[3:])).max() for row in sections)
    print(f"{wanted.name} at {rate_hz:g} Hz: {error.magnitude_db:.4f} dB, {error.phase_deg:.2f} deg")
    assert error.magnitude_db < 0.02
    assert largest_pole < 0.9999


def test_a_rate_below_80_hz_is_refused() -> None:
    with pytest.raises(ValueError, match="from 80 Hz"):
        design_sections(WEIGHTING, 50)
