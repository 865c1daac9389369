"""A thread per source, which only looks at its device at the right moment and queues what it got, with the time.

So a slow card or a slow window never delays a sample.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable

from drivers.dump import Event
from logger.service.supervisor import Supervisor
from logger.units import US_PER_S

CLOSED_WAIT_S = 0.1
STOP_WAIT_S = 2.0
HANG_US = 10 * US_PER_S
log = logging.getLogger(__name__)


def monotonic_us() -> int:
    """The monotonic clock in whole microseconds, the resolution of a recorded dump."""
    return time.monotonic_ns() // 1000


class Listener(threading.Thread):
    """Looks at one device for ever. ``pace`` waits between two looks.

    waiting_since_us    an event as early as this may still come [us]; None: none is held back
    """

    def __init__(self, supervisor: Supervisor, events: deque[Event], pace: Callable[[], None]) -> None:
        super().__init__(name=supervisor.name, daemon=True)
        self._supervisor = supervisor
        self._events = events
        self._pace = pace
        self._stop_asked = threading.Event()
        self.failure: BaseException | None = None
        self.waiting_since_us: int | None = None
        self.looked_us = monotonic_us()

    def run(self) -> None:
        """Until stopped. A fault that is not the device's ends the thread; the main loop sees it."""
        try:
            while not self._stop_asked.is_set():
                self.looked_us = monotonic_us()
                self.look()
                if self._supervisor.retry_at_us is not None:
                    self._stop_asked.wait(CLOSED_WAIT_S)
                else:
                    self._pace()
        except BaseException as failure:  # noqa: BLE001 - handed to the main thread, which raises it
            self.failure = failure
        finally:
            self._events.extend(self._supervisor.close())
            self.waiting_since_us = None

    def look(self) -> None:
        """Once. What comes is in the queue before ``waiting_since_us`` says that it does not wait any more."""
        self._events.extend(self._supervisor.step())
        self.waiting_since_us = self._supervisor.waiting_since_us

    def stop(self) -> None:
        """Ask it to end and wait for it, but not for one that hangs in its device."""
        self._stop_asked.set()
        self.join(STOP_WAIT_S)
        if self.is_alive():
            log.error("%s: its device does not return; stopping without it", self.name)

    def hangs(self, now_us: int) -> bool:
        """True when the device has not returned from a look for so long that only a restart can help."""
        return now_us - self.looked_us > HANG_US
