"""The parts of the live loop that a whole process cannot show."""

from __future__ import annotations

import threading
import time
from collections import deque

import pytest

from drivers.dump import Event
from drivers.errors import NotPresent
from logger.service import live
from logger.service.live import Deadlines, Listener, monotonic_us
from logger.service.supervisor import Supervisor


class Stuck:
    """A device whose driver never returns."""

    name = "bma220"

    def __init__(self) -> None:
        self.release = threading.Event()

    def open(self) -> None:
        """Opens well."""

    def poll(self) -> Event | None:
        self.release.wait()
        raise NotPresent("released")

    def close(self) -> None:
        """Nothing to let go of."""


def test_a_device_that_never_returns_is_noticed_and_does_not_hold_up_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "STOP_WAIT_S", 0.05)
    device = Stuck()
    listener = Listener(Supervisor(device, monotonic_us), deque(), lambda: None)
    listener.start()
    assert not listener.hangs(monotonic_us())
    assert listener.hangs(monotonic_us() + live.HANG_US + 1_000_000)
    began_s = time.monotonic()
    listener.stop()
    assert time.monotonic() - began_s < 1.0
    device.release.set()
    listener.join()


def test_deadlines_that_are_missed_are_counted_and_skipped() -> None:
    deadlines = Deadlines(step_us=5_000)
    deadlines.wait()
    time.sleep(0.021)
    deadlines.wait()
    assert deadlines.missed >= 3
    before_us = monotonic_us()
    deadlines.wait()
    assert monotonic_us() - before_us >= 4_000
