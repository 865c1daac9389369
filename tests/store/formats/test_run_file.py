"""``run.yaml``: what is written comes back, and what cannot be is refused with its line."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.errors import BadInput
from logger.runs import UNKNOWN, RecordFacts, Signal
from logger.store.formats.drive_file import RUN, read_run_facts, write_run_facts

SIZES = st.none() | st.floats(1e-3, 1e3).map(lambda one: float(f"{one:.6g}"))


@given(step=SIZES, noise=SIZES, place=SIZES, delay=SIZES, band=st.none() | st.just((0.5, 25.0)),
       vehicle=st.none() | st.just("rav4-2009"), source=st.none() | st.just("a: drive.dump"))
def test_what_is_written_comes_back(tmp_path_factory: pytest.TempPathFactory, step: float | None, noise: float | None,
                                    place: float | None, delay: float | None, band: tuple[float, float] | None,
                                    vehicle: str | None, source: str | None) -> None:
    folder = tmp_path_factory.mktemp("run")
    facts = RecordFacts(step_mps2=step, noise_mps2=noise, place_std_m=place, delay_s=delay, pass_band_hz=band,
                        places_by="road" if vehicle else None, vehicle=vehicle, source=source)
    write_run_facts(folder, facts)
    assert read_run_facts(folder) == facts


def test_signals_come_back(tmp_path: Path) -> None:
    facts = RecordFacts(signals=(Signal("seat_mps2", "acceleration", ahead_m=-1.2, left_m=0.3),
                                 Signal("wheel_mps2", "acceleration", "front_left_wheel"),
                                 Signal("travel_m", "travel", "rear_suspension"),
                                 Signal("pitch_rad_per_s", "pitch_rate")))
    write_run_facts(tmp_path, facts)
    assert read_run_facts(tmp_path) == facts


def test_a_folder_without_it_says_nothing(tmp_path: Path) -> None:
    assert read_run_facts(tmp_path) == UNKNOWN


@pytest.mark.parametrize(("text", "complaint"), [
    ("sensor: {step: 0.1}\n", ":1: expected one of the keys step_mps2"),
    ("source: a\nsensor: {step_mps2: 0}\n", ":2: expected a number from 1e-09"),
    ("pass_band_hz: [25, 0.5]\n", ":1: expected two frequencies"),
    ("place_std_m: -1\n", ":1: expected a number"),
    ("receiver: {delay_s: 0.2,\n  delay_std_s: -0.1}\n", ":2: expected a number"),
    ("receiver: {speed_scale: 0}\n", ":1: expected a number from 0.001 to 1000"),
    ("sensor: {noise_mps2: 1e-320}\n", ":1: expected a number from"),
    ("sensor: {range_mps2: 1e158}\n", ":1: expected a number from"),
    ("receiver: {delay_s: 1e9}\n", ":1: expected a number from"),
    ("receiver: {speed_scale_std: -3}\n", ":1: expected a number"),
    ("places: {by: guess}\n", ":1: expected one of road, receiver"),
    ("signals:\n  a_mps2: {measures: sound}\n", ":2: expected one of acceleration, velocity, displacement, travel"),
    ("signals:\n  a_mps2: {of: body}\n", ":2: expected the key 'measures' here, it is missing"),
    ("signals:\n  a_mm: {measures: travel, of: front_suspension}\n", ":2: expected .* whose name ends in _m, its unit"),
    ("signals:\n  a_m: {measures: travel, of: front_wheel}\n", ":2: expected one of suspension, front_suspension"),
    ("sensor: {kind: watch}\n", ":1: expected one of accelerometer, encoder"),
    ("signals:\n  w_mps2: {measures: acceleration, of: front_wheel, ahead_m: 1}\n", ":2: expected no place"),
])
def test_what_cannot_be_is_refused_with_its_line(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / RUN).write_text(text)
    with pytest.raises(BadInput, match=complaint):
        read_run_facts(tmp_path)
