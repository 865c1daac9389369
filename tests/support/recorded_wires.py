"""Recorded wires: an I2C bus and a serial port that play a recording and misbehave on cue.

Problem: what goes wrong on real wires must be tried on purpose. Solution: ``RecordedBus`` and ``RecordedPort`` offer
the methods of the real ones and raise the same ``OSError``. Each works in one of two ways:

- loaded: the player calls ``load`` with the bytes of an event, and the driver reads them;
- playing: the recording runs against a clock that is handed in, and a read gives what is there by now.

A ``Cue`` says what goes wrong and when. After ``close`` the wire may be used again: that opens it again.
"""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Protocol, Self

from drivers.accelerometers.bma220 import Bma220Chip
from drivers.played_bus import PlayedBus, PlayedRecording, RecordedChip, os_error
from drivers.readings import US_PER_S, Event


class Fault(Enum):
    """What can happen to a wire.

    NACK         bus: the next ``count`` transfers are not acknowledged
    TIMEOUT      bus: the next ``count`` transfers time out; port: the next ``count`` reads find nothing
    SHORT_READ   port: the next ``count`` reads give one byte at most
    BUSY         bus: the next ``count`` transfers find that a kernel driver owns the address
    STUCK_LOW    bus: the chip holds SDA low and transfers time out, until its own watchdog lets go (after one
                 transfer, if it was switched on) or its power goes
    BROWN_OUT    bus: the chip's supply dips; it runs on with its default settings
    UNPLUG       nothing answers, and what is sent meanwhile is lost
    REPLUG       the plug is back: a chip has its defaults; a port must be closed and opened again
    """

    NACK = auto()
    TIMEOUT = auto()
    SHORT_READ = auto()
    BUSY = auto()
    STUCK_LOW = auto()
    BROWN_OUT = auto()
    UNPLUG = auto()
    REPLUG = auto()


BUS_FAULTS = frozenset(Fault) - {Fault.SHORT_READ}
PORT_FAULTS = frozenset({Fault.TIMEOUT, Fault.SHORT_READ, Fault.UNPLUG, Fault.REPLUG})
TRANSFER_ERRNO = {Fault.NACK: errno.EREMOTEIO, Fault.TIMEOUT: errno.ETIMEDOUT, Fault.BUSY: errno.EBUSY}


@dataclass(frozen=True)
class Cue:
    """``fault`` happens at a moment: at the recording's time ``at_us`` [us], or just before the data read number
    ``at_read``, counted from 0 (a burst on a bus, a ``read`` on a port)."""

    fault: Fault
    at_us: int | None = None
    at_read: int | None = None
    count: int = 1

    def __post_init__(self) -> None:
        if (self.at_us is None) == (self.at_read is None):
            raise ValueError("a cue has either at_us or at_read")
        if self.count < 1:
            raise ValueError(f"a cue happens at least once, not {self.count} times")


class _Cues:
    """The cues still to come on one wire."""

    def __init__(self, cues: Iterable[Cue], possible: frozenset[Fault], now_us: Callable[[], int] | None) -> None:
        self._waiting = list(cues)
        self._now_us = now_us
        for cue in self._waiting:
            if cue.fault not in possible:
                raise ValueError(f"{cue.fault.name} cannot happen on this kind of wire")
            if cue.at_us is not None and now_us is None:
                raise ValueError("a cue with at_us needs a clock")

    def due(self, reads: int) -> list[Cue]:
        """Take out what happens by now; ``reads`` data reads have begun."""
        if not self._waiting:
            return []
        now_us = self._now_us() if self._now_us is not None else 0
        due = [
            cue for cue in self._waiting
            if (cue.at_us is not None and cue.at_us <= now_us) or (cue.at_read is not None and cue.at_read < reads)
        ]
        self._waiting = [cue for cue in self._waiting if cue not in due]
        return due


class FailingChip(RecordedChip, Protocol):
    """A chip whose power and watchdog can be tried; ``watchdog_on``: it lets go of a bus that it holds low."""

    @property
    def watchdog_on(self) -> bool: ...
    def lose_power(self) -> None: ...


class WithoutWatchdog(Bma220Chip):
    """A chip whose watchdog does nothing, whatever it is told."""

    watchdog_on = False


