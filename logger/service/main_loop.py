"""The live service: threads that listen, one loop that thinks.

Each source has a thread of its own (``logger.service.listener``) that puts what it got into a queue. The main loop
empties the queue twice a second, brings the events into order of time, as far as no source holds earlier ones back,
records them if asked to, feeds the core, and reports to systemd and the status file. A pipeline that hangs
stops feeding the watchdog.
What was written is synced at every second round: a row is on the disk half a second after it was made, or later where
``sync_s`` allows it.
"""

from __future__ import annotations

import gc
import sys
from collections import deque
from collections.abc import Callable

from drivers.dump import Event
from logger.service.event_core import EventCore
from logger.service.event_merger import EventMerger
from logger.service.listener import Listener, monotonic_us
from logger.service.shutdown_signals import Stop
from logger.service.storage import Storage
from logger.units import US_PER_S

LOOP_S = 0.5
HOLD_BACK_US = 60_000
THREAD_SWITCH_S = 0.0005


class MainLoop:
    """The main loop.

    ``beat`` is called every ``beat_s`` [s] or so, after the pipeline has moved: status file and watchdog hang on it.
    """

    def __init__(
        self,
        core: EventCore,
        storage: Storage,
        listeners: list[Listener],
        events: deque[Event],
        sync_s: float,
        beat_s: float,
        beat: Callable[[int], None],
    ) -> None:
        self._core = core
        self._storage = storage
        self._listeners = listeners
        self._events = events
        self._merger = EventMerger()
        self._sync_us = round(sync_s * US_PER_S)
        self._beat_us = round(beat_s * US_PER_S)
        self._beat = beat
        self._floor_us = 0
        self._unsynced_us: int | None = None

    def run(self, stop: Stop) -> None:
        """Until ``stop`` is set; then finish the current window and close the files."""
        sys.setswitchinterval(THREAD_SWITCH_S)
        for listener in self._listeners:
            listener.start()
        gc.collect()
        gc.freeze()
        beat_us = monotonic_us()
        while not stop.wait(LOOP_S):
            now_us = monotonic_us()
            self.move(now_us)
            self.sync_in_time(now_us)
            self._storage.tend()
            if now_us - beat_us >= self._beat_us:
                beat_us = now_us
                self._beat(now_us)
        self._end()

    def _end(self) -> None:
        for listener in self._listeners:
            listener.stop()
        self._feed_until(monotonic_us())
        self._core.finish()
        self._storage.close()

    def move(self, now_us: int) -> None:
        """Take the events as far as they are complete; later ones wait for earlier ones that may still come.

        Only events move the pipeline. Time that passes without any would leave no trace in a recording, and what it
        did could not be played again.
        """
        held_us = [listener.waiting_since_us for listener in self._listeners]
        self._feed_until(min([now_us - HOLD_BACK_US, *(since_us - 1 for since_us in held_us if since_us is not None)]))

    def _feed_until(self, until_us: int) -> None:
        for listener in self._listeners:
            if listener.failure is not None:
                raise listener.failure
        self._merger.add([self._events.popleft() for _ in range(len(self._events))])
        for event in self._merger.until(until_us):
            self._take(event)

    def _take(self, event: Event) -> None:
        if event.t_us < self._floor_us:
            event = event._replace(t_us=self._floor_us)
        self._floor_us = event.t_us
        self._storage.record(event)
        self._core.feed(event)

    def sync_in_time(self, now_us: int) -> None:
        """Sync where it is time for that, asked once a round [us, monotonic]: what was written since the last sync must
        not be older than ``sync_s`` in the next round."""
        if self._unsynced_us is None:
            self._unsynced_us = now_us
        if now_us + LOOP_S * US_PER_S - self._unsynced_us > self._sync_us:
            self._unsynced_us = None
            self._storage.sync()
