"""What pyserial, smbus2 and the system raise at real wires comes out as the protocols say, and nothing stays open."""

from __future__ import annotations

import errno
import fcntl
import os
import struct
import termios
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import serial
import smbus2

from drivers.errors import DeviceError, NotPresent, SettingsError, Unforeseen, as_device_error
from drivers.hardware import Machine, open_i2c, open_serial
from drivers.sources import ChipSource, Deadlines

TORN = (TypeError("'NoneType' object cannot be interpreted as an integer"), struct.error("unpack requires"),
        ValueError("file descriptor cannot be a negative integer (-1)"), AttributeError("fd"))


def every_error(kind: type[Exception] = OSError) -> list[Exception]:
    return [kind(number, os.strerror(number)) for number in errno.errorcode]


def held() -> set[str]:
    """Descriptors of this process, as what they lead to."""
    return {str(entry.readlink()) for entry in Path("/proc/self/fd").iterdir() if entry.is_symlink()}


@pytest.fixture
def path() -> Iterator[str]:
    master, slave = os.openpty()
    tty.setraw(slave)
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


def refuse(patched: pytest.MonkeyPatch, owner: object, name: str, fault: Exception) -> None:
    def refuses(*_: Any, **__: Any) -> Any:
        raise fault

    patched.setattr(owner, name, refuses)


@pytest.mark.parametrize(("owner", "name", "kind"), [
    (termios, "tcgetattr", termios.error), (termios, "tcsetattr", termios.error), (termios, "tcflush", termios.error),
    (fcntl, "ioctl", OSError), (fcntl, "flock", OSError),
])
def test_a_port_that_refuses_a_call_while_it_is_opened_is_named_with_the_cause(
        path: str, owner: object, name: str, kind: type[Exception]) -> None:
    before = held()
    for fault in (*every_error(kind), *TORN):
        with pytest.MonkeyPatch.context() as patched:
            refuse(patched, owner, name, fault)
            if name == "ioctl" and fault.args[0] in (errno.EINVAL, errno.ENOTTY):
                open_serial(path, 9600).close()  # a port without these lines, as pyserial says
                continue
            with pytest.raises(NotPresent, match=path) as caught:
                open_serial(path, 9600)
        assert "\n" not in str(caught.value)
    assert held() == before
    open_serial(path, 9600).close()


@pytest.mark.parametrize("call", ["fileno", "read", "write"])
def test_what_an_open_port_raises_is_an_os_error_with_a_number_and_its_name(path: str, call: str) -> None:
    port = open_serial(path, 9600)
    for fault in (*every_error(), *every_error(termios.error), *TORN):
        with pytest.MonkeyPatch.context() as patched:
            refuse(patched, serial.Serial, call, fault)
            if call == "read":
                patched.setattr("select.select", lambda *_: ([1], [], []))
            with pytest.raises(OSError, match=f"{path} has gone: ") as caught:
                port.write(b"x") if call == "write" else port.read(1, 0.0)
        assert caught.value.errno == (fault.args[0] if isinstance(fault.args[0], int) else errno.EIO)
    port.close()


@pytest.mark.parametrize("what", ["as the kernel does", "before it has begun", "the library"])
def test_a_port_whose_closing_fails_is_let_go_of_all_the_same(path: str, what: str) -> None:
    before, works, others = held(), os.close, []

    for fault in (*every_error(), *TORN):
        port = open_serial(path, 9600)
        with pytest.MonkeyPatch.context() as patched:
            if what == "the library":
                refuse(patched, serial.Serial, "close", fault)
            else:
                faults = [fault]

                def fails(descriptor: int, faults: list[Exception] = faults) -> None:
                    is_last = not faults
                    if is_last or what == "as the kernel does":
                        works(descriptor)
                    if not is_last:
                        others.append(os.open(os.devnull, os.O_RDONLY))  # by another thread: it may get the number
                        raise faults.pop()

                patched.setattr(os, "close", fails)
            port.close()
            port.close()
    del port
    for other in others:
        os.close(other)  # nobody has closed a number twice
    assert held() == before


