"""Where events come from: each source opens its device and turns one look at it into events.

A source knows nothing of retrying or threads. The bus and the port are given as functions that open
them, so real and recorded ones look the same.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from drivers.bma220 import Bma220, Bma220Settings
from drivers.dump import Event
from drivers.errors import DeviceError, NotPresent
from drivers.ports import BytePort, I2cBus

CHECK_EVERY_US = 60_000
"""One of the chip's four registers each time: all have been seen a quarter of a second after a reading."""

READ_BYTES = 4096
GATHER_S = 0.05


class Source(Protocol):
    """One device. ``open`` and ``poll`` raise ``DeviceError`` when it is not well.

    waiting_since_us    time of the oldest reading that ``poll`` may still give [us]; None: it holds none back
    dropped             readings left out because nothing vouched for them
    """

    name: str
    dropped: int

    @property
    def waiting_since_us(self) -> int | None: ...
    def open(self) -> None: ...
    def poll(self) -> list[Event]: ...
    def flush(self) -> list[Event]: ...
    def close(self) -> None: ...


class Bma220Source:
    """One burst read of the chip per poll, given once the chip has vouched for it.

    Problem: a chip that lost power for a moment goes on with its default settings and plausible numbers. Solution: one
    register is read back every ``CHECK_EVERY_US``, each in turn, and a reading is held back until every one of them has
    been seen to be right after it: a loss at any moment, in the middle of a round too, comes to light before any
    reading from after it is given. What is still held back when the device is closed is dropped: a quarter of a second
    of readings. That adds 14 to 16 reads of a byte per second to the bursts (39 bits each: 0.6 % of the time of a bus
    of 100 kHz), never more than one per poll, so that 800 polls a second still fit.
    """

    name = "bma220"

    def __init__(
        self,
        open_bus: Callable[[], I2cBus],
        settings: Bma220Settings,
        now_us: Callable[[], int],
        sleep: Callable[[float], None],
    ) -> None:
        self._open_bus = open_bus
        self._settings = settings
        self._now_us = now_us
        self._sleep = sleep
        self._bus: I2cBus | None = None
        self._device: Bma220 | None = None
        self._held: deque[tuple[int, Event]] = deque()
        self._checks = 0
        self._checked_us = 0
        self.dropped = 0

    @property
    def waiting_since_us(self) -> int | None:
        """Time of the oldest reading that is held back [us]."""
        return self._held[0][1].t_us if self._held else None

    def open(self) -> None:
        """Open the bus and start the chip."""
        self._bus = self._open_bus()
        self._device = Bma220(self._bus, self._settings, self._sleep)
        self._device.start()
        self._checked_us = self._now_us()

    def poll(self) -> list[Event]:
        """Read X, Y, Z once, and a register when it is time. Gives the readings that are certain by now; the time of
        each is that just before its read."""
        if self._device is None:
            raise NotPresent("the accelerometer is not open")
        t_us = self._now_us()
        data = self._device.read_raw()
        self._held.append((self._checks + self._device.registers_to_check, Event(t_us, self.name, data)))
        if t_us - self._checked_us >= CHECK_EVERY_US:
            self._device.check_next()
            self._checked_us = t_us
            self._checks += 1
        certain = []
        while self._held and self._held[0][0] <= self._checks:
            certain.append(self._held.popleft()[1])
        return certain

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
        """Drop what is held back, suspend the chip if it still answers, and let go of the bus."""
        self._drop()
        bus, device, self._bus, self._device = self._bus, self._device, None, None
        if device is not None:
            device.stop()
        if bus is not None:
            bus.close()

    def _drop(self) -> None:
        self.dropped += len(self._held)
        self._held.clear()


class SerialSource:
    """The bytes that have arrived on a serial port, as one chunk per poll. It holds nothing back.

    Where ``gather`` is called between polls, every other one takes what has come while it slept, and the one after it
    waits for the next byte: a few wake-ups bring all bytes, and every other chunk has the time of its first byte.
    """

    dropped = 0
    waiting_since_us = None

    def __init__(
        self, name: str, open_port: Callable[[], BytePort], now_us: Callable[[], int], wait_s: float,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.name = name
        self._open_port = open_port
        self._now_us = now_us
        self._wait_s = wait_s
        self._sleep = sleep
        self._has_slept = False
        self._port: BytePort | None = None

    def open(self) -> None:
        """Open the port."""
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

    def gather(self) -> None:
        """Sleep after a poll that waited, so that the next one finds more than a byte; not after the one that slept."""
        self._has_slept = not self._has_slept
        if self._has_slept:
            self._sleep(GATHER_S)

    def flush(self) -> list[Event]:
        """Nothing is held back."""
        return []

    def close(self) -> None:
        """Let go of the port."""
        port, self._port = self._port, None
        if port is not None:
            port.close()
