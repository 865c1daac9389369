"""Every weighting of the folder against the standard's printed factors, its formula and its saw-tooth bursts."""

from __future__ import annotations

from importlib import import_module
from math import inf

import numpy as np
import pytest
from scipy import signal

from logger.comfort.iso2631 import HEALTH_FACTORS
from logger.dsp.design import design_error, design_sections
from logger.dsp.weightings.weighting import Weighting
from logger.plugins import catalogue

WEIGHTINGS = catalogue("logger.dsp.weightings", "WEIGHTING")

# ISO 2631-1 Table 3: Wk and Wd, then Wf, times 1000 at nominal one-third-octave frequencies [Hz]. Two of 98 are printed
# a little more than half a digit low (Wk at 1.25 and 16 Hz).
WK_WD = """
0.1 31.2 62.4; 0.125 48.6 97.3; 0.16 79.0 158; 0.2 121 243; 0.25 182 365; 0.315 263 530; 0.4 352 713; 0.5 418 853
0.63 459 944; 0.8 477 992; 1 482 1011; 1.25 484 1008; 1.6 494 968; 2 531 890; 2.5 631 776; 3.15 804 642; 4 967 512
5 1039 409; 6.3 1054 323; 8 1036 253; 10 988 212; 12.5 902 161; 16 768 125; 20 636 100; 25 513 80.0; 31.5 405 63.2
40 314 49.4; 50 246 38.8; 63 186 29.5; 80 132 21.1; 100 88.7 14.1; 125 54.0 8.63; 160 28.5 4.55; 200 15.2 2.43
250 7.90 1.26; 315 3.98 0.64; 400 1.95 0.31"""
WF = """
0.02 24.2; 0.025 37.7; 0.0315 59.7; 0.04 97.1; 0.05 157; 0.063 267; 0.08 461; 0.1 695; 0.125 895; 0.16 1006; 0.2 992
0.25 854; 0.315 619; 0.4 384; 0.5 224; 0.63 116; 0.8 53.0; 1 23.5; 1.25 9.98; 1.6 3.77; 2 1.55; 2.5 0.64; 3.15 0.25
4 0.097"""
MISPRINTED = {("wd", "10"): "202"}


def printed() -> list[tuple[str, str, str]]:
    rows = [row.split() for table in (WK_WD, WF) for row in table.replace("\n", ";").split(";") if row]
    cells = [(name, row[0], text) for row in rows
             for name, text in zip(("wk", "wd") if len(row) == 3 else ("wf",), row[1:], strict=True)]
    return [(name, f_hz, MISPRINTED.get((name, f_hz), text)) for name, f_hz, text in cells]


@pytest.mark.parametrize(("name", "f_hz", "text"), printed())
def test_formula_gives_the_printed_factor(name: str, f_hz: str, text: str) -> None:
    last_digit = 10.0 ** -len(text.partition(".")[2])
    assert abs(1000 * abs(WEIGHTINGS[name].response(float(f_hz))) - float(text)) < 0.75 * last_digit


@pytest.mark.parametrize("name", WEIGHTINGS)
def test_formula_gives_the_factors_that_its_file_has_from_the_standard(name: str) -> None:
    """Three of a table (ISO 2631-1 Tables 3 and 4), or the one of ISO 8041-1 Table 1, to three digits."""
    printed = WEIGHTINGS[name].printed
    assert len(printed) >= 3 or 15.915 in printed
    for f_hz, factor in printed.items():
        last_digit = 10.0 ** (np.floor(np.log10(factor)) - 2)
        assert abs(abs(WEIGHTINGS[name].response(f_hz)) - factor) < 0.75 * last_digit, f_hz


def test_a_part_without_its_quality_factor_is_refused() -> None:
    for missing in ({"f4_hz": 2.0}, {"f5_hz": 2.0, "f6_hz": 3.0, "q6": 0.9}, {"f5_hz": 2.0, "q5": 0.9, "f6_hz": 3.0}):
        with pytest.raises(ValueError, match=r"wx: expected q[456], as there is f[456]_hz"):
            Weighting("wx", 0.4, 100.0, **missing)


def closed_form(weighting: Weighting, f: np.ndarray) -> np.ndarray:
    """Magnitude by the right sides of Eq 2.13-2.16, f6 and Q6 in the denominator of the last."""

    def quadratic(pole_hz: float, q: float) -> np.ndarray:
        return np.sqrt(f**4 * q**2 + f**2 * pole_hz**2 * (1 - 2 * q**2) + pole_hz**4 * q**2)

    w = weighting
    magnitude = w.gain * np.sqrt(f**4 / (f**4 + w.f1_hz**4)) * np.sqrt(w.f2_hz**4 / (f**4 + w.f2_hz**4))
    if w.f3_hz < inf:
        magnitude = magnitude * np.sqrt(f**2 + w.f3_hz**2) / w.f3_hz
    if w.f4_hz < inf:
        magnitude = magnitude * w.f4_hz**2 * w.q4 / quadratic(w.f4_hz, w.q4)
    if w.f6_hz < inf:
        # the factor (w5 / w6)^2 of the transfer function stands in the squares of the numerator
        magnitude = magnitude * w.q6 / w.q5 * quadratic(w.f5_hz, w.q5) / quadratic(w.f6_hz, w.q6)
    return magnitude


@pytest.mark.parametrize("name", WEIGHTINGS)
def test_magnitude_is_the_closed_form_of_the_standard(name: str) -> None:
    f_hz = np.geomspace(0.01, 500.0, 200)
    weighting = WEIGHTINGS[name]
    np.testing.assert_allclose(np.abs(weighting.response(f_hz)), closed_form(weighting, f_hz), rtol=1e-9)


