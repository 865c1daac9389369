"""The receiver's delay from drive to drive: settings, file, header, words."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivers.disk import FileSystem
from drivers.dump import DumpHeader, open_dump
from logger.errors import BadInput
from logger.estimation.drive_alignment import DriveAlignment
from logger.estimation.receiver_delay import UNKNOWN, CarriedDelay, DelayEstimate
from logger.service import wiring
from logger.service.config import Config, GpsConfig
from logger.service.learning import DELAY, SAVE_EVERY_US, ReceiverLearning, delay_at_start, read_delay
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model

from ..support.drives.replay import rows_of


def config_of(header: DumpHeader, gps: GpsConfig) -> Config:
    """The settings that a recording's header asks for, with these of the receiver."""
    return replace(wiring.config_for_dump(header, None, None), gps=gps)


class Told(DriveAlignment):
    """A drive that showed this much."""

    def __init__(self, found: DelayEstimate, complaints: tuple[str, ...] = ()) -> None:
        super().__init__(2, 1.0)
        self._reported = found
        self._complaints = complaints

    def estimate(self) -> DelayEstimate:
        return self._reported

    @property
    def complaints(self) -> tuple[str, ...]:
        return self._complaints


FOUND = Told(DelayEstimate(0.16, 0.015))
NOTHING = Told(DelayEstimate(reason="not enough driving yet"))
AUTO, SET = GpsConfig(), GpsConfig(latency_s=0.25)


def test_what_is_learned_is_there_at_the_next_start(tmp_path: Path) -> None:
    assert read_delay(tmp_path) is None
    assert delay_at_start(AUTO, None) == UNKNOWN
    ReceiverLearning(tmp_path, FOUND, UNKNOWN, None).save()
    learned = read_delay(tmp_path)
    assert learned is not None
    assert learned.delay_s == pytest.approx(0.159, abs=0.001)
    assert learned.std_s == pytest.approx(0.0148, abs=0.001)
    assert learned.drives == 1
    assert delay_at_start(AUTO, learned) == learned
    ReceiverLearning(tmp_path, FOUND, learned, learned).save()
    again = read_delay(tmp_path)
    assert again is not None
    assert again.drives == 2
    assert again.std_s < learned.std_s
    assert [path.name for path in tmp_path.iterdir()] == [DELAY.file_name]


def test_a_delay_of_about_nothing_is_read_back(tmp_path: Path) -> None:
    before_the_sensor = Told(DelayEstimate(-0.02, 0.015))
    ReceiverLearning(tmp_path, before_the_sensor, UNKNOWN, None).save()
    learned = read_delay(tmp_path)
    assert learned is not None and learned.delay_s == 0.0 and learned.drives == 1


def test_a_number_in_the_settings_counts_and_has_no_error() -> None:
    assert delay_at_start(SET, CarriedDelay(0.1, 0.01, 4)) == CarriedDelay(0.25, 0.0)


def test_it_is_saved_now_and_then(tmp_path: Path) -> None:
    learning = ReceiverLearning(tmp_path, FOUND, UNKNOWN, None)
    learning.tend(0)
    learning.tend(SAVE_EVERY_US - 1)
    assert read_delay(tmp_path) is None
    learning.tend(SAVE_EVERY_US)
    assert read_delay(tmp_path) is not None


def test_nothing_learned_writes_nothing(tmp_path: Path) -> None:
    ReceiverLearning(tmp_path, NOTHING, UNKNOWN, None).save()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"latency_s": "x", "latency_std_s": 0.1}', "\xff",
                                  '{"latency_s": NaN, "latency_std_s": 0.1}', '{"latency_s": 0.1}', "[" * 900,
                                  '"latency_s"', '["latency_s"]',
                                  f'{{"latency_s": 1{"0" * 400}, "latency_std_s": 0.1}}',
                                  '{"latency_s": 0.1, "latency_std_s": 0.0, "latency_drives": 1}'])
def test_a_damaged_file_is_as_none(tmp_path: Path, text: str) -> None:
    (tmp_path / DELAY.file_name).write_bytes(text.encode("latin-1"))
    assert read_delay(tmp_path) is None


