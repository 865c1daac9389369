"""The status file: what was written is what is read, and a dead or hung service shows."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from logger.commands.status import screen
from logger.errors import BadInput
from logger.records import WindowRecord
from logger.service.status import (
    SensorState,
    SensorStatus,
    ServiceStatus,
    StorageStatus,
    process_exists,
    read_status,
    trouble,
    write_status,
)

WINDOW = WindowRecord(
    segment=7, drive=1, t_us=12_000_000, utc_us=None, duration_s=0.4, distance_start_m=45.72, distance_end_m=53.34,
    lat_deg=46.5, lon_deg=6.6, speed_mps=20.0, iri_m_per_km=3.21, iri_std_m_per_km=1.1, iri_rms_m_per_km=3.21,
    a_w_mps2=0.4, mtvv_mps2=0.5, vdv_mps175=0.6, crest_factor=3.0, comfort="a_little_uncomfortable", iri_class="B",
    accel_rms_mps2=0.7, samples=40, clipped_samples=0, flags=("time_unset",))
STATUS = ServiceStatus(
    state="recording", pid=4321, version="0.1.0", uptime_s=3725.0, updated_t_us=5_000_000,
    accelerometer=SensorStatus("bma220", "/dev/i2c-1", "ok", 3700.0, None, 370_000, {"anomalies": 2}),
    gps=SensorStatus("nmea", "/dev/serial0", "ok", 3700.0, "no such port", 3600, {"bad_checksum": 1}),
    fix_valid=True, satellites=9, utc_known=True, log_directory="/var/lib/ridelog", current_file="00001-000.csv.part",
    rows_written=1234, distance_m=9403.0, free_bytes=5_000_000_000, last_window=WINDOW, counters={"late": 1})


def test_what_was_written_is_what_is_read(tmp_path: Path) -> None:
    path = tmp_path / "ridelog" / "status.json"  # no unit has made the folder
    assert read_status(path) is None
    write_status(path, replace(STATUS, last_window=None))
    known = replace(STATUS, notices=("roll is not corrected", "another"), receiver_delay="0.14 ± 0.02 s",
                    receiver_delay_s=0.14, receiver_delay_std_s=0.02)
    write_status(path, known)
    assert read_status(path) == known
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "{}", '{"state": "recording"}', "\xff", "[" * 90_000,
                                  "[" * 10**6])
def test_another_file_is_refused_by_name(tmp_path: Path, text: str) -> None:
    path = tmp_path / "status.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(BadInput, match=r"status\.json: expected the status"):
        read_status(path)


@pytest.mark.parametrize("change", [{"state": "asleep"}, {"pid": "4321"}, {"accelerometer": {"driver": "bma220"}}])
def test_a_status_that_does_not_fit_is_refused(tmp_path: Path, change: dict[str, object]) -> None:
    path = tmp_path / "status.json"
    write_status(path, STATUS)
    path.write_text(json.dumps({**json.loads(path.read_text(encoding="utf-8")), **change}), encoding="utf-8")
    with pytest.raises(BadInput, match="expected the status"):
        read_status(path)


@pytest.mark.parametrize(("status", "now_t_us", "pid_exists", "words"), [
    (STATUS, 6_000_000, True, None),
    (STATUS, 15_000_000, True, None),
    (STATUS, 15_100_000, True, "hangs"),
    (STATUS, 6_000_000, False, "process 4321 has ended"),
    (STATUS, 4_000_000, True, "before this boot"),
    (None, 6_000_000, False, "left no status"),
])
def test_a_dead_or_hung_service_shows(status: ServiceStatus | None, now_t_us: int, pid_exists: bool,
                                      words: str | None) -> None:
    fault = trouble(status, now_t_us, pid_exists)
    assert fault is None if words is None else fault is not None and words in fault


def test_this_process_exists_and_an_ended_one_does_not() -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        ended.wait()
    assert process_exists(os.getpid())
    assert not process_exists(ended.pid)


def test_the_screen_of_a_healthy_service_says_so() -> None:
    late = replace(STATUS, receiver_delay="0.14 ± 0.02 s, learned over 3 drives")
    assert "  receiver delay  0.14 ± 0.02 s, learned over 3 drives" in screen(late, None)
    text = "\n".join(screen(STATUS, None))
    assert "is recording, up 1 h 02 min" in text
    assert "72 km/h, IRI 3.2 m/km, a little uncomfortable, time_unset" in text
    assert "all is well" in text


@pytest.mark.parametrize(("change", "step"), [
    ({"accelerometer": SensorStatus("bma220", "/dev/i2c-1", "absent", 70.0, "no acknowledge")}, "four wires"),
    ({"gps": SensorStatus("nmea", "/dev/serial0", "silent", 9.0)}, "baud rate"),
    ({"gps": SensorStatus("nmea", "/dev/serial0", "retrying", 9.0)}, "cable"),
    ({"fix_valid": None}, "view of the sky"),
    ({"free_bytes": 1_000_000}, "1 MB left"),
    ({"storage": StorageStatus("the disk is full", 70.0, 12)}, "12 rows wait in memory"),
    ({"storage": StorageStatus("the disk has become read-only", 70.0, 12)}, "sudo systemctl restart ridelog"),
    ({"storage": StorageStatus(rows_lost=3)}, "3 rows were lost"),
    ({"storage": StorageStatus(recording_trouble="little room")}, "not recorded: little room"),
    ({"storage": StorageStatus(dumps_lost=2)}, "ridelog removed 2 dumps"),
    ({"notices": ("roll is not corrected",)}, "roll is not corrected"),
])
def test_the_screen_says_what_to_do_next(change: dict[str, object], step: str) -> None:
    lines = screen(replace(STATUS, **change), None)
    assert any(step in line for line in lines[lines.index("What to do"):])


def test_a_service_that_cannot_write_says_so_in_the_first_line() -> None:
    lines = screen(replace(STATUS, storage=StorageStatus("the disk has become read-only", 70.0, 12)), None)
    assert lines[0] == "ridelog is recording, but writes NOTHING: the disk has become read-only, up 1 h 02 min"


def test_without_a_service_the_screen_says_how_to_start_one() -> None:
    assert any("systemctl start ridelog" in line for line in screen(None, "ridelog is not running"))


@pytest.mark.parametrize(("state", "is_said"), [("silent", True), ("absent", True), ("retrying", True), ("ok", False)])
def test_a_port_that_is_not_on_the_pins_is_said_beside_its_silence(
        state: SensorState, is_said: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("logger.commands.status.port_advice", lambda port: f"{port} is the debug connector")
    gps = SensorStatus("nmea", "/dev/serial0", state, last_error="no such port")
    said = "\n".join(screen(replace(STATUS, gps=gps), None))
    assert ("/dev/serial0 is the debug connector. Last error: no such port." in said) == is_said
