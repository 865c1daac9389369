"""What goes wrong with sensors and their wires: through the service's own sources, supervisors, core and observer, on
buses and ports that misbehave, in time that a trial lets pass."""

from __future__ import annotations

import errno
import math
import random
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache
from itertools import product
from pathlib import Path
from unittest.mock import patch

import numpy as np

from drivers.accelerometers.bma220 import (
    AXES,
    CHIP_ID,
    FILTER,
    RANGE,
    RANGE_CODES,
    WATCHDOG,
    Bma220Chip,
    Bma220Config,
    chip_source,
)
from drivers.dump import DumpHeader, Event
from drivers.errors import NotPresent
from drivers.sources import SerialSource, Source
from logger.commands.status import advice
from logger.records import WindowRecord
from logger.service import wiring
from logger.service.config import AccelerometerConfig, Config
from logger.service.doubted_spans import FROZEN_S
from logger.service.event_core import EventCore
from logger.service.main_loop import HANG_US, Listener, MainLoop, monotonic_us
from logger.service.serve import StatusReporter
from logger.service.status import ServiceStatus
from logger.service.storage import Storage
from logger.service.supervisor import Supervisor
from logger.service.timebase import LASTING_US
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model
from logger.store.log.disk_quota import QuotaLimits
from logger.store.log.log_writer import LONGEST_WAIT_US
from logger.store.log.row_format import read_log

from ..drives.replay import Rows, parts_for
from ..recorded_wires import Cue, Fault, RecordedBus, RecordedPort, WithoutWatchdog
from .trials import Found, Hazard, found

STEP_US = 10_000
NOON = datetime(2026, 6, 15, 12, 0, 0, tzinfo=UTC)
BEGIN_US = 1_000_000_000


def checked(text: str) -> bytes:
    total = 0
    for byte in text.encode():
        total ^= byte
    return f"${text}*{total:02X}\r\n".encode()


def epoch(second: float, speed_mps: float, travelled_m: float, when: datetime | None = None, fix: bool = True) -> bytes:
    """What a receiver sends in a second."""
    utc = (when or NOON) + timedelta(seconds=second)
    if not fix:
        return checked("GPRMC,,V,,,,,,,,,,N") + checked("GPGGA,,,,,,0,00,99.99,,,,,,")
    minutes = 60 * (46.0 + travelled_m / 111_195.0 - 46)
    place = f"46{minutes:08.5f},N,00630.00000,E"
    return checked(f"GPRMC,{utc:%H%M%S}.00,A,{place},{speed_mps * 3600 / 1852:.3f},0.0,{utc:%d%m%y},,,A")


class Bus(RecordedBus):
    """A recorded bus on which transfers may fail at random, and failing ones take their time."""

    def __init__(self, clock: Clock, cues: list[Cue]) -> None:
        super().__init__(Bma220Chip(), cues, clock)
        self.clock = clock
        self.loss = 0.0
        self.rng = random.Random(3)
        self.timeout_us = 1_000_000

    def _transfer(self, i2c_addr: int, read_register: int | None) -> None:
        if self.rng.random() < self.loss:
            raise OSError(errno.EREMOTEIO, "not acknowledged")
        try:
            super()._transfer(i2c_addr, read_register)
        except OSError as error:
            self.clock.now_us += self.timeout_us if error.errno == errno.ETIMEDOUT else 0
            raise


class Port(RecordedPort):
    """A recorded port that cannot be opened while it is unplugged, and is well as soon as it can be."""

    def opened(self) -> Port:
        with suppress(OSError):
            self._cue()
        self.close()
        if self._gone:
            raise NotPresent("no such port")
        return self


class Clock:
    """Time that passes when it is stepped. It never goes back."""

    def __init__(self) -> None:
        self.now_us = monotonic_us()

    def __call__(self) -> int:
        return self.now_us


