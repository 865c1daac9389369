"""An I2C bus that plays a recording.

Problem: the whole service must run at a desk, on what was recorded in a car, through the very driver that it uses in
the car. Solution: ``PlayedBus`` offers the methods of a real bus, with a model of the chip's registers on it, and
raises the same ``OSError``. The recording runs against a clock that is handed in, and a read gives what is there by
now.
"""

import errno
import os
from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

from drivers.errors import DumpError
from drivers.readings import Event


class PlayedRecording:
    """Events in order of time against a clock that starts now, at the recording's time ``first_us`` (its first
    event when None). Holds one event at a time."""

    def __init__(self, events: Iterable[Event], clock_us: Callable[[], int], first_us: int | None) -> None:
        self._events = iter(events)
        self._next = next(self._events, None)
        if first_us is None:
            first_us = self._next.t_us if self._next is not None else 0
        self._clock_us = clock_us
        self._offset_us = first_us - clock_us()

    def now_us(self) -> int:
        """The time on the recording's own scale."""
        return self._clock_us() + self._offset_us

    def next_us(self) -> int | None:
        """When the next event comes; None after the last."""
        return self._next.t_us if self._next is not None else None

    def until_now(self) -> Iterator[bytes]:
        """Take the events that have come by now."""
        now_us = self.now_us()
        while self._next is not None and self._next.t_us <= now_us:
            data = self._next.data
            self._next = next(self._events, None)
            yield data


class RecordedChip(Protocol):
    """A chip on such a bus, as a model of its registers.

    data_address, sample_bytes    a read of so many bytes from there on takes a sample
    sample                        gives the bytes of one
    """

    data_address: int
    sample_bytes: int
    sample: Callable[[], bytes]

    def read(self, address: int, length: int = 1) -> bytes: ...
    def write(self, address: int, value: int) -> None: ...


class PlayedBus:
    """An I2C bus with one chip on it, whose data registers give recorded samples: a burst gives the latest at or before
    the present. With nothing to give, a burst is not acknowledged: a sample is never invented. A sample of the wrong
    length is a DumpError when it is its turn."""

    def __init__(self, chip: RecordedChip, recording: PlayedRecording | None, address: int = 0x0A) -> None:
        self.chip = chip
        self.chip.sample = self._sample
        self._address, self._recording = address, recording
        self._latest: bytes | None = None

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        self._transfer(i2c_addr, register)
        return self.chip.read(register)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        self._transfer(i2c_addr, None)
        self.chip.write(register, value)

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        self._transfer(i2c_addr, register)
        return list(self.chip.read(register, length=length))

    def close(self) -> None:
        """Nothing to let go of."""

    def _transfer(self, i2c_addr: int, read_register: int | None) -> None:
        """What comes before the bytes: address and acknowledgement."""
        if i2c_addr != self._address:
            raise os_error(errno.EREMOTEIO)

    def _whole_sample(self, data: bytes) -> bytes:
        if len(data) != self.chip.sample_bytes:
            raise DumpError(f"a recorded read of the chip has {len(data)} bytes, expected {self.chip.sample_bytes}")
        return data

    def _sample(self) -> bytes:
        for data in self._recording.until_now() if self._recording is not None else ():
            self._latest = self._whole_sample(data)
        if self._latest is None:
            raise os_error(errno.EREMOTEIO)
        return self._latest


def os_error(number: int) -> OSError:
    """What the system raises for an errno."""
    return OSError(number, os.strerror(number))
