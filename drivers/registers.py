"""Register fields as declarations.

Problem: shifts and masks scattered through a driver go wrong silently: a value too large for its field spills
into the neighbour, a write clears bits that somebody else owns, and some registers change the chip when they are
merely read. Solution: a driver declares each register and field once. A field refuses what does not fit, an update
touches only the declared bits and reads them back, and a register whose read has a side effect is of another type
that has no plain ``read`` at all.

An ``OSError`` of the bus passes through; the driver knows what it means for its device.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivers.errors import BadReply, SettingsError
from drivers.ports import I2cBus


@dataclass(frozen=True)
class RegisterField:
    """Bits ``high_bit`` down to ``low_bit`` of a byte register, both included."""

    name: str
    high_bit: int
    low_bit: int

    def __post_init__(self) -> None:
        if not 0 <= self.low_bit <= self.high_bit <= 7:
            raise ValueError(f"field {self.name}: bits {self.high_bit}:{self.low_bit} are not inside a byte")

    @property
    def largest(self) -> int:
        return (1 << (self.high_bit - self.low_bit + 1)) - 1

    @property
    def mask(self) -> int:
        return self.largest << self.low_bit

    def extract(self, byte: int) -> int:
        """The field's value in ``byte``."""
        return (byte & self.mask) >> self.low_bit

    def insert(self, byte: int, value: int) -> int:
        """``byte`` with this field set to ``value``; SettingsError when it does not fit."""
        if not 0 <= value <= self.largest:
            raise SettingsError(f"{self.name} takes 0 to {self.largest}, not {value}")
        return (byte & ~self.mask) | (value << self.low_bit)


@dataclass(frozen=True)
class Register:
    """A byte register that may be read at any time. ``reset_value`` is what it holds after power-on."""

    name: str
    address: int
    reset_value: int = 0

    def read(self, bus: I2cBus, chip: int) -> int:
        return bus.read_byte_data(chip, self.address)

    def check(self, bus: I2cBus, chip: int, values: Mapping[RegisterField, int]) -> None:
        """Read the register once; BadReply when a field does not hold its value."""
        byte = self.read(bus, chip)
        for field, value in values.items():
            if field.extract(byte) != value:
                raise BadReply(
                    f"register 0x{self.address:02X} ({self.name}) of the chip at 0x{chip:02X}: "
                    f"{field.name} reads {field.extract(byte)}, expected {value}"
                )

    def update(self, bus: I2cBus, chip: int, values: Mapping[RegisterField, int]) -> None:
        """Set the fields, leave all other bits as they are, and check that the chip took them.

        SettingsError when a value does not fit (nothing is written then), BadReply when it reads back otherwise.
        """
        byte = self.read(bus, chip)
        for field, value in values.items():
            byte = field.insert(byte, value)
        bus.write_byte_data(chip, self.address, byte)
        self.check(bus, chip, values)


@dataclass(frozen=True)
class ToggleRegister:
    """A register whose every read flips a state of the chip: 0x00 answers "I was running, now I am not", 0xFF answers
    "I was not, now I am running". A read that failed may or may not have flipped it, so it is never repeated blindly.
    """

    name: str
    address: int

    def flip(self, bus: I2cBus, chip: int) -> bool:
        """Flip the state by one read. True: the chip runs now. BadReply when the answer is neither 0x00 nor 0xFF."""
        answer = bus.read_byte_data(chip, self.address)
        if answer not in (0x00, 0xFF):
            raise BadReply(
                f"register 0x{self.address:02X} ({self.name}) of the chip at 0x{chip:02X} "
                f"answered 0x{answer:02X}, expected 0x00 or 0xFF"
            )
        return answer == 0xFF
