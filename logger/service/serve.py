"""The live service put together (devices, threads, log, status and watchdog), and what it reports of itself: a snapshot
for the status file, a line for systemd."""

import logging
import os
import shutil
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from drivers.accelerometers.accelerometer import SERIAL_WAIT_S
from drivers.disk import FileSystem
from drivers.hardware import Machine
from drivers.readings import GPS, Event
from drivers.sources import SerialSource
from logger.errors import BadInput
from logger.service import wiring
from logger.service.config import GRAVITY_TOLERANCE_G, Config
from logger.service.event_core import EventCore
from logger.service.learning import NoiseLearning, ReceiverLearning, delay_at_start, noise_at_start, read_delay
from logger.service.main_loop import PROGRESS_EVERY_US, Listener, MainLoop, monotonic_us
from logger.service.pipeline import Pipeline
from logger.service.signal_chain import Axis
from logger.service.status import SensorStatus, ServiceState, ServiceStatus, write_status
from logger.service.storage import Storage
from logger.service.supervisor import Supervisor
from logger.service.systemd_notify import Notifier, Stop, go_first, watchdog_interval_s
from logger.shipped import version
from logger.store.log.atomic_file import FolderLock
from logger.store.log.disk_quota import QuotaLimits, memory_notice
from logger.units import STANDARD_GRAVITY_MPS2, US_PER_S

RECENT_US = 15 * US_PER_S
LOOKS_WITHOUT_GRAVITY = 5
UNREADABLE_S = 10.0
_OTHER_UNITS = ((STANDARD_GRAVITY_MPS2, "it seems to send m/s2, and is read as g. Choose the profile lines_mps2"),
                (1 / STANDARD_GRAVITY_MPS2, "it seems to send g, and is read as m/s2. Choose the profile lines"),
                (1000.0, "it seems to send thousandths of g, and is read as g. Have it send g"))
"""What gravity comes to in another unit than is read [g]."""
log = logging.getLogger(__name__)