class Car:
    """The service in a car, with a chip on a bus (or a serial sensor) and a receiver on a port.

    sample      gives the bytes of the accelerometer at a time [s since the start]
    receiver    gives the bytes of the receiver in a second of that time
    """

    def __init__(self, folder: Path, bus_cues: list[Cue] | None = None, port_cues: list[Cue] | None = None,
                 serial: bool = False, settings: Bma220Config | None = None) -> None:
        self.clock = Clock()
        self.begin_us = self.clock.now_us
        self.bus = Bus(self.clock, self._later(bus_cues))
        self.port = Port(self._later(port_cues), self.clock)
        self.lines = RecordedPort()
        self.rng = random.Random(1)
        self.sample: Callable[[float], bytes] = self.rough_road
        self.speed_mps = 12.0
        self.travelled_m = self.swing = 0.0
        self.receiver: Callable[[float], bytes] = lambda s: epoch(s, self.speed_mps, self.travelled_m)
        folder.mkdir(exist_ok=True)
        config = Config(status_file=folder / "status.json", vehicle=vehicle_file("rav4-2009"))
        settings = settings or Bma220Config(oversample=1)
        if serial:
            config = replace(config, accelerometer=AccelerometerConfig("pasco", "+z"))
        else:
            config = replace(config, accelerometer=AccelerometerConfig(
                sections=AccelerometerConfig().sections | {"bma220": settings}))
        self.config = replace(config, log=replace(config.log, directory=folder))
        sensor = wiring.instrument(self.config.accelerometer)
        vehicle = wiring.car_of(self.config, read_model)
        self.storage = Storage(folder, {}, 4_000_000, None, QuotaLimits(), self.clock)
        self.decoder = wiring.gps_decoder(self.config)
        self.pipeline = wiring.pipeline(self.config, sensor, vehicle)
        self.rows = Rows()
        self.core = EventCore(sensor.decoder, self.decoder, self.pipeline, self.rows)
        source: Source = SerialSource("pasco", lambda: self.lines, self.clock, 0.0) if serial else chip_source(
            lambda: self.bus, settings, self.clock, lambda seconds: None)
        self.accelerometer = Supervisor(source, self.clock)
        self.gps = Supervisor(SerialSource("nmea", self.port.opened, self.clock, 0.0), self.clock)
        counters = {"accelerometer": lambda: sensor.decoder.counts, "gps": dict}
        self.observer = StatusReporter(self.config, self.core, self.storage, self.pipeline, self.accelerometer,
                                       self.gps, counters)
        events: deque[Event] = deque()
        self.listeners = [Listener(part, events, lambda: None) for part in (self.accelerometer, self.gps)]
        self.service = MainLoop(self.core, self.storage, self.listeners, events, 1.0, 1.0, lambda now_us: None)
        self.heard_us: list[int] = []
        self.core.feed = self._heard  # type: ignore[method-assign]
        self.longest_step_us = 0
        self._second = -1

    def _later(self, cues: list[Cue] | None) -> list[Cue]:
        return [replace(cue, at_us=self.begin_us + cue.at_us) if cue.at_us is not None else cue for cue in cues or []]

    @property
    def now_s(self) -> float:
        return (self.clock.now_us - self.begin_us) / 1e6

    def _heard(self, event: Event) -> None:
        if event.source != "nmea":
            self.heard_us.append(event.t_us)
        EventCore.feed(self.core, event)

    def rough_road(self, second: float) -> bytes:
        """A body that swings as on a road of some 5 m/km: white noise has no IRI, and takes twice as long to judge."""
        self.swing = 0.9 * self.swing + self.rng.gauss(0.0, 0.3)
        return bytes((0, 4 * self.rng.randrange(2), 4 * (16 + round(self.swing))))

    def drive(self, seconds: float) -> ServiceStatus:
        """Let time pass; give the status at its end."""
        until_us = self.clock.now_us + round(seconds * 1e6)
        while self.clock.now_us < until_us:
            self._tick()
        return self.observer.snapshot(self.clock.now_us)

    def _tick(self) -> None:
        began_us = self.clock.now_us
        data = self.sample(self.now_s)
        if self.config.accelerometer.driver == "bma220":
            self.bus.load(data)
        else:
            self.lines.load(data)
        if int(self.now_s) > self._second:
            self._second = int(self.now_s)
            self.travelled_m += self.speed_mps
            self.port.load(self.receiver(self._second))
            self.observer.write(self.clock.now_us)
        for listener in self.listeners:
            listener.look()
        self.service.move(self.clock.now_us)
        self.longest_step_us = max(self.longest_step_us, self.clock.now_us - began_us)
        self.clock.now_us += STEP_US

    def flags(self) -> set[str]:
        """Of all rows so far."""
        return {flag for record in self.rows.records for flag in record.flags}