class RecordedBus(PlayedBus):
    """A played bus that fails on cue, or is loaded: ``load`` puts a sample into the data registers, over one that
    nobody has read; a burst takes it out. ``now_us`` is only needed for cues with ``at_us``."""

    chip: FailingChip

    def __init__(self, chip: FailingChip, cues: Iterable[Cue] = (), now_us: Callable[[], int] | None = None,
                 address: int = 0x0A, recording: PlayedRecording | None = None) -> None:
        super().__init__(chip, recording, address)
        self._cues = _Cues(cues, BUS_FAULTS, now_us)
        self._failing: list[int] = []
        self._unplugged = False
        self._stuck_low = False
        self._reads = 0

    @classmethod
    def playing(cls, chip: FailingChip, events: Iterable[Event], now_us: Callable[[], int], cues: Iterable[Cue] = (),
                first_us: int | None = None) -> Self:
        """A bus on which ``events`` (of this sensor only) happen from now on, the first at once unless ``first_us``
        names another start on the recording's scale."""
        recording = PlayedRecording(events, now_us, first_us)
        return cls(chip, cues, recording.now_us, recording=recording)

    def load(self, data: bytes) -> None:
        """Put one whole sample into the data registers. DumpError on any other length."""
        self._latest = self._whole_sample(data)

    def _sample(self) -> bytes:
        data = super()._sample()
        if self._recording is None:
            self._latest = None
        return data

    def _transfer(self, i2c_addr: int, read_register: int | None) -> None:
        """What comes before the bytes: address, acknowledgement, and whatever goes wrong. A burst that fails here
        loses its sample, as on a real wire."""
        if read_register == self.chip.data_address:
            self._reads += 1
        for cue in self._cues.due(self._reads):
            self._happen(cue)
        failure = self._failure(i2c_addr)
        if failure:
            if read_register == self.chip.data_address:
                self._latest = None
            raise os_error(failure)

    def _failure(self, i2c_addr: int) -> int:
        """The errno of this transfer, 0 when it goes well."""
        if self._unplugged:
            return errno.EREMOTEIO
        if self._stuck_low:
            self._stuck_low = not self.chip.watchdog_on
            return errno.ETIMEDOUT
        if self._failing:
            return self._failing.pop(0)
        return 0 if i2c_addr == self._address else errno.EREMOTEIO

    def _happen(self, cue: Cue) -> None:
        if cue.fault in TRANSFER_ERRNO:
            self._failing += [TRANSFER_ERRNO[cue.fault]] * cue.count
        elif cue.fault is Fault.STUCK_LOW:
            self._stuck_low = True
        else:
            self._unplugged = cue.fault is Fault.UNPLUG
            self._stuck_low = False
            self.chip.lose_power()


class RecordedPort:
    """A serial port on which recorded bytes arrive. What a driver writes is kept in ``written``.

    Loaded: ``load`` adds bytes to those that wait; a read takes at most ``size`` of them and never waits.
    Playing: bytes arrive when they did in the recording; a read waits for the first as a real port does.
    """

    def __init__(self, cues: Iterable[Cue] = (), now_us: Callable[[], int] | None = None) -> None:
        self.written = bytearray()
        self._cues = _Cues(cues, PORT_FAULTS, now_us)
        self._waiting = bytearray()
        self._recording: PlayedRecording | None = None
        self._sleep: Callable[[float], None] | None = None
        self._unplugged = False
        self._gone = False
        self._silent_reads = 0
        self._short_reads = 0
        self._reads = 0

    @classmethod
    def playing(
        cls,
        events: Iterable[Event],
        now_us: Callable[[], int],
        sleep: Callable[[float], None],
        cues: Iterable[Cue] = (),
        first_us: int | None = None,
    ) -> Self:
        """A port on which ``events`` (of this port only) happen from now on, the first at once unless ``first_us``
        names another start on the recording's scale. ``sleep`` takes seconds."""
        recording = PlayedRecording(events, now_us, first_us)
        port = cls(cues, recording.now_us)
        port._recording = recording
        port._sleep = sleep
        return port

    def load(self, data: bytes) -> None:
        """Bytes arrive, and are lost when the port is unplugged."""
        if not self._gone:
            self._waiting += data

    def read(self, size: int, timeout_s: float) -> bytes:
        self._reads += 1
        self._cue()
        if self._silent_reads:
            self._silent_reads -= 1
            self._pause(timeout_s)
            return b""
        self._arrive()
        if not self._waiting:
            self._pause(self._until_next_s(timeout_s))
            self._cue()
            self._arrive()
        if self._short_reads:
            self._short_reads -= 1
            size = min(size, 1)
        data = bytes(self._waiting[:size])
        del self._waiting[:size]
        return data

    def write(self, data: bytes) -> int:
        self._cue()
        self.written += data
        return len(data)

    def close(self) -> None:
        """Let go. The next use is a port just opened: without old input, and well again if the plug is back."""
        self._gone = self._unplugged
        self._waiting.clear()

    def _cue(self) -> None:
        """Let happen what is due; OSError EIO while the port has gone."""
        for cue in self._cues.due(self._reads):
            if cue.fault is Fault.TIMEOUT:
                self._silent_reads += cue.count
            elif cue.fault is Fault.SHORT_READ:
                self._short_reads += cue.count
            elif cue.fault is Fault.REPLUG:
                self._unplugged = False
            else:
                self._unplugged = self._gone = True
                self._waiting.clear()
        if self._gone:
            self._arrive()
            raise os_error(errno.EIO)

    def _arrive(self) -> None:
        if self._recording is not None:
            for data in self._recording.until_now():
                self.load(data)

    def _until_next_s(self, timeout_s: float) -> float:
        next_us = self._recording.next_us() if self._recording is not None else None
        if self._recording is None or next_us is None:
            return timeout_s
        return min(timeout_s, (next_us - self._recording.now_us()) / US_PER_S)

    def _pause(self, wait_s: float) -> None:
        if self._sleep is not None and wait_s > 0:
            self._sleep(wait_s)