def test_a_disk_that_refuses_is_tried_again(tmp_path: Path) -> None:
    class Full(FileSystem):
        refuses = True

        def write(self, descriptor: int, data: bytes) -> None:
            if self.refuses:
                raise OSError(28, "No space left on device")
            super().write(descriptor, data)

    disk = Full()
    learning = ReceiverLearning(tmp_path, FOUND, UNKNOWN, None, disk)
    learning.save()
    assert read_delay(tmp_path) is None
    disk.refuses = False
    learning.save()
    assert read_delay(tmp_path) is not None


def test_a_recording_carries_what_its_drive_went_by() -> None:
    known = CarriedDelay(0.17, 0.02, 3)
    header = wiring.dump_header(Config(), known)
    assert wiring.receiver_for_dump(header, Config()) == known
    assert wiring.receiver_for_dump(header, replace(Config(), gps=SET)) == CarriedDelay(0.25, 0.0)
    old = replace(header, gps={"baud": 9600})
    assert wiring.receiver_for_dump(old, Config()) == UNKNOWN


@pytest.mark.parametrize("gps", [{"latency_s": -1}, {"latency_s": "1"}, {"latency_s": 0.1, "latency_std_s": 1e9},
                                 {"latency_s": 0.1, "latency_std_s": 0.1, "latency_drives": -1}])
def test_a_header_that_cannot_be_is_refused(gps: dict[str, Any]) -> None:
    header = DumpHeader(None, {"driver": "bma220"}, {"baud": 9600, **gps}, "rav4-2009")
    with pytest.raises(BadInput, match=r"dump:1: expected latency_s"):
        wiring.receiver_for_dump(header, Config(), place="dump:1")


@pytest.mark.slow
def test_a_recording_replays_with_what_its_drive_went_by(short_dump: Path) -> None:
    with open_dump(short_dump) as reader:
        header, events = reader.header, list(reader)[:6000]
    header = replace(header, accelerometer={**header.accelerometer, "noise": {"noise_mps2": "auto"}})
    learned = replace(header, gps={**header.gps, **DELAY.fields(CarriedDelay(0.25, 0.0, 3))})
    rows = rows_of(learned, events).rows
    assert rows == rows_of(header, events, config_of(header, SET)).rows
    assert rows != rows_of(header, events).rows


def test_a_sidecar_says_what_its_rows_went_by() -> None:
    config = Config()
    car = read_model(vehicle_file("rav4-2009"))
    known = CarriedDelay(0.17, 0.02, 3)
    facts = wiring.sidecar(config, wiring.instrument(config.accelerometer), car, known)
    assert DELAY.from_fields(facts["receiver"]) == known
    assert facts["receiver"] == DELAY.fields(known)


def test_status_says_it_in_words(tmp_path: Path) -> None:
    learned = CarriedDelay(0.14, 0.02, 2)
    words = ReceiverLearning(tmp_path, NOTHING, learned, learned).words()
    assert words == "0.14 ± 0.02 s, learned over 2 drives"
    assert ReceiverLearning(tmp_path, FOUND, learned, learned).words().endswith("learned over 3 drives")
    first = ReceiverLearning(tmp_path, FOUND, UNKNOWN, None).words()
    assert first.endswith("learned over 1 drive; from the next start on")
    assert ReceiverLearning(tmp_path, NOTHING, UNKNOWN, None).words() == \
        "0.14 ± 0.07 s, assumed: not enough driving yet"
    assert ReceiverLearning(tmp_path, NOTHING, delay_at_start(SET, None), None).words() == "0.25 s by the settings"


def test_a_wrong_number_and_a_loose_sensor_are_reported(tmp_path: Path) -> None:
    (words,) = ReceiverLearning(tmp_path, FOUND, delay_at_start(SET, None), None).notices()
    assert "latency_s is 0.25 s in the settings" in words
    assert "set latency_s: auto" in words
    loose = Told(DelayEstimate(), ("it has tilted by 12 degrees 9 min after the drive began: fasten it",))
    assert ReceiverLearning(tmp_path, loose, UNKNOWN, None).notices() == (
        "accelerometer: it has tilted by 12 degrees 9 min after the drive began: fasten it",)
