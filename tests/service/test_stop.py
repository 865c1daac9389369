"""A wish to stop is heard whenever its signal comes, also in the middle of waiting."""

from __future__ import annotations

import os
import signal
import threading
import time

from logger.service.stop import Stop, stopped_by_signals


def test_a_signal_at_any_instant_of_waiting_is_heard() -> None:
    """A thousand signals against a thread that does nothing but wait: with the lock of an event, one of them would
    find that held and wait for ever."""
    heard = 0
    with stopped_by_signals() as stop:
        sent = threading.Thread(target=lambda: [(os.kill(os.getpid(), signal.SIGTERM), time.sleep(1e-4))
                                                for _ in range(1000)])
        sent.start()
        while sent.is_alive():
            heard += stop.wait(1e-5)
    assert heard and stop.is_set()


def test_waiting_ends_when_it_is_asked_for_and_not_before() -> None:
    stop = Stop()
    began_s = time.monotonic()
    assert not stop.wait(0.05)
    assert time.monotonic() - began_s > 0.04
    threading.Timer(0.05, stop.set).start()
    assert stop.wait(30.0) and stop.wait(30.0) and stop.is_set()
    assert time.monotonic() - began_s < 20.0
    stop.close()


def test_more_wishes_than_a_pipe_holds_are_no_more_than_one() -> None:
    stop = Stop()
    for _ in range(100_000):
        stop.set()
    assert stop.wait(1.0)
    stop.close()


def test_handlers_go_back_to_what_they_were() -> None:
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with stopped_by_signals():
        assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] != before
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
