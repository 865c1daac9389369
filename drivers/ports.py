"""The two kinds of wire a driver may hold, as protocols. Real ones and replayed ones look the same."""

from __future__ import annotations

from typing import Protocol


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
