"""What a source may use of the computer that it runs on, handed in, so that tests can hand in another one."""

from __future__ import annotations

import select
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from drivers.hardware import open_i2c, open_serial
from drivers.ports import BytePort, I2cBus


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
