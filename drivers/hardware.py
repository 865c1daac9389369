"""The wires of this machine: what drivers ask of one, how one is opened, and which is the board's own."""

from __future__ import annotations

import errno
import logging
import os
import select
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from drivers.errors import NotPresent, SettingsError, as_os_error, error_number, why_forbidden, words_of

if TYPE_CHECKING:
    from serial import Serial
    from smbus2 import SMBus


class I2cBus(Protocol):
    """The part of smbus2's ``SMBus`` that drivers use. A fault is an ``OSError`` with the kernel's errno
    (121 EREMOTEIO or 6 ENXIO: not acknowledged, 110 ETIMEDOUT: bus held, 16 EBUSY: a kernel driver owns it)."""

    def read_byte_data(self, i2c_addr: int, register: int) -> int: ...
    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None: ...
    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]: ...
    def close(self) -> None: ...


class BytePort(Protocol):
    """A serial line. ``read`` waits up to ``timeout_s`` for the first byte, then returns what is there
    (at most ``size``); empty means silence. A port that has gone raises ``OSError``."""

    def read(self, size: int, timeout_s: float) -> bytes: ...
    def write(self, data: bytes) -> int: ...
    def close(self) -> None: ...


MODEL = "sys/firmware/devicetree/base/model"
DEBUG = "ttyAMA10"
SWITCH_ON = "switch the port on (sudo raspi-config, Interface Options, Serial Port: login shell no, port hardware yes)"
_SINCE_5 = ("Raspberry Pi 5", "Raspberry Pi Compute Module 5")  # "Raspberry Pi 500" begins so too
_ON_THE_PINS = "pins 8 and 10 of a {model} are /dev/ttyAMA0: write dtparam=uart0=on into /boot/firmware/config.txt, " \
               "restart, and set the port to /dev/ttyAMA0"


def port_advice(port: str, root: Path = Path("/")) -> str:
    """What to do about a port of the board that is not the one on its pins, or is off; empty: nothing is known.
    ``root``: below it lie ``dev`` and ``sys``.

    Problem. /dev/serial0 is on pins 8 and 10 of every Raspberry Pi but the 5 and its like, where it is the three-pin
    debug connector: a receiver on the pins is silent there, however right its wires. And /dev/ttyAMA0, which is right
    on those, is the Bluetooth chip on a 3, a 4 and a Zero W. Solution. What the names lead to, and the model, are read
    from the kernel.

    Sources: Raspberry Pi documentation, computers/configuration/uart.adoc (primary and secondary UART by model; pull
    request 3294 of raspberrypi/documentation); overlays/README (dtparam uart0).
    """
    try:
        place = root / Path(port).relative_to("/")
        target = place.resolve()
        is_there = place.exists()
        model = (root / MODEL).read_text("ascii", "replace").strip("\0\n ") if (root / MODEL).exists() else ""
        is_second = target == (root / "dev/serial1").resolve() and (root / "dev/serial1").exists()
    except (OSError, ValueError):
        return ""
    if target.name == DEBUG:
        return f"{port} is the three-pin debug connector; {_ON_THE_PINS.format(model='Raspberry Pi 5')}"
    if model.startswith(_SINCE_5):
        is_of_the_board = Path(port).name in ("serial0", "ttyS0") and target.name != "ttyAMA0"
        is_off = Path(port).name == "ttyAMA0" and not is_there
        return _ON_THE_PINS.format(model="Raspberry Pi 5") if is_of_the_board or is_off else ""
    if is_second and Path(port).name != "serial0":
        return (f"{port} is not on pins 8 and 10, but on the Bluetooth chip where the Pi has one: set the port to "
                "/dev/serial0")
    if model.startswith("Raspberry Pi") and Path(port).name in ("serial0", "ttyS0") and not is_there:
        return SWITCH_ON
    return ""


WRITE_TIMEOUT_S = 1.0
_PIPES = tuple(f"pipe_abort_{use}_{end}" for use in ("read", "write") for end in "rw")
"""What a port of pyserial holds beside its own descriptor."""

log = logging.getLogger(__name__)


def open_i2c(number: int, register_step: int | None) -> I2cBus:
    """Bus ``/dev/i2c-<number>``, for chips whose registers' addresses are ``register_step`` apart.

    NotPresent when it is not there, may not be opened, or is behind an adapter that cannot do what it takes. One that
    reads single registers only is used so (``ByteReads``), unless ``register_step`` is None: the chip needs blocks.
    """
    from smbus2 import I2cFunc, SMBus

    bus = SMBus()
    wire = _Bus(bus)
    try:
        with as_os_error():
            bus.open(number)
    except OSError as error:
        wire.close()
        raise NotPresent(f"/dev/i2c-{number}: {_i2c_hint(error, number)}") from error
    registers = I2cFunc.SMBUS_READ_BYTE_DATA | I2cFunc.SMBUS_WRITE_BYTE_DATA
    if bus.funcs & registers != registers:
        wire.close()
        raise NotPresent(f"/dev/i2c-{number}: its adapter cannot read and write registers (i2cdetect -F {number} tells "
                         "what it can); connect the sensor to the Pi's own I2C pins, or use another adapter")
    if bus.funcs & I2cFunc.SMBUS_READ_I2C_BLOCK:
        return wire
    if register_step is None:
        wire.close()
        raise NotPresent(f"/dev/i2c-{number}: its adapter reads single registers only, and this chip needs blocks; "
                         "connect the sensor to the Pi's own I2C pins, or use another adapter")
    log.info("/dev/i2c-%d: its adapter reads no blocks, each register is read by itself", number)
    return ByteReads(wire, register_step)


