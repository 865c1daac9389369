"""What goes wrong with sensors and their wires: through the service's own sources, supervisors, core and observer, on
buses and ports that misbehave, in time that a test lets pass."""

from __future__ import annotations

import ast
import errno
import random
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

import drivers
import logger
from drivers.bma220 import CHIP_ID, Bma220Settings
from drivers.dump import DumpHeader, Event
from drivers.errors import NotPresent
from drivers.replay import Cue, Fault, RecordedBus, RecordedPort
from logger.commands.status import advice
from logger.service import assemble
from logger.service.config import AccelerometerConfig, Config, PascoConfig
from logger.service.core import Core
from logger.service.live import HANG_US, Deadlines, monotonic_us
from logger.service.observer import Observer
from logger.service.sources import Bma220Source, SerialSource, Source
from logger.service.status import ServiceStatus
from logger.service.stillness import FROZEN_S
from logger.service.storage import Storage
from logger.service.supervisor import LONGEST_WAIT_US, Supervisor
from logger.service.timebase import OTHER_DATE_US
from logger.store.segment_log import read_log
from logger.store.space import Limits
from logger.store.vehicle_file import read_vehicle

from replaying import Rows, core_for

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
        super().__init__(cues, clock)
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
    """Time that passes when it is told to. It never goes back."""

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
                 serial: bool = False, settings: Bma220Settings | None = None) -> None:
        self.clock = Clock()
        self.begin_us = self.clock.now_us
        self.bus = Bus(self.clock, self._later(bus_cues))
        self.port = Port(self._later(port_cues), self.clock)
        self.lines = RecordedPort()
        self.rng = random.Random(1)
        self.sample: Callable[[float], bytes] = self.rough_road
        self.speed_mps = 12.0
        self.travelled_m = 0.0
        self.receiver: Callable[[float], bytes] = lambda s: epoch(s, self.speed_mps, self.travelled_m)
        folder.mkdir(exist_ok=True)
        config = Config(status_file=folder / "status.json")
        if serial:
            lines = PascoConfig(profile="lines")
            config = replace(config, accelerometer=AccelerometerConfig("pasco", "+z", pasco=lines))
        self.config = replace(config, log=replace(config.log, directory=folder))
        sensor = assemble.instrument(self.config.accelerometer)
        vehicle = read_vehicle(self.config.vehicle)
        self.storage = Storage(folder, {}, 4_000_000, None, Limits(), self.clock)
        self.decoder = assemble.gps_decoder(self.config)
        self.pipeline = assemble.pipeline(self.config, sensor, vehicle)
        self.rows = Rows()
        self.core = Core(sensor.decoder, self.decoder, self.pipeline, self.rows)
        source: Source = SerialSource("pasco", lambda: self.lines, self.clock, 0.0) if serial else Bma220Source(
            lambda: self.bus, settings or Bma220Settings(), self.clock, lambda seconds: None)
        self.accelerometer = Supervisor(source, self.clock)
        self.gps = Supervisor(SerialSource("nmea", self.port.opened, self.clock, 0.0), self.clock)
        self.observer = Observer(self.config, self.core, self.storage, self.pipeline, self.accelerometer, self.gps,
                                 {"accelerometer": sensor.counters, "gps": dict}, Deadlines(STEP_US))
        self.heard_us: list[int] = []
        self.longest_step_us = 0
        self._second = -1

    def _later(self, cues: list[Cue] | None) -> list[Cue]:
        return [replace(cue, at_us=self.begin_us + cue.at_us) if cue.at_us is not None else cue for cue in cues or []]

    @property
    def now_s(self) -> float:
        return (self.clock.now_us - self.begin_us) / 1e6

    def rough_road(self, second: float) -> bytes:
        return bytes((0, 4 * self.rng.randrange(2), 4 * (16 + self.rng.randrange(-2, 3))))

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
        for supervisor in (self.accelerometer, self.gps):
            event = supervisor.step()
            if event is not None:
                self.core.feed(event)
                if event.source != "nmea":
                    self.heard_us.append(event.t_us)
        self.longest_step_us = max(self.longest_step_us, self.clock.now_us - began_us)
        self.clock.now_us += STEP_US

    def flags(self) -> set[str]:
        """Of all rows so far."""
        return {flag for record in self.rows.records for flag in record.flags}


def heard_after(car: Car, second: float) -> float:
    """When the first sample after a time came [s]."""
    return next((t_us - car.begin_us) / 1e6 for t_us in car.heard_us if t_us >= car.begin_us + second * 1e6)


