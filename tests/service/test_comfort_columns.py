"""Comfort columns: the ride without its noise, the raw values beside it, and words that never guess."""

from __future__ import annotations

from dataclasses import replace
from math import nan

import numpy as np
import pytest

from logger.comfort.iso2631 import comfort_word
from logger.comfort.uncertain_ride import NO_FIGURES, NoiseFloor, RideFigures, Uncertain
from logger.dsp.weightings.wk import WEIGHTING
from logger.dsp.windows import Window
from logger.estimation.sensor_noise import NoiseBelief, Sensor
from logger.estimation.streaming import WindowEstimate
from logger.records import WindowRecord
from logger.service.config import Config, GpsConfig
from logger.service.signal_chain import ComfortColumns, word_of

from ..support.drives.replay import rows_of
from ..support.drives.simulated_drive import DemoDrive

GAIN = np.abs(WEIGHTING.response(np.linspace(0.0, 50.0, 1025)))
STEP_MPS2 = 0.613
WINDOW = Window(0, 0.6, 0.0, 7.62, 1, 0, 12.7, 60, 0, 0.9, 0.6, 0.7, 0.65, 1.5, frozenset())
RIDE = RideFigures(Uncertain(0.55, 0.05), Uncertain(0.65, 0.06), Uncertain(0.6, 0.06))


def columns(step_mps2: float = STEP_MPS2, noise_mps2: float = 0.1) -> ComfortColumns:
    return ComfortColumns(NoiseFloor(GAIN, 100, step_mps2), Sensor(noise_mps2, step_mps2))


def estimate(ride: RideFigures) -> WindowEstimate:
    return WindowEstimate(0, 3.0, 0.3, 0.9, frozenset(), ride)


@pytest.mark.parametrize(("value", "std", "hidden_mps2", "word", "hidden"), [
    (0.6, 0.1, 0.3, "fairly_uncomfortable", False),
    (0.1, 0.04, 0.3, "not_uncomfortable", False),
    (0.1, 0.06, 0.3, "not_uncomfortable", True),
    (0.1, 0.12, 0.3, "", True),  # up to 0.34 m/s2 is possible
    (0.0, 0.0, 0.0, "not_uncomfortable", False),
    (nan, nan, 0.3, "not_uncomfortable", True),
    (nan, nan, 0.4, "", True),
    (0.01, 0.02, 0.4, "", True),
])
def test_words_say_no_more_than_the_bound(
    value: float, std: float, hidden_mps2: float, word: str, hidden: bool
) -> None:
    assert word_of(Uncertain(value, std), hidden_mps2) == (word, hidden)


def test_the_estimated_ride_is_taken_where_there_is_one() -> None:
    found = columns().of(WINDOW, estimate(RIDE), None)
    assert (found.ride, found.word, found.is_hidden) == (RIDE, "fairly_uncomfortable", False)


def test_without_one_the_power_of_the_noise_is_taken_off() -> None:
    for nothing in (None, estimate(NO_FIGURES)):
        found = columns().of(WINDOW, nothing, None)
        assert 0.5 < found.ride.a_w.value < WINDOW.a_w_mps2
        assert found.ride.a_w.std > 0.0


def test_a_learned_noise_counts_with_its_error() -> None:
    given = columns().of(WINDOW, None, None).ride.a_w
    same = columns(noise_mps2=0.4).of(WINDOW, None, NoiseBelief(np.log(0.1), 0.3)).ride.a_w
    assert same.value == pytest.approx(given.value)
    assert same.std > given.std


def test_what_toggles_between_two_steps_is_bounded_not_guessed() -> None:
    still = replace(WINDOW, accel_rms_mps2=0.3, a_w_mps2=0.2, mtvv_mps2=0.2, vdv_mps175=0.2)
    found = columns().of(still, None, None)
    assert np.isnan(found.ride.a_w.value)
    assert (found.word, found.is_hidden) == ("not_uncomfortable", True)
    coarser = columns(2 * STEP_MPS2).of(still, None, None)
    assert (coarser.word, coarser.is_hidden) == ("", True)


def test_a_window_without_readings_has_nothing_and_hides_nothing() -> None:
    found = columns().of(WINDOW.without_figures(), estimate(RIDE), None)
    assert found.word == ""
    assert not found.is_hidden
    assert np.isnan(found.ride.a_w.value)


@pytest.fixture(scope="module")
def records(short_drive: DemoDrive) -> list[WindowRecord]:
    return rows_of(short_drive.header, short_drive.events, Config(gps=GpsConfig(latency_s=0.15))).records


@pytest.mark.slow
def test_rows_hold_the_ride_its_error_and_the_raw_value(records: list[WindowRecord]) -> None:
    whole = [row for row in records if not row.flags]
    assert len(whole) > 30
    for row in whole:
        assert row.a_w_mps2 is not None
        assert row.a_w_std_mps2 is not None
        assert row.a_w_raw_mps2 is not None
        assert row.a_w_mps2 < row.a_w_raw_mps2 + 2 * row.a_w_std_mps2
        assert row.comfort == comfort_word(row.a_w_mps2)
    assert np.mean([row.a_w_mps2 for row in whole]) < np.mean([row.a_w_raw_mps2 for row in whole])


def test_rows_tell_what_errors_of_the_iri_share(records: list[WindowRecord]) -> None:
    """The receiver's delay and a place of some metre cost something everywhere; a noise that is given costs nothing."""
    seen = 0
    for row in records:
        parts = (row.iri_level_std_m_per_km, row.iri_common_std_m_per_km, row.iri_place_std_m_per_km)
        if row.iri_m_per_km is None:
            assert (row.iri_std_m_per_km, *parts) == (None,) * 4
            continue
        assert row.iri_std_m_per_km is not None
        level, common, place = (part for part in parts if part is not None)
        assert np.hypot(np.hypot(level, common), place) < row.iri_std_m_per_km
        assert level > 0 and place > 0
        seen += "gps_lost" not in row.flags
    assert seen > 30


def test_rows_without_readings_hold_no_ride(records: list[WindowRecord]) -> None:
    for row in records:
        if row.a_w_raw_mps2 is None:
            assert row.a_w_mps2 is row.vdv_mps175 is row.mtvv_mps2 is row.a_w_std_mps2 is None
            assert row.comfort == ""
            assert "hidden" not in row.flags


def test_of_a_fine_sensor_no_more_than_the_usual_noise_is_taken_off() -> None:
    """What a drive tells of it holds the misfit of the car's model, which is ride."""
    fine = columns(step_mps2=0.0, noise_mps2=0.05)
    usual = fine.of(WINDOW, None, NoiseBelief.guessed(0.05)).ride.a_w.value
    assert fine.of(WINDOW, None, NoiseBelief.guessed(0.4)).ride.a_w.value == pytest.approx(usual)
    assert fine.of(WINDOW, None, NoiseBelief.guessed(0.01)).ride.a_w.value > usual
