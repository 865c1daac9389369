"""A car's day through the service's own code with files, at many times real time, and what can be said of it after.

Buses, drivers, core, storage and clean-up are the real ones; only the clock is that of the day, and the threads of the
live service are left out, as in any replay.
"""

from __future__ import annotations

import ctypes
import gc
import re
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path

from drivers.dump import Event, open_dump
from logger.records import WindowRecord
from logger.service import wiring
from logger.service.config import Config, LogConfig
from logger.service.event_core import EventCore
from logger.service.main_loop import Player
from logger.service.storage import Storage
from logger.store.formats.vehicle_file import read_model
from logger.store.integrity import FileCheck, verify
from logger.store.log.disk_quota import QuotaLimits
from logger.store.log.row_format import read_log

from ..drives.car_days import HEADER, START_US, CarDay

SAMPLED_US = 300 * 1_000_000
MAX_FILE_BYTES = 60_000


@dataclass(frozen=True)
class Sample:
    """The process and its folder at one time of the day.

    memory_bytes    of its own, not that of files it has mapped
    blocks          of memory that Python's objects hold: a leak shows here even where the process has room to spare
    """

    t_us: int
    memory_bytes: int
    blocks: int
    open_files: int
    folder_bytes: int


@dataclass(frozen=True)
class Soaked:
    """What is left of the day.

    samples       every five minutes while something was heard
    rows          of all files, in their order
    log_bytes     size of each log
    dump_s        how much of the day was recorded before the room was needed for the logs [s]
    checks        what ``verify`` says of the folder
    """

    wall_s: float
    cpu_s: float
    events: int
    samples: list[Sample]
    rows: list[WindowRecord]
    log_bytes: list[int]
    dump_s: float
    checks: list[FileCheck]
    rows_lost: int

    def gained(self, what: Callable[[Sample], int], since_us: int) -> int:
        """The most after this time of the day, less the most by then."""
        most = max(what(sample) for sample in self.samples if sample.t_us <= since_us)
        return max(what(sample) for sample in self.samples if sample.t_us > since_us) - most

    def known_m(self) -> float:
        """Length of all windows with a distance [m]."""
        return sum(row.distance_end_m - row.distance_start_m for row in self.rows
                   if row.distance_end_m is not None and row.distance_start_m is not None)

    def blind_s(self) -> float:
        """Time in windows without one [s]."""
        return sum(row.duration_s for row in self.rows if row.distance_end_m is None)

    def utc_errors_s(self, day: CarDay) -> list[float]:
        """Of each row; infinite for one without UTC."""
        return [abs(row.utc_us - day.utc_us(row.t_us)) / 1e6 if row.utc_us is not None else inf for row in self.rows]


class _Service:
    """What the loop of the live service does with each event, on the day's clock."""

    def __init__(self, directory: Path, quota_bytes: int) -> None:
        config = wiring.config_for_dump(HEADER, Config(log=LogConfig(directory, MAX_FILE_BYTES)), None)
        sensor, vehicle = wiring.instrument(config.accelerometer), wiring.car_of(config, read_model)
        self._directory = directory
        self._sync_us = config.log.sync_s * 1e6
        self.t_us = START_US
        self.storage = Storage(directory, wiring.sidecar(config, sensor, vehicle), MAX_FILE_BYTES, HEADER,
                               QuotaLimits(quota_bytes, floor_bytes=0), lambda: self.t_us)
        pipeline = wiring.pipeline(config, sensor, vehicle)
        self._core = EventCore(sensor.decoder, wiring.gps_decoder(config), pipeline, self.storage.log)
        self._tended_us = self._sampled_us = START_US
        self.samples: list[Sample] = []

    def feed(self, event: Event) -> None:
        self.t_us = event.t_us
        self.storage.record(event)
        self._core.feed(event)
        if event.t_us - self._tended_us >= self._sync_us:
            self._tended_us = event.t_us
            self.storage.sync()
            self.storage.tend()
            if event.t_us - self._sampled_us >= SAMPLED_US:
                self._sampled_us = event.t_us
                self.samples.append(self._sample())

    def finish(self) -> None:
        self._core.finish()
        self.storage.close()

    def _sample(self) -> Sample:
        gc.collect()
        memory = re.search(r"RssAnon:\s+(\d+) kB", Path("/proc/self/status").read_text())
        assert memory is not None
        open_files = sum(1 for _ in Path("/proc/self/fd").iterdir())
        folder_bytes = sum(path.stat().st_size for path in self._directory.iterdir())
        return Sample(self.t_us, 1024 * int(memory[1]), sys.getallocatedblocks(), open_files, folder_bytes)


def soak(day: CarDay, directory: Path, quota_bytes: int) -> Soaked:
    """Let the day happen, with its files in an empty folder."""
    service = _Service(directory, quota_bytes)
    ctypes.CDLL(None).malloc_trim(0)  # room that the making of the day has left would hide a leak
    player = Player(service, 0.0, lambda _: None)
    began_s, began_cpu_s = time.monotonic(), time.process_time()
    events = player.play(day.events()).events
    wall_s, cpu_s = time.monotonic() - began_s, time.process_time() - began_cpu_s
    logs = sorted(directory.glob("*.csv"))
    return Soaked(
        wall_s=wall_s, cpu_s=cpu_s, events=events, samples=service.samples,
        rows=[row for path in logs for row in read_log(path).records],
        log_bytes=[path.stat().st_size for path in logs], dump_s=_recorded_s(directory), checks=verify([directory]),
        rows_lost=service.storage.status().rows_lost,
    )


def _recorded_s(directory: Path) -> float:
    """Time from the start of the day to the last event in any dump [s]."""
    last_us = START_US
    for path in directory.glob("*.dump.gz"):
        with open_dump(path) as reader:
            for event in reader:
                last_us = max(last_us, event.t_us)
    return (last_us - START_US) / 1e6