def heard_after(car: Car, second: float) -> float:
    """When the first sample after a time came [s]."""
    return next((t_us - car.begin_us) / 1e6 for t_us in car.heard_us if t_us >= car.begin_us + second * 1e6)


def accelerometer_unplugged(folder: Path, seed: int) -> Found:
    rng = random.Random(seed)
    out_s, out_for_s = rng.uniform(8, 15), rng.uniform(0.3, 40)
    back_s = out_s + out_for_s
    car = Car(folder, [Cue(Fault.UNPLUG, at_us=round(out_s * 1e6)), Cue(Fault.REPLUG, at_us=round(back_s * 1e6))])
    assert car.drive(out_s - 0.1).accelerometer.state == "ok"
    reported = ""
    if out_for_s > 1:
        away = car.drive(out_for_s)
        assert away.accelerometer.state == "retrying"
        reported, *_ = advice(away)
        assert "nothing answers" in reported
        assert away.gps.state == "ok"
    status = car.drive(max(out_for_s, 3) + 14)
    assert status.accelerometer.state == "ok"
    waited_s = heard_after(car, back_s) - back_s
    assert waited_s < min(LONGEST_WAIT_US / 1e6, out_for_s + 1.5)
    assert car.bus.chip.watchdog_on
    assert "gap" in car.flags()
    assert all(record.distance_start_m is not None or "gps_lost" in record.flags for record in car.rows.records)
    return found(reported=reported, waited_s=waited_s)


def receiver_unplugged(folder: Path, seed: int) -> Found:
    rng = random.Random(seed)
    out_s, out_for_s = rng.uniform(8, 12), rng.uniform(2, 30)
    cues = [Cue(Fault.UNPLUG, at_us=round(out_s * 1e6)), Cue(Fault.REPLUG, at_us=round((out_s + out_for_s) * 1e6))]
    car = Car(folder, port_cues=cues)
    away = car.drive(out_s + out_for_s - 0.1)
    assert away.gps.state == "retrying"
    assert away.accelerometer.state == "ok"
    reported, *_ = advice(away)
    status = car.drive(out_for_s + 12)
    assert status.gps.state == "ok"
    assert status.fix_valid
    assert "gps_lost" in car.flags()
    heard_share = len(car.heard_us) / (100 * car.now_s)
    assert abs(heard_share - 1) < 0.02
    return found(reported=reported, heard_percent=100 * heard_share)


def another_chip(folder: Path, identity: int) -> Found:
    car = Car(folder)
    car.bus.chip.stuck = {CHIP_ID.address: identity}
    status = car.drive(20)
    assert (status.accelerometer.state, status.accelerometer.readings) == ("absent", 0)
    reported, *_ = advice(status)
    assert f"has id 0x{identity:02X}, a BMA220 has 0xDD" in reported
    car.bus.chip.stuck = {}
    assert car.drive(31).accelerometer.state == "ok"
    return found(reported=reported)


