"""The live service put together: devices, threads, log, status and watchdog."""

from __future__ import annotations

import logging
import os
import time
from collections import deque
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from drivers.accelerometers.accelerometer import SERIAL_WAIT_S
from drivers.disk import FileSystem
from drivers.hardware import Machine
from drivers.readings import GPS, Event
from drivers.sources import SerialSource
from logger.errors import BadInput
from logger.service import noise_learning, wiring
from logger.service.config import Config
from logger.service.event_core import EventCore
from logger.service.listener import Listener, monotonic_us
from logger.service.main_loop import MainLoop
from logger.service.noise_learning import NoiseLearning
from logger.service.receiver_learning import ReceiverLearning, at_start, read_learnt
from logger.service.scheduling import go_first
from logger.service.shutdown_signals import Stop
from logger.service.status_reporter import StatusReporter
from logger.service.storage import Storage
from logger.service.supervisor import Supervisor
from logger.service.systemd_notify import Notifier, watchdog_interval_s
from logger.store.formats.vehicle_file import read_on_board
from logger.store.log.atomic_file import FolderLock
from logger.store.log.disk_quota import QuotaLimits, memory_notice

LONGEST_BEAT_S = 2.0
log = logging.getLogger(__name__)


def serve(config: Config, stop: Stop) -> None:
    """Run the service until ``stop`` is set. Raises BadInput for wrong settings, OSError where no folder can be."""
    go_first()
    make_log_folder(config.log.directory)
    with FolderLock(config.log.directory):
        _serve(config, stop)


def _serve(config: Config, stop: Stop) -> None:
    noise = noise_learning.at_start(config.log.directory, config.accelerometer)
    sensor = wiring.instrument(config.accelerometer, noise)
    model = read_on_board(config.vehicle)
    learnt = read_learnt(config.log.directory)
    receiver_delay = at_start(config.gps, learnt)
    facts = wiring.sidecar(config, sensor, model, receiver_delay, noise)
    header = wiring.dump_header(config, receiver_delay, noise) if config.log.record_dump else None
    limits = QuotaLimits(config.log.quota_bytes, config.log.keep_free_bytes)
    storage = Storage(config.log.directory, facts, config.log.max_file_bytes, header, limits, monotonic_us,
                      pairing=config.pairing)
    decoder = wiring.gps_decoder(config)
    pipeline = wiring.pipeline(config, sensor, model, receiver_delay)
    delay_learning = ReceiverLearning(config.log.directory, pipeline.alignment, receiver_delay, learnt)
    sensor_learning = NoiseLearning(config.log.directory, pipeline, config.accelerometer, noise)
    core = EventCore(sensor.decoder, decoder, pipeline, storage.log)
    events: deque[Event] = deque()
    machine = Machine(monotonic_us, time.sleep)
    receiver = SerialSource(GPS, lambda: machine.open_serial(config.gps.port, config.gps.baud), monotonic_us,
                            SERIAL_WAIT_S)
    sources = [config.accelerometer.kind.source(config.accelerometer.settings, machine), receiver]
    accelerometer, gps = (Supervisor(source, monotonic_us) for source in sources)
    listeners = [Listener(part, events, source.rest)
                 for part, source in zip((accelerometer, gps), sources, strict=True)]
    counters = {"accelerometer": lambda: sensor.decoder.counts, "gps": lambda: asdict(decoder.counters)}
    notices = tuple(filter(None, (*wiring.notices(model.vehicle), memory_notice(config.log.directory))))
    for notice in notices:
        log.warning("%s", notice)
    observer = StatusReporter(config, core, storage, pipeline, accelerometer, gps, counters, notices, delay_learning,
                              sensor_learning)
    notifier = Notifier()

    def beat(now_us: int) -> None:
        observer.write(now_us)
        delay_learning.tend(now_us)
        sensor_learning.tend(now_us)
        if not any(listener.hangs(now_us) for listener in listeners):
            notifier.watchdog()
        notifier.status(observer.line())

    notifier.ready()
    beat_s = min(LONGEST_BEAT_S, watchdog_interval_s() or LONGEST_BEAT_S)
    MainLoop(core, storage, listeners, events, config.log.sync_s, beat_s, beat).run(stop)
    notifier.stopping()
    notifier.status(observer.ending())
    delay_learning.save()
    sensor_learning.save()
    observer.remove()
    log.log(logging.ERROR if storage.log.rows_lost else logging.INFO, "%s", observer.ending())


def make_log_folder(directory: Path) -> None:
    """Make the folder of the logs, on the disk before anything in it is. Raises BadInput where none can be made, or
    written to."""
    try:
        missing = [folder for folder in (directory, *directory.parents) if not folder.exists()]
        directory.mkdir(parents=True, exist_ok=True)
        for folder in reversed(missing):
            with suppress(OSError):  # it is no reason to log nothing
                FileSystem().sync_directory(folder.parent)
    except (PermissionError, NotADirectoryError, FileExistsError) as error:
        raise BadInput(f"{directory}: expected a folder for the logs ({error.strerror})") from None
    # one that is mounted read-only is no wrong setting, and may pass
    if not (os.access(directory, os.W_OK | os.X_OK) or FileSystem().is_read_only(directory)):
        raise BadInput(f"{directory}: expected a folder that the service may write to")
