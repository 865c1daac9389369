"""The live service put together: devices, threads, log, status and watchdog."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from drivers.dump import DumpWriter, Event, open_dump
from drivers.hardware import open_i2c, open_serial
from drivers.ports import I2cBus
from drivers.replay import RecordedBus
from logger.errors import BadInput
from logger.service import assemble
from logger.service.config import Config
from logger.service.core import Core
from logger.service.live import Deadlines, Listener, LiveService, gather, monotonic_us
from logger.service.notify import Notifier, watchdog_interval_s
from logger.service.observer import Observer
from logger.service.sources import Bma220Source, SerialSource, Source
from logger.service.supervisor import Supervisor
from logger.store.folder_lock import FolderLock
from logger.store.rotation import SegmentLog, next_session, repair
from logger.store.vehicle_file import read_vehicle
from logger.units import US_PER_S

SERIAL_WAIT_S = 0.5
LONGEST_BEAT_S = 2.0
log = logging.getLogger(__name__)


def serve(config: Config, stop: threading.Event) -> None:
    """Run the service until ``stop`` is set. Raises BadInput for wrong settings, OSError for a failing card."""
    _make(config.log.directory)
    with FolderLock(config.log.directory):
        _serve(config, stop)


def _serve(config: Config, stop: threading.Event) -> None:
    sensor = assemble.instrument(config.accelerometer)
    vehicle = read_vehicle(config.vehicle)
    directory = config.log.directory
    for repaired in repair(directory):
        log.info("repaired %s", repaired)
    session = next_session(directory)
    segment_log = SegmentLog(directory, session, assemble.sidecar(config, sensor, vehicle), config.log.max_file_bytes)
    recorder = _recorder(config, session)
    decoder = assemble.gps_decoder(config)
    pipeline = assemble.pipeline(config, sensor, vehicle)
    core = Core(sensor.decoder, decoder, pipeline, segment_log)
    events: deque[Event] = deque()
    deadlines = Deadlines(US_PER_S // (100 * sensor.oversample))
    accelerometer = Supervisor(_accelerometer(config), monotonic_us)
    gps = Supervisor(_serial("nmea", config.gps.port, config.gps.baud), monotonic_us)
    pace = deadlines.wait if config.accelerometer.driver == "bma220" else gather
    listeners = [Listener(accelerometer, events, pace), Listener(gps, events, gather)]
    counters = {"accelerometer": sensor.counters, "gps": lambda: asdict(decoder.counters)}
    observer = Observer(config, core, segment_log, pipeline, accelerometer, gps, counters, deadlines)
    notifier = Notifier()

    def beat(now_us: int) -> None:
        observer.write(now_us)
        if not any(listener.hangs(now_us) for listener in listeners):
            notifier.watchdog()
        notifier.status(observer.line())

    notifier.ready()
    log.info("logging to %s, session %05d", directory, session)
    beat_s = min(LONGEST_BEAT_S, watchdog_interval_s() or LONGEST_BEAT_S)
    LiveService(core, segment_log, recorder, listeners, events, config.log.sync_s, beat_s, beat).run(stop)
    notifier.stopping()
    observer.remove()
    log.info("stopped: %d rows written", core.rows)


def _make(directory: Path) -> None:
    """The folder of the logs. Raises BadInput where no folder can be or may be written to."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except (PermissionError, NotADirectoryError, FileExistsError) as error:
        raise BadInput(f"{directory}: expected a folder for the logs ({error.strerror})") from None
    if not os.access(directory, os.W_OK | os.X_OK):
        raise BadInput(f"{directory}: expected a folder that the service may write to")


def _recorder(config: Config, session: int) -> DumpWriter | None:
    if not config.log.record_dump:
        return None
    return DumpWriter(config.log.directory / f"{session:05d}.dump.gz", assemble.dump_header(config))


def _accelerometer(config: Config) -> Source:
    if config.accelerometer.driver == "pasco":
        return _serial("pasco", config.accelerometer.pasco.port, config.accelerometer.pasco.baud)
    settings = assemble.bma220_settings(config.accelerometer)
    return Bma220Source(_bus_opener(config.accelerometer.bma220.i2c_bus), settings, monotonic_us, time.sleep)


def _bus_opener(bus: int | Path) -> Callable[[], I2cBus]:
    if isinstance(bus, int):
        return lambda: open_i2c(bus)

    def play() -> I2cBus:
        with open_dump(bus) as reader:
            events = [event for event in reader if event.source == "bma220"]
        return RecordedBus.playing(events, monotonic_us)

    return play


def _serial(name: str, port: str, baud: int) -> SerialSource:
    return SerialSource(name, lambda: open_serial(port, baud), monotonic_us, SERIAL_WAIT_S)