def garbled(data: bytes, rng: random.Random) -> bytes:
    """Text as a port of another baud rate sees it."""
    return bytes(rng.choice((0x00, 0x80, 0xF8, 0xFE, 0xE6, byte ^ rng.randrange(256))) for byte in data)


def receiver_with_wrong_baud_rate(folder: Path, seed: int) -> Found:
    car = Car(folder)
    car.rng = random.Random(seed)
    good = car.receiver
    car.receiver = lambda second: garbled(good(second), car.rng)
    status = car.drive(25)
    assert (status.gps.state, status.gps.readings, status.utc_known) == ("doubtful", 0, False)
    reported = " ".join(advice(status))
    assert "check the baud rate" in reported
    assert all(record.lat_deg is None for record in car.rows.records)
    car.receiver = good
    status = car.drive(5)
    assert status.gps.state == "ok"
    return found(reported=reported)


def another_device(folder: Path, kind: str) -> Found:
    car = Car(folder, serial=True)
    lines = lambda second: b"0.01,0.02,%.3f\r\n" % (1 + 0.1 * car.rng.random())  # noqa: E731
    car.sample = lines
    if kind == "sensor on the receiver's port":
        car.receiver = lambda second: lines(second) * 20
    elif kind == "receiver on the sensor's port":
        car.sample = lambda second: epoch(second, 10, 0) if int(second * 100) % 50 == 0 else b""
    else:
        car.sample = lambda second: garbled(lines(second), car.rng)
    status = car.drive(25)
    wrong, right = (status.gps, status.accelerometer) if kind.startswith("sensor") else (status.accelerometer,
                                                                                         status.gps)
    assert (wrong.state, wrong.readings) == ("doubtful", 0)
    assert (right.state, right.readings > 10) == ("ok", True)
    reported = " ".join(advice(status))
    assert ("no other device" if kind == "wrong baud rate" else "ports may be swapped") in reported
    return found(reported=reported)


def settings_lost(folder: Path, case: tuple[int, str]) -> Found:
    """A chip whose readings follow its registers, as a real one's do. What it says under others than were written to
    it must not come near a row."""
    range_g, loss = case
    lost_s = 20.003
    car = Car(folder, settings=Bma220Config(range_g=range_g, oversample=1))
    wrong_us: list[int] = []
    right: dict[int, int] = {}

    def sample(second: float) -> bytes:
        if second > 1 and not right:
            right.update(car.bus.chip.registers)
        if second >= lost_s and not wrong_us:
            lose(car.bus.chip, loss)
        if right and car.bus.chip.registers != right:
            wrong_us.append(car.clock.now_us)
        codes = {code: full_g for full_g, code in RANGE_CODES.items()}
        counts_per_g = 32 / codes[car.bus.chip.registers[RANGE.address] & 3]
        felt_g = 1 + 0.3 * math.sin(40 * second) + 0.1 * math.sin(9 * second)
        return bytes((0, 0, 4 * max(-32, min(31, round(counts_per_g * felt_g))) & 0xFF))

    car.sample = sample
    car.drive(lost_s - 0.5)
    status = car.drive(20)
    restored_s = (wrong_us[-1] - wrong_us[0]) / 1e6
    assert restored_s < 1
    assert not set(car.heard_us) & set(wrong_us)
    assert status.accelerometer.state == "ok"
    assert car.accelerometer.restarts == 1
    reported = " ".join(advice(status))
    assert "lost its settings" in reported
    doubtful = [record for record in car.rows.records
                if record.t_us <= wrong_us[-1] and wrong_us[0] <= record.t_us + record.duration_s * 1e6]
    assert doubtful
    assert all("gap" in record.flags for record in doubtful)
    heard = np.array(car.heard_us)
    unheard_s = float(np.diff(heard[heard > car.begin_us + 1e6]).max()) / 1e6
    assert unheard_s < 1
    after = [record for record in car.rows.records if record.t_us > wrong_us[-1]]
    assert len(after) > 5
    usual = np.median([record.accel_rms_mps2 for record in car.rows.records if record.t_us < wrong_us[0]
                       and record.accel_rms_mps2 is not None])
    assert all(abs(record.accel_rms_mps2 / usual - 1) < 0.15 for record in car.rows.records
               if record.accel_rms_mps2 is not None)
    return found(reported=reported, unheard_s=unheard_s)


