"""A real ``ridelog run`` killed at random under load, started again in the same folder, and what is left each time; and
one that may write no more.

Windows of one metre at 24 m/s, files of a few seconds and a raw dump make load. A kill comes at any time from the
first import on, so the repair is killed as well.
"""

from __future__ import annotations

import os
import random
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from unittest.mock import patch

from drivers.dump import Event, intact_bytes, open_dump
from logger.commands.status import advice, screen
from logger.service.status import ServiceStatus, read_status
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.store.integrity import verify
from logger.store.log.log_name import log_name
from logger.store.log.row_format import read_log

from ..drives.simulated_drive import DrivePlan, RoadStretch, record, simulate_drive
from .trials import Found, Hazard, found

PATIENCE_S = 60.0
Rows = dict[int, set[int]]


def fast_drive(path: Path, seconds: float) -> None:
    """Recorded at 24 m/s nearly from the start."""
    speed = ((0, 0), (1, 0), (4, 24), (seconds, 24))
    plan = DrivePlan(speed_knots=speed, stretches=(RoadStretch(30 * seconds, 60),), seed=7)
    record(simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009"))), path)


@dataclass
class Kills:
    """What was found after each kill. ``wrong`` is empty when every promise was held."""

    kills: int = 0
    rows: int = 0
    rows_reported: int = 0
    torn_tails: int = 0
    dumps: int = 0
    wrong: list[str] = field(default_factory=list)


class KilledService:
    """A service in a folder of its own, and a receiver on a pseudo-terminal that never stops sending."""

    def __init__(self, work: Path, dump: Path) -> None:
        work.mkdir()
        self.work = work
        self.log = work / "log"
        self.found = Kills()
        self._stop = threading.Event()
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        with open_dump(dump) as reader:
            sentences = [event for event in reader if event.source == "nmea"]
        (work / "ridelog.yaml").write_text(
            f"accelerometer: {{bma220: {{i2c_bus: 'dump:{dump}'}}}}\n"
            f"gps: {{port: {os.ttyname(slave)}}}\n"
            f"pipeline: {{window_m: 1}}\n"
            f"log: {{directory: {self.log}, record_dump: true, max_file_bytes: 10000}}\n"
            f"status_file: {work / 'status.json'}\n"
        )
        threading.Thread(target=self._send, args=(sentences,), daemon=True).start()

    def _send(self, events: list[Event]) -> None:
        while not self._stop.is_set():
            began_s = time.monotonic()
            for event in events:
                wait_s = began_s + (event.t_us - events[0].t_us) / 1e6 - time.monotonic()
                if self._stop.wait(max(wait_s, 0.0)):
                    return
                with suppress(BlockingIOError):
                    os.write(self._master, event.data)

    def close(self) -> None:
        """The receiver stops."""
        self._stop.set()

    def run(self, kills: int, rng: random.Random, longest_s: float) -> Kills:
        """So many kills, each followed by a start that is killed again; the last start ends well. Every second one
        comes when the service is up, however long its imports take on a busy machine."""
        before: Rows = {}
        for number in range(kills):
            process = self.start()
            if number % 2:
                self._wait_until_repaired(process)
            time.sleep(rng.uniform(0.3, longest_s))
            process.kill()
            process.wait(timeout=PATIENCE_S)
            self.found.kills += 1
            before = self._after_kill(process.pid, before)
        process = self.start()
        self._wait_until_repaired(process)
        process.terminate()
        process.wait(timeout=PATIENCE_S)
        self._check(before, all_finished=True)
        return self.found

    def start(self) -> subprocess.Popen[bytes]:
        ridelog = Path(sys.executable).with_name("ridelog")
        with (self.work / "stderr.txt").open("ab") as errors:
            return subprocess.Popen([ridelog, "run", "--config", self.work / "ridelog.yaml"], stderr=errors,
                                    env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})

    def _wait_until_repaired(self, process: subprocess.Popen[bytes]) -> None:
        until_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < until_s and process.poll() is None:
            status = read_status(self.work / "status.json")
            if status is not None and status.pid == process.pid:
                return
            time.sleep(0.05)
        self.found.wrong.append(f"did not start: {(self.work / 'stderr.txt').read_text()[-500:]}")

    def _after_kill(self, pid: int, before: Rows) -> Rows:
        """Compare with what was there after the kill before, and with what the status had reported."""
        rows = self._check(before, all_finished=False)
        status = read_status(self.work / "status.json")
        if status is not None and status.pid == pid and status.rows_written:
            newest = max(rows)
            self.found.rows_reported += status.rows_written
            if len(rows[newest]) < status.rows_written:
                self.found.wrong.append(f"status reported {status.rows_written} rows, {len(rows[newest])} are there")
        return rows

    def _check(self, before: Rows, all_finished: bool) -> Rows:
        """Every row that was there is still there, and all that is finished is good."""
        rows: Rows = {}
        opened = set()
        for path in sorted(self.log.glob("*.csv*")) if self.log.exists() else []:
            name = log_name(path)
            if name is not None:
                content = read_log(path)
                rows.setdefault(name.session, set()).update(record.segment for record in content.records)
                if name.is_open:
                    opened.add(path)
                    self.found.torn_tails += content.damaged_lines
        for session, segments in before.items():
            if not segments <= rows.get(session, set()):
                self.found.wrong.append(f"session {session}: {len(segments - rows.get(session, set()))} rows are gone")
        for session, segments in rows.items():
            if segments and segments != set(range(1, max(segments) + 1)):
                self.found.wrong.append(f"session {session}: rows are missing in between")
        finished = [*self.log.glob("*.csv"), *self.log.glob("*.dump.gz")]
        for check in verify(finished) if finished else []:
            bad = [problem for problem in check.problems if "nothing from the accelerometer" not in problem]
            self.found.wrong += [f"{check.path.name}: {problem}" for problem in bad]
        for part in self.log.glob("*.dump.gz.part") if self.log.exists() else []:
            self.found.dumps += intact_bytes(part) > 0
        if all_finished and (opened or list(self.log.glob("*.part"))):
            self.found.wrong.append("a part was left open")
        self.found.rows = sum(len(segments) for segments in rows.values())
        return rows