@pytest.mark.parametrize("name", WEIGHTINGS)
def test_every_weighting_names_its_source_and_is_stable(name: str) -> None:
    said = str(import_module(f"logger.dsp.weightings.{name}").__doc__).partition("Source: ")[2]
    assert any(letter.isdigit() for letter in said)  # of a standard, with its number
    assert all((np.roots(denominator).real < 0).all() for _, denominator in WEIGHTINGS[name].factors())
    assert abs(WEIGHTINGS[name].response(0.0)) == 0.0


# Saw-tooth bursts of ISO 8041, 60 s: weighted r.m.s. [m/s2] for 1, 2, 4, 8, 16 teeth every 10 s, and without end.
BURSTS = {
    "band": (0.0433, 0.0612, 0.0865, 0.122, 0.173, 0.546),
    "wk": (0.0299, 0.0411, 0.0577, 0.0814, 0.115, 0.362),
    "wd": (0.00669, 0.00906, 0.0116, 0.0148, 0.0197, 0.0590),
}
BAND = Weighting("band", 0.4, 100.0)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "tolerance"), [("band", 0.004), ("wk", 0.004), ("wd", 0.015)])
def test_whole_records_give_the_saw_tooth_values_of_iso_8041(name: str, tolerance: float) -> None:
    rate_hz, length_s, period_s = 20_000, 60, 2 * np.pi / 100
    weighting = WEIGHTINGS.get(name, BAND)
    t_s = np.arange(rate_hz * length_s) / rate_hz
    for teeth, expected_mps2 in zip((1, 2, 4, 8, 16, inf), BURSTS[name], strict=True):
        phase = (t_s if teeth == inf else t_s % 10.0) / period_s
        wave = np.where(phase < teeth, 2 * ((phase + 0.5) % 1.0) - 1.0, 0.0)
        ours_mps2 = np.sqrt(np.mean(weighting.weigh(wave, rate_hz) ** 2))
        assert ours_mps2 == pytest.approx(expected_mps2, rel=tolerance), teeth


@pytest.mark.slow
@pytest.mark.parametrize("name", WEIGHTINGS)
def test_a_whole_record_is_weighted_as_an_analog_filter_would(name: str) -> None:
    rate_hz = 1500.0
    t_s = np.arange(int(50 * rate_hz)) / rate_hz
    waves = sum(np.sin(2 * np.pi * f_hz * t_s + f_hz) for f_hz in (0.17, 0.9, 6.0, 21.0))
    blow = waves * np.exp(-((t_s - 20) / 4) ** 2)
    blow -= blow.mean()
    numerator, denominator = [1.0], [1.0]
    for part in WEIGHTINGS[name].factors():
        numerator, denominator = np.polymul(numerator, part[0]), np.polymul(denominator, part[1])
    _, analog, _ = signal.lsim(signal.tf2ss(numerator, denominator), blow, t_s)
    assert np.abs(WEIGHTINGS[name].weigh(blow, rate_hz) - analog).max() < 1e-3 * np.abs(analog).max()


def test_gravity_and_the_end_of_a_record_leave_its_beginning_alone() -> None:
    wave = np.random.default_rng(2).standard_normal(3000)
    wave -= wave.mean()
    weighting = WEIGHTINGS["wk"]
    weighted = weighting.weigh(wave, 100.0)
    np.testing.assert_allclose(weighting.weigh(wave + 9.81, 100.0), weighted, atol=1e-12)
    late = wave.copy()
    late[-100:] += 50.0 * np.hanning(100) * np.sin(np.arange(100.0))
    assert np.abs(weighting.weigh(late, 100.0) - weighted)[-100:].max() > 10.0
    assert np.abs(weighting.weigh(late, 100.0) - weighted)[:2000].max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "rate_hz"),
    [
        ("wd", 80.0),
        ("wb", 84.0),
        ("wb", 500.0),
        ("wb", 1000.0),
        ("wb", 1250.0),
        ("wc", 256.0),
        ("we", 2000.0),
        ("wj", 1000.0),
        ("wk", 128.0),
    ],
)
def test_sections_for_other_rates_are_within_0_02_db(name: str, rate_hz: float) -> None:
    weighting = WEIGHTINGS[name]
    band_hz = np.geomspace(0.1, 0.4 * rate_hz, 1000)
    error = design_error(weighting, design_sections(weighting, rate_hz), rate_hz, band_hz)
    print(f"{name} at {rate_hz:g} Hz: {error.magnitude_db:.4f} dB")
    assert error.magnitude_db < 0.02


def test_each_says_itself_what_its_values_stand_for() -> None:
    """ISO 2631-1 clauses 1, 7.2.3, 9 and C.2.3: which are of health, which of motion sickness, up to where they count,
    of which the words for comfort are said. One that somebody adds says it for itself."""
    of_standard = {name: WEIGHTINGS[name] for name in ("wb", "wc", "wd", "we", "wf", "wj", "wk")}
    assert {name: one.health_factor for name, one in of_standard.items() if one.health_factor is not None} == {
        "wk": HEALTH_FACTORS[2], "wd": HEALTH_FACTORS[0]}
    assert [name for name, one in of_standard.items() if one.is_sickness] == ["wf"]
    assert [name for name, one in of_standard.items() if not one.comfort_words] == ["we", "wf"]
    assert {name: one.counts_up_to_hz for name, one in of_standard.items() if one.counts_up_to_hz != 80.0} == {
        "wf": 0.5}
    assert {name: one.horizontal for name, one in of_standard.items() if one.horizontal} == {"wk": "wd"}
    assert all(one.horizontal in WEIGHTINGS for one in WEIGHTINGS.values() if one.horizontal)
