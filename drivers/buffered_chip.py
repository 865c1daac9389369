"""What chips have in common that sample by their own clock into a buffer, which the host empties on a bus.

Problem: such a chip's rate is no more than nominal, its buffer gives samples without times, and one that ran over has
lost some. Solution: ``BufferedChip`` empties the buffer and says where entries were lost, also by a transfer that
failed; ``BufferedDecoder`` gives the samples their times (``SampleClock``) and starts them over after a loss;
``buffered_source`` looks often enough that the buffer stays half empty. A chip's own file has its registers, the bytes
of an entry, and their scale.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.chip_bus import ConfiguredChip, bus_fault
from drivers.dated_samples import DatedSamples, UndatedSamples
from drivers.errors import BadReply
from drivers.machine import Machine
from drivers.ports import I2cBus
from drivers.readings import UNREAD_CHIP, AccelerationBlock
from drivers.registers import Register, RegisterField
from drivers.sources import US_PER_S, ChipSource, Scattered

LONGEST_LOOK_US = 50_000
"""Between two looks: how late a reading may come, whatever the buffer holds."""


class BufferState(NamedTuple):
    """What a chip says of its buffer: how many entries it holds, whether some were lost, and the bytes that said so."""

    entries: int
    overrun: bool
    said: bytes


class BufferedChip(ConfiguredChip, ABC):
    """One chip on a bus. A driver's ``start`` empties the buffer and sets ``_lost``: what was before is gone.

    entry_bytes     of one entry, which a read at ``data_address`` takes out of the buffer
    """

    def __init__(self, name: str, bus: I2cBus, settings: Sequence[tuple[Register, Mapping[RegisterField, int]]],
                 data_address: int, entry_bytes: int) -> None:
        super().__init__(name, bus, settings)
        self._data_address = data_address
        self._entry_bytes = entry_bytes
        self._lost = True

    @abstractmethod
    def start(self) -> int:
        """Find the chip, set it up with an empty buffer, and let it measure. Gives the address that it answers at."""

    @abstractmethod
    def stop(self) -> None:
        """Let the chip stand by. Never raises."""

    @abstractmethod
    def _waiting(self, chip: int) -> BufferState:
        """Ask the chip about its buffer. OSError of the bus."""

    @abstractmethod
    def _marked(self, said: bytes, lost: bool) -> bytes:
        """What the chip said, with its mark of an overrun as ``lost`` has it."""

    def read(self, now_us: Callable[[], int]) -> tuple[int, bytes]:
        """The time at which the chip was asked how many entries it holds [us], and its answer: what it said, then each
        entry, oldest first. Empty where it holds none.

        Its mark of an overrun is also set where entries were lost between the last answer and this one: by a transfer
        that failed, or because the chip has been started.
        """
        chip = self._started()
        try:
            waiting = self._waiting(chip)
            t_us = now_us()
            if not waiting.entries:
                return t_us, b""
            lost = self._lost or waiting.overrun
            self._lost = True  # until all entries are here
            entries = [self._entry(chip) for _ in range(waiting.entries)]
        except OSError as error:
            raise bus_fault(error, chip) from error
        self._lost = False
        return t_us, self._marked(waiting.said, lost) + b"".join(entries)

    def _entry(self, chip: int) -> bytes:
        data = bytes(self._bus.read_i2c_block_data(chip, self._data_address, self._entry_bytes))
        if len(data) != self._entry_bytes:
            raise BadReply(f"{self.name} at 0x{chip:02X}: a read of {self._entry_bytes} bytes gave {len(data)}")
        return data


class Entries(NamedTuple):
    """Decoded entries of one answer: ``after_loss``, some were lost before them; accelerations (n, 3) [m/s2]; at an
    end of the range (n,)."""

    after_loss: bool
    accel_mps2: npt.NDArray[np.float64]
    clipped: npt.NDArray[np.bool_]


class BufferedDecoder(ABC):
    """What ``BufferedChip.read`` gave, in; samples with their times, out.

    check    what to look at where samples are lost
    """

    name: str
    check: ClassVar[str] = ("Check the wires of the bus, its clock (400 kHz for 400 samples a second and more), and "
                            "what else keeps the computer busy")

    def __init__(self, rate_hz: int, rate_tolerance: float) -> None:
        self._samples = DatedSamples(rate_hz, rate_tolerance)
        self._overruns = 0

    @abstractmethod
    def _decoded(self, data: bytes) -> Entries:
        """The entries of one answer. BadReply for what is none."""

    @property
    def doubt(self) -> str:
        """What is wrong with the samples that come; empty: nothing."""
        return self._samples.doubt(self.check)

    @property
    def note(self) -> str:
        """How the samples come; empty: as they should."""
        return self._samples.note

    unread = UNREAD_CHIP

    @property
    def counts(self) -> dict[str, int]:
        """What came in so far, and what is missing in it."""
        clock = self._samples.clock
        return {"samples": self._samples.good, "overruns": self._overruns, "lost": clock.lost,
                "resyncs": clock.resyncs, "undated": self._samples.undated}

    def feed(self, t_us: int, data: bytes) -> None:
        """Take the entries of one look at ``t_us``. BadReply (and nothing taken) for bytes that are none."""
        entries = self._decoded(data)
        count = len(entries.accel_mps2)
        self._overruns += entries.after_loss
        self._samples.add(UndatedSamples(
            after_loss=entries.after_loss, arrivals_us=np.full(count, t_us, dtype=np.int64),
            accel_mps2=entries.accel_mps2, clipped=entries.clipped, good=np.ones(count, dtype=np.bool_)))

    def flush(self) -> None:
        """No more will come: the next ``take`` gives all."""
        self._samples.flush()

    def take(self) -> AccelerationBlock:
        """The samples whose times are certain by now."""
        return self._samples.take()


def buffered_source(name: str, machine: Machine, i2c_bus: int, make_chip: Callable[[I2cBus], BufferedChip],
                    rate_hz: int, entries: int) -> ChipSource:
    """Looks that leave a buffer of so many entries half empty."""
    interval_us = US_PER_S // rate_hz
    look_us = min(LONGEST_LOOK_US, entries // 2 * interval_us)
    return ChipSource(name, lambda: machine.open_i2c(i2c_bus, None), make_chip, machine.now_us,
                      Scattered(look_us, interval_us, machine.sleep))
