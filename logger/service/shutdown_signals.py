"""A wish to stop that signals utter.

Problem: a handler runs in the main thread between any two steps of it. If that thread waits for a ``threading.Event``
and just holds the event's lock, which is not reentrant, a handler that sets the event waits for its own thread for
ever. Solution: the handler only writes a byte to a pipe, and the one who waits looks at the pipe.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
from collections.abc import Iterator


class Stop:
    """Asked for once, by a handler or another thread; from then on it is set."""

    def __init__(self) -> None:
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._writer, False)
        self._asked = False

    def set(self) -> None:
        """Ask for it."""
        self._asked = True
        with contextlib.suppress(BlockingIOError):  # a full pipe holds the request already
            os.write(self._writer, b"!")

    def is_set(self) -> bool:
        """Whether it was asked for."""
        return self._asked

    def wait(self, seconds: float) -> bool:
        """Wait until it is asked for, but no longer than so many seconds; whether it was."""
        select.select([self._reader], [], [], seconds)
        return self._asked

    def close(self) -> None:
        """Give the pipe back."""
        os.close(self._reader)
        os.close(self._writer)


@contextlib.contextmanager
def stopped_by_signals() -> Iterator[Stop]:
    """A wish that Ctrl-C and SIGTERM utter, while inside."""
    stop = Stop()
    wanted = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: stop.set()) for number in wanted]
    try:
        yield stop
    finally:
        for number, handler in zip(wanted, before, strict=True):
            signal.signal(number, handler)
        stop.close()
