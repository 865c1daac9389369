"""The drive that the guest's sensors see, and the receiver at its serial port.

The chip's part lies in the shared folder as a recorded dump, which ``in_guest/chip.py`` plays into the registers of a
chip, or the service itself plays (``i2c_bus: dump:FILE``). The receiver's sentences are sent from the host, in real
time, into a terminal that is the guest's serial port: a receiver has power of its own and does not know when the
guest boots.
"""

from __future__ import annotations

import fcntl
import os
import struct
import termios
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from drivers.dump import DumpHeader, DumpWriter, Event, open_dump
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from ...support.drives.simulated_drive import DrivePlan, RoadStretch, record, simulate_drive

FAST_MPS, SLOW_MPS = 20.0, 14.0
SPEED_CHANGE_S = 30.0
MOST_UNREAD_BYTES = 400  # some sentences: what a UART and its driver hold


def make_drive(path: Path, seconds: float) -> None:
    """A car that moves from the first second on and never stands: windows come two to three a second."""
    knots = [(0.0, SLOW_MPS)]
    while knots[-1][0] < seconds:
        t_s, speed = knots[-1]
        knots.append((t_s + SPEED_CHANGE_S, FAST_MPS if speed == SLOW_MPS else SLOW_MPS))
    plan = DrivePlan(speed_knots=knots, stretches=(RoadStretch(500, 60), RoadStretch(500, 200)), seed=18)
    record(simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009"))), path)


def part_of(dump: Path, source: str) -> tuple[DumpHeader, list[Event]]:
    """The events of one source of a recording."""
    with open_dump(dump) as reader:
        return reader.header, [event for event in reader if event.source == source]


def only(dump: Path, source: str, path: Path) -> None:
    """Write a recording that holds only one of its sources."""
    header, events = part_of(dump, source)
    writer = DumpWriter(path, header)
    for event in events:
        writer.write(event)
    writer.close()


class Receiver:
    """A GPS receiver on a pseudo-terminal; ``port`` is the end that the guest is given.

    It sends the drive's sentences from its beginning, in real time, from ``begin`` on, and again from the start at the
    next ``begin``. ``silent`` holds it back while it is set: its plug is pulled.
    """

    def __init__(self, dump: Path) -> None:
        _, self._events = part_of(dump, "nmea")
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)
        self.silent = threading.Event()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
                 ) -> None:
        self.end()
        os.close(self._master)
        os.close(self._slave)

    def begin(self) -> None:
        """Send the drive from its start."""
        self.end()
        self._stop.clear()
        self._thread = threading.Thread(target=self._send, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Send no more."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()

    def _send(self) -> None:
        began_s = time.monotonic()
        for event in self._events:
            wait_s = began_s + (event.t_us - self._events[0].t_us) / 1e6 - time.monotonic()
            if self._stop.wait(max(wait_s, 0)):
                return
            if not self.silent.is_set():
                self._forget_unread()
                with suppress(BlockingIOError):
                    os.write(self._master, event.data)

    def _forget_unread(self) -> None:
        """A serial line keeps nothing for a machine that does not listen yet; a pseudo-terminal would."""
        waiting = struct.unpack("i", fcntl.ioctl(self._slave, termios.FIONREAD, b"\0" * 4))[0]
        if waiting > MOST_UNREAD_BYTES:
            termios.tcflush(self._slave, termios.TCIFLUSH)