class _Bus:
    """A bus of smbus2."""

    def __init__(self, bus: SMBus) -> None:
        self._bus = bus

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        with as_os_error():
            return self._bus.read_byte_data(i2c_addr, register)

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        with as_os_error():
            self._bus.write_byte_data(i2c_addr, register, value)

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        with as_os_error():
            return self._bus.read_i2c_block_data(i2c_addr, register, length)

    def close(self) -> None:
        with suppress(Exception):
            self._bus.close()


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
        raise OSError(errno.EAGAIN, "the registers changed during each attempt to read them")


def open_serial(path: str, baud: int) -> BytePort:
    """Serial port ``path`` at ``baud`` 8N1, locked against other programs, without input from before.

    Problem: both libraries report a missing device, missing rights and a pulled plug in ways of their own, and
    pyserial's ``read`` waits for a full buffer; and some USB adapters cannot read several I2C registers in one
    transfer. Solution: two functions that open a wire behind these protocols. What cannot be opened is NotPresent with
    the next step to take; what breaks later is an ``OSError`` with an errno, whatever the library raises; closing
    raises nothing.

    NotPresent when it is not there or may not be opened; SettingsError on a baud rate it cannot have.
    """
    from serial import Serial

    if baud <= 0:
        raise SettingsError(f"{path}: a baud rate is a positive number, not {baud}")
    try:
        return _SerialPort(path, Serial(path, baud, timeout=0, write_timeout=WRITE_TIMEOUT_S, exclusive=True))
    except Exception as error:
        raise NotPresent(f"{path}: {_serial_hint(error, path)}") from error


class _SerialPort:
    """A pyserial port that never waits, behind a ``select`` that does: setting pyserial's own timeout for each
    read would configure the port each time."""

    def __init__(self, path: str, port: Serial) -> None:
        self._path = path
        self._port = port
        self._device = os.fstat(port.fileno()).st_rdev

    def read(self, size: int, timeout_s: float) -> bytes:
        with as_os_error(f"{self._path} has gone: "):
            ready, _, _ = select.select([self._port], [], [], timeout_s)
            return self._port.read(size) if ready else b""

    def write(self, data: bytes) -> int:
        with as_os_error(f"{self._path} has gone: "):
            return self._port.write(data) or 0

    def close(self) -> None:
        """Let go of all that pyserial holds, also where it gives up half way: else Python would have it close the same
        numbers once more, which may be another file's by then, and a lock that stays would keep us from opening."""
        port, fd = self._port, self._port.fd
        with suppress(Exception):
            port.close()
        if not port.is_open:
            return
        port.is_open = False
        if fd is not None and self._is_still(fd):
            with suppress(OSError):
                os.close(fd)
        for name in _PIPES:
            if (end := getattr(port, name, None)) is not None:
                with suppress(OSError):
                    os.close(end)

    def _is_still(self, fd: int) -> bool:
        """Whether a number is still that of the port: Linux gives a descriptor back also where closing it failed."""
        with suppress(OSError):
            return os.fstat(fd).st_rdev == self._device
        return False


def _i2c_hint(error: OSError, number: int) -> str:
    if error.errno == errno.ENOENT:
        return "no such bus; enable I2C (dtparam=i2c_arm=on in /boot/firmware/config.txt) and restart"
    if error.errno in (errno.EACCES, errno.EPERM):
        return why_forbidden(error.errno, f"/dev/i2c-{number}", "rw", "i2c")
    return f"cannot be opened as an I2C bus: {error.strerror}"


def _serial_hint(error: Exception, path: str = "/dev/PORT") -> str:
    """What to do about a port that pyserial cannot open. What it raises itself is of the opening and the lock; what it
    lets through is of the settings and the lines (DTR, RTS) of a port that is open."""
    from serial import SerialException

    number = error_number(error)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return "no such port; is the device plugged in, and the name right (see /dev/serial/by-id)?"
    if isinstance(error, SerialException):
        if number in (errno.EACCES, errno.EPERM):
            return why_forbidden(number, path, "rw", "dialout")
        if number in (errno.EAGAIN, errno.EBUSY):
            return "another program has it open (gpsd, a serial console, a second ridelog?)"
    reason = os.strerror(number) if number is not None else words_of(error)
    return (f"cannot be opened as a serial port: {reason}; unplug the device and plug it in again, and try another "
            "cable or adapter if this persists")


def wait_readable(descriptor: int, timeout_s: float) -> bool:
    """Wait until a file has something to read, at most so long [s]; False: it has not."""
    return bool(select.select([descriptor], [], [], timeout_s)[0])


@dataclass(frozen=True)
class Machine:
    """Clock, buses, ports, and files of the kernel.

    now_us           the monotonic clock [us]
    sleep            takes seconds
    open_i2c         a bus by its number, as ``drivers.hardware.open_i2c``
    open_serial      a port by its path and baud rate, as ``drivers.hardware.open_serial``
    wait_readable    as the function above
    root             below it lie ``sys`` and ``dev``
    """

    now_us: Callable[[], int]
    sleep: Callable[[float], None]
    open_i2c: Callable[[int, int | None], I2cBus] = open_i2c
    open_serial: Callable[[str, int], BytePort] = open_serial
    wait_readable: Callable[[int, float], bool] = wait_readable
    root: Path = Path("/")
