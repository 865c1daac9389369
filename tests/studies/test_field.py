"""The printed values of the field shelf are those of their sources, and ours by another way."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binomtest

from logger.studies.field import (
    five_modes,
    golden_car_gain,
    iri_check_profile,
    iso_8041_bursts,
    lab_examination,
)
from logger.studies.study import DISSERTATION, Effort, Word, studies

from ..benchmarks.weightings import BURSTS
from ..roads.test_iri import RUNNING_IRI, golden_response


def test_the_shelf_is_whole() -> None:
    covered = [item for study in studies("field").values() for item in study.covers]
    assert {"IRI check profile", "ISO 8041 bursts", "Golden Car gain curve", "hidden mass from a bump",
            "five modes at 20 dB", "the lab's examination"} <= set(covered)
    assert all(study.source != DISSERTATION for study in studies("field").values())


def test_the_check_profile_s_printed_values() -> None:
    for at_m, printed in iri_check_profile.PRINTED:
        assert printed == RUNNING_IRI[round(at_m / 0.25) - 1]
    values = iri_check_profile.run(Effort()).values
    assert max(abs(one.ours - one.printed) for one in values[:-1]) < 7e-6
    assert values[-1].word is Word.MISPRINT
    assert values[-1].ours == pytest.approx(5.476206e-3, abs=1e-9)


def test_the_bursts_are_those_of_the_benchmark_and_agree() -> None:
    assert iso_8041_bursts.PRINTED_MPS2 == BURSTS
    wave = iso_8041_bursts.saw_teeth(4)
    assert np.ptp(wave) == pytest.approx(2, abs=1e-2)
    first = np.flatnonzero(wave)
    assert wave[first[0]] > 0
    ten_s = wave[: len(wave) // 6]
    assert np.mean(ten_s**2) == pytest.approx(4 * (2 * np.pi / 100) / 3 / 10, rel=0.01)  # four teeth's mean square, 1/3
    assert max(abs(one.ours / one.printed - 1) for one in iso_8041_bursts.run(Effort()).values) < 0.015


def test_the_gain_is_that_of_the_transfer_function() -> None:
    for one in golden_car_gain.run(Effort()).values[2:]:
        assert abs(golden_response(np.array([one.ours]))[0]) == pytest.approx(0.5, abs=2e-3)


def test_modes_are_better_than_all_packages_that_miss_none() -> None:
    whole = [one for one in five_modes.PEERS if one[1] == 0]
    assert min(one[2] for one in whole if one[2] is not None) == five_modes.FREQUENCY
    assert min(one[3] for one in whole if one[3] is not None) == five_modes.DAMPING
    assert all(one.holds for one in five_modes.run(Effort(0.01)).values)


def test_intervals_of_the_examination_are_wilson_s() -> None:
    for _, hits, cases, *_ in lab_examination.PRINTED:
        theirs = binomtest(hits, cases).proportion_ci(0.95, "wilson")
        assert lab_examination.interval_percent(hits, cases) == pytest.approx((100 * theirs.low, 100 * theirs.high))
