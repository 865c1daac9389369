"""The accelerometer's noise from drive to drive: settings, file, header, sidecar, words, and rows that replay."""

from __future__ import annotations

from dataclasses import replace
from math import log, sqrt
from pathlib import Path
from typing import Any

import pytest

from drivers.accelerometers.bma220 import Bma220Config
from drivers.dump import DumpHeader, Event, open_dump
from logger.errors import BadInput
from logger.estimation.receiver_delay import UNKNOWN
from logger.estimation.sensor_noise import NoiseBelief
from logger.service import wiring
from logger.service.config import AUTO, AccelerometerConfig, Config, load_config
from logger.service.learning import DELAY, NOISE, KnownNoise, NoiseLearning, noise_at_start, read_noise
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model

from ..support.drives.replay import parts_for, rows_of

LEARNS = AccelerometerConfig()
KNOWN = KnownNoise(NoiseBelief(log(0.15), 0.06), 3)
USUAL_MPS2 = 0.1 * sqrt(125 / 32)  # of one of four reads, whose filter is wider than that of one
DRIVEN_MPS2 = 0.1  # that of the demo's drives


class Drive:
    """A pipeline that has learned so much."""

    def __init__(self, belief: NoiseBelief | None, stretches: int) -> None:
        self.noise, self.noise_stretches = belief, stretches


LEARNED = Drive(NoiseBelief(log(0.2), 0.04), 12)
NOTHING = Drive(NoiseBelief(log(0.3), 1.0), 0)


def config_of(text: str, folder: Path) -> Config:
    path = folder / "ridelog.yaml"
    path.write_text(text)
    return load_config(path)


@pytest.fixture(scope="module")
def recorded(short_dump: Path) -> tuple[DumpHeader, list[Event]]:
    with open_dump(short_dump) as reader:
        return reader.header, list(reader)


@pytest.mark.parametrize(("text", "noise"), [("", AUTO), ("noise_mps2: null", AUTO), ("noise_mps2:", AUTO),
                                             ("noise_mps2: auto", AUTO), ("noise_mps2: 0.15", 0.15)])
def test_the_setting(tmp_path: Path, text: str, noise: float | str | None) -> None:
    config = config_of(f"accelerometer:\n  driver: bma220\n  {text}\n", tmp_path).accelerometer
    assert config.noise_mps2 == noise
    sensor = wiring.instrument(config)
    assert sensor.sensor.noise_rms_mps2 == (0.15 if noise == 0.15 else USUAL_MPS2)
    assert (sensor.noise is not None) == (noise == AUTO)


def test_what_was_learned_of_the_mean_of_several_readings_is_not_taken_for_that_of_one(tmp_path: Path) -> None:
    """Recordings and files of programs that took the mean of several readings to have no steps."""
    settings = "accelerometer:\n  driver: bma220\n  noise_mps2: auto\n  bma220: {oversample: 4}\n"
    config = config_of(settings, tmp_path)
    header = wiring.dump_header(config, None, KNOWN)
    assert header.accelerometer["noise"]["reads"] == 4
    assert wiring.noise_for_dump(header, config) == KNOWN
    old = replace(header, accelerometer=header.accelerometer | {"noise": NOISE.fields(KNOWN)})
    assert wiring.noise_for_dump(old, config) is None
    once = wiring.dump_header(config_of(settings.replace("4", "1"), tmp_path), None, KNOWN)
    assert "reads" not in once.accelerometer["noise"]


@pytest.mark.parametrize("value", ["Auto", "0", "-0.1", "1000", "0.1 m/s2", "[]", "nan"])
def test_a_setting_that_cannot_be_is_refused(tmp_path: Path, value: str) -> None:
    with pytest.raises(BadInput, match=r"ridelog\.yaml:2: expected (auto or )?a number"):
        config_of(f"accelerometer:\n  noise_mps2: {value}\n", tmp_path)


