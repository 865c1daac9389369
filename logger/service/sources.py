"""Where events come from: each source opens its device and turns one look at it into events.

A source knows nothing of waiting, retrying or threads. The bus and the port are given as functions that open
them, so real and recorded ones look the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from drivers.bma220 import Bma220, Bma220Settings
from drivers.dump import Event
from drivers.errors import NotPresent
from drivers.ports import BytePort, I2cBus
from logger.units import US_PER_S

CHECK_EVERY_US = 10 * US_PER_S
READ_BYTES = 4096


class Source(Protocol):
    """One device. ``open`` and ``poll`` raise ``DeviceError`` when it is not well."""

    name: str

    def open(self) -> None: ...
    def poll(self) -> Event | None: ...
    def close(self) -> None: ...


class Bma220Source:
    """One burst read of the chip per poll; its settings are looked at again every ten seconds, because a chip
    that lost power for a moment goes on with other ones and plausible numbers."""

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
        self._checked_us = 0

    def open(self) -> None:
        """Open the bus and start the chip."""
        self._bus = self._open_bus()
        self._device = Bma220(self._bus, self._settings, self._sleep)
        self._device.start()
        self._checked_us = self._now_us()

    def poll(self) -> Event | None:
        """Read X, Y, Z once. The time is that just before the read."""
        if self._device is None:
            raise NotPresent("the accelerometer is not open")
        t_us = self._now_us()
        data = self._device.read_raw()
        if t_us - self._checked_us >= CHECK_EVERY_US:
            self._checked_us = t_us
            self._device.check_settings()
        return Event(t_us, self.name, data)

    def close(self) -> None:
        """Suspend the chip if it can still be told, and let go of the bus."""
        bus, device, self._bus, self._device = self._bus, self._device, None, None
        if device is not None:
            device.stop()
        if bus is not None:
            bus.close()


class SerialSource:
    """The bytes that have arrived on a serial port, as one chunk per poll."""

    def __init__(
        self, name: str, open_port: Callable[[], BytePort], now_us: Callable[[], int], wait_s: float
    ) -> None:
        self.name = name
        self._open_port = open_port
        self._now_us = now_us
        self._wait_s = wait_s
        self._port: BytePort | None = None

    def open(self) -> None:
        """Open the port."""
        self._port = self._open_port()

    def poll(self) -> Event | None:
        """Wait for bytes at most ``wait_s``; None when there were none."""
        if self._port is None:
            raise NotPresent(f"the {self.name} port is not open")
        try:
            data = self._port.read(READ_BYTES, self._wait_s)
        except OSError as error:
            raise NotPresent(f"the {self.name} port has gone: {error}") from error
        return Event(self._now_us(), self.name, data) if data else None

    def close(self) -> None:
        """Let go of the port."""
        port, self._port = self._port, None
        if port is not None:
            port.close()