class StatusReporter:
    """Looks at the parts of the service and puts together what they say."""

    def __init__(self, config: Config, core: EventCore, storage: Storage, pipeline: Pipeline, accelerometer: Supervisor,
                 gps: Supervisor, counters: Mapping[str, Callable[[], dict[str, int]]], notices: tuple[str, ...] = (),
                 learning: ReceiverLearning | None = None, noise: NoiseLearning | None = None) -> None:
        self._config, self._core, self._storage, self._pipeline = config, core, storage, pipeline
        self._sensors = {"accelerometer": accelerometer, "gps": gps}
        self._counters = counters
        self._notices = notices
        self._learning, self._noise = learning, noise
        self._began_us = monotonic_us()
        self._logged_us = self._began_us
        self._state_since: dict[str, tuple[str, int]] = {}
        self._version = version()
        self._rows = 0
        self._row_us: int | None = None
        self._failed = False
        self._without_gravity = 0
        self._gravity_advice: str | None = None
        self._progress = {"accelerometer": ReadingProgress(), "gps": ReadingProgress()}
        self._started_anew_us = self._began_us

    def write(self, now_us: int) -> None:
        """Renew the status file; once a minute a line in the log."""
        if self._core.rows != self._rows:
            self._rows, self._row_us = self._core.rows, now_us
        try:
            write_status(self._config.status_file, self.snapshot(now_us))
            self._failed = False
        except OSError as error:
            if not self._failed:
                log.warning("status file %s: %s", self._config.status_file, error.strerror)
            self._failed = True
        self._look_at_gravity()
        self._look_at_stillness(now_us)
        if now_us - self._logged_us >= PROGRESS_EVERY_US:
            self._logged_us = now_us
            log.info("%s", self.line())

    def remove(self) -> None:
        """The service ends: its status goes with it."""
        with suppress(OSError):
            self._config.status_file.unlink(missing_ok=True)

    @property
    def rows_on_disk(self) -> int:
        """Rows of this service that are known to be on the disk: others wait for it, or were lost."""
        return self._core.rows - self._storage.log.waiting - self._storage.log.rows_lost

    def ending(self) -> str:
        """What became of all rows, once the storage is closed."""
        lost = self._storage.log.rows_lost
        why = f", {lost} lost: {self._storage.log.trouble or 'the disk did not take them in time'}" if lost else ""
        return f"stopped: {self.rows_on_disk} rows written{why}"

    def line(self) -> str:
        distance_km = self._pipeline.odometer.total_m / 1000.0
        sensors = ", ".join(f"{name} {part.state()}" for name, part in self._sensors.items())
        trouble = f", NOT WRITING: {self._storage.log.trouble}" if self._storage.log.trouble else ""
        return f"{sensors}, {self.rows_on_disk} rows, {distance_km:.1f} km{trouble}"

    def snapshot(self, now_us: int) -> ServiceStatus:
        """Everything that ``ridelog status`` shows."""
        fix = self._core.last_fix
        storage = self._storage.status()
        delay = self._learning.shown if self._learning is not None else None
        noise = self._noise.now if self._noise is not None else None
        place = self._config.accelerometer.kind.place(self._config.accelerometer.settings)
        return ServiceStatus(
            state=self._state(now_us),
            pid=os.getpid(),
            version=self._version,
            uptime_s=(now_us - self._began_us) / US_PER_S,
            updated_t_us=now_us,
            accelerometer=self._sensor("accelerometer", now_us, place, self._core.samples),
            gps=self._sensor("gps", now_us, self._config.gps.port, self._core.fixes),
            fix_valid=fix.valid if fix else None,
            satellites=fix.satellites if fix else None,
            utc_known=self._core.utc_known,
            log_directory=str(self._config.log.directory),
            current_file=self._storage.log.file_name,
            rows_written=self.rows_on_disk,
            distance_m=self._pipeline.odometer.total_m,
            free_bytes=_free_bytes(str(self._config.log.directory)),
            last_window=self._core.last_record,
            storage=storage,
            notices=(*self._notices, *(self._learning.notices() if self._learning is not None else ()),
                     *(f"accelerometer: {advice}" for advice in [self._pipeline.range_use.advice] if advice)),
            receiver_delay=self._learning.words() if self._learning is not None else "",
            receiver_delay_s=delay.delay_s if delay is not None else None,
            receiver_delay_std_s=delay.std_s if delay is not None else None,
            sensor_noise=self._noise.words() if self._noise is not None else "",
            sensor_noise_mps2=noise.belief.noise_rms_mps2 if noise is not None else None,
            sensor_noise_std_mps2=noise.belief.std_mps2 if noise is not None else None,
            counters={
                "missed_samples": self._sensors["accelerometer"].source.missed,
                "late_samples": self._pipeline.late_samples,
                "crowded_samples": self._pipeline.crowded_samples,
                "bad_events": self._core.bad_events,
                "time_jumps": self._pipeline.timebase.time_jumps,
                "rejected_fixes": self._pipeline.odometer.rejected_fixes,
                "fixes_without_speed": self._pipeline.odometer.fixes_without_speed,
            },
        )

    def _look_at_gravity(self) -> None:
        """Notice an accelerometer that does not feel the earth along the axis that is set to point up."""
        block = self._core.last_block
        if block is None:
            return
        felt_g = block.accel_mps2.mean(axis=0) / STANDARD_GRAVITY_MPS2
        word = self._config.accelerometer.vertical_axis
        up = Axis.from_word(word)
        if abs(up.sign * felt_g[up.column] - 1.0) <= GRAVITY_TOLERANCE_G:
            self._without_gravity, self._gravity_advice = 0, None
            return
        self._without_gravity += 1
        if self._without_gravity == LOOKS_WITHOUT_GRAVITY:
            axes = ", ".join(f"{name} {value:+.2f}" for name, value in zip("xyz", felt_g, strict=True))
            in_g = float(np.hypot.reduce(felt_g))
            near = GRAVITY_TOLERANCE_G / 2
            unit = next((words for ratio, words in _OTHER_UNITS if abs(in_g / ratio - 1) <= near), "")
            self._gravity_advice = (f"axis {word} does not feel 1 g ({axes} g): "
                                    f"{unit or 'check vertical_axis, range and mounting'}")
            log.warning("accelerometer: %s", self._gravity_advice)

    def _look_at_stillness(self, now_us: int) -> None:
        """Restart an accelerometer that drives and gives nothing new; not more than once a minute."""
        frozen_s = self._pipeline.stillness.frozen_s
        if frozen_s and now_us - self._started_anew_us >= PROGRESS_EVERY_US:
            self._started_anew_us = now_us
            log.warning("accelerometer: %s; restarting it", _frozen(frozen_s))
            self._sensors["accelerometer"].restart(_frozen(frozen_s))

    def _doubt(self, name: str, now_us: int, state: str, readings: int) -> str | None:
        """What is wrong with a sensor that speaks; None: nothing."""
        is_accelerometer = name == "accelerometer"
        unread_s = self._progress[name].unread_s(now_us, state == "ok", readings)
        reported = self._core.accelerometer_doubt if is_accelerometer else self._core.gps_doubt
        if state == "ok" and reported:
            return reported
        if unread_s >= UNREADABLE_S:
            decoder = self._core.accelerometer if is_accelerometer else self._core.gps
            return f"for {unread_s:.0f} s: {decoder.unread}"
        if state != "ok" or not is_accelerometer:
            return None
        frozen_s = self._pipeline.stillness.frozen_s
        return _frozen(frozen_s) if frozen_s else self._gravity_advice

    def _state(self, now_us: int) -> ServiceState:
        if not self._core.samples and not self._core.rows:
            return "starting"
        recent = self._row_us is not None and now_us - self._row_us < RECENT_US
        return "recording" if recent else "standing"

    def _sensor(self, name: str, now_us: int, place: str, readings: int) -> SensorStatus:
        part = self._sensors[name]
        state = part.state()
        doubt = self._doubt(name, now_us, state, readings)
        if doubt:
            state = "doubtful"
        if self._state_since.get(name, ("", 0))[0] != state:
            self._state_since[name] = (state, now_us)
        return SensorStatus(
            driver=part.name,
            place=place,
            state=state,
            since_s=(now_us - self._state_since[name][1]) / US_PER_S,
            last_error=doubt or part.error or None,
            readings=readings,
            note=part.source.note or (self._core.accelerometer.note if name == "accelerometer" else ""),
            counters={"faults": part.faults, "restarts": part.restarts, "settings_lost": part.settings_lost,
                      "dropped_readings": part.source.dropped, **self._counters[name]()},
        )


