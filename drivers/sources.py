"""Where events come from: each source opens its device and turns one look at it into events.

A source knows nothing of retrying or threads. The bus and the port are given as functions that open
them, so real and recorded ones look the same.
"""

import random
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from drivers.errors import DeviceError, NotPresent
from drivers.hardware import BytePort, I2cBus
from drivers.readings import US_PER_S, Event

CHECK_EVERY_US = 60_000
"""One of a chip's registers each time: all four of a BMA220 have been seen a quarter of a second after a reading."""

READ_BYTES = 4096
GATHER_S = 0.05
SCATTER_S = 0.01  # an interval of the slowest sensor that is taken: 95 samples a second


class Source(Protocol):
    """One device. ``open`` and ``poll`` raise ``DeviceError`` when it is not well.

    waiting_since_us    time of the oldest reading that ``poll`` may still give [us]; None: it holds none back
    dropped             readings left out because nothing vouched for them
    missed              looks that came too late to be made
    note                what a person should know of how it is read; empty: nothing
    """

    name: str

    @property
    def dropped(self) -> int: ...
    @property
    def missed(self) -> int: ...
    @property
    def note(self) -> str: ...
    @property
    def waiting_since_us(self) -> int | None: ...
    def open(self) -> None: ...
    def poll(self) -> list[Event]: ...
    def rest(self) -> None: ...
    def flush(self) -> list[Event]: ...
    def close(self) -> None: ...


class Pace(Protocol):
    """The time between two looks at a device: ``wait`` sleeps until the next one is due."""

    missed: int

    def wait(self) -> None: ...


class Deadlines:
    """Instants at equal steps. One that is missed is counted and skipped, never made up for in a burst."""

    def __init__(self, step_us: int, now_us: Callable[[], int], sleep: Callable[[float], None]) -> None:
        self._step_us, self._now_us, self._sleep = step_us, now_us, sleep
        self._next_us = 0
        self.missed = 0

    def wait(self) -> None:
        now_us = self._now_us()
        self._next_us = (self._next_us or now_us) + self._step_us
        wait_us = self._next_us - now_us
        if wait_us < 0:
            skipped = -wait_us // self._step_us + 1
            self.missed += skipped
            self._next_us += skipped * self._step_us
            wait_us = self._next_us - now_us
        self._sleep(wait_us / US_PER_S)


class Scattered:
    """Times to look into a buffer that a device fills at even intervals.

    Problem: looks in step with the device find the newest sample always equally old, until the clocks have drifted
    apart by an interval; then its age jumps by that, as where a sample was lost. Solution: each wait is longer by
    another share of the interval, by chance, so that every few looks one finds a sample that has just been taken.
    """

    missed = 0

    def __init__(self, step_us: int, interval_us: int, sleep: Callable[[float], None]) -> None:
        self._step_us, self._interval_us, self._sleep = step_us, interval_us, sleep
        self._rng = random.Random(0)

    def wait(self) -> None:
        self._sleep((self._step_us + self._interval_us * self._rng.random()) / US_PER_S)


class Chip(Protocol):
    """What drivers of chips on a bus offer. Every method but ``stop`` raises the DeviceError family.

    registers_to_check   so many ``check_next`` see every setting once
    """

    @property
    def registers_to_check(self) -> int: ...
    def start(self) -> object: ...
    def read(self, now_us: Callable[[], int]) -> tuple[int, bytes]: ...
    def check_next(self) -> None: ...
    def check_settings(self) -> None: ...
    def stop(self) -> None: ...


