"""``ridelog run`` in a process where calls of the system and of libraries fail: ``python -m
tests.support.faults.foreign KIND ARGUMENTS``.

Each call that a device is reached by fails once with every error number that there is and with what else was seen to
come out of libraries, one after the other, and then works. KIND says which device: ``serial``, ``i2c`` or ``iio``.
Waits between two tries are short, so that all of them come up within seconds.
"""

from __future__ import annotations

import errno
import fcntl
import functools
import os
import select
import struct
import sys
import termios
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import serial
import smbus2

from drivers import sources
from drivers.accelerometers.bma220 import REGISTER_STEP, Bma220Chip
from drivers.hardware import Machine
from logger.commands import main
from logger.service import main_loop, serve, supervisor

NUMBERS = sorted(errno.errorcode)
ROOT_VARIABLE = "RIDELOG_TEST_ROOT"
"""Of the environment: the folder that stands for / where an IIO device is looked for."""


def from_the_system() -> Iterator[Exception]:
    """Every error number."""
    for number in NUMBERS:
        yield OSError(number, os.strerror(number))


def from_termios() -> Iterator[Exception]:
    """The same, as the module ``termios`` raises them."""
    for number in NUMBERS:
        yield termios.error(number, os.strerror(number))


def from_a_library() -> Iterator[Exception]:
    """The same, and what a library raises on a port that was torn away between two of its calls."""
    yield from (TypeError("'NoneType' object cannot be interpreted as an integer"), struct.error("unpack requires"),
                ValueError("file descriptor cannot be a negative integer (-1)"), AttributeError("fd"),
                serial.SerialException("device reports readiness to read but returned no data"))
    yield from from_termios()
    yield from from_the_system()


LEFT: dict[str, int] = {}
"""How many faults each call still has to raise."""


def fails(owner: object, name: str, faults: Iterable[Exception], concerns: Callable[..., bool],
          done_first: bool = False) -> None:
    """Let each call that ``concerns`` the device raise the next of the faults, until there is none; ``done_first``: as
    the kernel closes a descriptor, whatever it says of it."""
    works, waiting = getattr(owner, name), list(faults)[::-1]
    call = f"{getattr(owner, '__name__', '')}.{name}"
    LEFT[call] = len(waiting)

    @functools.wraps(works)
    def failing(*arguments: Any, **named: Any) -> Any:
        if not waiting or not concerns(*arguments):
            return works(*arguments, **named)
        fault = waiting.pop()
        LEFT[call] = len(waiting)
        if done_first:
            works(*arguments, **named)
        raise fault

    setattr(owner, name, failing)


def is_port(descriptor: Any, *_: Any) -> bool:
    return isinstance(descriptor, int) and os.isatty(descriptor)


def serial_ports() -> None:
    """Everything that pyserial asks of the system."""
    fails(os, "open", from_the_system(), lambda path, *_: str(path).endswith("/gps"))
    for name in ("tcgetattr", "tcsetattr", "tcflush"):
        fails(termios, name, from_termios(), is_port)
    fails(fcntl, "ioctl", from_the_system(), is_port)
    fails(fcntl, "flock", from_the_system(), is_port)
    fails(select, "select", from_a_library(), lambda ports, *_: isinstance(ports[0], serial.Serial))
    fails(os, "read", from_the_system(), is_port)
    fails(os, "close", from_the_system(), is_port, done_first=True)
    fails(serial.Serial, "read", from_a_library(), lambda *_: True)
    fails(serial.Serial, "close", from_a_library(), lambda port: port.is_open)


class Chip:
    """What smbus2 offers, with a BMA220 on each bus."""

    funcs = smbus2.I2cFunc.SMBUS_READ_BYTE_DATA | smbus2.I2cFunc.SMBUS_WRITE_BYTE_DATA | \
        smbus2.I2cFunc.SMBUS_READ_I2C_BLOCK
    chip = Bma220Chip(lambda: bytes((0, 0, (15 + time.monotonic_ns() // 10_000_000 % 3) << 2)))

    def open(self, number: int) -> None:
        """Nothing has to be opened."""

    def close(self) -> None:
        """Nothing has to be closed."""

    def read_byte_data(self, address: int, register: int) -> int:
        self._answers(address)
        return self.chip.read(register)[0]

    def write_byte_data(self, address: int, register: int, value: int) -> None:
        self._answers(address)
        self.chip.write(register, value)

    def read_i2c_block_data(self, address: int, register: int, length: int) -> list[int]:
        self._answers(address)
        return list(self.chip.read(register, length))

    def _answers(self, address: int) -> None:
        if address != 0x0A:
            raise OSError(errno.EREMOTEIO, os.strerror(errno.EREMOTEIO))


def i2c_buses() -> None:
    """Everything that is asked of smbus2."""
    assert REGISTER_STEP == 2
    for name in ("open", "read_byte_data", "write_byte_data", "read_i2c_block_data", "close"):
        fails(Chip, name, from_a_library(), lambda *_: True)
    smbus2.SMBus = Chip


def iio_devices() -> None:
    """Everything that is asked of the kernel's files, for a device without a buffer."""
    root = Path(os.environ[ROOT_VARIABLE])
    opened: set[int] = set()
    opens = os.open

    def open_and_note(path: Any, *arguments: Any, **named: Any) -> int:
        descriptor = opens(path, *arguments, **named)
        if str(path).endswith("_raw"):
            opened.add(descriptor)
        return descriptor

    os.open = open_and_note
    fails(os, "open", from_the_system(), lambda path, *_: str(path).endswith("_raw"))
    fails(os, "pread", from_the_system(), lambda descriptor, *_: descriptor in opened)
    fails(os, "close", from_the_system(), lambda descriptor: descriptor in opened, done_first=True)
    for name in ("read_text", "exists", "glob"):
        fails(Path, name, from_the_system(), lambda path, *_: path.is_relative_to(root))
    serve.Machine = functools.partial(Machine, root=root)


if __name__ == "__main__":
    supervisor.FIRST_WAIT_US = supervisor.LONGEST_WAIT_US = 1000
    main_loop.CLOSED_WAIT_S = sources.GATHER_S = 0.002
    {"serial": serial_ports, "i2c": i2c_buses, "iio": iio_devices}[sys.argv.pop(1)]()
    try:
        main.run()
    finally:
        print("faults left:", LEFT, file=sys.stderr)
