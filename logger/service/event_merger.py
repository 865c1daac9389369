"""Events of several sources, brought into order of time."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable

from drivers.dump import Event


class EventMerger:
    """Each source brings its events in order of time, and some of them late."""

    def __init__(self) -> None:
        self._waiting: list[Event] = []

    def add(self, events: Iterable[Event]) -> None:
        """More events, of any source."""
        self._waiting.extend(events)

    def until(self, until_us: int) -> list[Event]:
        """Take out the events up to ``until_us`` [us], in order; before that no source may bring any more."""
        self._waiting.sort(key=_time_of)
        count = bisect_right(self._waiting, until_us, key=_time_of)
        ready, self._waiting = self._waiting[:count], self._waiting[count:]
        return ready


def _time_of(event: Event) -> int:
    return event.t_us
