"""The BMA220 as a set of registers, side effects and all, for recorded buses and for tests.

Problem: a driver of a chip whose reads change its state cannot be tried against a table of canned answers. Solution:
the chip's own behaviour, one register access at a time. Where the data sheet's behaviour is not known (what the data
registers answer while it is suspended or held in reset), the model answers zero and takes no sample.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.accelerometers._bma220_registers import (
    AXES,
    CHIP_ID,
    DATA_ADDRESS,
    FILTER,
    RANGE,
    REGISTER_STEP,
    REVISION,
    SAMPLE_BYTES,
    SOFT_RESET,
    SUSPEND,
    WATCHDOG,
    WATCHDOG_CODE,
)

WRITABLE = (AXES, FILTER, RANGE, WATCHDOG)


def lying_flat() -> bytes:
    """One sample of a chip at rest with Z up, at the range of +-2 g."""
    return bytes((0, 0, 16 << 2))


class Bma220Chip:
    """One chip. All attributes may be changed at any time, to put it into any state.

    data_address, sample_bytes    a read of so many bytes from there on takes a sample
    sample       gives the three data bytes; called once per read that begins at the data registers
    suspended    in suspend: reads work, writes are ignored
    in_reset     held in soft reset: the same, and the registers stand at their defaults
    registers    what the writable registers hold, by address
    stuck        register address to the value it answers, whatever was written: a broken chip, or another one
    """

    data_address = DATA_ADDRESS
    sample_bytes = SAMPLE_BYTES

    def __init__(self, sample: Callable[[], bytes] = lying_flat) -> None:
        self.sample = sample
        self.stuck: dict[int, int] = {}
        self.registers: dict[int, int] = {}
        self.suspended = False
        self.in_reset = False
        self.lose_power()

    def lose_power(self) -> None:
        """A dip of the supply: running, with every setting at its default."""
        self.suspended = False
        self.in_reset = False
        self._set_defaults()

    @property
    def running(self) -> bool:
        return not (self.suspended or self.in_reset)

    @property
    def watchdog_on(self) -> bool:
        return WATCHDOG_CODE.extract(self.registers[WATCHDOG.address]) >= 2

    def read(self, address: int, length: int = 1) -> bytes:
        """``length`` consecutive registers from ``address`` on, whose addresses are two apart."""
        if address == DATA_ADDRESS and length == SAMPLE_BYTES and self.running and not self.stuck:
            return self.sample()
        sample = self.sample() if address == DATA_ADDRESS and self.running else bytes(SAMPLE_BYTES)
        return bytes(self._answer(address + REGISTER_STEP * step, sample) for step in range(length))

    def write(self, address: int, value: int) -> None:
        """Write one register. Ignored while not running, and for registers that cannot be written."""
        if self.running and any(address == register.address for register in WRITABLE):
            self.registers[address] = value

    def _answer(self, address: int, sample: bytes) -> int:
        if address == SUSPEND.address:
            self.suspended, was_off = not self.suspended, self.suspended
            answer = 0xFF if was_off else 0x00
        elif address == SOFT_RESET.address:
            self.in_reset, was_off = not self.in_reset, self.in_reset
            if self.in_reset:
                self._set_defaults()
            answer = 0xFF if was_off else 0x00
        elif DATA_ADDRESS <= address < DATA_ADDRESS + 2 * SAMPLE_BYTES and address % 2 == 0:
            answer = sample[(address - DATA_ADDRESS) // 2]
        else:
            answer = self.registers.get(address, 0)
        return self.stuck.get(address, answer)

    def _set_defaults(self) -> None:
        self.registers = {register.address: register.reset_value for register in (CHIP_ID, REVISION, *WRITABLE)}
