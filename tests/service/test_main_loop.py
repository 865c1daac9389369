"""The parts of the live loop that a whole process cannot show."""

from __future__ import annotations

import random
import threading
import time
from collections import deque

import pytest

from drivers.dump import Event
from drivers.errors import NotPresent
from drivers.sources import Deadlines
from logger.service import main_loop
from logger.service.main_loop import Listener, MainLoop, monotonic_us
from logger.service.supervisor import Supervisor


class Stuck:
    """A device whose driver never returns."""

    name = "bma220"
    dropped = 0
    waiting_since_us = None

    def __init__(self) -> None:
        self.release = threading.Event()

    def open(self) -> None:
        """Opens well."""

    def poll(self) -> list[Event]:
        self.release.wait()
        raise NotPresent("released")

    def flush(self) -> list[Event]:
        return []

    def close(self) -> None:
        """Nothing to let go of."""


def test_a_device_that_never_returns_is_noticed_and_does_not_hold_up_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(main_loop, "STOP_WAIT_S", 0.05)
    device = Stuck()
    listener = Listener(Supervisor(device, monotonic_us), deque(), lambda: None)
    listener.start()
    assert not listener.hangs(monotonic_us())
    assert listener.hangs(monotonic_us() + main_loop.HANG_US + 1_000_000)
    began_s = time.monotonic()
    listener.stop()
    assert time.monotonic() - began_s < 1.0
    device.release.set()
    listener.join()


class Syncs:
    """A storage that notes when it was synced."""

    def __init__(self) -> None:
        self.count = 0

    def sync(self) -> None:
        self.count += 1


@pytest.mark.parametrize(("sync_s", "longest_s"), [(1.0, 1.0), (0.1, 0.0), (3.0, 3.0)])
def test_what_was_written_is_synced_before_it_is_as_old_as_the_settings_allow(sync_s: float, longest_s: float) -> None:
    storage = Syncs()
    service = MainLoop(None, storage, [], deque(), sync_s, 2.0, lambda now_us: None)  # type: ignore[arg-type]
    rng = random.Random(4)
    now_us, oldest_us, ages_us = 0, None, []
    for _ in range(200):
        now_us += 500_000 + rng.randrange(3_000)  # a round, and what it wrote
        oldest_us = now_us if oldest_us is None else oldest_us
        before = storage.count
        service.sync_in_time(now_us)
        if storage.count > before:
            ages_us.append(now_us - oldest_us)
            oldest_us = None
    assert max(ages_us) <= longest_s * 1e6
    assert storage.count <= 200 * 0.5 / max(sync_s, 0.5) + 1  # and not more often than that needs


def test_deadlines_that_are_missed_are_counted_and_skipped() -> None:
    deadlines = Deadlines(5_000, monotonic_us, time.sleep)
    deadlines.wait()
    time.sleep(0.021)
    deadlines.wait()
    assert deadlines.missed >= 3
    before_us = monotonic_us()
    for _ in range(5):
        deadlines.wait()
    # Five steps, less what the last wait was late by: a step at most, or it would have been skipped.
    assert monotonic_us() - before_us >= 20_000
