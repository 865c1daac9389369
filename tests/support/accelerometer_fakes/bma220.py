"""A BMA220 on a bus, register by register, as its data sheet says.

Addresses are those on I2C, twice the numbers of the data sheet (Bosch Sensortec BMA220, BST-BMA220-DS003, register
map): 0x00 id 0xDD, 0x04 to 0x08 X, Y, Z in six bits to the left, 0x1E enabled axes, 0x20 filter, 0x22 range,
0x2E bus watchdog, 0x30 suspend, 0x32 soft reset, which a read flips. One count is 62.5 mg at +-2 g, 125 at +-4, 250 at
+-8, 500 at +-16.
"""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

from drivers.accelerometers.bma220 import Bma220Config
from drivers.hardware import Machine

from .fake import Clock, DataSheet, Example, Fake, Vector

G_MPS2 = 9.80665
CHIP_ID = 0x00
RESET = {CHIP_ID: 0xDD, 0x02: 0x00, 0x1E: 0x07, 0x20: 0x00, 0x22: 0x00, 0x2E: 0x00}
FILTER_HZ = {0: 1000, 1: 500, 2: 250, 3: 125, 4: 64, 5: 32}
COUNT_G = {0: 0.0625, 1: 0.125, 2: 0.25, 3: 0.5}
SETTINGS = (0x1E, 0x20, 0x22, 0x2E)
FILTER, RANGE, SUSPEND, SOFT_RESET = 0x20, 0x22, 0x30, 0x32


def six_bits(accel_mps2: Vector, count_g: float) -> list[int]:
    """The data registers X, Y, Z: two's complement in the upper six bits."""
    counts = [max(-32, min(31, round(value / G_MPS2 / count_g))) for value in accel_mps2]
    return [(count % 64) * 4 for count in counts]


class Bus:
    """The I2C bus that the chip sits on."""

    def __init__(self, fake: FakeBma220) -> None:
        self.fake = fake

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        return self.read_i2c_block_data(i2c_addr, register, 1)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        self._transfer(i2c_addr)
        if register in SETTINGS and self.fake.awake:
            self.fake.registers[register] = value

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        self._transfer(i2c_addr)
        data = six_bits(self.fake.accel(self.fake.clock.now_us), COUNT_G[self.fake.registers[RANGE] & 3])
        return [self._answer(register + 2 * step, data) for step in range(length)]

    def close(self) -> None:
        """Nothing to let go of."""

    def _answer(self, register: int, data: list[int]) -> int:
        if register in (SUSPEND, SOFT_RESET):
            was_off = register in self.fake.held
            self.fake.held ^= {register}
            if register == SOFT_RESET and not was_off:
                self.fake.registers = {**RESET, CHIP_ID: self.fake.identity}
            return 0xFF if was_off else 0x00
        if 0x04 <= register <= 0x08:
            return data[(register - 0x04) // 2] if self.fake.awake else 0
        return self.fake.registers.get(register, 0)

    def _transfer(self, i2c_addr: int) -> None:
        self.fake.clock.sleep(100e-6)
        if self.fake.unplugged or i2c_addr != 0x0A:
            raise OSError(errno.EREMOTEIO, "not acknowledged")


class FakeBma220(Fake):
    """The chip on its bus. ``held``: by which of suspend and soft reset."""

    name = "bma220"
    variants = (Bma220Config(), Bma220Config(range_g=8, oversample=2), Bma220Config(range_g=16, bandwidth_hz=32))
    wrong = r"0x0A has id 0xE5, a BMA220 has 0xDD"
    examples = (  # data sheet, "acceleration data": 01 1111 is +1.94 g, 00 0000 is 0, 11 1111 -0.06 g, 10 0000 -2 g
        Example(Bma220Config(), bytes((0b0111_1100, 0b0000_0000, 0b1111_1100)), (31 / 16 * G_MPS2, 0.0, -G_MPS2 / 16),
                clipped=True),
        Example(Bma220Config(), bytes((0b1000_0000, 0, 0)), (-2 * G_MPS2, 0.0, 0.0), clipped=True),
        Example(Bma220Config(), bytes((0b0000_0100, 0b1100_0000, 0b0100_0000)), (G_MPS2 / 16, -G_MPS2, G_MPS2)),
        Example(Bma220Config(range_g=4), bytes((0b0000_0100, 0b1100_0000, 0b0100_0000)),
                (G_MPS2 / 8, -2 * G_MPS2, 2 * G_MPS2)),
        Example(Bma220Config(range_g=16), bytes((0b0000_0100, 0b1100_0000, 0b0100_0000)),
                (G_MPS2 / 2, -8 * G_MPS2, 8 * G_MPS2)),
    )

    def __init__(self, folder: Path, clock: Clock, settings: Any = None) -> None:
        super().__init__(folder, clock, settings)
        self.identity = RESET[CHIP_ID]
        self.registers = dict(RESET)
        self.held: set[int] = set()
        self.unplugged = False

    @property
    def awake(self) -> bool:
        return not self.held

    @property
    def sheet(self) -> DataSheet:
        range_g, rate_hz = self.settings.range_g, 100 * self.settings.reads
        wanted_hz = self.settings.bandwidth_hz or max(hz for hz in FILTER_HZ.values() if hz <= 0.64 * rate_hz / 2)
        return DataSheet(rate_hz, range_g / 32 * G_MPS2, (0.03, 0.3), range_g * G_MPS2, wanted_hz)

    @property
    def state(self) -> dict[Any, Any]:
        return {"filter_hz": FILTER_HZ[self.registers[FILTER] & 7], "range": self.registers[RANGE],
                **{register: self.registers[register] for register in (0x1E, 0x2E)}}

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
        self.lose_settings()

    def lose_settings(self) -> None:
        self.registers = {**RESET, CHIP_ID: self.identity}
        self.held.clear()

    def replace_by_another(self) -> None:
        self.identity = self.registers[CHIP_ID] = 0xE5


FAKE = FakeBma220
