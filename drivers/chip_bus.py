"""What chips on an I2C bus have in common: what a failed transfer means, which address a chip answers at, and whether
it still holds its settings."""

from __future__ import annotations

import errno
from collections.abc import Mapping, Sequence

from drivers.errors import BadReply, DeviceError, NotPresent, SettingsLost, Timeout, WrongDevice
from drivers.ports import I2cBus
from drivers.registers import Register, RegisterField

NOT_ACKNOWLEDGED = (errno.EREMOTEIO, errno.ENXIO)


def bus_fault(error: OSError, chip: int) -> DeviceError:
    """What a failed transfer with the chip at this address means, in one line."""
    if error.errno in NOT_ACKNOWLEDGED:
        return NotPresent(f"nothing answers at I2C address 0x{chip:02X}: check the sensor's power, ground, SDA and SCL")
    if error.errno == errno.ETIMEDOUT:
        return Timeout(
            f"I2C transfer with 0x{chip:02X} timed out: the bus is held low; check SDA and SCL, "
            "and take the sensor's power away for a moment if it stays"
        )
    if error.errno == errno.EBUSY:
        return NotPresent(
            f"a kernel driver owns I2C address 0x{chip:02X}: unload it (see lsmod) or remove its overlay, "
            "or read the sensor through it (driver: iio)"
        )
    return BadReply(f"I2C transfer with 0x{chip:02X} failed: {error}")


def find_chip(bus: I2cBus, chip_id: Register, addresses: Sequence[int], title: str) -> int:
    """The first address at which the chip answers whose ``chip_id`` register holds its reset value.

    ``title`` is its name with an article. Raises the most informative error otherwise: a held bus at once, then a wrong
    chip or an occupied address, and only then that nobody is there.
    """
    faults: list[DeviceError] = []
    for chip in addresses:
        try:
            found = chip_id.read(bus, chip)
        except OSError as error:
            fault = bus_fault(error, chip)
            if isinstance(fault, Timeout):
                raise fault from error
            if error.errno not in NOT_ACKNOWLEDGED:
                faults.append(fault)
            continue
        if found == chip_id.reset_value:
            return chip
        faults.append(WrongDevice(
            f"the chip at I2C address 0x{chip:02X} has id 0x{found:02X}, {title} has 0x{chip_id.reset_value:02X}"
        ))
    if faults:
        raise faults[0]
    places = " or ".join(f"0x{chip:02X}" for chip in addresses)
    raise NotPresent(f"nothing answers at I2C address {places}: check the sensor's power, ground, SDA and SCL")


class ConfiguredChip:
    """A chip whose settings a driver writes when it starts it, and reads back later, one register at a time.

    A driver's ``start`` calls ``_write_settings`` and then sets ``_chip``, the address that the chip answers at; None:
    it has not been started.

    name                 of the chip
    registers_to_check   so many ``check_next`` see every setting once
    """

    def __init__(
        self, name: str, bus: I2cBus, settings: Sequence[tuple[Register, Mapping[RegisterField, int]]]
    ) -> None:
        self.name = name
        self.registers_to_check = len(settings)
        self._bus = bus
        self._settings_written = tuple(settings)
        self._chip: int | None = None
        self._checked = 0

    def check_settings(self) -> None:
        """SettingsLost when the chip no longer holds what ``start`` wrote, as after a dip of its supply."""
        for _ in self._settings_written:
            self.check_next()

    def check_next(self) -> None:
        """Read back one register, each in its turn. SettingsLost when it does not hold what ``start`` wrote; after a
        transfer that failed it is the same one's turn again."""
        chip = self._started()
        register, values = self._settings_written[self._checked]
        try:
            register.check(self._bus, chip, values)
        except OSError as error:
            raise bus_fault(error, chip) from error
        except BadReply as error:
            raise SettingsLost(f"{self.name} lost its settings (did its supply dip?): {error}") from error
        self._checked = (self._checked + 1) % len(self._settings_written)

    def _write_settings(self, chip: int) -> None:
        """OSError of the bus; BadReply where the chip does not take one."""
        self._checked = 0
        for register, values in self._settings_written:
            register.update(self._bus, chip, values)

    def _started(self) -> int:
        if self._chip is None:
            raise NotPresent(f"the {self.name} has not been started")
        return self._chip
