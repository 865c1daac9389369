"""The registers of the Bosch BMA220 on I2C.

Addresses are those on I2C, twice the numbers that the data sheet gives for SPI. Facts from the Linux kernel's driver
(drivers/iio/accel/bma220), Bosch's API of 2014 and the UPM library, which agree.
"""

from __future__ import annotations

from drivers.registers import Register, RegisterField, ToggleRegister

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