def kill_many(folder: Path, kills: int, services: int, longest_s: float, seed: int) -> list[Kills]:
    """So many kills of each of some services that run side by side, each up to ``longest_s`` after its start."""
    fast_drive(folder / "drive.dump.gz", 60.0)
    running = [KilledService(folder / f"service-{number}", folder / "drive.dump.gz") for number in range(services)]
    try:
        with ThreadPoolExecutor(services) as pool:
            return list(pool.map(lambda entry: entry[1].run(kills, random.Random(seed + entry[0]), longest_s),
                                 enumerate(running)))
    finally:
        for service in running:
            service.close()


SERVICES = 6


def killed_at_random(folder: Path, case: tuple[int, float, int]) -> Found:
    kills, longest_s, seed = case
    services = kill_many(folder, kills, SERVICES, longest_s, seed)
    figures = {name: float(sum(getattr(one, name) for one in services))
               for name in ("rows", "rows_reported", "torn_tails", "dumps")}
    wrong = tuple(words for one in services for words in one.wrong)
    return Found(sum(one.kills for one in services), figures, wrong=wrong)


def may_write_no_more(folder: Path, case: None) -> Found:
    """The system refuses longer files (EFBIG) in the middle of a write, for some seconds."""
    fast_drive(folder / "drive.dump.gz", 60.0)
    service = KilledService(folder / "service", folder / "drive.dump.gz")
    heard_by = {"NOTIFY_SOCKET": str(folder / "notify"), "WATCHDOG_USEC": "1000000"}
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager, patch.dict(os.environ, heard_by):
        manager.bind(str(folder / "notify"))
        manager.setblocking(False)
        process = service.start()
        try:
            _wait_for(service, process.pid, lambda status: status.rows_written > 20)
            unlimited = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
            sidecar, *_ = service.log.glob("*.json")
            limit = sidecar.stat().st_size - 1  # no file can be begun any more, while the status file still fits
            assert (service.work / "status.json").stat().st_size < limit
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit, unlimited[1]))
            full = _wait_for(service, process.pid, lambda status: status.storage.rows_waiting > 10)
            _drain(manager)
            time.sleep(1.5)
            reported = _drain(manager)
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, unlimited)
            _wait_for(service, process.pid, lambda status: not status.storage.trouble)
        finally:
            process.send_signal(signal.SIGTERM)
            ended = process.wait(timeout=PATIENCE_S)
            service.close()
    assert ended == 0
    assert "WATCHDOG=1" in reported
    assert any("NOT WRITING" in words for words in reported)
    assert full.accelerometer.state == "ok"
    lines = "\n".join(screen(full, None))
    assert "but writes NOTHING" in lines
    assert "rows wait in memory" in lines
    segments = [record.segment for path in sorted(service.log.glob("*.csv")) for record in read_log(path).records]
    assert segments == list(range(1, len(segments) + 1))
    assert len(segments) > full.rows_written + full.storage.rows_waiting
    assert all(check.ok for check in verify(sorted(service.log.glob("*.csv"))))
    return found(reported=advice(full)[0], waited=full.storage.rows_waiting)


