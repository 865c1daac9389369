"""A bridge that sends a line ``x,y,z`` per sample, in g or in m/s2, a hundred a second, over a serial line."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

from drivers.accelerometers.pasco import PascoConfig
from drivers.hardware import Machine

from .fake import Clock, DataSheet, Example, Fake

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
    variants = (PascoConfig(), PascoConfig(profile="lines_mps2"))
    wrong = r"bytes arrive, but none that can be read"
    examples = (
        Example(PascoConfig(), b"1.0,-0.5,.25\r\n", (9.80665, -4.903325, 2.4516625)),
        Example(PascoConfig(), b"0,0,16.0\n", (0.0, 0.0, 156.9064), clipped=True),
        Example(PascoConfig(profile="lines_mps2"), b"1.5,-0.5,9.80665*06\n", (1.5, -0.5, 9.80665)),
    )

    def __init__(self, folder: Path, clock: Clock, settings: Any = None) -> None:
        super().__init__(folder, clock, settings)
        self.waiting = bytearray()
        self.next_us = clock.now_us
        self.unplugged = False
        self.garbled = False

    @property
    def sheet(self) -> DataSheet:
        saturates_mps2 = 16 * 9.80665 if self.settings.profile == "lines" else 160.0
        return DataSheet(100.0, 0.0, (0.02, 0.15), saturates_mps2)

    @property
    def state(self) -> dict[Any, Any]:
        return {}

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
            unit_mps2 = 9.80665 if self.settings.profile == "lines" else 1.0
            line = ",".join(f"{value / unit_mps2:.5f}" for value in self.accel(self.next_us)).encode() + b"\n"
            self.waiting += line.translate(bytes(range(128, 256)) * 2) if self.garbled else line
            self.next_us += INTERVAL_US
        if self.unplugged:
            self.waiting.clear()

    def unplug(self) -> None:
        self.unplugged = True

    def plug(self) -> None:
        self.unplugged = False

    def lose_settings(self) -> None:
        """It has none."""

    def replace_by_another(self) -> None:
        self.garbled = True


FAKE = FakeLines