def lose(chip: Bma220Chip, loss: str) -> None:
    """Settings go, without a word."""
    if loss == "brown-out":
        chip.lose_power()
    elif loss == "range and filter":
        chip.registers |= {RANGE.address: 3, FILTER.address: 0}
    else:
        register = {"range": RANGE, "filter": FILTER, "axes": AXES, "watchdog": WATCHDOG}[loss]
        chip.registers |= {register.address: 1 if loss == "range" else 0}


def bus_held_low(folder: Path, has_watchdog: bool) -> Found:
    """Every transfer takes a second to time out. The chip's own watchdog frees the bus; without it, a power cycle."""
    cues = [Cue(Fault.STUCK_LOW, at_us=10_000_000), Cue(Fault.REPLUG, at_us=70_000_000)]
    car = Car(folder, cues)
    car.bus.chip = car.bus.chip if has_watchdog else WithoutWatchdog(car.bus.chip.sample)
    car.drive(10)
    status = car.drive(50)
    assert car.longest_step_us < HANG_US
    assert status.gps.state == "ok"
    assert status.rows_written > 20
    reported = ""
    if has_watchdog:
        assert status.accelerometer.state == "ok"
        assert heard_after(car, 10.0) < 13
    else:
        assert status.accelerometer.state == "retrying"
        reported, *_ = advice(status)
        assert "the bus is held low" in reported
        assert car.drive(45).accelerometer.state == "ok"
    assert car.bus.chip.watchdog_on is has_watchdog
    return found(reported=reported, step_s=car.longest_step_us / 1e6)


def refused_transfers(folder: Path, loss: float) -> Found:
    car = Car(folder)
    car.drive(5)
    car.bus.loss = loss
    car.drive(30)
    heard = len([t_us for t_us in car.heard_us if t_us > car.begin_us + 5_000_000])
    if loss <= 0.3:
        assert heard > 3000 * (1 - loss) * 0.9
    car.bus.loss = 0.0
    storm_end_s = car.now_s
    status = car.drive(35)
    assert status.accelerometer.state == "ok"
    waited_s = heard_after(car, storm_end_s) - storm_end_s
    assert waited_s <= LONGEST_WAIT_US / 1e6 + 0.1
    assert car.longest_step_us < HANG_US
    assert car.bus.chip.running
    return found(waited_s=waited_s)


def figures_of(record: WindowRecord) -> list[float | str | None]:
    """All that the accelerometer says of a window; None where it says nothing."""
    return [None if figure == "" else figure for figure in (
        record.iri_m_per_km, record.iri_std_m_per_km, record.iri_rms_m_per_km, record.iri_class, record.a_w_mps2,
        record.mtvv_mps2, record.vdv_mps175, record.crest_factor, record.comfort, record.accel_rms_mps2)]


def frozen_chip(folder: Path, level: int) -> Found:
    car = Car(folder)
    car.drive(40)
    restarts = car.accelerometer.restarts
    car.sample = lambda second: bytes((0, 0, 4 * level))
    status = car.drive(FROZEN_S - 3)
    assert status.accelerometer.state == "ok"
    status = car.drive(45)
    assert status.accelerometer.state == "doubtful"
    reported, *_ = advice(status)
    assert "not changed at all" in reported
    assert car.accelerometer.restarts > restarts
    late = [record for record in car.rows.records if record.t_us > car.begin_us + (40 + FROZEN_S + 2) * 1e6]
    assert len(late) > 30
    assert all("frozen" in record.flags for record in late)
    figures = [figure for record in car.rows.records if "frozen" in record.flags for figure in figures_of(record)]
    assert figures == [None] * len(figures)
    car.sample = car.rough_road
    status = car.drive(20)
    assert status.accelerometer.state == "ok"
    assert "frozen" not in car.rows.records[-1].flags
    return found(reported=reported, rows=len(late))


