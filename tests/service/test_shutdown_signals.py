"""A wish to stop is heard whenever its signal comes, also in the middle of waiting."""

from __future__ import annotations

import os
import signal
import threading
import time

from logger.service.systemd_notify import Stop, stopped_by_signals


def test_a_signal_at_any_instant_of_waiting_is_heard() -> None:
    """Thousands of signals against a thread that does nothing but wait: one that finds the lock of an event held waits
    for it for ever, and the next ones in its midst, until the stack is full."""
    heard = []
    stop = Stop()
    before = signal.signal(signal.SIGALRM, lambda *_: heard.append(stop.set()))
    try:
        signal.setitimer(signal.ITIMER_REAL, 2e-4, 2e-4)
        until_s = time.monotonic() + 1.0
        while time.monotonic() < until_s:
            stop.wait(0.0)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        stop.close()
    assert len(heard) > 100


def test_terminating_asks_to_stop() -> None:
    with stopped_by_signals() as stop:
        assert not stop.is_set()
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.wait(10.0)


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
