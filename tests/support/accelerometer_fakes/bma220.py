"""A BMA220 on a bus: the chip that recordings are played on, with a device to feel."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

from drivers.accelerometers._bma220_chip import Bma220Chip
from drivers.accelerometers._bma220_registers import CHIP_ID
from drivers.accelerometers.bma220 import ACCELEROMETER, Bma220Config
from drivers.machine import Machine

from .fake import Clock, Fake


class Bus:
    """The I2C bus that the chip sits on."""

    def __init__(self, fake: FakeBma220) -> None:
        self.fake = fake

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        return self.read_i2c_block_data(i2c_addr, register, 1)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        self._transfer(i2c_addr)
        self.fake.chip.write(register, value)

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        self._transfer(i2c_addr)
        return list(self.fake.chip.read(register, length))

    def close(self) -> None:
        """Nothing to let go of."""

    def _transfer(self, i2c_addr: int) -> None:
        self.fake.clock.sleep(100e-6)
        if self.fake.unplugged or i2c_addr != 0x0A:
            raise OSError(errno.EREMOTEIO, "not acknowledged")


class FakeBma220(Fake):
    """The chip on its bus."""

    name = "bma220"
    saturates_mps2 = 2 * 9.80665
    wrong = r"0x0A has id 0xE5, a BMA220 has 0xDD"

    def __init__(self, folder: Path, clock: Clock) -> None:
        super().__init__(folder, clock)
        self.chip = Bma220Chip(self._sample)
        self.unplugged = False

    @property
    def settings(self) -> Bma220Config:
        return Bma220Config()

    def machine(self) -> Machine:
        def opened(number: int, register_step: int | None) -> Any:
            return Bus(self)
        return Machine(self.clock, self.clock.sleep, open_i2c=opened)

    def advance(self, now_us: int) -> None:
        """It samples when it is read."""

    def unplug(self) -> None:
        self.unplugged = True

    def plug(self) -> None:
        self.unplugged = False
        self.chip.lose_power()

    def replace_by_another(self) -> None:
        self.chip.stuck[CHIP_ID.address] = 0xE5

    def _sample(self) -> bytes:
        return ACCELEROMETER.simulated(self.settings, self.accel(self.clock.now_us)[None, :])[0]


FAKE = FakeBma220
