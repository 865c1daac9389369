"""Chips on an I2C bus: their registers, what a failed transfer means, and buffers that the host empties."""

import errno
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.errors import BadReply, DeviceError, NotPresent, SettingsError, SettingsLost, Timeout, WrongDevice
from drivers.hardware import I2cBus, Machine
from drivers.readings import UNREAD_CHIP, US_PER_S, AccelerationBlock
from drivers.sample_clock import DatedSamples, UndatedSamples
from drivers.sources import ChipSource, Scattered


@dataclass(frozen=True)
class RegisterField:
    """Bits ``high_bit`` down to ``low_bit`` of a byte register, both included."""

    name: str
    high_bit: int
    low_bit: int

    def __post_init__(self) -> None:
        if not 0 <= self.low_bit <= self.high_bit <= 7:
            raise ValueError(f"field {self.name}: bits {self.high_bit}:{self.low_bit} are not inside a byte")

    @property
    def largest(self) -> int:
        return (1 << (self.high_bit - self.low_bit + 1)) - 1

    @property
    def mask(self) -> int:
        return self.largest << self.low_bit

    def extract(self, byte: int) -> int:
        """The field's value in ``byte``."""
        return (byte & self.mask) >> self.low_bit

    def insert(self, byte: int, value: int) -> int:
        """``byte`` with this field set to ``value``; SettingsError when it does not fit."""
        if not 0 <= value <= self.largest:
            raise SettingsError(f"{self.name} takes 0 to {self.largest}, not {value}")
        return (byte & ~self.mask) | (value << self.low_bit)


@dataclass(frozen=True)
class Register:
    """A byte register that may be read at any time, as the data sheet has it.

    reset_value    what it holds after power-on
    fields         highest and lowest bit of each, both included, by name

    Problem: shifts and masks scattered through a driver go wrong silently: a value too large for its field spills
    into the neighbour, a write clears bits that somebody else owns, and some registers change the chip when they are
    merely read. Solution: a driver declares each register and field once. A field refuses what does not fit, an update
    touches only the declared bits and reads them back, and a register whose read has a side effect is of another type
    that has no plain ``read`` at all.

    An ``OSError`` of the bus passes through; the driver knows what it means for its device.
    """

    name: str
    address: int
    reset_value: int = 0
    fields: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def field(self, name: str) -> RegisterField:
        """The field of that name."""
        return RegisterField(name, *self.fields[name])

    def read(self, bus: I2cBus, chip: int) -> int:
        return bus.read_byte_data(chip, self.address)

    def check(self, bus: I2cBus, chip: int, values: Mapping[str, int]) -> None:
        """Read the register once; BadReply when a field does not hold its value."""
        byte = self.read(bus, chip)
        for name, value in values.items():
            if (found := self.field(name).extract(byte)) != value:
                raise BadReply(f"register 0x{self.address:02X} ({self.name}) of the chip at 0x{chip:02X}: {name} reads "
                               f"{found}, expected {value}")

    def update(self, bus: I2cBus, chip: int, values: Mapping[str, int]) -> None:
        """Set the fields, leave all other bits as they are, and check that the chip took them.

        SettingsError when a value does not fit (nothing is written then), BadReply when it reads back otherwise.
        """
        byte = self.read(bus, chip)
        for name, value in values.items():
            byte = self.field(name).insert(byte, value)
        bus.write_byte_data(chip, self.address, byte)
        self.check(bus, chip, values)


@dataclass(frozen=True)
class ToggleRegister:
    """A register whose every read flips a state of the chip: 0x00 answers "I was running, now I am not", 0xFF answers
    "I was not, now I am running". A read that failed may or may not have flipped it, so it is never repeated blindly.
    """

    name: str
    address: int

    def flip(self, bus: I2cBus, chip: int) -> bool:
        """Flip the state by one read. True: the chip runs now. BadReply when the answer is neither 0x00 nor 0xFF."""
        answer = bus.read_byte_data(chip, self.address)
        if answer not in (0x00, 0xFF):
            raise BadReply(f"register 0x{self.address:02X} ({self.name}) of the chip at 0x{chip:02X} answered "
                           f"0x{answer:02X}, expected 0x00 or 0xFF")
        return answer == 0xFF


NOT_ACKNOWLEDGED = (errno.EREMOTEIO, errno.ENXIO)


def bus_fault(error: OSError, chip: int) -> DeviceError:
    """What a failed transfer with the chip at this address means, in one line."""
    if error.errno in NOT_ACKNOWLEDGED:
        return NotPresent(f"nothing answers at I2C address 0x{chip:02X}: check the sensor's power, ground, SDA and SCL")
    if error.errno == errno.ETIMEDOUT:
        return Timeout(f"I2C transfer with 0x{chip:02X} timed out: the bus is held low; check SDA and SCL, and if this "
                       "persists, unplug the sensor's power for a moment")
    if error.errno == errno.EBUSY:
        return NotPresent(f"a kernel driver owns I2C address 0x{chip:02X}: unload it (see lsmod) or remove its "
                          "overlay, or read the sensor through it (driver: iio)")
    return BadReply(f"I2C transfer with 0x{chip:02X} failed: {error}")