def ends_while_it_may_not_write(folder: Path) -> tuple[str, list[str], int]:
    """A service that is stopped while the system refuses longer files: the last words of its journal, what systemd
    heard, and the rows in all its files."""
    fast_drive(folder / "drive.dump.gz", 60.0)
    service = KilledService(folder / "service", folder / "drive.dump.gz")
    with (socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager,
          patch.dict(os.environ, {"NOTIFY_SOCKET": str(folder / "notify")})):
        manager.bind(str(folder / "notify"))
        manager.setblocking(False)
        process = service.start()
        try:
            _wait_for(service, process.pid, lambda status: status.rows_written > 20)
            sidecar, *_ = service.log.glob("*.json")
            limit = sidecar.stat().st_size - 1
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
            _wait_for(service, process.pid, lambda status: status.storage.rows_waiting > 10)
            _drain(manager)  # what nobody reads leaves no room for the last words
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=PATIENCE_S)
            service.close()
        heard = _drain(manager)
    rows = {record.segment for path in service.log.glob("*.csv*") for record in read_log(path).records}
    return (service.work / "stderr.txt").read_text().splitlines()[-1], heard, len(rows)


def _wait_for(service: KilledService, pid: int, what: Callable[[ServiceStatus], bool]) -> ServiceStatus:
    until_s = time.monotonic() + PATIENCE_S
    status = None
    while time.monotonic() < until_s:
        status = read_status(service.work / "status.json")
        if status is not None and status.pid == pid and what(status):
            return status
        time.sleep(0.1)
    raise AssertionError(f"not reached: {status}")


def _drain(manager: socket.socket) -> list[str]:
    """What systemd was notified of."""
    reported = []
    try:
        while True:
            reported.append(manager.recv(1000).decode())
    except BlockingIOError:
        return reported


KILLS = Hazard(
    "the real service killed (SIGKILL)", f"{SERVICES} services at a time under load (windows of 1 m at 24 m/s, files "
    "of 10 kB, a raw dump), at any moment from the first import on, each started again in the same folder",
    "no row that was there or that `ridelog status` had reported is gone, none is missing in between; every finished "
    "file is good", "{rows.total:.0f} rows left, {rows_reported.total:.0f} of them reported before, none gone; "
    "{torn_tails.total:.0f} torn rows refused, {dumps.total:.0f} dumps cut off", killed_at_random,
    ((2, 10.0, 1), *((8, 20.0, seed) for seed in range(2, 6))), 1)
WRITES_NO_MORE = Hazard(
    "the real service may write no more", "the system limits the size of its files in the middle of a write (EFBIG)",
    "it stays up, the watchdog is fed, systemd is notified and `status` says so; once it may, every row is written",
    "{waited.total:.0f} rows waited, all were written", may_write_no_more)
