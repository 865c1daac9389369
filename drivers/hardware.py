"""Real wires: the only file that imports smbus2 and pyserial.

Problem: both libraries report a missing device, missing rights and a pulled plug in ways of their own, and pyserial's
``read`` waits for a full buffer; and some USB adapters cannot read several I2C registers in one transfer. Solution: two
functions that open a wire behind the protocols of ``drivers.ports``. What cannot be opened is NotPresent with the next
step to take; what breaks later is an ``OSError`` with an errno.
"""

from __future__ import annotations

import errno
import logging
import select
from typing import TYPE_CHECKING

from drivers.errors import NotPresent, SettingsError
from drivers.ports import BytePort, I2cBus

if TYPE_CHECKING:
    from serial import Serial

WRITE_TIMEOUT_S = 1.0

log = logging.getLogger(__name__)


def open_i2c(number: int, register_step: int | None = 1) -> I2cBus:
    """Bus ``/dev/i2c-<number>``, for chips whose registers' addresses are ``register_step`` apart.

    NotPresent when it is not there, may not be opened, or is behind an adapter that cannot do what it takes. One that
    reads single registers only is used so (``ByteReads``), unless ``register_step`` is None: the chip needs blocks.
    """
    from smbus2 import I2cFunc, SMBus

    bus = SMBus()
    try:
        bus.open(number)
    except OSError as error:
        bus.close()
        raise NotPresent(f"/dev/i2c-{number}: {_i2c_hint(error)}") from error
    registers = I2cFunc.SMBUS_READ_BYTE_DATA | I2cFunc.SMBUS_WRITE_BYTE_DATA
    if bus.funcs & registers != registers:
        bus.close()
        raise NotPresent(f"/dev/i2c-{number}: its adapter cannot read and write registers (i2cdetect -F {number} tells "
                         "what it can); connect the sensor to the Pi's own I2C pins, or use another adapter")
    if bus.funcs & I2cFunc.SMBUS_READ_I2C_BLOCK:
        return bus
    if register_step is None:
        bus.close()
        raise NotPresent(f"/dev/i2c-{number}: its adapter reads single registers only, and this chip needs blocks; "
                         "connect the sensor to the Pi's own I2C pins, or use another adapter")
    log.info("/dev/i2c-%d: its adapter reads no blocks, each register is read by itself", number)
    return ByteReads(bus, register_step)


class ByteReads:
    """A bus whose blocks are read register by register, for adapters that cannot do it in one transfer.

    Problem: a chip that renews its registers between two of the reads gives a block that never was. Solution: the
    registers are read in turn, again and again. One that is read between two reads of all others that agree stood
    together with them, if there is no more than one renewal in the time of a block's reads (three bytes: 1 ms on a bus
    of 100 kHz). So of three registers five reads are enough, and the one in the middle may change each time.
    After ``READINGS_MAX`` readings of all it is an OSError (EAGAIN): on a rough road 0.1 % of them at 0.5 ms a byte,
    0.5 % at 0.75 ms, 2 % at 1 ms (registers renewed each 1 ms; a second look at all three lost 11, 30 and 41 %).
    """

    READINGS_MAX = 4

    def __init__(self, bus: I2cBus, register_step: int) -> None:
        self._bus = bus
        self._register_step = register_step
        self.read_byte_data = bus.read_byte_data
        self.write_byte_data = bus.write_byte_data
        self.close = bus.close

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        """``length`` registers from ``register`` on, as they stood together."""
        addresses = [register + k * self._register_step for k in range(length)]
        read: list[int] = []
        for count, address in enumerate(addresses * self.READINGS_MAX, 1):
            read.append(self._bus.read_byte_data(i2c_addr, address))
            others_from = count - length + 1  # the latest look at all others than the one in the middle
            if others_from >= length and read[others_from:] == read[others_from - length:count - length]:
                lap = count - count % length
                return read[lap:] + read[count - length:lap]
        raise OSError(errno.EAGAIN, "the registers were renewed while they were read, each time")


def open_serial(path: str, baud: int) -> BytePort:
    """Serial port ``path`` at ``baud`` 8N1, locked against other programs, without input from before.

    NotPresent when it is not there or may not be opened; SettingsError on a baud rate it cannot have.
    """
    from serial import Serial, SerialException

    if baud <= 0:
        raise SettingsError(f"{path}: a baud rate is a positive number, not {baud}")
    try:
        port = Serial(path, baud, timeout=0, write_timeout=WRITE_TIMEOUT_S, exclusive=True)
    except SerialException as error:
        raise NotPresent(f"{path}: {_serial_hint(error)}") from error
    except ValueError as error:
        raise SettingsError(f"{path}: {error}") from error
    return _SerialPort(path, port)


class _SerialPort:
    """A pyserial port that never waits, behind a ``select`` that does: setting pyserial's own timeout for each
    read would configure the port each time."""

    def __init__(self, path: str, port: Serial) -> None:
        self._path = path
        self._port = port

    def read(self, size: int, timeout_s: float) -> bytes:
        try:
            ready, _, _ = select.select([self._port], [], [], timeout_s)
            return self._port.read(size) if ready else b""
        except OSError as error:
            raise self._gone(error) from error

    def write(self, data: bytes) -> int:
        try:
            return self._port.write(data) or 0
        except OSError as error:
            raise self._gone(error) from error

    def close(self) -> None:
        self._port.close()

    def _gone(self, error: OSError) -> OSError:
        """pyserial's errors mostly carry no errno; whatever it was, the port has to be opened again."""
        return OSError(error.errno or errno.EIO, f"{self._path} has gone: {error}")


def _i2c_hint(error: OSError) -> str:
    if error.errno == errno.ENOENT:
        return "no such bus; enable I2C (dtparam=i2c_arm=on in /boot/firmware/config.txt) and restart"
    if error.errno in (errno.EACCES, errno.EPERM):
        return "not allowed; let the user join the group i2c (sudo usermod -aG i2c USER) and log in again"
    return f"cannot be opened as an I2C bus: {error.strerror}"


def _serial_hint(error: OSError) -> str:
    if error.errno in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return "no such port; is the device plugged in, and the name right (see /dev/serial/by-id)?"
    if error.errno in (errno.EACCES, errno.EPERM):
        return "not allowed; let the user join the group dialout (sudo usermod -aG dialout USER) and log in again"
    if error.errno in (errno.EAGAIN, errno.EBUSY):
        return "another program has it open (gpsd, a serial console, a second ridelog?)"
    return f"cannot be opened as a serial port: {error}"