def find_chip(bus: I2cBus, chip_id: Register, addresses: Sequence[int], title: str) -> int:
    """The first address at which the chip answers whose ``chip_id`` register holds its reset value.

    ``title`` is its name with an article. Raises the most informative error otherwise: a held bus at once, then a wrong
    chip or an occupied address, and only then that nobody is there.
    """
    faults: list[DeviceError] = []
    for chip in addresses:
        try:
            found = chip_id.read(bus, chip)
        except OSError as error:
            fault = bus_fault(error, chip)
            if isinstance(fault, Timeout):
                raise fault from error
            if error.errno not in NOT_ACKNOWLEDGED:
                faults.append(fault)
            continue
        if found == chip_id.reset_value:
            return chip
        faults.append(WrongDevice(
            f"the chip at I2C address 0x{chip:02X} has id 0x{found:02X}, {title} has 0x{chip_id.reset_value:02X}"
        ))
    if faults:
        raise faults[0]
    places = " or ".join(f"0x{chip:02X}" for chip in addresses)
    raise NotPresent(f"nothing answers at I2C address {places}: check the sensor's power, ground, SDA and SCL")


class ConfiguredChip:
    """A chip whose settings a driver writes when it starts it, and reads back later, one register at a time.

    A driver's ``start`` calls ``_write_settings`` and then sets ``_chip``, the address that the chip answers at; None:
    it has not been started.

    name                 of the chip
    registers_to_check   so many ``check_next`` see every setting once
    """

    def __init__(self, name: str, bus: I2cBus, settings: Sequence[tuple[Register, Mapping[str, int]]]) -> None:
        self.name = name
        self.registers_to_check = len(settings)
        self._bus = bus
        self._settings_written = tuple(settings)
        self._chip: int | None = None
        self._checked = 0

    def check_settings(self) -> None:
        """SettingsLost when the chip no longer holds what ``start`` wrote, as after a dip of its supply."""
        for _ in self._settings_written:
            self.check_next()

    def check_next(self) -> None:
        """Read back one register, each in its turn. SettingsLost when it does not hold what ``start`` wrote; after a
        transfer that failed it is the same one's turn again."""
        chip = self._started()
        register, values = self._settings_written[self._checked]
        try:
            register.check(self._bus, chip, values)
        except OSError as error:
            raise bus_fault(error, chip) from error
        except BadReply as error:
            raise SettingsLost(f"{self.name} lost its settings (did its supply dip?): {error}") from error
        self._checked = (self._checked + 1) % len(self._settings_written)

    def _write_settings(self, chip: int) -> None:
        """OSError of the bus; BadReply where the chip does not take one."""
        self._checked = 0
        for register, values in self._settings_written:
            register.update(self._bus, chip, values)

    def _started(self) -> int:
        if self._chip is None:
            raise NotPresent(f"the {self.name} has not been started")
        return self._chip


class BufferState(NamedTuple):
    """What a chip says of its buffer: how many entries it holds, whether some were lost, and the bytes that said so."""

    entries: int
    overrun: bool
    said: bytes


class BufferedChip(ConfiguredChip, ABC):
    """One chip on a bus. A driver's ``start`` empties the buffer and sets ``_lost``: what was before is gone.

    Problem: such a chip's rate is no more than nominal, its buffer gives samples without times, and one that ran over
    has lost some. Solution: ``BufferedChip`` empties the buffer and says where entries were lost, also by a transfer
    that failed; ``BufferedDecoder`` gives the samples their times (``SampleClock``) and starts them over after a loss;
    ``buffered_source`` looks often enough that the buffer stays half empty. A chip's own file has its registers, the
    bytes of an entry, and their scale.

    entry_bytes     of one entry, which a read at ``data_address`` takes out of the buffer
    """

    def __init__(self, name: str, bus: I2cBus, settings: Sequence[tuple[Register, Mapping[str, int]]],
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
    """Entries of one answer: ``after_loss``, some were lost before; accelerations (n, 3) [m/s2]; clipped (n,)."""

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

    def __init__(self, rate_hz: int) -> None:
        self._samples = DatedSamples(rate_hz)
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
        return {**self._samples.counts, "overruns": self._overruns}

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
    longest_look_us = 50_000  # Between two looks: how late a reading may come, whatever the buffer holds.
    interval_us = US_PER_S // rate_hz
    look_us = min(longest_look_us, entries // 2 * interval_us)
    return ChipSource(name, lambda: machine.open_i2c(i2c_bus, None), make_chip, machine.now_us,
                      Scattered(look_us, interval_us, machine.sleep))