class Bus:
    """What smbus2 offers."""

    funcs = smbus2.I2cFunc.SMBUS_READ_BYTE_DATA | smbus2.I2cFunc.SMBUS_WRITE_BYTE_DATA | \
        smbus2.I2cFunc.SMBUS_READ_I2C_BLOCK
    closed = 0

    def open(self, number: int) -> None:
        """As it should."""

    def read_byte_data(self, *_: int) -> int:
        return 0xDD

    def write_byte_data(self, *_: int) -> None:
        """As it should."""

    def read_i2c_block_data(self, *_: int) -> list[int]:
        return [0, 0, 64]

    def close(self) -> None:
        type(self).closed += 1


@pytest.mark.parametrize("call", ["open", "read_byte_data", "write_byte_data", "read_i2c_block_data", "close"])
def test_what_a_bus_raises_keeps_its_number(call: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(smbus2, "SMBus", Bus)
    for fault in (*every_error(), *TORN):
        with pytest.MonkeyPatch.context() as patched:
            refuse(patched, Bus, call, fault)
            if call == "open":
                with pytest.raises(NotPresent, match="/dev/i2c-1: "):
                    open_i2c(1, 1)
                continue
            bus = open_i2c(1, 1)
            if call == "close":
                bus.close()
                continue
            with pytest.raises(OSError) as caught:
                {"read_byte_data": lambda bus=bus: bus.read_byte_data(0x0A, 0),
                 "write_byte_data": lambda bus=bus: bus.write_byte_data(0x0A, 0, 0),
                 "read_i2c_block_data": lambda bus=bus: bus.read_i2c_block_data(0x0A, 4, 3)}[call]()
        assert caught.value.errno == (fault.args[0] if isinstance(fault.args[0], int) else errno.EIO)


def test_a_bus_is_closed_whatever_its_chip_does_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    class BadEnd:
        registers_to_check = 1

        def start(self) -> None:
            """As it should."""

        def stop(self) -> None:
            raise TypeError("torn away")

    monkeypatch.setattr(smbus2, "SMBus", Bus)
    closed = Bus.closed
    machine = Machine(lambda: 0, lambda seconds: None)
    source = ChipSource("chip", lambda: open_i2c(1, 1), lambda bus: BadEnd(),  # type: ignore[arg-type, return-value]
                        machine.now_us, Deadlines(1, machine.now_us, machine.sleep))
    source.open()
    with pytest.raises(Unforeseen, match="TypeError: torn away"), as_device_error():
        source.close()
    assert Bus.closed == closed + 1


def test_what_a_driver_says_on_purpose_stays_as_it_is() -> None:
    for known in (NotPresent("cable"), SettingsError("baud")):
        with pytest.raises(type(known)) as caught, as_device_error():
            raise known
        assert caught.value is known
    with pytest.raises(DeviceError, match=r"^/dev/x: Protocol error$"), as_device_error():
        raise OSError(errno.EPROTO, os.strerror(errno.EPROTO), "/dev/x")


@pytest.mark.parametrize(("number", "words"), [
    (errno.EACCES, "group dialout"),
    (errno.EPERM, r"device policy.*sudo systemctl edit ridelog.*DeviceAllow={path} rw"),
])
def test_a_port_that_may_not_be_opened_says_who_forbids_it(
        path: str, number: int, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    refuse(monkeypatch, serial.serialposix.os, "open", PermissionError(number, os.strerror(number)))
    with pytest.raises(NotPresent, match=words.format(path=path)) as caught:
        open_serial(path, 9600)
    assert ("dialout" in str(caught.value)) == (number == errno.EACCES)


@pytest.mark.parametrize(("number", "words"), [(errno.EACCES, "group i2c"), (errno.EPERM, "DeviceAllow=/dev/i2c-1 rw")])
def test_so_does_a_bus(number: int, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    refuse(monkeypatch, smbus2.SMBus, "open", PermissionError(number, os.strerror(number)))
    with pytest.raises(NotPresent, match=words):
        open_i2c(1, 1)


def test_rights_that_an_open_port_refuses_are_not_those_of_opening_it(
        path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    refuse(monkeypatch, fcntl, "ioctl", PermissionError(errno.EPERM, "Operation not permitted"))
    with pytest.raises(NotPresent, match="cannot be opened as a serial port: Operation not permitted") as caught:
        open_serial(path, 9600)
    assert "DeviceAllow" not in str(caught.value)
