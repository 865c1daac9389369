"""An ADXL345 on a bus, register by register, with its FIFO, as its data sheet says."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

import numpy as np

from drivers.accelerometers.adxl345 import Adxl345Config
from drivers.hardware import Machine

from .fake import Clock, DataSheet, Example, Fake

RESET = {0x00: 0xE5, 0x2C: 0x0A, **dict.fromkeys((0x1E, 0x1F, 0x20, 0x2D, 0x2E, 0x2F, 0x31, 0x38), 0)}
READ_ONLY = (0x00, 0x2B, 0x30, *range(0x32, 0x38), 0x39)
TRANSFER_US = 100


class Adxl345Chip:
    """The chip: registers, and a FIFO of 32 entries with one more at the output filter.

    clock_error    its clock is faster by this share
    """

    def __init__(self, accel: Any) -> None:
        self.accel = accel
        self.clock_error = 0.0
        self.samples = 0
        self.lost = 0
        self.lose_power(0)

    def lose_power(self, now_us: int) -> None:
        self.registers = dict(RESET)
        self.entries: list[bytes] = []
        self.overrun = False
        self.next_us = float(now_us)

    @property
    def interval_us(self) -> float:
        """100 Hz at code 0x0A, twice as fast for each code above (Table 7)."""
        return 1e6 / (100 * 2.0 ** ((self.registers[0x2C] & 0x0F) - 0x0A) * (1 + self.clock_error))

    def advance(self, now_us: int) -> None:
        if not self.registers[0x2D] & 0x08:
            self.next_us = now_us + self.interval_us
            return
        while self.next_us <= now_us:
            self._sample(round(self.next_us))
            self.next_us += self.interval_us

    def _sample(self, t_us: int) -> None:
        range_g = 2 << (self.registers[0x31] & 3)
        full = bool(self.registers[0x31] & 0x08)
        per_g = 256 if full else 512 / range_g
        most = 256 * range_g if full else 512
        counts = np.clip(np.rint(self.accel(t_us) / 9.80665 * per_g), -most, most - 1).astype("<i2")
        room = 33 if self.registers[0x38] >> 6 == 2 else 1  # stream, or bypass
        if len(self.entries) == room:
            del self.entries[0]
            self.overrun = True
            self.lost += 1
        self.entries.append(counts.tobytes())
        self.samples += 1

    def read(self, register: int, length: int) -> list[int]:
        if register == 0x30:
            return [0x80 * bool(self.entries) | 0x02 * (len(self.entries) > 16) | 0x01 * self.overrun]
        if register == 0x39:
            return [len(self.entries)]
        if 0x32 <= register <= 0x37:  # any read of data pops an entry, as long as it may be
            entry = self.entries.pop(0) if self.entries else bytes(6)
            self.overrun = False
            return list(entry[register - 0x32:][:length])
        return [self.registers.get(register, 0)]

    def write(self, register: int, value: int) -> None:
        if register in self.registers and register not in READ_ONLY:
            self.registers[register] = value
            if register == 0x38 and value >> 6 == 0:
                self.entries.clear()  # bypass empties the buffer


class Bus:
    """The I2C bus that the chip sits on, at 400 kHz or so. ``failing``: errno of the next transfers, 0: goes well."""

    def __init__(self, fake: FakeAdxl345) -> None:
        self.fake = fake
        self.failing: list[int] = []

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        self._transfer(i2c_addr)
        return self.fake.chip.read(register, 1)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        self._transfer(i2c_addr)
        self.fake.chip.write(register, value)

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        self._transfer(i2c_addr)
        return self.fake.chip.read(register, length)

    def close(self) -> None:
        """Nothing to let go of."""

    def _transfer(self, i2c_addr: int) -> None:
        self.fake.clock.sleep(TRANSFER_US / 1e6)
        failure = self.failing.pop(0) if self.failing else 0
        if failure:
            raise OSError(failure, "on cue")
        if self.fake.unplugged or i2c_addr != self.fake.address:
            raise OSError(errno.EREMOTEIO, "not acknowledged")


class FakeAdxl345(Fake):
    """The chip on its bus."""

    name = "adxl345"
    variants = (Adxl345Config(), Adxl345Config(rate_hz=800))
    wrong = r"0x53 has id 0xDD, an ADXL345 has 0xE5"
    examples = (  # data sheet, Table 1 and registers 0x32 to 0x37: 256 counts per g, least significant byte first
        Example(Adxl345Config(), bytes.fromhex("8001" "0001" "00ff" "0100"),
                (9.80665, -9.80665, 9.80665 / 256), interval_us=5000),
        Example(Adxl345Config(), bytes.fromhex("8001" "ff0f" "0000" "0000"), (4095 / 256 * 9.80665, 0.0, 0.0),
                clipped=True, interval_us=5000),
        Example(Adxl345Config(), bytes.fromhex("8001" "0000" "00f0" "0000"), (0.0, -16 * 9.80665, 0.0),
                clipped=True, interval_us=5000),
    )

    def __init__(self, folder: Path, clock: Clock, settings: Any = None) -> None:
        super().__init__(folder, clock, settings)
        self.chip = Adxl345Chip(lambda t_us: self.accel(t_us))
        self.bus = Bus(self)
        self.unplugged = False
        self.address = 0x53
        self.steps: list[int | None] = []

    @property
    def sheet(self) -> DataSheet:
        return DataSheet(self.settings.rate_hz, 0.0, (0.8 / 256 * 9.80665, 1.5 / 256 * 9.80665), 16 * 9.80665,
                         self.settings.rate_hz / 2)

    @property
    def state(self) -> dict[Any, Any]:
        """Bandwidth and rate (Table 7), and the registers of power, format and buffer."""
        rate_hz = 1e6 / self.chip.interval_us * (1 + self.chip.clock_error)
        return {"filter_hz": rate_hz / 2, **{one: self.chip.registers[one] for one in (0x2D, 0x31, 0x38)}}

    def machine(self) -> Machine:
        def opened(number: int, register_step: int | None) -> Any:
            self.steps.append(register_step)
            return self.bus
        return Machine(self.clock, self.clock.sleep, open_i2c=opened)

    def advance(self, now_us: int) -> None:
        if not self.unplugged:
            self.chip.advance(now_us)

    def unplug(self) -> None:
        self.unplugged = True

    def plug(self) -> None:
        self.unplugged = False
        self.chip.lose_power(self.clock.now_us)

    def lose_settings(self) -> None:
        self.chip.lose_power(self.clock.now_us)

    def replace_by_another(self) -> None:
        self.chip.registers[0x00] = RESET[0x00] ^ 0x38


FAKE = FakeAdxl345