# --- cables


@pytest.mark.parametrize("seed", range(6))
def test_an_accelerometer_that_loses_its_cable_is_back_within_the_longest_wait(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    out_s, out_for_s = rng.uniform(8, 15), rng.uniform(0.3, 40)
    back_s = out_s + out_for_s
    car = Car(tmp_path, [Cue(Fault.UNPLUG, at_us=round(out_s * 1e6)), Cue(Fault.REPLUG, at_us=round(back_s * 1e6))])
    assert car.drive(out_s - 0.1).accelerometer.state == "ok"
    if out_for_s > 1:
        away = car.drive(out_for_s)
        assert away.accelerometer.state == "retrying"
        assert "nothing answers" in advice(away)[0]
        assert away.gps.state == "ok"
    status = car.drive(max(out_for_s, 3) + 14)
    assert status.accelerometer.state == "ok"
    assert heard_after(car, back_s) - back_s < min(LONGEST_WAIT_US / 1e6, out_for_s + 1.5)
    assert car.bus.chip.watchdog_on
    assert "gap" in car.flags()
    assert all(record.distance_start_m is not None or "gps_lost" in record.flags for record in car.rows.records)


@pytest.mark.parametrize("seed", range(4))
def test_a_receiver_that_loses_its_cable_leaves_marked_rows_and_is_back(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    out_s, out_for_s = rng.uniform(8, 12), rng.uniform(2, 30)
    cues = [Cue(Fault.UNPLUG, at_us=round(out_s * 1e6)), Cue(Fault.REPLUG, at_us=round((out_s + out_for_s) * 1e6))]
    car = Car(tmp_path, port_cues=cues)
    away = car.drive(out_s + out_for_s - 0.1)
    assert away.gps.state == "retrying"
    assert away.accelerometer.state == "ok"
    status = car.drive(out_for_s + 12)
    assert status.gps.state == "ok"
    assert status.fix_valid
    assert "gps_lost" in car.flags()
    assert len(car.heard_us) == pytest.approx(100 * car.now_s, rel=0.02)


# --- another device, another baud rate


def test_another_chip_at_the_address_is_named_and_gives_no_sample(tmp_path: Path) -> None:
    car = Car(tmp_path)
    car.bus.chip.stuck = {CHIP_ID.address: 0xE5}
    status = car.drive(20)
    assert (status.accelerometer.state, status.accelerometer.readings) == ("absent", 0)
    assert "has id 0xE5, a BMA220 has 0xDD" in advice(status)[0]
    car.bus.chip.stuck = {}
    assert car.drive(31).accelerometer.state == "ok"


def garbled(data: bytes, rng: random.Random) -> bytes:
    """Text as a port of another baud rate sees it."""
    return bytes(rng.choice((0x00, 0x80, 0xF8, 0xFE, 0xE6, byte ^ rng.randrange(256))) for byte in data)


def test_a_wrong_baud_rate_is_said_to_be_one(tmp_path: Path) -> None:
    car = Car(tmp_path)
    good = car.receiver
    car.receiver = lambda second: garbled(good(second), car.rng)
    status = car.drive(25)
    assert (status.gps.state, status.gps.readings, status.utc_known) == ("doubtful", 0, False)
    assert "check the baud rate" in " ".join(advice(status))
    assert all(record.lat_deg is None for record in car.rows.records)
    car.receiver = good
    status = car.drive(5)
    assert status.gps.state == "ok"


@pytest.mark.parametrize("kind", ["receiver on the sensor's port", "sensor on the receiver's port", "wrong baud rate"])
def test_another_device_on_a_port_makes_no_reading_and_is_told(tmp_path: Path, kind: str) -> None:
    car = Car(tmp_path, serial=True)
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
    assert "no other device" in " ".join(advice(status))


# --- the bus


@pytest.mark.parametrize("watchdog_ms", [10, 0])
def test_a_bus_held_low_stops_nothing_else_and_is_named(tmp_path: Path, watchdog_ms: int) -> None:
    """Every transfer takes a second to time out. The chip's own watchdog frees the bus; without it, a power cycle."""
    cues = [Cue(Fault.STUCK_LOW, at_us=10_000_000), Cue(Fault.REPLUG, at_us=70_000_000)]
    car = Car(tmp_path, cues, settings=Bma220Settings(watchdog_ms=watchdog_ms))
    car.drive(10)
    status = car.drive(50)
    assert car.longest_step_us < HANG_US
    assert status.gps.state == "ok"
    assert status.rows_written > 20
    if watchdog_ms:
        assert status.accelerometer.state == "ok"
        assert heard_after(car, 10.0) < 13
    else:
        assert status.accelerometer.state == "retrying"
        assert "the bus is held low" in advice(status)[0]
        assert car.drive(45).accelerometer.state == "ok"
    assert car.bus.chip.watchdog_on is bool(watchdog_ms)


@pytest.mark.parametrize("loss", [0.05, 0.3, 0.6, 0.9, 0.99])
def test_a_storm_of_refused_transfers_costs_the_samples_it_hits(tmp_path: Path, loss: float) -> None:
    car = Car(tmp_path)
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
    assert heard_after(car, storm_end_s) - storm_end_s <= LONGEST_WAIT_US / 1e6 + 0.1
    assert car.longest_step_us < HANG_US
    assert car.bus.chip.running


# --- readings that cannot be true


def test_a_frozen_chip_is_noticed_while_the_car_drives_and_started_anew(tmp_path: Path) -> None:
    car = Car(tmp_path)
    car.drive(40)
    restarts = car.accelerometer.restarts
    car.sample = lambda second: bytes((0, 0, 4 * 17))
    status = car.drive(FROZEN_S - 3)
    assert status.accelerometer.state == "ok"
    status = car.drive(45)
    assert status.accelerometer.state == "doubtful"
    assert "not changed at all" in advice(status)[0]
    assert car.accelerometer.restarts > restarts
    late = [record for record in car.rows.records if record.t_us > car.begin_us + (40 + FROZEN_S + 2) * 1e6]
    assert len(late) > 30
    assert all("frozen" in record.flags for record in late)
    car.sample = car.rough_road
    status = car.drive(20)
    assert status.accelerometer.state == "ok"
    assert "frozen" not in car.rows.records[-1].flags


@pytest.mark.parametrize("receiver", ["stands", "no fix", "drifts at a walking pace"])
def test_a_parked_car_is_never_taken_for_a_frozen_sensor(tmp_path: Path, receiver: str) -> None:
    car = Car(tmp_path)
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


def test_a_saturated_sensor_is_flagged_in_every_row_and_told(tmp_path: Path) -> None:
    car = Car(tmp_path)
    car.sample = lambda second: bytes((0, 4 * car.rng.randrange(2), 4 * 31))
    status = car.drive(30)
    assert status.accelerometer.state == "doubtful"
    assert "does not feel 1 g" in advice(status)[0]
    placed = [record for record in car.rows.records if record.samples]
    assert len(placed) > 10
    assert all("clipped" in record.flags for record in placed)


def test_peaks_beyond_the_range_are_flagged_where_they_are(tmp_path: Path) -> None:
    car = Car(tmp_path)
    car.sample = lambda second: bytes((0, 0, 4 * 31)) if 20.2 < second < 20.3 else car.rough_road(second)
    status = car.drive(35)
    assert status.accelerometer.state == "ok"
    clipped = [record for record in car.rows.records if "clipped" in record.flags]
    assert 1 <= len(clipped) <= 3
    assert sum(record.clipped_samples for record in clipped) in range(8, 13)


# --- the receiver's time


def test_an_hour_without_a_fix_gives_blind_rows_and_the_fix_is_taken_up_again() -> None:
    """Rows go on, in constant memory, and are blind; with the fix the distance goes on where it was."""
    core, rows = core_for(DumpHeader(None, {"driver": "bma220", "range_g": 2}, {}, "rav4-2009"))
    rng = random.Random(2)
    waiting = []
    for second in range(3720):
        t_us = BEGIN_US + second * 1_000_000
        core.feed(Event(t_us, "nmea", epoch(second, 12, 12 * second, fix=not 30 <= second < 3630)))
        for tick in range(100):
            core.feed(Event(t_us + tick * STEP_US, "bma220", bytes((0, 0, 4 * (16 + rng.randrange(-2, 3))))))
        waiting.append(sum(len(part) for part in core._pipeline._pending))
    core.finish()
    lost = [record for record in rows.records if 50 < (record.t_us - BEGIN_US) / 1e6 < 3620]
    assert len(lost) == pytest.approx(3570 / 5, abs=3)
    assert all({"blind", "gps_lost"} <= set(record.flags) and record.lat_deg is None for record in lost)
    assert all(record.a_w_mps2 is not None and record.iri_m_per_km is None for record in lost)
    assert all(record.utc_us is not None for record in lost)
    after = [record for record in rows.records if (record.t_us - BEGIN_US) / 1e6 > 3640]
    assert len(after) > 80
    assert all(record.lat_deg is not None for record in after)
    assert max(waiting) < 2500


def dated_rows(jump: Callable[[int], timedelta], seconds: int) -> tuple[Core, Rows]:
    core, rows = core_for(DumpHeader(None, {"driver": "bma220", "range_g": 2}, {}, "rav4-2009"))
    rng = random.Random(2)
    for second in range(seconds):
        t_us = BEGIN_US + second * 1_000_000
        core.feed(Event(t_us, "nmea", epoch(second, 12, 12 * second, NOON + jump(second))))
        for tick in range(100):
            core.feed(Event(t_us + tick * STEP_US, "bma220", bytes((0, 0, 4 * (16 + rng.randrange(-2, 3))))))
    core.finish()
    return core, rows


WEEK = timedelta(days=7)


@pytest.mark.parametrize("jump", [WEEK, -WEEK, 1024 * WEEK, timedelta(days=-1)])
@pytest.mark.parametrize("lasts_s", [1, 3, 20])
def test_a_date_that_jumps_for_some_seconds_changes_no_row(jump: timedelta, lasts_s: int) -> None:
    _, straight = dated_rows(lambda second: timedelta(), 60)
    core, rows = dated_rows(lambda second: jump if 30 <= second < 30 + lasts_s else timedelta(), 60)
    assert rows.records == straight.records
    assert core._pipeline.timebase.time_jumps == 0


@pytest.mark.parametrize("jump", [WEEK, -WEEK])
def test_a_date_that_jumps_for_good_moves_utc_after_half_a_minute_and_nothing_else(jump: timedelta) -> None:
    _, straight = dated_rows(lambda second: timedelta(), 100)
    core, rows = dated_rows(lambda second: jump if second >= 30 else timedelta(), 100)
    assert [replace(record, utc_us=None) for record in rows.records] == [
        replace(record, utc_us=None) for record in straight.records]
    week_us = round(jump.total_seconds() * 1e6)
    moved = [(new.t_us - BEGIN_US, new.utc_us - old.utc_us) for new, old in zip(rows.records, straight.records,
                                                                            strict=True) if old.utc_us is not None]
    assert {by for _, by in moved} == {0, week_us}
    first_us = min(t_us for t_us, by in moved if by)
    assert first_us + 30_000_000 > 15_000_000 + OTHER_DATE_US
    assert first_us < 30_000_000 + OTHER_DATE_US + 2_000_000
    assert core._pipeline.timebase.time_jumps == 1


# --- the system's clock

WALL_CLOCKS = {("time", "time"), ("time", "time_ns"), ("time", "localtime"), ("time", "gmtime"), ("time", "ctime"),
               ("time", "strftime"), ("datetime", "now"), ("datetime", "utcnow"), ("datetime", "today"),
               ("date", "today"), ("time", "CLOCK_REALTIME")}


def test_nobody_asks_the_systems_clock() -> None:
    asked = []
    for package in (drivers, logger):
        for path in Path(str(package.__file__)).parent.rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name | ast.Attribute):
                    owner = node.value.id if isinstance(node.value, ast.Name) else node.value.attr
                    if (owner, node.attr) in WALL_CLOCKS:
                        asked.append(f"{path}:{node.lineno}")
    assert asked == []


def test_a_clock_set_back_by_a_year_in_the_middle_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The service writes the same rows to the same file, and its status is fresh."""
    straight = Car(tmp_path / "straight")
    straight.drive(60)
    car = Car(tmp_path / "set back")
    car.drive(30)
    wall_s = time.time() - 365 * 86400
    monkeypatch.setattr(time, "time", lambda: wall_s)
    monkeypatch.setattr(time, "time_ns", lambda: int(wall_s * 1e9))
    status = car.drive(30)
    texts = [[replace(record, t_us=record.t_us - car.begin_us, utc_us=None) for record in car.rows.records]
             for car in (straight, car)]
    assert texts[0] == texts[1]
    assert status.updated_t_us == car.clock.now_us
    for record in car.rows.records:
        car.storage.log.append(record)
    car.storage.close()
    (path,) = (tmp_path / "set back").glob("*.csv")
    assert len(read_log(path).records) == len(car.rows.records)