def parked(folder: Path, receiver: str) -> Found:
    car = Car(folder)
    car.sample = lambda second: bytes((0, 0, 4 * 17))
    car.speed_mps = 1.2 if receiver == "drifts at a walking pace" else 0.0
    if receiver == "no fix":
        car.receiver = lambda second: epoch(second, 0, 0, fix=False)
    status = car.drive(90)
    assert status.accelerometer.state == "ok"
    assert status.accelerometer.last_error is None
    assert car.accelerometer.restarts == 0
    assert "frozen" not in car.flags()
    car.speed_mps, car.sample = 10.0, car.rough_road
    car.receiver = lambda second: epoch(second, car.speed_mps, car.travelled_m)
    assert car.drive(40).accelerometer.state == "ok"
    assert "frozen" not in car.flags()
    return found()


def saturated(folder: Path, level: int) -> Found:
    car = Car(folder)
    car.sample = lambda second: bytes((0, 4 * car.rng.randrange(2), 4 * level & 0xFF))
    status = car.drive(30)
    assert status.accelerometer.state == "doubtful"
    reported, *_ = advice(status)
    assert "does not feel 1 g" in reported
    placed = [record for record in car.rows.records if record.samples]
    assert len(placed) > 10
    assert all("clipped" in record.flags for record in placed)
    return found(reported=reported, rows=len(placed))


def peaks_beyond_the_range(folder: Path, at_s: float) -> Found:
    car = Car(folder)
    car.sample = lambda second: bytes((0, 0, 4 * 31)) if at_s < second < at_s + 0.1 else car.rough_road(second)
    status = car.drive(at_s + 15)
    assert status.accelerometer.state == "ok"
    clipped = [record for record in car.rows.records if "clipped" in record.flags]
    assert 1 <= len(clipped) <= 3
    assert sum(record.clipped_samples for record in clipped) in range(8, 13)
    return found(rows=len(clipped))


def hour_without_fix(folder: Path, case: None) -> Found:
    """Rows go on, in constant memory, and are blind; with the fix the distance goes on where it was."""
    core, rows, pipeline = parts_for(DumpHeader(None, {"driver": "bma220", "range_g": 2}, {}, "rav4-2009"))
    rng = random.Random(2)
    waiting = []
    for second in range(3720):
        t_us = BEGIN_US + second * 1_000_000
        core.feed(Event(t_us, "nmea", epoch(second, 12, 12 * second, fix=not 30 <= second < 3630)))
        for tick in range(100):
            core.feed(Event(t_us + tick * STEP_US, "bma220", bytes((0, 0, 4 * (16 + rng.randrange(-2, 3))))))
        waiting.append(pipeline.waiting_samples)
    core.finish()
    lost = [record for record in rows.records if 50 < (record.t_us - BEGIN_US) / 1e6 < 3620]
    assert abs(len(lost) - 3570 / 5) <= 3
    assert all({"blind", "gps_lost"} <= set(record.flags) and record.lat_deg is None for record in lost)
    assert all(record.a_w_mps2 is not None and record.iri_m_per_km is None for record in lost)
    assert all(record.utc_us is not None for record in lost)
    after = [record for record in rows.records if (record.t_us - BEGIN_US) / 1e6 > 3640]
    assert len(after) > 80
    assert all(record.lat_deg is not None for record in after)
    assert max(waiting) < 2500
    return found(rows=len(lost))