def test_what_is_learned_is_there_at_the_next_start(tmp_path: Path) -> None:
    assert noise_at_start(tmp_path, LEARNS) is None
    NoiseLearning(tmp_path, LEARNED, LEARNS, None).save()
    first = read_noise(tmp_path, LEARNS)
    assert first is not None
    assert (first.belief.noise_rms_mps2, first.drives) == (pytest.approx(0.2), 1)
    begun = noise_at_start(tmp_path, LEARNS)
    assert begun is not None and begun.belief.log_std > first.belief.log_std
    NoiseLearning(tmp_path, LEARNED, LEARNS, begun).save()
    again = read_noise(tmp_path, LEARNS)
    assert again is not None and again.drives == 2
    assert noise_at_start(tmp_path, AccelerometerConfig(noise_mps2=0.15)) is None  # it is not to be learned


def test_of_a_sensor_that_is_set_otherwise_nothing_is_known(tmp_path: Path) -> None:
    NoiseLearning(tmp_path, LEARNED, LEARNS, None).save()
    ranged = replace(LEARNS, sections={**LEARNS.sections, "bma220": Bma220Config(range_g=8)})
    assert read_noise(tmp_path, ranged) is None
    assert read_noise(tmp_path, replace(LEARNS, driver="pasco")) is None


@pytest.mark.parametrize("drive", [NOTHING, Drive(None, 0)])
def test_nothing_learned_writes_nothing(tmp_path: Path, drive: Drive) -> None:
    NoiseLearning(tmp_path, drive, LEARNS, KNOWN).save()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", [
    "", "{", "[]", "null", "\xff", '{"noise_mps2": 0.1}', '{"noise_mps2": "x", "noise_std_mps2": 0.1}',
    '{"noise_mps2": 0.1, "noise_std_mps2": 0, "noise_drives": 1}',
    '{"noise_mps2": 0.1, "noise_std_mps2": 1e-300, "noise_drives": 1}', '{"noise_mps2": NaN, "noise_std_mps2": 0.1}',
    f'{{"noise_mps2": 1{"0" * 400}, "noise_std_mps2": 0.1}}', '["noise_std_mps2"]',
    '{"noise_mps2": 0.1, "noise_std_mps2": 0.1, "noise_drives": 1.5}', '{"noise_mps2": 0, "noise_std_mps2": 0.1}'])
def test_a_damaged_file_is_as_none(tmp_path: Path, text: str) -> None:
    (tmp_path / NOISE.file_name).write_bytes(text.encode("latin-1"))
    assert read_noise(tmp_path, LEARNS) is None


def test_a_recording_and_a_sidecar_carry_what_their_drive_began_with() -> None:
    config = Config(accelerometer=LEARNS)
    header = wiring.dump_header(config, noise=KNOWN)
    assert wiring.config_for_dump(header, None, None).accelerometer.noise_mps2 == AUTO
    found = wiring.noise_for_dump(header, config)
    assert found is not None and found.drives == 3
    assert found.belief.noise_rms_mps2 == pytest.approx(0.15) and found.belief.log_std == pytest.approx(0.06)
    assert wiring.noise_for_dump(header, Config(accelerometer=AccelerometerConfig(noise_mps2=0.2))) is None
    car = read_model(vehicle_file("rav4-2009"))
    facts = wiring.sidecar(config, wiring.instrument(LEARNS, KNOWN), car, noise=KNOWN)
    assert NOISE.from_fields(facts["noise"]) == NOISE.from_fields(NOISE.fields(KNOWN))
    first = wiring.dump_header(config)
    assert wiring.config_for_dump(first, None, None).accelerometer.noise_mps2 == AUTO
    assert wiring.noise_for_dump(first, config) is None
    fixed = wiring.dump_header(Config(accelerometer=AccelerometerConfig(noise_mps2=0.2)))
    assert wiring.config_for_dump(fixed, None, None).accelerometer.noise_mps2 == 0.2


