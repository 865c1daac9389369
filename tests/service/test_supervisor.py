"""One device kept alive: what a fault costs, how long the waits are, what the state says."""

from __future__ import annotations

import itertools

import pytest

from drivers.accelerometers.bma220 import Bma220Chip, Bma220Config, chip_source
from drivers.dump import Event
from drivers.errors import DeviceError, NotPresent, Timeout
from drivers.sources import SerialSource
from logger.service.supervisor import FAULTS_IN_A_ROW, FAULTY_US, FIRST_WAIT_US, Supervisor
from logger.store.log.log_writer import LONGEST_WAIT_US

from ..support.recorded_wires import Cue, Fault, RecordedBus, RecordedPort


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now_us = 1_000_000

    def __call__(self) -> int:
        return self.now_us


class Device:
    """A source whose behaviour is written down: an error, an event or silence per look."""

    name = "bma220"
    dropped = 0
    waiting_since_us = None

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.opened = 0
        self.closed = 0
        self.refuse: DeviceError | None = None
        self.answer: DeviceError | bytes | None = b"\0\0\x40"

    def open(self) -> None:
        self.opened += 1
        if self.refuse is not None:
            raise self.refuse

    def poll(self) -> list[Event]:
        if isinstance(self.answer, DeviceError):
            raise self.answer
        return [Event(self.clock(), self.name, self.answer)] if self.answer else []

    def flush(self) -> list[Event]:
        return []

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def device(clock: Clock) -> Device:
    return Device(clock)


def test_an_absent_device_is_tried_at_growing_intervals(clock: Clock, device: Device) -> None:
    device.refuse = NotPresent("cable out")
    supervisor = Supervisor(device, clock)
    begun_us = clock.now_us
    tries_us = []
    while clock.now_us < begun_us + 200_000_000:
        opened = device.opened
        assert supervisor.step() == []
        if device.opened > opened:
            tries_us.append(clock.now_us)
        clock.now_us += 100_000
    waits_us = [b - a for a, b in itertools.pairwise(tries_us)]
    assert waits_us[0] == FIRST_WAIT_US
    assert waits_us[1] == 2 * FIRST_WAIT_US
    assert max(waits_us) == LONGEST_WAIT_US
    assert supervisor.state() == "absent"
    assert "cable out" in supervisor.error


def test_a_device_that_appears_is_taken_and_the_wait_is_short_again(clock: Clock, device: Device) -> None:
    device.refuse = NotPresent("cable out")
    supervisor = Supervisor(device, clock)
    for _ in range(100):
        supervisor.step()
        clock.now_us += 1_000_000
    device.refuse = None
    clock.now_us += LONGEST_WAIT_US
    assert supervisor.step()
    assert supervisor.state() == "ok"
    assert supervisor.error == ""
    device.answer = Timeout("silent")
    for _ in range(FAULTS_IN_A_ROW):
        assert supervisor.state() == "ok"
        clock.now_us += FAULTY_US // 4
        supervisor.step()
    assert supervisor.state() == "retrying"
    assert supervisor.retry_at_us == clock.now_us + FIRST_WAIT_US


def test_one_failed_read_costs_one_sample_and_no_restart(clock: Clock, device: Device) -> None:
    supervisor = Supervisor(device, clock)
    assert supervisor.step()
    device.answer = Timeout("no answer")
    assert supervisor.step() == []
    device.answer = b"\0\0\x40"
    assert supervisor.step()
    assert device.opened == 1
    assert supervisor.faults == 1
    assert supervisor.restarts == 0


def test_an_open_device_that_says_nothing_is_silent(clock: Clock, device: Device) -> None:
    supervisor = Supervisor(device, clock)
    device.answer = None
    supervisor.step()
    clock.now_us += 6_000_000
    supervisor.step()
    assert supervisor.state() == "silent"


@pytest.mark.parametrize("fault", [ZeroDivisionError(), OSError(71, "Protocol error"), TypeError("torn away")])
@pytest.mark.parametrize("call", ["open", "poll", "flush", "close"])
def test_whatever_leaves_a_source_costs_its_own_readings_only(
        clock: Clock, device: Device, call: str, fault: Exception, caplog: pytest.LogCaptureFixture) -> None:
    def broken() -> list[Event]:
        raise fault

    sound = getattr(device, call)
    setattr(device, call, broken)
    supervisor = Supervisor(device, clock)
    for _ in range(FAULTS_IN_A_ROW + 1):
        clock.now_us += FAULTY_US
        supervisor.step()
    supervisor.restart("looked odd")
    supervisor.step()
    if call in ("open", "poll"):
        assert type(fault).__name__ in caplog.text or "Protocol error" in caplog.text
        assert ("Traceback" in caplog.text) == (not isinstance(fault, OSError))
    setattr(device, call, sound)
    clock.now_us += LONGEST_WAIT_US
    assert [event.data for event in supervisor.step()] == [device.answer]
    setattr(device, call, broken)
    assert supervisor.close() == []


@pytest.mark.parametrize("fault", [Fault.NACK, Fault.TIMEOUT, Fault.STUCK_LOW])
def test_the_chip_comes_back_after_a_fault_of_the_bus(clock: Clock, fault: Fault) -> None:
    bus = RecordedBus(Bma220Chip(), cues=[Cue(fault, at_read=4)], now_us=clock)
    source = chip_source(lambda: bus, Bma220Config(oversample=1), clock, lambda seconds: None)
    supervisor = Supervisor(source, clock)
    seen = []
    for count in range(400):
        bus.load(bytes((0, 0, 4 * (count % 8))))
        seen += supervisor.step()
        clock.now_us += 10_000
    assert len(seen) > 300
    assert supervisor.faults >= 1
    assert supervisor.state() == "ok"


def test_a_chip_that_was_unplugged_is_started_again_with_its_settings(clock: Clock) -> None:
    cues = [Cue(Fault.UNPLUG, at_us=2_000_000), Cue(Fault.REPLUG, at_us=9_000_000)]
    bus = RecordedBus(Bma220Chip(), cues=cues, now_us=clock)
    source = chip_source(lambda: bus, Bma220Config(range_g=4, oversample=1), clock, lambda seconds: None)
    supervisor = Supervisor(source, clock)
    seen_us = []
    for _ in range(2000):
        bus.load(b"\0\0\x20")
        seen_us += [event.t_us for event in supervisor.step()]
        clock.now_us += 10_000
    seen_us += [event.t_us for event in supervisor.flush()]
    gaps_us = [b - a for a, b in itertools.pairwise(seen_us)]
    assert 6_900_000 < max(gaps_us) < 16_000_000
    assert supervisor.restarts == 1
    assert seen_us[-1] == clock.now_us - 10_000


def test_an_unplugged_port_is_a_fault_of_the_device(clock: Clock) -> None:
    port = RecordedPort(cues=[Cue(Fault.UNPLUG, at_us=1_500_000)], now_us=clock)
    supervisor = Supervisor(SerialSource("nmea", lambda: port, clock, wait_s=0.0), clock)
    port.load(b"$GP")
    assert supervisor.step() == [Event(1_000_000, "nmea", b"$GP")]
    clock.now_us = 1_600_000
    for _ in range(FAULTS_IN_A_ROW):
        clock.now_us += FAULTY_US // 4
        assert supervisor.step() == []
    assert supervisor.state() == "retrying"
    assert "nmea port has gone" in supervisor.error
