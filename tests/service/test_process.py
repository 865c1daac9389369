"""The real command as a process: real serial code on a pseudo-terminal, a recorded chip, real files and signals."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivers.dump import Event, open_dump
from logger.shipped import vehicle_file

from ..support.command import called

PATIENCE_S = 90.0


class SerialDevice:
    """A device at the other end of a pseudo-terminal, which sends what was recorded in real time."""

    def __init__(self, link: Path, events: list[Event]) -> None:
        self.link = link
        self._events = events
        self._stop = threading.Event()
        self._master = -1
        self.plug()

    def plug(self) -> None:
        """Come (back) onto the port."""
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(slave))
        os.close(slave)
        self._stop.clear()
        self._thread = threading.Thread(target=self._send, args=(self._master,), daemon=True)
        self._thread.start()

    def pull(self) -> None:
        """Be unplugged: the port goes."""
        self._stop.set()
        self._thread.join()
        os.close(self._master)

    def _send(self, master: int) -> None:
        began_s = time.monotonic()
        for event in self._events:
            wait_s = began_s + (event.t_us - self._events[0].t_us) / 1e6 - time.monotonic()
            if self._stop.wait(max(wait_s, 0.0)):
                return
            os.write(master, event.data)


class Service:
    """A running ``ridelog run``."""

    def __init__(self, ridelog: Path, work: Path) -> None:
        self.work = work
        self.log = work / "log"
        self.errors = work / "stderr.txt"
        with self.errors.open("ab") as errors:
            self.process = subprocess.Popen([ridelog, "run", "--config", work / "ridelog.yaml"], stderr=errors)

    def status(self) -> dict | None:
        try:
            return json.loads((self.work / "status.json").read_text())
        except FileNotFoundError:
            return None

    def wait_for(self, what: Callable[[dict], bool]) -> dict:
        """Wait until the status is as it should be."""
        deadline_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline_s:
            assert self.process.poll() is None, self.errors.read_text()
            status = self.status()
            if status is not None and status["pid"] == self.process.pid and what(status):
                return status
            time.sleep(0.1)
        raise AssertionError(f"not reached; last status {self.status()}\n{self.errors.read_text()}")

    def terminate(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout=PATIENCE_S)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait(timeout=PATIENCE_S)


@pytest.fixture
def gps(short_dump: Path, tmp_path: Path) -> Iterator[SerialDevice]:
    with open_dump(short_dump) as reader:
        sentences = [event for event in reader if event.source == "nmea"]
    moving = [event for event in sentences if event.t_us - sentences[0].t_us > 7_000_000]
    receiver = SerialDevice(tmp_path / "gps", moving)
    yield receiver
    if not receiver._stop.is_set():
        receiver.pull()


@pytest.fixture
def start(ridelog: Path, tmp_path: Path) -> Iterator[Callable[[], Service]]:
    services: list[Service] = []

    def begin() -> Service:
        services.append(Service(ridelog, tmp_path))
        return services[-1]

    yield begin
    for service in services:
        if service.process.poll() is None:
            service.kill()


def write_config(work: Path, bus: str, record_dump: bool = False) -> None:
    (work / "ridelog.yaml").write_text(
        f"accelerometer: {{bma220: {{i2c_bus: {bus}}}}}\n"
        f"gps: {{port: {work / 'gps'}}}\n"
        f"log: {{directory: {work / 'log'}, record_dump: {str(record_dump).lower()}}}\n"
        f"status_file: {work / 'status.json'}\n"
    )


def rows_in(folder: Path, pattern: str) -> list[str]:
    return [line for path in sorted(folder.glob(pattern)) for line in path.read_text().splitlines()[1:]]


@pytest.mark.slow
def test_recorded_live_and_replayed_gives_the_same_bytes(
    ridelog: Path, gps: SerialDevice, start: Callable[[], Service], short_dump: Path, tmp_path: Path
) -> None:
    write_config(tmp_path, f"'dump:{short_dump}'", record_dump=True)
    service = start()
    service.wait_for(lambda status: status["rows_written"] >= 8)
    assert service.terminate() == 0
    assert not list(service.log.glob("*.part"))
    (recording,) = service.log.glob("*.dump.gz")
    again = tmp_path / "again"
    command = [ridelog, "replay", recording, "--out", again, "--config", tmp_path / "ridelog.yaml"]
    subprocess.run(command, check=True, capture_output=True)
    live = rows_in(service.log, "*.csv")
    assert len(live) >= 8
    assert rows_in(again, "*.csv") == live
    subprocess.run([ridelog, "verify", service.log], check=True, capture_output=True)


@pytest.mark.slow
def test_kill_loses_no_finished_row_and_the_next_start_repairs(
    ridelog: Path, gps: SerialDevice, start: Callable[[], Service], short_dump: Path, tmp_path: Path
) -> None:
    write_config(tmp_path, f"'dump:{short_dump}'")
    service = start()
    service.wait_for(lambda status: status["rows_written"] >= 5)
    rows_reported = service.wait_for(lambda status: True)["rows_written"]
    time.sleep(1.2)
    service.kill()
    (part,) = service.log.glob("*.csv.part")
    assert part.read_text().count("\n") - 1 >= rows_reported
    kept = part.read_text().splitlines()[1:]
    second = start()
    second.wait_for(lambda status: status["state"] != "starting")
    assert second.terminate() == 0
    repaired = service.log / part.name.removesuffix(".part")
    rows = repaired.read_text().splitlines()[1:]
    assert [row.split(",")[0] for row in rows] == [row.split(",")[0] for row in kept]
    subprocess.run([ridelog, "verify", service.log], check=True, capture_output=True)


@pytest.mark.slow
def test_gps_pulled_and_put_back(
    gps: SerialDevice, start: Callable[[], Service], short_dump: Path, tmp_path: Path
) -> None:
    write_config(tmp_path, f"'dump:{short_dump}'")
    service = start()
    before = service.wait_for(lambda status: status["gps"]["state"] == "ok" and status["rows_written"] > 2)
    gps.pull()
    lost = service.wait_for(lambda status: status["gps"]["state"] == "retrying")
    assert lost["gps"]["last_error"]
    assert lost["accelerometer"]["readings"] > before["accelerometer"]["readings"]
    gps.plug()
    service.wait_for(lambda status: status["gps"]["state"] == "ok" and status["fix_valid"])
    assert service.terminate() == 0


@pytest.mark.slow
def test_accelerometer_missing_at_start_while_the_rest_goes_on(
    gps: SerialDevice, start: Callable[[], Service], tmp_path: Path
) -> None:
    write_config(tmp_path, "250")
    service = start()
    status = service.wait_for(lambda status: status["accelerometer"]["last_error"] and status["rows_written"] > 3)
    assert status["accelerometer"]["state"] == "absent"
    assert status["gps"]["state"] == "ok"
    assert status["last_window"]["a_w_mps2"] is None
    assert status["last_window"]["lat_deg"] is not None
    assert service.terminate() == 0


@pytest.mark.slow
def test_a_sensor_beside_the_middle_line_is_reported(start: Callable[[], Service], tmp_path: Path) -> None:
    car = vehicle_file("rav4-2009-full").read_text()
    (tmp_path / "car.yaml").write_text(f"{car}\nsensor: {{left_m: -0.3}}\n")
    write_config(tmp_path, "250")
    with (tmp_path / "ridelog.yaml").open("a") as settings:
        settings.write("vehicle: ./car.yaml\n")
    service = start()
    notice = service.wait_for(lambda status: True)["notices"][0]
    assert "0.3 m right of the middle" in notice
    assert "does not correct for roll" in notice
    assert service.terminate() == 0
    assert service.errors.read_text().count(notice) == 1


@pytest.mark.slow
def test_logs_in_memory_are_reported(ridelog: Path, start: Callable[[], Service], tmp_path: Path) -> None:
    write_config(tmp_path, "250")
    config = tmp_path / "ridelog.yaml"
    logs = Path("/dev/shm", f"ridelog-test-{os.getpid()}")
    config.write_text(config.read_text().replace(f"{tmp_path / 'log'}", f"{logs}"))
    try:
        service = start()
        service.wait_for(lambda status: True)
        said = subprocess.run([ridelog, "status", "--config", config], capture_output=True, text=True).stdout
        assert f"logs: {logs} lies in memory (/dev/shm is a tmpfs" in said
        assert "every drive is lost when the power goes" in service.errors.read_text()
        assert service.terminate() == 0
    finally:
        shutil.rmtree(logs, ignore_errors=True)


@pytest.mark.slow
def test_status_for_a_person_and_for_a_program(
    ridelog: Path, gps: SerialDevice, start: Callable[[], Service], short_dump: Path, tmp_path: Path
) -> None:
    write_config(tmp_path, f"'dump:{short_dump}'")
    service = start()
    service.wait_for(lambda status: status["utc_known"])
    command = [ridelog, "status", "--config", tmp_path / "ridelog.yaml"]
    screen = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert "accelerometer" in screen.lower()
    reported = json.loads(subprocess.run([*command, "--json"], check=True, capture_output=True, text=True).stdout)
    assert reported["accelerometer"]["state"] == "ok"
    assert service.terminate() == 0
    assert subprocess.run(command, capture_output=True, text=True).returncode == 1


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        ("gps: {prot: /dev/x}\n", 1, "prot"),
        ("log:\n  sync_s: soon\n", 2, "number"),
        ("vehicle: hovercraft\n", 1, "hovercraft"),
        ("gps: {baud: 9600\n", 2, "expected"),
    ],
)
def test_wrong_settings_are_refused_with_their_line(
    tmp_path: Path, text: str, line: int, word: str
) -> None:
    config = tmp_path / "ridelog.yaml"
    config.write_text(text)
    done = called("run", "--config", config)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"{config}:{line}" in done.stderr
    assert word in done.stderr


@pytest.mark.slow
def test_an_axis_that_does_not_feel_the_earth_is_noticed(
    gps: SerialDevice, start: Callable[[], Service], short_dump: Path, tmp_path: Path
) -> None:
    write_config(tmp_path, f"'dump:{short_dump}'")
    config = tmp_path / "ridelog.yaml"
    config.write_text(config.read_text().replace("{bma220:", "{vertical_axis: +x, bma220:"))
    service = start()
    status = service.wait_for(lambda status: status["accelerometer"]["last_error"])
    assert "check vertical_axis" in status["accelerometer"]["last_error"]
    assert service.terminate() == 0


@pytest.mark.slow
def test_a_second_service_on_the_same_folder_is_refused(
    ridelog: Path, gps: SerialDevice, start: Callable[[], Service], short_dump: Path, tmp_path: Path
) -> None:
    write_config(tmp_path, f"'dump:{short_dump}'")
    service = start()
    service.wait_for(lambda status: True)
    second = subprocess.run(
        [ridelog, "run", "--config", tmp_path / "ridelog.yaml"], capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert second.returncode == 2
    assert "another ridelog is writing here" in second.stderr
    again = [ridelog, "replay", short_dump, "--out", service.log]
    assert subprocess.run(again, capture_output=True, timeout=PATIENCE_S).returncode == 2
    assert service.terminate() == 0


@pytest.mark.release
def test_a_serial_accelerometer_pulled_and_put_back(
    gps: SerialDevice, start: Callable[[], Service], tmp_path: Path
) -> None:
    lines = [Event(10_000 * count, "pasco", b"0.01,0.02,%.3f\n" % (1 + 0.05 * (count % 7))) for count in range(6000)]
    sensor = SerialDevice(tmp_path / "accelerometer", lines)
    (tmp_path / "ridelog.yaml").write_text(
        f"accelerometer: {{driver: pasco, pasco: {{port: {sensor.link}, profile: lines}}}}\n"
        f"gps: {{port: {gps.link}}}\n"
        f"log: {{directory: {tmp_path / 'log'}}}\n"
        f"status_file: {tmp_path / 'status.json'}\n"
    )
    service = start()
    service.wait_for(lambda status: status["accelerometer"]["state"] == "ok" and status["rows_written"] > 2)
    sensor.pull()
    lost = service.wait_for(lambda status: status["accelerometer"]["state"] == "retrying")
    sensor.plug()
    back = service.wait_for(lambda status: status["accelerometer"]["state"] == "ok")
    service.wait_for(lambda status: status["accelerometer"]["readings"] > back["accelerometer"]["readings"] + 100)
    assert lost["gps"]["state"] == "ok"
    sensor.pull()
    assert service.terminate() == 0
    flags = [row.split(",")[17] for row in rows_in(service.log, "*.csv")]
    assert any("gap" in words for words in flags)


@pytest.mark.slow
def test_systemd_is_reported(
    ridelog: Path, gps: SerialDevice, short_dump: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_config(tmp_path, f"'dump:{short_dump}'")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.settimeout(PATIENCE_S)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "1000000")
        service = Service(ridelog, tmp_path)
        reported = [manager.recv(1000).decode() for _ in range(6)]
        assert reported[0] == "READY=1"
        assert reported.count("WATCHDOG=1") >= 2
        assert any(text.startswith("STATUS=accelerometer ok") for text in reported)
        assert service.terminate() == 0
        while (text := manager.recv(1000).decode()) != "STOPPING=1":
            assert text.startswith(("WATCHDOG", "STATUS"))


@pytest.mark.slow
def test_a_receiver_that_is_set_wrong_is_said_to_be(
    ridelog: Path, start: Callable[[], Service], short_dump: Path, tmp_path: Path
) -> None:
    """Whole sentences without a checksum, through real serial code: not "check the baud rate"."""
    burst = b"$GPRMC,090000.00,A,1220.4000,N,04540.2000,E,19.44,45.0,040526,,,A\r\n"
    receiver = SerialDevice(tmp_path / "gps", [Event(k * 1_000_000, "nmea", burst) for k in range(120)])
    write_config(tmp_path, f"'dump:{short_dump}'")
    service = start()
    status = service.wait_for(lambda status: status["gps"]["state"] == "doubtful")
    assert "come without a checksum" in status["gps"]["last_error"]
    assert burst[:40].decode() in status["gps"]["last_error"]
    shown = subprocess.run([ridelog, "status", "--config", tmp_path / "ridelog.yaml"], capture_output=True, text=True)
    assert "GPS: for " in shown.stdout and "switch the checksum on in the receiver" in shown.stdout
    assert service.terminate() == 0
    receiver.pull()