class ChipSource:
    """One read of a chip per poll, given once the chip has vouched for it.

    Problem: a chip that lost power for a moment goes on with its default settings and plausible numbers. Solution: one
    register is read back every ``CHECK_EVERY_US``, each in turn, and a reading is held back until every one of them has
    been seen to be right after it: a loss at any moment, in the middle of a round too, comes to light before any
    reading from after it is given. What is still held back when the device is closed is dropped: a quarter of a second
    of readings of a chip with four such registers. That adds 14 to 16 reads of a byte per second (39 bits each: 0.6 %
    of the time of a bus of 100 kHz), never more than one per poll.

    make_chip    the chip on an open bus
    pace         the time between two looks
    """

    note = ""

    def __init__(self, name: str, open_bus: Callable[[], I2cBus], make_chip: Callable[[I2cBus], Chip],
                 now_us: Callable[[], int], pace: Pace) -> None:
        self.name, self._open_bus, self._make_chip, self._now_us, self._pace = name, open_bus, make_chip, now_us, pace
        self._bus: I2cBus | None = None
        self._device: Chip | None = None
        self._held: deque[tuple[int, Event]] = deque()
        self._checks = 0
        self._checked_us = 0
        self.dropped = 0

    @property
    def missed(self) -> int:
        """Looks that came too late to be made."""
        return self._pace.missed

    @property
    def waiting_since_us(self) -> int | None:
        """Time of the oldest reading that is held back [us]."""
        return self._held[0][1].t_us if self._held else None

    def open(self) -> None:
        self._bus = self._open_bus()
        self._device = self._make_chip(self._bus)
        self._device.start()
        self._checked_us = self._now_us()

    def poll(self) -> list[Event]:
        """Read the chip once, and a register when it is time. Gives the readings that are certain by now."""
        if self._device is None:
            raise NotPresent("the accelerometer is not open")
        t_us, data = self._device.read(self._now_us)
        if data:
            self._held.append((self._checks + self._device.registers_to_check, Event(t_us, self.name, data)))
        if t_us - self._checked_us >= CHECK_EVERY_US:
            self._device.check_next()
            self._checked_us = t_us
            self._checks += 1
        certain = []
        while self._held and self._held[0][0] <= self._checks:
            certain.append(self._held.popleft()[1])
        return certain

    def rest(self) -> None:
        """Sleep until the next look is due."""
        self._pace.wait()

    def flush(self) -> list[Event]:
        """Look at all registers now, and give what was held back; when they are not right it is dropped."""
        certain: list[Event] = []
        if self._device is not None and self._held:
            with suppress(DeviceError):
                self._device.check_settings()
                certain = [event for _, event in self._held]
                self._held.clear()
        self._drop()
        return certain

    def close(self) -> None:
        """Drop what is held back, stop the chip if it still answers, and let go of the bus."""
        self._drop()
        bus, device, self._bus, self._device = self._bus, self._device, None, None
        try:
            if device is not None:
                device.stop()
        finally:
            if bus is not None:
                bus.close()

    def _drop(self) -> None:
        self.dropped += len(self._held)
        self._held.clear()


class SerialSource:
    """The bytes that have arrived on a serial port, as one chunk per poll. It holds nothing back.

    Where ``rest`` is called between polls, every other one takes what has come while it slept, and the one after it
    waits for the next byte: a few wake-ups bring all bytes, and every other chunk has the time of its first byte. Each
    sleep is longer by chance, by up to ``SCATTER_S``: one of even length would find each eighth sample of 150 a second,
    for minutes, whether or not one was lost on the way (see ``Scattered``).
    """

    dropped = 0
    missed = 0
    note = ""
    waiting_since_us = None

    def __init__(self, name: str, open_port: Callable[[], BytePort], now_us: Callable[[], int], wait_s: float,
                 sleep: Callable[[float], None] = time.sleep) -> None:
        self.name, self._open_port, self._now_us, self._wait_s, self._sleep = name, open_port, now_us, wait_s, sleep
        self._rng = random.Random(0)
        self._has_slept = False
        self._port: BytePort | None = None

    def open(self) -> None:
        self._port = self._open_port()

    def poll(self) -> list[Event]:
        """Wait for bytes at most ``wait_s``; empty when there were none."""
        if self._port is None:
            raise NotPresent(f"the {self.name} port is not open")
        try:
            data = self._port.read(READ_BYTES, 0.0 if self._has_slept else self._wait_s)
        except OSError as error:
            raise NotPresent(f"the {self.name} port has gone: {error}") from error
        return [Event(self._now_us(), self.name, data)] if data else []

    def rest(self) -> None:
        """Sleep after a poll that waited, so that the next one finds more than a byte; not after the one that slept."""
        self._has_slept = not self._has_slept
        if self._has_slept:
            self._sleep(GATHER_S + SCATTER_S * self._rng.random())

    def flush(self) -> list[Event]:
        return []

    def close(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            port.close()


def serial_advice(state: str) -> str:
    """What to look at when a device on a serial port is ``silent``, ``absent`` or ``retrying``."""
    if state == "silent":
        return "check its power, that its TX goes to our RX, and the baud rate in the settings"
    return "check the cable, and the port in the settings (ls /dev/serial/by-id)"
