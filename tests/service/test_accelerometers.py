"""Promises that every file in ``drivers/accelerometers`` keeps: a newcomer is tried by them at once."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from drivers.accelerometers import DEFAULT, accelerometers, line_reader, serial_accelerometers
from drivers.dump import DumpHeader
from drivers.errors import BadReply
from drivers.readings import GPS, Decimal, Flag, Kind, OneOf, OrNone, Special, Text, Whole
from logger.commands.status import advice
from logger.dsp.weightings.wk import WEIGHTING
from logger.errors import BadInput
from logger.service import wiring
from logger.service.config import AccelerometerConfig, load_config
from logger.service.serve import ReadingProgress
from logger.service.status import SensorStatus, ServiceStatus
from logger.store.formats.vehicle_file import read_model

from ..support.accelerometer_fakes import fakes
from ..support.accelerometer_fakes.fake import Vector
from ..support.accelerometer_promises import (
    data_sheet_examples_decode,
    lost_settings_are_noticed,
    recording_alone_gives_the_same_rows,
    samples_are_what_it_felt,
)
from ..support.accelerometer_ride import ROUGH_MPS2, ROUGH_TONES_HZ, Ride, core_of, rough

NAMES = list(accelerometers())
ROUGH_A_W_MPS2 = ROUGH_MPS2 * np.sqrt(0.5 * sum(abs(WEIGHTING.response(np.array(ROUGH_TONES_HZ))) ** 2))
SOONER = [name if name == "bma220" else pytest.param(name, marks=pytest.mark.slow) for name in NAMES]
VARIANTS = [pytest.param(name, settings, id=f"{name}{number or ''}")
            for name, fake in fakes().items() for number, settings in enumerate(fake.variants)]


@pytest.fixture
def ride(tmp_path: Path) -> Callable[[str], Ride]:
    return lambda name: Ride(name, tmp_path)


def examples(kind: Kind) -> tuple[list[str], list[str]]:
    """Pieces of YAML that a setting takes, and such that it refuses."""
    match kind:
        case Whole(low, high):
            return [str(low), str(high)], [str(low - 1), str(high + 1), f"{low}.5", "much"]
        case Decimal(low, high):
            return [repr(low), repr(high)], [repr(low - 1), repr(high + 1), "much"]
        case OneOf(numbers):
            return [str(number) for number in numbers], [str(max(numbers) + 1), "much"]
        case Flag():
            return ["true", "false"], ["yes", "1"]
        case Text():
            return ["/dev/anything"], ["[a, list]"]
        case Special(_, good):
            return list(good), ["{no: such}"]
        case OrNone(word, inner):
            good, bad = examples(inner)
            return [*good, word], bad


def loaded(path: Path, name: str, key: str, text: str) -> Any:
    """The section with one key, or, where that does not go alone, with another one that it goes with."""
    others = [f"{other}: {example}" for other, kind in accelerometers()[name].keys.items() if other != key
              for example in examples(kind)[0]]
    for other in ["", *others]:
        path.write_text(f"accelerometer:\n  {name}:\n    {key}: {text}\n    {other}\n")
        with suppress(BadInput):
            return load_config(path).accelerometer.sections[name]
    raise AssertionError(f"{name}: {key}: {text} goes with nothing")


KEYS = [(name, key) for name, kind in accelerometers().items() for key in kind.keys]


def test_each_has_a_fake_to_be_tried_with() -> None:
    assert list(fakes()) == NAMES
    assert {"bma220", "pasco"} <= set(NAMES)
    assert DEFAULT in NAMES
    assert line_reader().name in serial_accelerometers()


@pytest.mark.parametrize(("name", "key"), KEYS)
def test_a_setting_comes_back_as_it_was_written_and_a_wrong_one_with_its_line(
    name: str, key: str, tmp_path: Path
) -> None:
    kind = accelerometers()[name]
    good, bad = examples(kind.keys[key])
    path = tmp_path / "ridelog.yaml"
    read = []
    for text in good:
        read.append(getattr(loaded(path, name, key, text), key))
        written = yaml.safe_load(text)
        assert read[-1] == written or not isinstance(written, int | float) or read[-1] is None
    assert len({repr(value) for value in read}) == len(good)
    for text in bad:
        path.write_text(f"accelerometer:\n  {name}:\n    {key}: {text}\n")
        with pytest.raises(BadInput, match=r"ridelog\.yaml:[34]: expected "):
            load_config(path)


@pytest.mark.parametrize("name", NAMES)
def test_its_settings_are_its_keys_and_what_it_says_can_be_kept(name: str, ride: Callable[[str], Ride]) -> None:
    kind, settings = accelerometers()[name], ride(name).fake.settings
    assert [field.name for field in fields(kind.settings)] == list(kind.keys)
    assert kind.settings() == AccelerometerConfig().sections[name]
    assert isinstance(kind.place(settings), str)
    assert isinstance(kind.facts(settings)["verified"], bool)
    assert json.loads(json.dumps(kind.facts(settings))) == kind.facts(settings)
    readings = kind.readings(settings)
    assert readings.noise_mps2 > 0
    assert readings.step_mps2 >= 0
    decoder = kind.decoder(settings, 2)
    assert decoder.name == kind.name
    assert decoder.doubt == ""
    assert all(count == 0 for count in decoder.counts.values())
    for state in ("absent", "retrying", "silent"):
        assert len(kind.advice(state).split()) >= 5


SAID_NOTHING: dict[str, dict[str, Any]] = {"bma220": {"oversample": 1}}
"""What is true of recordings that say nothing of a setting, where that is not what is usual today."""


@pytest.mark.parametrize("name", NAMES)
def test_the_header_of_a_recording_brings_its_settings_back(name: str, tmp_path: Path) -> None:
    """For each setting that the header carries; one that cannot be is refused with its place."""
    kind = accelerometers()[name]
    usual = kind.settings()
    said = kind.header(usual)
    for key in set(kind.keys) & set(said):
        for text in examples(kind.keys[key])[0]:
            other = loaded(tmp_path / "ridelog.yaml", name, key, text)
            header = DumpHeader(None, {"driver": name, "vertical_axis": "-y", **kind.header(other)}, {}, "rav4-2009")
            config = wiring.config_for_dump(header, None, None)
            assert config.accelerometer.driver == name
            assert config.accelerometer.vertical_axis == "-y"
            assert kind.header(config.accelerometer.settings) == kind.header(other)
        wrong = DumpHeader(None, {"driver": name, **said, key: ["no such"]}, {}, "rav4-2009")
        with pytest.raises(BadInput, match=r"^drive\.dump:1: "):
            wiring.config_for_dump(wrong, None, None, "drive.dump:1")
    header = DumpHeader(None, {"driver": name}, {}, "rav4-2009")
    before = SAID_NOTHING.get(name, {})
    assert wiring.config_for_dump(header, None, None).accelerometer.settings == replace(usual, **before)


@pytest.mark.parametrize("name", NAMES)
def test_bytes_of_the_data_sheet_are_what_it_says(name: str) -> None:
    data_sheet_examples_decode(name)


@pytest.mark.parametrize(("name", "settings"), VARIANTS)
def test_samples_are_what_the_device_felt(name: str, settings: Any, tmp_path: Path) -> None:
    samples_are_what_it_felt(name, settings, tmp_path)


@pytest.mark.parametrize(("name", "settings"), VARIANTS)
def test_settings_that_a_device_has_lost_are_set_again(name: str, settings: Any, tmp_path: Path) -> None:
    lost_settings_are_noticed(name, settings, tmp_path)


@pytest.mark.parametrize(("name", "settings"), [
    one if str(one.id) == "bma220" else pytest.param(*one.values, id=one.id, marks=pytest.mark.slow)
    for one in VARIANTS])
def test_a_recording_alone_gives_the_same_rows_again(name: str, settings: Any, tmp_path: Path) -> None:
    live = recording_alone_gives_the_same_rows(name, settings, tmp_path)
    known = [record for record in live.records if record.iri_m_per_km is not None]
    assert known or settings.__dict__.get("range_g", 2) > 2  # steps of a larger range hide this road
    rides = [(record.a_w_mps2, record.a_w_std_mps2 or 0.0) for record in live.records[8:-8]
             if record.a_w_mps2 is not None]
    assert len(rides) > 6
    for figure, std in rides:  # the tones beat: from one short window to the next the ride is 0.1 m/s2 more or less
        assert abs(figure - ROUGH_A_W_MPS2) < 3 * np.hypot(std, 0.1)
        assert 1.0 < figure < 2.5 or std > 0.1
        assert std < 0.1 or settings.__dict__.get("range_g", 2) >= 8


@pytest.mark.parametrize("name", SOONER)
def test_unplugged_it_is_a_gap_and_plugged_in_it_goes_on(name: str, ride: Callable[[str], Ride]) -> None:
    driven = ride(name).drive(20)
    assert driven.supervisor.state() == "ok"
    driven.fake.unplug()
    gone_us = driven.clock.now_us
    driven.drive(15)
    assert driven.supervisor.state() == "retrying"
    assert driven.supervisor.error
    assert "\n" not in driven.supervisor.error
    assert not [event for event in driven.events if event.source == name and event.t_us > gone_us + 500_000]
    driven.fake.plug()
    back_us = driven.clock.now_us
    driven.drive(40)
    assert driven.supervisor.state() == "ok"
    assert driven.supervisor.error == ""
    for record in driven.rows().records:
        end_us = record.t_us + round(record.duration_s * 1e6)
        if gone_us < record.t_us and end_us < back_us:
            assert "gap" in record.flags
            assert record.a_w_mps2 is None
        elif end_us < gone_us - 2_000_000 or (back_us + 20_000_000 < record.t_us):
            assert "gap" not in record.flags, record


@pytest.mark.parametrize("name", NAMES)
def test_another_device_in_its_place_is_refused_in_one_line(name: str, ride: Callable[[str], Ride]) -> None:
    driven = ride(name)
    driven.fake.replace_by_another()
    driven.drive(15)
    core, rows = core_of(driven.config)
    for event in driven.parked():
        core.feed(event)
    core.finish()
    progress = ReadingProgress()
    speaks = driven.supervisor.error == ""
    unread_s = [progress.unread_s(s * 1_000_000, speaks, core.samples) for s in range(15)][-1]
    said = [driven.supervisor.error, core.accelerometer.unread if unread_s > 10 else ""]
    reported = next(words for words in reversed(said) if words)
    assert re.search(driven.fake.wrong, reported)
    assert "\n" not in reported
    assert all(record.a_w_mps2 is None for record in rows.records)


@pytest.mark.slow
@pytest.mark.parametrize("name", SOONER)
def test_at_the_end_of_its_range_rows_are_flagged(name: str, ride: Callable[[str], Ride]) -> None:
    driven = ride(name)
    begin_us, beyond_mps2 = driven.clock.now_us, 1.2 * driven.fake.sheet.saturates_mps2

    def jolts(t_us: int) -> Vector:
        hit = 20_000_000 <= t_us - begin_us < 25_000_000 and (t_us // 100_000) % 5 == 0
        return np.array([0.0, 0.0, beyond_mps2]) if hit else rough(t_us)

    driven.fake.accel = jolts
    flagged = {"clipped" in record.flags: record for record in driven.drive(40).rows().records if record.clipped_samples
               or record.t_us < begin_us + 18_000_000}
    assert set(flagged) == {True, False}
    assert begin_us + 19_000_000 < flagged[True].t_us < begin_us + 26_000_000


@pytest.mark.slow
@pytest.mark.parametrize("name", SOONER)
def test_frozen_it_is_reported_and_its_rows_are_flagged(name: str, ride: Callable[[str], Ride]) -> None:
    driven = ride(name).drive(15)
    still = rough(driven.clock.now_us)
    driven.fake.accel = lambda t_us: still
    frozen_us = driven.clock.now_us
    rows = driven.drive(60).rows().records
    late = [record for record in rows if frozen_us + 32_000_000 < record.t_us]
    assert len(late) > 20
    assert all("frozen" in record.flags and record.a_w_mps2 is None for record in late)
    assert not any("frozen" in record.flags for record in rows if record.t_us < frozen_us - 3_000_000)


@pytest.mark.parametrize("name", NAMES)
def test_status_says_what_to_do_and_how_it_is_read(name: str) -> None:
    sensor = SensorStatus(name, "there", "absent", 20.0, "nothing answers")
    status = ServiceStatus("starting", 1, "1", 1.0, 1, accelerometer=sensor, gps=SensorStatus(GPS, "there", "ok"))
    (line,) = [line for line in advice(status) if line.startswith("accelerometer")]
    assert accelerometers()[name].advice("absent") in line
    noted = replace(sensor, state="ok", note="polled")
    assert "accelerometer: polled (at there)." in advice(replace(status, accelerometer=noted))


@pytest.mark.parametrize("name", NAMES)
def test_bytes_that_are_none_of_its_own_do_no_harm(name: str) -> None:
    rng = np.random.default_rng(5)
    decoder = accelerometers()[name].decoder(accelerometers()[name].settings(), 2)
    for number in range(300):
        data = rng.bytes(int(rng.integers(1, 60)))
        try:
            decoder.feed(number * 10_000, data)
        except BadReply as error:
            assert "\n" not in str(error)
    decoder.flush()
    block = decoder.take()
    assert np.isfinite(block.accel_mps2).all()
    assert len(block.t_us) == len(block.clipped) == len(block.accel_mps2)
    assert (np.diff(block.t_us) >= 0).all()


@pytest.mark.parametrize("name", NAMES)
def test_its_facts_and_settings_stand_beside_the_log(name: str, ride: Callable[[str], Ride]) -> None:
    driven = ride(name)
    sensor = wiring.instrument(driven.config.accelerometer)
    facts = wiring.sidecar(driven.config, sensor, read_model(driven.config.vehicle))
    assert facts["sensor"]["driver"] == name
    section = json.loads(json.dumps(facts["settings"]["accelerometer"]))
    assert section["driver"] == name
    expected: dict[str, Any] = asdict(driven.fake.settings)
    assert set(section[name]) == set(expected)
