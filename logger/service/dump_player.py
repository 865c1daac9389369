"""A recorded drive through the service: its events to the core, as the live service gave them.

A dump holds what the core was given while it was recorded, in that order: what a driver had made sure of, and merged
by time. So nothing of the drivers' part is done again, and what the live service made of the drive comes out.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drivers.dump import Event
from logger.service.event_core import EventCore
from logger.units import US_PER_S

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
        self._core = core
        self._rate = rate
        self._progress = progress

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
                _sleep_until(started_s + (t_us - first_us) / US_PER_S / self._rate)
            self._core.feed(event)
            count += 1
            if t_us - shown_us >= PROGRESS_EVERY_US:
                shown_us = t_us
                self._progress((t_us - first_us) / US_PER_S)
        self._core.finish()
        return Playback(count, (t_us - first_us) / US_PER_S if first_us is not None else 0.0)


def _sleep_until(monotonic_s: float) -> None:
    wait_s = monotonic_s - time.monotonic()
    if wait_s > 0:
        time.sleep(wait_s)