def dated_rows(jump: Callable[[int], timedelta], seconds: int) -> tuple[Rows, int]:
    """Rows, and how often the date was found to have jumped."""
    core, rows, pipeline = parts_for(DumpHeader(None, {"driver": "bma220", "range_g": 2}, {}, "rav4-2009"))
    rng = random.Random(2)
    for second in range(seconds):
        t_us = BEGIN_US + second * 1_000_000
        core.feed(Event(t_us, "nmea", epoch(second, 12, 12 * second, NOON + jump(second))))
        for tick in range(100):
            core.feed(Event(t_us + tick * STEP_US, "bma220", bytes((0, 0, 4 * (16 + rng.randrange(-2, 3))))))
    core.finish()
    return rows, pipeline.timebase.time_jumps


@cache
def straight_rows(seconds: int) -> Rows:
    """With dates that do not jump."""
    return dated_rows(lambda second: timedelta(), seconds)[0]


def date_jumps_for_seconds(folder: Path, case: tuple[timedelta, int]) -> Found:
    jump, lasts_s = case
    rows, jumps = dated_rows(lambda second: jump if 30 <= second < 30 + lasts_s else timedelta(), 60)
    assert rows.records == straight_rows(60).records
    assert jumps == 0
    return found(rows=len(rows.records))


def date_jumps_for_good(folder: Path, jump: timedelta) -> Found:
    straight = straight_rows(100)
    rows, jumps = dated_rows(lambda second: jump if second >= 30 else timedelta(), 100)
    assert [replace(record, utc_us=None) for record in rows.records] == [
        replace(record, utc_us=None) for record in straight.records]
    week_us = round(jump.total_seconds() * 1e6)
    moved = [(new.t_us - BEGIN_US, new.utc_us - old.utc_us) for new, old in zip(rows.records, straight.records,
                                                                            strict=True) if old.utc_us is not None]
    assert {by for _, by in moved} == {0, week_us}
    first_us = min(t_us for t_us, by in moved if by)
    assert first_us + 30_000_000 > 15_000_000 + LASTING_US
    assert first_us < 30_000_000 + LASTING_US + 2_000_000
    assert jumps == 1
    return found(after_s=first_us / 1e6 - 30)


def system_clock_set_back(folder: Path, days: int) -> Found:
    """The service writes the same rows to the same file, and its status is fresh."""
    straight = Car(folder / "straight")
    straight.drive(60)
    car = Car(folder / "set back")
    car.drive(30)
    wall_s = time.time() - days * 86400
    with patch.object(time, "time", lambda: wall_s), patch.object(time, "time_ns", lambda: int(wall_s * 1e9)):
        status = car.drive(30)
    texts = [[replace(record, t_us=record.t_us - car.begin_us, utc_us=None) for record in car.rows.records]
             for car in (straight, car)]
    assert texts[0] == texts[1]
    assert status.updated_t_us == car.clock.now_us
    for record in car.rows.records:
        car.storage.log.append(record)
    car.storage.close()
    (path,) = (folder / "set back").glob("*.csv")
    assert len(read_log(path).records) == len(car.rows.records)
    return found(rows=len(texts[0]))


