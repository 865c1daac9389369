"""A recorded drive through the service: the real drivers on recorded buses, under a clock of its own.

The player is the only thing that differs from the live service. It sets the clock to the time of the next event,
lays the event's bytes on the recorded bus or port, and lets the supervised source look at its device once. What comes
goes to the core in order of time, as far as no source holds earlier events back.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drivers.dump import Event
from drivers.events import GPS
from drivers.recorded_wires import RecordedPort
from drivers.sources import Played, SerialSource
from logger.service.config import AccelerometerConfig
from logger.service.event_core import EventCore
from logger.service.event_merger import EventMerger
from logger.service.supervisor import Supervisor
from logger.units import US_PER_S

PROGRESS_EVERY_US = 60 * US_PER_S
LONGEST_HELD_US = US_PER_S


@dataclass(frozen=True)
class Playback:
    """How much was played: events, and the time from the first to the last [s]."""

    events: int
    duration_s: float


class Player:
    """Plays events of the accelerometer and of the GPS into a core; those of anything else are counted there as bad.

    rate        multiple of real time; 0: as fast as it goes
    progress    called about once a minute of drive with the time played [s]
    """

    def __init__(
        self, core: EventCore, accelerometer: AccelerometerConfig, rate: float, progress: Callable[[float], None]
    ) -> None:
        self._core = core
        self._rate = rate
        self._progress = progress
        self._clock_us = 0
        port = RecordedPort()
        receiver = SerialSource(GPS, lambda: port, self._now_us, wait_s=0.0)
        sensor = accelerometer.kind.played(accelerometer.settings, self._now_us)
        self._devices = {sensor.source.name: sensor, GPS: Played(receiver, port.load, port.has_bytes)}
        self._supervisors = {name: Supervisor(one.source, self._now_us) for name, one in self._devices.items()}
        self._chip = self._supervisors[sensor.source.name]
        self._merger = EventMerger()

    def play(self, events: Iterable[Event]) -> Playback:
        """All events, then the end of the drive."""
        count = 0
        first_us: int | None = None
        shown_us = 0
        started_s = time.monotonic()
        for event in events:
            t_us = event.t_us
            if first_us is None:
                first_us = shown_us = t_us
            if self._rate:
                _sleep_until(started_s + (t_us - first_us) / US_PER_S / self._rate)
            self._one(event)
            count += 1
            if t_us - shown_us >= PROGRESS_EVERY_US:
                shown_us = t_us
                self._progress((t_us - first_us) / US_PER_S)
        for supervisor in self._supervisors.values():
            self._merger.add(supervisor.close())
        self._feed_until(self._clock_us)
        self._core.finish()
        return Playback(count, (self._clock_us - first_us) / US_PER_S if first_us is not None else 0.0)

    def _one(self, event: Event) -> None:
        self._clock_us = event.t_us
        device = self._devices.get(event.source)
        if device is None:
            self._merger.add([event])
            self._feed(False)
            return
        device.load(event.data)
        supervisor = self._supervisors[event.source]
        seen = supervisor.step()
        self._merger.add(seen)
        while seen and device.has_more():
            seen = supervisor.step()
            self._merger.add(seen)
        self._feed(bool(seen) and supervisor is self._chip)

    def _feed(self, chip_gave: bool) -> None:
        """Give the core what is complete. A chip that is not heard any more must not hold up the rest."""
        held_us = self._chip.waiting_since_us
        if held_us is not None and self._clock_us - held_us > LONGEST_HELD_US:
            self._merger.add(self._chip.flush())
            held_us = None
        if held_us is None:
            self._feed_until(self._clock_us)
        elif chip_gave:
            self._feed_until(held_us - 1)

    def _feed_until(self, until_us: int) -> None:
        for event in self._merger.until(until_us):
            self._core.feed(event)

    def _now_us(self) -> int:
        return self._clock_us


def _sleep_until(monotonic_s: float) -> None:
    wait_s = monotonic_s - time.monotonic()
    if wait_s > 0:
        time.sleep(wait_s)
