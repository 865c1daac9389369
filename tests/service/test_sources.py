"""Readings of the chip are given once it has vouched for them, and in order with those of other sources."""

from __future__ import annotations

from collections import deque

import pytest

from drivers.accelerometers.bma220 import FILTER, RANGE, Bma220Chip, Bma220Config, chip_source
from drivers.dump import Event
from logger.service.main_loop import EventMerger, Listener, MainLoop
from logger.service.supervisor import Supervisor

from ..support.recorded_wires import RecordedBus

SETTINGS = Bma220Config(range_g=4, oversample=1)
STEP_US = 10_000
FILTER_CODE_32_HZ = 5


class Bus(RecordedBus):
    """The chip's readings name the registers under which they were made. Its power dips before some transfers."""

    def __init__(self, dips: set[int]) -> None:
        super().__init__(Bma220Chip())
        self.dips = dips
        self.transfers = 0
        self.register_reads = 0
        self.chip.sample = lambda: bytes((self.chip.registers[RANGE.address], self.chip.registers[FILTER.address], 64))

    def _transfer(self, i2c_addr: int, read_register: int | None) -> None:
        if self.transfers in self.dips:
            self.chip.lose_power()
        self.transfers += 1
        super()._transfer(i2c_addr, read_register)

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        self.register_reads += 1
        return super().read_byte_data(i2c_addr, register)


class Clock:
    now_us = 1_000_000

    def __call__(self) -> int:
        return self.now_us


def polled(bus: Bus, polls: int, step_us: int = STEP_US) -> tuple[Supervisor, list[Event]]:
    clock = Clock()
    supervisor = Supervisor(chip_source(lambda: bus, SETTINGS, clock, lambda seconds: None), clock)
    events = []
    for _ in range(polls):
        events += supervisor.step()
        clock.now_us += step_us
    return supervisor, events + supervisor.close()


def test_no_reading_from_after_a_dip_is_given_whichever_transfer_it_hits() -> None:
    started = Bus(set())
    polled(started, 1)
    for dip in range(started.transfers, started.transfers + 90):
        bus = Bus({dip})
        supervisor, events = polled(bus, 200)
        assert {event.data for event in events} == {bytes((1, FILTER_CODE_32_HZ, 64))}
        assert (supervisor.settings_lost, supervisor.restarts) == (1, 1)
        assert 200 - len(events) <= 32  # a quarter of a second, and the restart
        assert supervisor.source.dropped <= 30


@pytest.mark.parametrize(("step_us", "most_per_s"), [(10_000, 17), (1_250, 17), (100_000, 10)])
def test_what_the_looks_cost(step_us: int, most_per_s: float) -> None:
    bus = Bus(set())
    polled(bus, 1, step_us)
    start = bus.register_reads
    bus = Bus(set())
    supervisor, events = polled(bus, 10_000_000 // step_us, step_us)
    per_s = (bus.register_reads - start) / 10
    assert 9 < per_s <= most_per_s
    assert len(events) == 10_000_000 // step_us
    assert supervisor.source.dropped == 0


def test_a_chip_that_loses_its_settings_over_and_over_is_waited_for() -> None:
    bus = Bus(set(range(0, 100_000, 30)))
    supervisor, events = polled(bus, 3_000)
    assert events == []
    assert supervisor.settings_lost < 20
    assert "lost its settings" in supervisor.error


class Fed:
    """A core and a storage that note what comes."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.feed = self.events.append

    def record(self, event: Event) -> None:
        """Nothing is recorded."""


def test_events_of_another_source_wait_for_the_readings_that_are_held_back() -> None:
    fed, queue, clock = Fed(), deque[Event](), Clock()
    bus = Bus(set())
    chip = Supervisor(chip_source(lambda: bus, SETTINGS, clock, lambda seconds: None), clock)
    listener = Listener(chip, queue, lambda: None)
    service = MainLoop(fed, fed, [listener], queue, 1.0, 1.0, lambda now_us: None)  # type: ignore[arg-type]
    for tick in range(500):
        listener.look()
        if tick % 7 == 0:
            queue.append(Event(clock.now_us + 3_000, "nmea", b"$"))
        service.move(clock.now_us)
        clock.now_us += STEP_US
    times_us = [event.t_us for event in fed.events]
    assert times_us == sorted(times_us)
    assert len(set(times_us)) == len(times_us)
    assert clock.now_us - times_us[-1] < 350_000
    assert {event.source for event in fed.events} == {"bma220", "nmea"}


def test_the_merger_gives_everything_once_in_order() -> None:
    merger = EventMerger()
    merger.add([Event(3, "bma220", b"c"), Event(5, "bma220", b"e")])
    merger.add([Event(1, "nmea", b"a"), Event(4, "nmea", b"d"), Event(4, "nmea", b"D")])
    assert [event.data for event in merger.until(4)] == [b"a", b"c", b"d", b"D"]
    assert merger.until(4) == []
    assert [event.data for event in merger.until(9)] == [b"e"]
