"""The BMA220's registers, and the chip as an emulation and a recording hold it.

The registers of the Bosch BMA220 on I2C.

Addresses are those on I2C, twice the numbers that the data sheet gives for SPI. Facts from the Linux kernel's driver
(drivers/iio/accel/bma220), Bosch's API of 2014 and the UPM library, which agree.

The BMA220 as a set of registers, side effects and all, for recorded buses and for tests.

Problem: a driver of a chip whose reads change its state cannot be tried against a table of canned answers. Solution:
the chip's own behaviour, one register access at a time. Where the data sheet's behaviour is not known (what the data
registers answer while it is suspended or held in reset), the model answers zero and takes no sample.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.chip_bus import Register, RegisterField, ToggleRegister

CHIP_ID = Register("chip id", 0x00, reset_value=0xDD)
REVISION = Register("revision", 0x02)
DATA_ADDRESS = 0x04  # X, Y, Z: three registers in one burst, which steps from register to register by itself
SAMPLE_BYTES = 3
REGISTER_STEP = 2  # from one register's address to the next one's
AXES = Register("power and axes", 0x1E, reset_value=0x07)
FILTER = Register("filter", 0x20)
RANGE = Register("range", 0x22)
WATCHDOG = Register("bus watchdog", 0x2E)
SUSPEND = ToggleRegister("suspend", 0x30)
SOFT_RESET = ToggleRegister("soft reset", 0x32)

SLEEP_ENABLE = RegisterField("sleep_en", 6, 6)
ENABLED_AXES = RegisterField("en_x, en_y, en_z", 2, 0)
SERIAL_HIGH_BANDWIDTH = RegisterField("serial_high_bw", 7, 7)
FILTER_CODE = RegisterField("filter code", 3, 0)
SELF_TEST = RegisterField("sbist", 3, 2)
RANGE_CODE = RegisterField("range code", 1, 0)
WATCHDOG_CODE = RegisterField("watchdog code", 2, 1)


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
