"""The weighting's formula against the standard's numbers, and its sections against the formula."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from logger.dsp.design import design_error, design_sections
from logger.dsp.sections import frequency_response
from logger.dsp.weightings.weighting import Weighting
from logger.dsp.weightings.wk import WEIGHTING

BAND_HZ = np.geomspace(0.1, 40.0, 2000)

# ISO 2631-1 Table 3, Wk times 1000 at nominal one-third-octave frequencies.
ISO_TABLE = {0.1: 31.2, 0.5: 418, 1: 482, 2: 531, 4: 967, 6.3: 1054, 8: 1036, 16: 768, 31.5: 405, 80: 132}

# Saw-tooth bursts of ISO 8041: number of teeth (None: without end) and weighted r.m.s. [m/s2].
SAW_TEETH = {1: 0.0299, 2: 0.0411, 4: 0.0577, 8: 0.0814, 16: 0.115, None: 0.362}


def weighting(name: str, f3_hz: float, f4_hz: float, step: tuple[float, float, float, float]) -> Weighting:
    f5_hz, q5, f6_hz, q6 = step
    return Weighting(name, 0.4, 100.0, f3_hz, f4_hz, 0.63, f5_hz, q5, f6_hz, q6, {})


NO_STEP = (inf, 1.0, inf, 1.0)
WD = weighting("wd", 2.0, 2.0, NO_STEP)
WJ = weighting("wj", inf, inf, (3.75, 0.91, 5.32, 0.91))
WF = Weighting("wf", 0.08, 0.63, inf, 0.25, 0.86, 0.0625, 0.80, 0.1, 0.80, {})


@pytest.mark.parametrize(("f_hz", "thousandths"), ISO_TABLE.items())
def test_formula_gives_the_table_of_the_standard(f_hz: float, thousandths: float) -> None:
    last_digit = 0.1 if thousandths < 100 else 1.0
    assert abs(1000 * abs(WEIGHTING.response(f_hz)) - thousandths) < last_digit


@pytest.mark.parametrize(("teeth", "expected_mps2"), SAW_TEETH.items())
def test_formula_gives_the_saw_tooth_values_of_iso_8041(teeth: int | None, expected_mps2: float) -> None:
    rate_hz, length_s, period_s = 20_000, 60, 2 * np.pi / 100
    t_s = np.arange(rate_hz * length_s) / rate_hz
    phase = (t_s % 10.0 if teeth else t_s) / period_s
    wave = np.where(phase < (teeth or inf), 2 * ((phase + 0.5) % 1.0) - 1.0, 0.0)
    spectrum = np.fft.rfft(wave, 2 * len(wave))
    f_hz = np.fft.rfftfreq(2 * len(wave), 1 / rate_hz)
    weighted = np.fft.irfft(spectrum * WEIGHTING.response(f_hz))[: len(wave)]
    assert np.sqrt(np.mean(weighted**2)) == pytest.approx(expected_mps2, rel=0.004)


def test_absent_parts_leave_no_trace() -> None:
    f_hz = np.array([0.5, 3.0, 30.0])
    band = (f_hz**2 / np.sqrt(f_hz**4 + 0.4**4)) * 100**2 / np.sqrt(f_hz**4 + 100**4)  # Eq 2.13, 2.14
    np.testing.assert_allclose(np.abs(weighting("band", inf, inf, NO_STEP).response(f_hz)), band, rtol=1e-12)
    q2 = 0.63**2
    transition = np.sqrt((f_hz**2 + 4) / 4 * 16 * q2 / (f_hz**4 * q2 + f_hz**2 * 4 * (1 - 2 * q2) + 16 * q2))
    np.testing.assert_allclose(np.abs(WD.response(f_hz)), band * transition, rtol=1e-12)  # Eq 2.15


def test_stored_sections_are_within_0_02_db_of_the_formula() -> None:
    error = design_error(WEIGHTING, WEIGHTING.sections[100], 100, BAND_HZ)
    road = design_error(WEIGHTING, WEIGHTING.sections[100], 100, np.geomspace(0.1, 20.0, 1000))
    print(f"Wk at 100 Hz: {error.magnitude_db:.4f} dB to 40 Hz; phase {road.phase_deg:.2f} deg to 20 Hz")
    assert error.magnitude_db < 0.02
    assert road.phase_deg < 0.2


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
        (WJ, 128.0),
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