class ReadingProgress:
    """Do the bytes that arrive become readings?"""

    def __init__(self) -> None:
        self._readings = 0
        self._since_us: int | None = None

    def unread_s(self, now_us: int, speaks: bool, readings: int) -> float:
        """For how long none has [s]. ``speaks``: bytes arrive. ``readings``: how many there have been so far."""
        if not speaks or readings != self._readings or self._since_us is None:
            self._since_us, self._readings = now_us, readings
        return (now_us - self._since_us) / US_PER_S


def _frozen(seconds: float) -> str:
    return (f"the car drives, and the readings have not changed at all for {seconds:.0f} s: the sensor has frozen; "
            "check its wires, and its mounting if a restart changes nothing")


def _free_bytes(directory: str) -> int | None:
    try:
        return shutil.disk_usage(directory).free
    except OSError:
        return None


LONGEST_BEAT_S = 2.0


def serve(config: Config, stop: Stop) -> None:
    """Run the service until ``stop`` is set. Raises BadInput for wrong settings, OSError where no folder can be."""
    go_first()
    make_log_folder(config.log.directory)
    with FolderLock(config.log.directory):
        _serve(config, stop)


def _serve(config: Config, stop: Stop) -> None:
    noise = noise_at_start(config.log.directory, config.accelerometer)
    sensor = wiring.instrument(config.accelerometer, noise)
    model = wiring.car_of(config)
    learned = read_delay(config.log.directory)
    receiver_delay = delay_at_start(config.gps, learned)
    facts = wiring.sidecar(config, sensor, model, receiver_delay, noise)
    header = wiring.dump_header(config, receiver_delay, noise) if config.log.record_dump else None
    limits = QuotaLimits(config.log.quota_bytes, config.log.keep_free_bytes)
    pipeline = wiring.pipeline(config, sensor, model, receiver_delay)
    storage = Storage(config.log.directory, facts, config.log.max_file_bytes, header, limits, monotonic_us,
                      pairing=config.pairing, more=pipeline.sidecar)
    decoder = wiring.gps_decoder(config)
    delay_learning = ReceiverLearning(config.log.directory, pipeline.alignment, receiver_delay, learned)
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
    counters = {"accelerometer": lambda: sensor.decoder.counts, "gps": lambda: decoder.counts}
    notices = tuple(filter(None, (*wiring.notices(config, model, sensor), memory_notice(config.log.directory))))
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
