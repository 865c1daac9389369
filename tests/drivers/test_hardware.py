"""Real ports, tried on pseudo-terminals; real I2C buses as far as a desk without one allows."""

import errno
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
import smbus2

from drivers.errors import NotPresent, SettingsError
from drivers.hardware import BytePort, open_i2c, open_serial


class Terminal:
    """A pseudo-terminal: ``master`` is the device at the far end of the cable."""

    def __init__(self) -> None:
        self.master, self._slave = os.openpty()
        self.path = os.ttyname(self._slave)
        self._open = {self.master, self._slave}

    def unplug(self) -> None:
        self._open.discard(self.master)
        os.close(self.master)

    def close(self) -> None:
        for descriptor in self._open:
            os.close(descriptor)


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    terminal = Terminal()
    yield terminal
    terminal.close()


@pytest.fixture
def port(terminal: Terminal) -> Iterator[BytePort]:
    port = open_serial(terminal.path, 9600)
    yield port
    port.close()


def test_a_read_gives_what_is_there_without_waiting_for_more(terminal: Terminal, port: BytePort) -> None:
    os.write(terminal.master, b"$GPRMC")
    assert port.read(4, 5.0) == b"$GPR"
    assert port.read(100, 5.0) == b"MC"
    assert port.read(100, 0.0) == b""
    assert port.read(100, 0.01) == b""


def test_every_byte_value_passes_both_ways_unchanged(terminal: Terminal, port: BytePort) -> None:
    everything = bytes(range(256))
    os.write(terminal.master, everything)
    got = b""
    while len(got) < 256:
        data = port.read(4096, 5.0)
        assert data
        got += data
    assert got == everything
    assert port.write(everything) == 256
    assert os.read(terminal.master, 4096) == everything


def test_input_from_before_the_opening_is_dropped(terminal: Terminal) -> None:
    first = open_serial(terminal.path, 9600)
    first.close()
    os.write(terminal.master, b"old")
    port = open_serial(terminal.path, 9600)
    os.write(terminal.master, b"new")
    assert port.read(100, 5.0) == b"new"
    port.close()


def test_a_pulled_plug_is_an_os_error_with_its_number(terminal: Terminal, port: BytePort) -> None:
    terminal.unplug()
    for call in (lambda: port.read(100, 5.0), lambda: port.write(b"x")):
        with pytest.raises(OSError, match=f"{terminal.path} has gone") as caught:
            call()
        assert caught.value.errno == errno.EIO


def test_a_closed_port_is_an_os_error_and_closing_twice_is_harmless(terminal: Terminal) -> None:
    port = open_serial(terminal.path, 9600)
    port.close()
    port.close()
    with pytest.raises(OSError, match="has gone"):
        port.read(1, 0.0)
    with pytest.raises(OSError, match="has gone"):
        port.write(b"x")


def test_a_far_end_that_takes_nothing_does_not_hold_us_for_ever(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("drivers.hardware.WRITE_TIMEOUT_S", 0.05)
    port = open_serial(terminal.path, 9600)
    with pytest.raises(OSError, match="Write timeout"):
        port.write(bytes(1_000_000))
    port.close()


def test_one_port_has_one_user(terminal: Terminal, port: BytePort) -> None:
    with pytest.raises(NotPresent, match="another program has it open"):
        open_serial(terminal.path, 9600)
    port.close()
    open_serial(terminal.path, 9600).close()


def test_a_missing_port_says_what_to_look_at(tmp_path: Path) -> None:
    with pytest.raises(NotPresent, match=r"ttyUSB0: no such port; is the device plugged in"):
        open_serial(str(tmp_path / "ttyUSB0"), 9600)


def test_a_file_is_no_port(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("")
    with pytest.raises(NotPresent, match="cannot be opened as a serial port"):
        open_serial(str(path), 9600)


@pytest.mark.parametrize("baud", [0, -9600])
def test_a_baud_rate_is_positive(terminal: Terminal, baud: int) -> None:
    with pytest.raises(SettingsError, match="baud"):
        open_serial(terminal.path, baud)


def test_a_missing_bus_says_how_to_enable_it() -> None:
    with pytest.raises(NotPresent, match=r"/dev/i2c-9999: no such bus; enable I2C \(dtparam=i2c_arm=on"):
        open_i2c(9999, 1)


@pytest.mark.parametrize(("number", "words"), [
    (errno.EACCES, "group i2c"), (errno.ENOTTY, "cannot be opened as an I2C bus: Inappropriate ioctl"),
])
def test_a_bus_that_may_not_be_opened(number: int, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(bus: smbus2.SMBus, path: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(smbus2.SMBus, "open", refuse)
    with pytest.raises(NotPresent, match=words):
        open_i2c(1, 1)


def test_serial_rights_are_explained(monkeypatch: pytest.MonkeyPatch, terminal: Terminal) -> None:
    def refuse(path: str, flags: int) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("serial.serialposix.os.open", refuse)
    with pytest.raises(NotPresent, match="group dialout"):
        open_serial(terminal.path, 9600)
