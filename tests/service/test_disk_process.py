"""The real command: killed at random under load, and with a limit of the system on its files."""

from __future__ import annotations

import resource
import signal
import socket
import time
from pathlib import Path

import pytest

from logger.commands.status import screen
from logger.service.status import ServiceStatus, read_status
from logger.store.segment_log import read_log
from logger.store.verify import verify

from killing import KilledService, fast_drive, kill_many

PATIENCE_S = 40.0


def test_a_dozen_kills(tmp_path: Path) -> None:
    found = kill_many(tmp_path, kills=2, services=6, longest_s=10.0, seed=1)
    assert [words for kills in found for words in kills.wrong] == []
    assert sum(kills.kills for kills in found) == 12
    assert sum(kills.dumps for kills in found) > 6


def wait_for(service: KilledService, pid: int, what: object) -> ServiceStatus:
    until_s = time.monotonic() + PATIENCE_S
    status = None
    while time.monotonic() < until_s:
        status = read_status(service.work / "status.json")
        if status is not None and status.pid == pid and what(status):  # type: ignore[operator]
            return status
        time.sleep(0.1)
    raise AssertionError(f"not reached: {status}")


def test_a_service_that_may_write_no_more_stays_up_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The system refuses longer files (EFBIG) in the middle of a write, for some seconds."""
    fast_drive(tmp_path / "drive.dump.gz", 60.0)
    service = KilledService(tmp_path / "service", tmp_path / "drive.dump.gz")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "1000000")
        process = service.start()
        try:
            wait_for(service, process.pid, lambda status: status.rows_written > 20)
            unlimited = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
            sidecar, *_ = service.log.glob("*.json")
            limit = sidecar.stat().st_size - 1  # no file can be begun any more, while the status file still fits
            assert (service.work / "status.json").stat().st_size < limit
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit, unlimited[1]))
            full = wait_for(service, process.pid, lambda status: status.storage.rows_waiting > 10)
            drain(manager)
            time.sleep(1.5)
            told = drain(manager)
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, unlimited)
            wait_for(service, process.pid, lambda status: not status.storage.trouble)
        finally:
            process.send_signal(signal.SIGTERM)
            status = process.wait(timeout=PATIENCE_S)
            service.close()
    assert status == 0
    assert "WATCHDOG=1" in told
    assert any("NOT WRITING" in words for words in told)
    assert full.accelerometer.state == "ok"
    lines = "\n".join(screen(full, None))
    assert "but writes NOTHING" in lines
    assert "rows wait in memory" in lines
    segments = [record.segment for path in sorted(service.log.glob("*.csv")) for record in read_log(path).records]
    assert segments == list(range(1, len(segments) + 1))
    assert len(segments) > full.rows_written + full.storage.rows_waiting
    assert all(check.ok for check in verify(sorted(service.log.glob("*.csv"))))


def drain(manager: socket.socket) -> list[str]:
    """What systemd was told."""
    told = []
    try:
        while True:
            told.append(manager.recv(1000).decode())
    except BlockingIOError:
        return told
