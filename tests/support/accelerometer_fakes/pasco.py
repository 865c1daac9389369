"""A bridge that sends a line ``x,y,z`` in g per sample, a hundred a second, over a serial line."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

from drivers.accelerometers.pasco import ACCELEROMETER, PascoConfig
from drivers.machine import Machine

from .fake import Clock, Fake

INTERVAL_US = 10_000


class Port:
    """The serial port: what has arrived waits."""

    def __init__(self, fake: FakeLines) -> None:
        self.fake = fake

    def read(self, size: int, timeout_s: float) -> bytes:
        if self.fake.unplugged:
            raise OSError(errno.EIO, "gone")
        if not self.fake.waiting:
            self.fake.clock.sleep(min(timeout_s, 0.002))
        data = bytes(self.fake.waiting[:size])
        del self.fake.waiting[:size]
        return data

    def write(self, data: bytes) -> int:
        return len(data)

    def close(self) -> None:
        """Nothing to let go of."""


class FakeLines(Fake):
    """The bridge."""

    name = "pasco"
    saturates_mps2 = 16 * 9.80665
    wrong = r"bytes arrive, but none that can be read"

    def __init__(self, folder: Path, clock: Clock) -> None:
        super().__init__(folder, clock)
        self.waiting = bytearray()
        self.next_us = clock.now_us
        self.unplugged = False
        self.garbled = False

    @property
    def settings(self) -> PascoConfig:
        return PascoConfig()

    def machine(self) -> Machine:
        def opened(path: str, baud: int) -> Any:
            if self.unplugged:
                from drivers.errors import NotPresent

                raise NotPresent(f"{path}: no such port")
            self.waiting.clear()
            return Port(self)
        return Machine(self.clock, self.clock.sleep, open_serial=opened)

    def advance(self, now_us: int) -> None:
        while self.next_us <= now_us:
            line = ACCELEROMETER.simulated(self.settings, self.accel(self.next_us)[None, :])[0]
            self.waiting += line.translate(bytes(range(128, 256)) * 2) if self.garbled else line
            self.next_us += INTERVAL_US
        if self.unplugged:
            self.waiting.clear()

    def unplug(self) -> None:
        self.unplugged = True

    def plug(self) -> None:
        self.unplugged = False

    def replace_by_another(self) -> None:
        self.garbled = True


FAKE = FakeLines
