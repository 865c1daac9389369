"""What chips on an I2C bus have in common: what a failed transfer means, and which address a chip answers at."""

from __future__ import annotations

import errno
from collections.abc import Sequence

from drivers.errors import BadReply, DeviceError, NotPresent, Timeout, WrongDevice
from drivers.ports import I2cBus
from drivers.registers import Register

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

    ``title`` is its name with an article. Raises the error that tells most otherwise: a held bus at once, then a wrong
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