def test_a_recording_by_a_logger_that_did_not_learn_replays_with_what_it_took() -> None:
    """Such loggers said what they knew of the receiver, and of the noise only a number out of the settings. What says
    neither is by no logger: it is played as one would drive today."""
    said = NOISE.fields(KNOWN)
    by_logger = {"baud": 9600, "latency_s": 0.1, "latency_std_s": 0.1, "latency_drives": 0}
    for gps, noise, setting in ((by_logger, {}, None), ({"baud": 9600}, {}, AUTO), (by_logger, {"noise": said}, AUTO),
                                (by_logger, {"noise": {"noise_mps2": 0.2}}, 0.2)):
        header = DumpHeader(None, {"driver": "bma220", "oversample": 4, **noise}, gps, "rav4-2009")
        config = wiring.config_for_dump(header, None, None)
        assert config.accelerometer.noise_mps2 == setting
        sensor = wiring.instrument(config.accelerometer)
        assert (sensor.noise is not None) == (setting == AUTO)
        assert sensor.sensor.noise_rms_mps2 == pytest.approx(setting if isinstance(setting, float) else USUAL_MPS2)
    written = wiring.dump_header(Config())  # of today, before it learned anything
    assert "latency_s" in written.gps and written.accelerometer["noise"] == {"noise_mps2": AUTO}


@pytest.mark.parametrize("noise", ["loud", 3, {"noise_mps2": -1}, {"noise_mps2": True}, {"noise_mps2": [1]},
                                   {"noise_mps2": 0.1, "noise_std_mps2": -1},
                                   {"noise_mps2": 0.1, "noise_std_mps2": 1e-160, "noise_drives": 1}])
def test_a_header_that_cannot_be_is_refused(noise: Any) -> None:
    header = DumpHeader(None, {"driver": "bma220", "noise": noise}, {"baud": 9600}, "rav4-2009")
    with pytest.raises(BadInput, match=r"drive\.dump:1: expected"):
        config = wiring.config_for_dump(header, None, None, "drive.dump:1")
        wiring.noise_for_dump(header, config, "drive.dump:1")


def test_a_drive_learns_the_noise_that_its_sensor_had(recorded: tuple[DumpHeader, list[Event]], tmp_path: Path) -> None:
    header, events = recorded
    auto = replace(header, accelerometer={**header.accelerometer, "noise": {"noise_mps2": AUTO}})
    core, _, pipeline = parts_for(auto)
    for event in events:
        core.feed(event)
    core.finish()
    config = wiring.config_for_dump(auto, None, None).accelerometer
    NoiseLearning(tmp_path, pipeline, config, None).save()
    learned = read_noise(tmp_path, config)
    assert learned is not None
    assert abs(learned.belief.log_mean - log(DRIVEN_MPS2)) < 2 * learned.belief.log_std  # the belief is log-normal


@pytest.mark.slow
def test_a_recording_replays_with_what_its_drive_began_with(recorded: tuple[DumpHeader, list[Event]]) -> None:
    header, events = recorded[0], recorded[1][:20000]
    loud = KnownNoise(NoiseBelief(log(0.4), 0.02), 5)
    said = replace(header, accelerometer={**header.accelerometer, "noise": NOISE.fields(loud)})
    rows = rows_of(said, events).rows
    assert rows == rows_of(said, events).rows
    assert rows != rows_of(header, events).rows
    usual = {**header.accelerometer, "noise": {"noise_mps2": 0.1}}
    old = replace(header, gps={"baud": 9600, **DELAY.fields(UNKNOWN)})
    assert rows_of(replace(header, accelerometer=usual), events).rows == rows_of(old, events).rows


def test_status_says_it_in_words(tmp_path: Path) -> None:
    def words(config: AccelerometerConfig, drive: Drive = NOTHING, known: KnownNoise | None = None) -> str:
        return NoiseLearning(tmp_path, drive, config, known).words()

    assert words(AccelerometerConfig(noise_mps2=0.15)) == "0.15 m/s2 by the settings"
    assert words(LEARNS) == "0.2 m/s2 assumed; it is learned while driving"
    assert words(LEARNS, known=KNOWN) == "0.15 ± 0.009 m/s2, learned over 3 drives"
    assert words(LEARNS, LEARNED) == "0.2 ± 0.008 m/s2, learned over 1 drive"
