"""The printed values of the field shelf are those of their sources, and ours by another way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from logger.studies.field import measurements, standards
from logger.studies.study import DISSERTATION, Word, Workload, studies

from ..benchmarks.weightings import BURSTS, THIRDS
from ..roads.test_iri import RUNNING_IRI, golden_response
from ..support.study_results import study_result


def test_the_shelf_is_whole() -> None:
    covered = [item for study in studies("field").values() for item in study.covers]
    assert {"IRI check profile", "ISO 8041 bursts", "Golden Car gain curve", "hidden mass from a bump",
            "five modes at 20 dB", "the lab's examination"} <= set(covered)
    ours = {item.name: item.word for study in studies("field").values() for item in study.items
            if "ridelog" in study.source}
    assert set(ours.values()) == {Word.NOT_REPRODUCIBLE}, "what is our own never agrees with a print"
    assert all(study.source != DISSERTATION for study in studies("field").values())


def test_the_check_profile_s_printed_values() -> None:
    for at_m, printed in standards.PRINTED_IRI_CHECK_PROFILE:
        assert printed == RUNNING_IRI[round(at_m / 0.25) - 1]
    values = standards.iri_check_profile.run(Workload()).values
    assert max(abs(one.ours - one.printed) for one in values[:-1]) < 7e-6
    assert values[-1].word is Word.MISPRINT
    assert values[-1].ours == pytest.approx(5.476206e-3, abs=1e-9)


@pytest.mark.slow
def test_the_bursts_are_those_of_the_benchmark_and_agree() -> None:
    assert standards.PRINTED_MPS2 == BURSTS
    wave = standards.saw_teeth(4)
    assert np.ptp(wave) == pytest.approx(2, abs=1e-2)
    first = np.flatnonzero(wave)
    assert wave[first[0]] > 0
    ten_s = wave[: len(wave) // 6]
    assert np.mean(ten_s**2) == pytest.approx(4 * (2 * np.pi / 100) / 3 / 10, rel=0.01)  # four teeth's mean square, 1/3
    assert max(abs(one.ours / one.printed - 1) for one in study_result("iso-8041-bursts").values) < 0.015


def test_the_gain_is_that_of_the_transfer_function() -> None:
    for one in standards.golden_car_gain.run(Workload()).values[2:]:
        assert abs(golden_response(np.array([one.ours]))[0]) == pytest.approx(0.5, abs=2e-3)


def test_factors_are_those_of_the_benchmark() -> None:
    for name, printed in standards.PRINTED_ISO_2631_FACTORS.items():
        known = {float(hz): float(one) for hz, one in zip(standards.HZ, printed, strict=True)}
        assert {hz: known[hz] for hz in THIRDS[name]} == THIRDS[name]


def test_the_building_has_the_printed_frequencies() -> None:
    """A uniform chain of five: 2 w sin((2 k - 1) pi / 22)."""
    mode = np.arange(1, 6)
    hz = np.sqrt(10_000 / 25.91) * 2 * np.sin((2 * mode - 1) * np.pi / 22) / (2 * np.pi)
    assert np.round(hz, 3) == pytest.approx(measurements.PRINTED_TRUE_HZ, abs=1e-9)


def test_counts_of_the_examination_are_those_of_its_page() -> None:
    counts = measurements.examined()
    page = (Path(__file__).parents[2] / "docs" / "examination.md").read_text("utf-8")
    assert page.startswith(f"# The lab examined\n\n{counts['cases']} random cases")
    assert f"seeds, {counts['first_seed']} to {counts['last_seed']}," in page
    asked = [one for one in counts["goals"] if one["of"]]
    assert asked
    for goal in asked:
        sign = "≥" if goal["at_least"] else "≤"
        assert f"| {goal['name']} | {sign} {goal['goal']:.0%} |" in page
        assert f"| {goal['count']} of {goal['of']} |" in page


def test_intervals_of_the_examination_are_wilson_s() -> None:
    for goal in measurements.examined()["goals"]:
        if not goal["of"]:
            continue
        theirs = binomtest(goal["count"], goal["of"]).proportion_ci(0.95, "wilson")
        assert measurements.interval_percent(goal["count"], goal["of"]) == pytest.approx(
            (100 * theirs.low, 100 * theirs.high))