WEEK = timedelta(days=7)
HAZARDS = (
    Hazard("accelerometer unplugged for 0.3 to 40 s", "no chip answers on the bus, from a random time on",
           "GPS goes on; back within 30 s after the cable is, with the hole marked `gap`; `status` names the wires",
           "back after {waited_s.least:.1f} to {waited_s.most:.1f} s", accelerometer_unplugged, range(60), 3),
    Hazard("GPS unplugged for 2 to 30 s", "the port fails, then cannot be opened",
           "no sample of the accelerometer is lost; rows are marked `gps_lost`; the fix is taken up again",
           "{heard_percent.least:.1f} % of samples heard, or more", receiver_unplugged, range(40), 2),
    Hazard("another chip at the address", "its identity register holds something else",
           "no sample is taken; both identities are named; the right chip is found within 31 s", "as promised",
           another_chip, (0xE5, 0x00, 0xFF, 0x33)),
    Hazard("GPS at a wrong baud rate", "every byte comes out as another",
           "no reading, no time, no place; `status` says to check the baud rate; right again within 5 s", "as promised",
           receiver_with_wrong_baud_rate, range(10), 1),
    Hazard("another device on a port", "receiver on the sensor's port, sensor on the receiver's, garbled lines",
           "no reading is made of it; the other sensor goes on; `status` says so", "as promised", another_device,
           ("receiver on the sensor's port", "sensor on the receiver's port", "wrong baud rate")),
    Hazard("accelerometer loses its settings", "a brown-out, or registers that change: the readings go on, "
           "2 to 8 times too large or too small, or with no filter",
           "no such reading is taken; restarted within a second; the rows in it are flagged `gap`; `status` says so",
           "{unheard_s.most:.2f} s of readings left out, or less", settings_lost,
           ((4, "brown-out"), (2, "brown-out"), (2, "range and filter"), (2, "range"), (2, "filter"), (2, "axes"),
            (2, "watchdog"))),
    Hazard("I2C bus held low", "every transfer times out after a second; with the chip's watchdog and without",
           f"the GPS and the rows go on, no step takes {HANG_US / 1e6:g} s; with its watchdog the chip is back within "
           "3 s, without it after a power cycle, and `status` says what is held low",
           "longest step {step_s.most:.1f} s", bus_held_low, (True, False)),
    Hazard("storm of refused transfers", "5 to 99 % of transfers are not acknowledged, for 30 s",
           "only the samples that are hit are lost (up to 30 %); back within 30 s after the storm",
           "back after {waited_s.most:.1f} s or less", refused_transfers, (0.05, 0.3, 0.6, 0.9, 0.99)),
    Hazard("frozen accelerometer", "one and the same reading while the car drives",
           f"reported after {FROZEN_S:g} s; from then on rows are flagged `frozen`, without IRI and comfort; the chip "
           "is restarted; well again by itself",
           "{rows.total:.0f} rows, all flagged, none with a figure", frozen_chip, (17, 15, 16), 1),
    Hazard("parked car", "one and the same reading while the car stands, has no fix or drifts",
           "never taken for a frozen sensor", "as promised", parked,
           ("stands", "no fix", "drifts at a walking pace")),
    Hazard("saturated accelerometer", "every reading at an end of the range",
           "every row is flagged `clipped`; `status` says that it does not feel 1 g",
           "{rows.total:.0f} rows, all flagged", saturated, (31, -32)),
    Hazard("peaks beyond the range", "a tenth of a second at the end of the range",
           "flagged `clipped` where it was and nowhere else", "{rows.least:.0f} to {rows.most:.0f} rows flagged each",
           peaks_beyond_the_range, (20.2, 23.5, 27.7, 31.1), 1),
    Hazard("an hour without a fix", "a receiver without a fix for 3600 s, the car drives",
           "rows without place and IRI, flagged `blind`, with comfort and UTC; the fix is taken up again; memory is "
           "bounded",
           "{rows.total:.0f} rows in that hour", hour_without_fix),
    Hazard("GPS date jumps for seconds", "a week on or back, 1024 weeks, a day, for 1, 3 and 20 s",
           "no row changes", "{rows.total:.0f} rows, all the same", date_jumps_for_seconds,
           tuple((jump, lasts_s) for lasts_s, jump in product(
               (1, 3, 20), (WEEK, -WEEK, 1024 * WEEK, timedelta(days=-1)))), 4),
    Hazard("GPS date jumps for good", "a week on or back, and it stays",
           "UTC follows after half a minute; nothing else in any row changes",
           "rows from {after_s.least:.0f} s after the jump on have the new UTC", date_jumps_for_good, (WEEK, -WEEK)),
    Hazard("system clock set back", "by a year, in the middle of a drive", "no row changes",
           "{rows.total:.0f} rows, all the same", system_clock_set_back, (365,)),
)
