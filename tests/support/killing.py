"""A real ``ridelog run`` killed at random under load, started again in the same folder, and what is left each time.

Windows of one metre at 24 m/s, files of a few seconds and a raw dump make load. A kill comes at any time from the
first import on, so the repair is killed as well.
"""

from __future__ import annotations

import os
import random
import subprocess
import sys
import threading
import time
import tty
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from drivers.dump import Event, intact_bytes, open_dump
from logger.demo.motion import Stretch
from logger.demo.simulated_drive import DrivePlan, record, simulate_drive
from logger.service.status import read_status
from logger.shipped import vehicle_file
from logger.store.rotation import LogName
from logger.store.segment_log import read_log
from logger.store.vehicle_file import read_vehicle
from logger.store.verify import verify

PATIENCE_S = 60.0
Rows = dict[int, set[int]]


def fast_drive(path: Path, seconds: float) -> None:
    """Recorded at 24 m/s nearly from the start."""
    speed = ((0, 0), (1, 0), (4, 24), (seconds, 24))
    plan = DrivePlan(speed_knots=speed, stretches=(Stretch(30 * seconds, 60),), seed=7)
    record(simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009"))), path)


@dataclass
class Kills:
    """What was found after each kill. ``wrong`` is empty when every promise was held."""

    kills: int = 0
    rows: int = 0
    rows_told: int = 0
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
        """So many kills, each followed by a start that is killed again; the last start ends well."""
        before: Rows = {}
        for _ in range(kills):
            process = self.start()
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
        """Compare with what was there after the kill before, and with what the status had told."""
        rows = self._check(before, all_finished=False)
        status = read_status(self.work / "status.json")
        if status is not None and status.pid == pid and status.rows_written:
            newest = max(rows)
            self.found.rows_told += status.rows_written
            if len(rows[newest]) < status.rows_written:
                self.found.wrong.append(f"status told {status.rows_written} rows, {len(rows[newest])} are there")
        return rows

    def _check(self, before: Rows, all_finished: bool) -> Rows:
        """Every row that was there is still there, and all that is finished is good."""
        rows: Rows = {}
        opened = set()
        for path in sorted(self.log.glob("*.csv*")) if self.log.exists() else []:
            name = LogName.of(path)
            if name is not None:
                content = read_log(path)
                rows.setdefault(name.session, set()).update(record.segment for record in content.records)
                if not name.finished:
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
