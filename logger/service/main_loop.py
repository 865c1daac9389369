"""The loop of the service, and where its events come from: threads that listen, or a recording.

Each source has a thread of its own, which only looks at its device at the right moment and queues what it got, with the
time: so a slow card or a slow window never delays a sample. The main loop empties the queue twice a second, brings the
events into order of time, as far as no source holds earlier ones back, records them if asked to, feeds the core, and
reports to systemd and the status file. A pipeline that hangs stops feeding the watchdog. What was written is synced at
every second round: a row is on the disk half a second after it was made, or later where ``sync_s`` allows it.

A dump holds what the core was given while it was recorded, in that order: what a driver had made sure of, and merged
by time. So nothing of the drivers' part is done again, and what the live service made of the drive comes out.
"""

import gc
import logging
import sys
import threading
import time
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drivers.dump import Event
from drivers.sources import GATHER_S, SCATTER_S
from logger.service.event_core import EventCore
from logger.service.storage import Storage
from logger.service.supervisor import Supervisor
from logger.service.systemd_notify import Stop
from logger.units import US_PER_S


class EventMerger:
    """Each source brings its events in order of time, and some of them late."""

    def __init__(self) -> None:
        self._waiting: list[Event] = []

    def add(self, events: Iterable[Event]) -> None:
        self._waiting.extend(events)

    def until(self, until_us: int) -> list[Event]:
        """Take out the events up to ``until_us`` [us], in order; before that no source may bring any more."""
        self._waiting.sort(key=_time_of)
        count = bisect_right(self._waiting, until_us, key=_time_of)
        ready, self._waiting = self._waiting[:count], self._waiting[count:]
        return ready


def _time_of(event: Event) -> int:
    return event.t_us


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
        self._supervisor, self._events, self._pace = supervisor, events, pace
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
        self.waiting_since_us = self._supervisor.source.waiting_since_us

    def stop(self) -> None:
        """Ask it to end and wait for it, but not for one that hangs in its device."""
        self._stop_asked.set()
        self.join(STOP_WAIT_S)
        if self.is_alive():
            log.error("%s: its device does not return; stopping without it", self.name)

    def hangs(self, now_us: int) -> bool:
        """True when the device has not returned from a look for so long that only a restart can help."""
        return now_us - self.looked_us > HANG_US


PROGRESS_EVERY_US = 60 * US_PER_S


@dataclass(frozen=True)
class Playback:
    """How much was played: events, and the time from the first to the last [s]."""

    events: int
    duration_s: float


class Player:
    """Plays events into a core; those that are neither the accelerometer's nor the receiver's are counted there as bad.

    rate        multiple of real time; 0: as fast as it goes
    progress    called about once a minute of drive with the time played [s]
    """

    def __init__(self, core: EventCore, rate: float, progress: Callable[[float], None]) -> None:
        self._core, self._rate, self._progress = core, rate, progress

    def play(self, events: Iterable[Event]) -> Playback:
        """All events, then the end of the drive."""
        count = 0
        first_us: int | None = None
        t_us = shown_us = 0
        started_s = time.monotonic()
        for event in events:
            t_us = event.t_us
            if first_us is None:
                first_us = shown_us = t_us
            if self._rate:
                time.sleep(max(0.0, started_s + (t_us - first_us) / US_PER_S / self._rate - time.monotonic()))
            self._core.feed(event)
            count += 1
            if t_us - shown_us >= PROGRESS_EVERY_US:
                shown_us = t_us
                self._progress((t_us - first_us) / US_PER_S)
        self._core.finish()
        return Playback(count, (t_us - first_us) / US_PER_S if first_us is not None else 0.0)


LOOP_S = 0.5
HOLD_BACK_US = round((GATHER_S + SCATTER_S) * US_PER_S)
THREAD_SWITCH_S = 0.0005


class MainLoop:
    """The main loop.

    ``beat`` is called every ``beat_s`` [s] or so, after the pipeline has moved: status file and watchdog hang on it.
    """

    def __init__(self, core: EventCore, storage: Storage, listeners: list[Listener], events: deque[Event],
                 sync_s: float, beat_s: float, beat: Callable[[int], None]) -> None:
        self._core, self._storage, self._listeners, self._events = core, storage, listeners, events
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
