"""The Bosch BMA220, a three-axis accelerometer with six bits per axis, over I2C: registers, emulation and driver.

Addresses are those on I2C, twice the numbers that the data sheet gives for SPI. Facts from the Linux kernel's driver
(drivers/iio/accel/bma220), Bosch's API of 2014 and the UPM library, which agree.

A driver of a chip whose reads change its state cannot be tried against a table of canned answers: the emulation behaves
as the chip, one register access at a time. Where the data sheet's behaviour is not known (what the data
registers answer while it is suspended or held in reset), the model answers zero and takes no sample.

Problem: the chip is easy to stop by accident (reading register 0x30 suspends it, reading 0x32 holds it in reset), it
can hold the bus low for ever, and after a dip of its supply it goes on delivering plausible numbers at the wrong scale
and without an anti-alias filter. Solution: ``start`` brings it from whatever state it is in to a known one, with its
bus watchdog on, and reads every setting back; ``check_settings`` and, one register at a time, ``check_next`` tell later
whether it still is in that state; ``read_raw`` is one burst and nothing else; decoding is done by the block, away from
the bus.

When anything raises a DeviceError, wait and call ``start`` again: it assumes nothing about the chip.
"""

from __future__ import annotations

import logging
from array import array
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drivers.accelerometers.accelerometer import Accelerometer, OtherSettings, ReadingQuality, setting
from drivers.chip_bus import ConfiguredChip, Register, ToggleRegister, bus_fault, find_chip
from drivers.errors import BadReply, DeviceError, SettingsError
from drivers.hardware import I2cBus, Machine
from drivers.readings import (
    STANDARD_GRAVITY_MPS2,
    UNREAD_CHIP,
    US_PER_S,
    AccelerationBlock,
    OneOf,
    OrNone,
    RecordedWords,
    Special,
    Whole,
)
from drivers.sources import ChipSource, Deadlines, Source

if TYPE_CHECKING:
    from drivers.plain_yaml import Node

ADDRESSES = (0x0A, 0x0B)
CHIP_ID = Register("chip id", 0x00, reset_value=0xDD)
REVISION = Register("revision", 0x02)
DATA_ADDRESS = 0x04  # X, Y, Z: three registers in one burst, which steps from register to register by itself
SAMPLE_BYTES = 3
REGISTER_STEP = 2  # from one register's address to the next one's
AXES = Register("power and axes", 0x1E, 0x07, {"sleep_en": (6, 6), "en_x, en_y, en_z": (2, 0)})
FILTER = Register("filter", 0x20, 0x00, {"serial_high_bw": (7, 7), "filter code": (3, 0)})
RANGE = Register("range", 0x22, 0x00, {"sbist": (3, 2), "range code": (1, 0)})
WATCHDOG = Register("bus watchdog", 0x2E, 0x00, {"watchdog code": (2, 1)})
SUSPEND = ToggleRegister("suspend", 0x30)
SOFT_RESET = ToggleRegister("soft reset", 0x32)
WRITABLE = (AXES, FILTER, RANGE, WATCHDOG)


class Bma220Chip:
    """One chip. All attributes may be changed at any time, to put it into any state.

    data_address, sample_bytes    a read of so many bytes from there on takes a sample
    sample       gives the three data bytes, as they are at rest with Z up at +-2 g unless it is given; called once per
                 read that begins at the data registers
    suspended    in suspend: reads work, writes are ignored
    in_reset     held in soft reset: the same, and the registers stand at their defaults
    registers    what the writable registers hold, by address
    stuck        register address to the value it answers, whatever was written: a broken chip, or another one
    """

    data_address = DATA_ADDRESS
    sample_bytes = SAMPLE_BYTES

    def __init__(self, sample: Callable[[], bytes] = lambda: bytes((0, 0, 16 << 2))) -> None:
        self.sample = sample
        self.stuck: dict[int, int] = {}
        self.registers: dict[int, int] = {}
        self.suspended = False
        self.in_reset = False
        self.lose_power()

    def lose_power(self) -> None:
        """A dip of the supply: running, with every setting at its default."""
        self.suspended = False
        self.in_reset = False
        self._set_defaults()

    @property
    def running(self) -> bool:
        return not (self.suspended or self.in_reset)

    @property
    def watchdog_on(self) -> bool:
        return WATCHDOG.field("watchdog code").extract(self.registers[WATCHDOG.address]) >= 2

    def read(self, address: int, length: int = 1) -> bytes:
        """``length`` consecutive registers from ``address`` on, whose addresses are two apart."""
        if address == DATA_ADDRESS and length == SAMPLE_BYTES and self.running and not self.stuck:
            return self.sample()
        sample = self.sample() if address == DATA_ADDRESS and self.running else bytes(SAMPLE_BYTES)
        return bytes(self._answer(address + REGISTER_STEP * step, sample) for step in range(length))

    def write(self, address: int, value: int) -> None:
        """Write one register. Ignored while not running, and for registers that cannot be written."""
        if self.running and any(address == register.address for register in WRITABLE):
            self.registers[address] = value

    def _answer(self, address: int, sample: bytes) -> int:
        if address == SUSPEND.address:
            self.suspended, was_off = not self.suspended, self.suspended
            answer = 0xFF if was_off else 0x00
        elif address == SOFT_RESET.address:
            self.in_reset, was_off = not self.in_reset, self.in_reset
            if self.in_reset:
                self._set_defaults()
            answer = 0xFF if was_off else 0x00
        elif DATA_ADDRESS <= address < DATA_ADDRESS + 2 * SAMPLE_BYTES and address % 2 == 0:
            answer = sample[(address - DATA_ADDRESS) // 2]
        else:
            answer = self.registers.get(address, 0)
        return self.stuck.get(address, answer)

    def _set_defaults(self) -> None:
        self.registers = {register.address: register.reset_value for register in (CHIP_ID, REVISION, *WRITABLE)}


BASE_RATE_HZ = 100
NOISE_MPS2 = 0.1  # r.m.s., beside its steps, through the filter that goes with 100 Hz; no data sheet states it
LARGEST_OVERSAMPLE = 8  # a burst takes 0.57 ms on a bus of 100 kHz, and some more in the kernel
USUAL_OVERSAMPLE = 4  # a quarter of the time of such a bus; the estimator stays 100 times as fast as the drive

_FAST_BUS = " (and the bus to 400 kHz)"
LARGEST_USEFUL_G = 8  # at 16 an IRI is no better than the mean of the road's windows (tests/benchmarks/noise.py)
RANGE_CODES = {2: 0, 4: 1, 8: 2, 16: 3}  # [g]
FILTER_CODES = {1000: 0, 500: 1, 250: 2, 125: 3, 64: 4, 32: 5}  # [Hz]
BANDWIDTHS_HZ = tuple(sorted(hz for hz in FILTER_CODES if hz <= BASE_RATE_HZ * LARGEST_OVERSAMPLE))
SETTLING_S = {1000: 0.002, 500: 0.002, 250: 0.003, 125: 0.005, 64: 0.009, 32: 0.017}
TOGGLE_WAIT_S = 0.002

log = logging.getLogger(__name__)


_DUMP = "dump:"


def _bus(node: Node) -> int | Path:
    """The number of a bus, or the path of a recorded drive."""
    text = node.content
    if isinstance(text, str) and text.startswith(_DUMP):
        path = node.path(after=_DUMP)
        if not path.is_file():
            raise node.wrong("a recorded dump (there is no such file)")
        return path
    if not node.plain or not isinstance(text, str) or not text.isdigit():
        raise node.wrong("the number of an I2C bus from 0 to 255, or dump:FILE")
    return node.integer(0, 255)


@dataclass(frozen=True)
class Bma220Config:
    """What may be chosen. SettingsError on a value the chip does not have.

    i2c_bus        the N of /dev/i2c-N, or the path of a recorded drive
    range_g        full scale: 2, 4, 8 or 16 [g]
    bandwidth_hz   the chip's filter: 32, 64, 125, 250, 500 [Hz], not above the sampling rate (beyond that everything
                   in the pass band would alias); None takes the largest not above 0.64 of half the sampling rate
    oversample     the sampling rate is 100 Hz times this, 1 to 8; None means automatic
    """

    i2c_bus: int | Path = setting(1, Special(_bus, ("1", "0")))
    range_g: int = setting(2, OneOf(tuple(RANGE_CODES)))
    bandwidth_hz: int | None = setting(None, OrNone("auto", OneOf(BANDWIDTHS_HZ)))
    oversample: int | None = setting(None, OrNone("auto", Whole(1, LARGEST_OVERSAMPLE)))

    def __post_init__(self) -> None:
        _choose("range_g", self.range_g, RANGE_CODES)
        _choose("oversample", self.reads, range(1, LARGEST_OVERSAMPLE + 1))
        if self.bandwidth_hz is not None:
            _choose("bandwidth_hz", self.bandwidth_hz, FILTER_CODES)
            if self.bandwidth_hz > self.rate_hz:
                raise SettingsError(f"bandwidth_hz {self.bandwidth_hz} is above the sampling rate of {self.rate_hz} "
                                    "Hz: the signal would be mostly aliases; choose a smaller one or leave it out")

    @property
    def reads(self) -> int:
        """Readings per sample of 100 Hz; of a recorded drive one, unless the settings say how it was read."""
        if self.oversample is not None:
            return self.oversample
        return USUAL_OVERSAMPLE if isinstance(self.i2c_bus, int) else 1

    @property
    def rate_hz(self) -> int:
        return BASE_RATE_HZ * self.reads

    @property
    def filter_hz(self) -> int:
        """The bandwidth the chip is set to [Hz]: 32 at 100 Hz, 250 at 800 Hz, unless chosen by hand."""
        if self.bandwidth_hz is not None:
            return self.bandwidth_hz
        return max(hz for hz in FILTER_CODES if hz <= 8 * self.rate_hz // 25)


class Bma220(ConfiguredChip):
    """One chip on a bus. ``sleep`` takes seconds. Every method but ``stop`` raises the DeviceError family:

    NotPresent   nothing acknowledges, or a kernel driver owns the address
    Timeout      the bus is held low
    WrongDevice  another chip is at the address
    BadReply     the chip does not do what was written to it
    SettingsLost    it did, and no longer does
    """

    def __init__(self, bus: I2cBus, settings: Bma220Config, sleep: Callable[[float], None]) -> None:
        super().__init__("BMA220", bus, (
            (WATCHDOG, {"watchdog code": 3}),  # the chip lets go of a stuck bus after 10 ms
            (RANGE, {"range code": RANGE_CODES[settings.range_g], "sbist": 0}),
            (FILTER, {"filter code": FILTER_CODES[settings.filter_hz], "serial_high_bw": 0}),
            (AXES, {"en_x, en_y, en_z": 0b111, "sleep_en": 0}),
        ))
        self._settings = settings
        self._sleep = sleep

    def start(self) -> int:
        """Find the chip, wake it, reset it, set it up, and wait until its filter has settled (about 30 ms). Gives the
        address that it answers at."""
        self._chip = None
        chip = find_chip(self._bus, CHIP_ID, ADDRESSES, "a BMA220")
        try:
            revision = REVISION.read(self._bus, chip)
            self._make_run(SUSPEND, chip)
            self._make_run(SOFT_RESET, chip)
            self._write_settings(chip)
        except OSError as error:
            raise bus_fault(error, chip) from error
        self._sleep(SETTLING_S[self._settings.filter_hz])
        self._chip = chip
        log.info("BMA220 revision %d runs at 0x%02X, filter %d Hz", revision, chip, self._settings.filter_hz)
        return chip

    def read_raw(self) -> bytes:
        """The three data bytes X, Y, Z, read in one burst so that they belong together."""
        chip = self._started()
        try:
            data = bytes(self._bus.read_i2c_block_data(chip, DATA_ADDRESS, SAMPLE_BYTES))
        except OSError as error:
            raise bus_fault(error, chip) from error
        if len(data) != SAMPLE_BYTES:
            raise BadReply(f"BMA220 at 0x{chip:02X}: a burst of {SAMPLE_BYTES} bytes gave {len(data)}")
        return data

    def read(self, now_us: Callable[[], int]) -> tuple[int, bytes]:
        """The time just before a read of the data [us], and the data."""
        t_us = now_us()
        return t_us, self.read_raw()

    def stop(self) -> None:
        """Suspend the chip if it was running. Never raises: a chip that does not answer stays as it is."""
        chip, self._chip = self._chip, None
        if chip is not None:
            with suppress(OSError, DeviceError):
                if SUSPEND.flip(self._bus, chip):
                    SUSPEND.flip(self._bus, chip)

    def _make_run(self, toggle: ToggleRegister, chip: int) -> None:
        """Flip the state until the chip says that it runs, two reads at most."""
        for _ in range(2):
            runs = toggle.flip(self._bus, chip)
            self._sleep(TOGGLE_WAIT_S)
            if runs:
                return
        raise BadReply(f"BMA220 at 0x{chip:02X} stays in {toggle.name}: two reads answered 0x00")


def mps2_per_count(range_g: int) -> float:
    """The nominal size of one count [m/s2]: 1/16 g at +-2 g, up to 1/2 g at +-16 g. SettingsError for another range."""
    _choose("range_g", range_g, RANGE_CODES)
    return STANDARD_GRAVITY_MPS2 * range_g / 32


class Bma220Decoder:
    """Raw samples in, acceleration out, a block at a time.

    Each data byte is a six-bit two's complement number, left-justified: counts -32 to +31, nominally 32 / range_g
    counts per g. The two low bits should be zero.

    mps2_per_count   scale [m/s2]
    anomalies        samples taken so far with a low bit set; the bits are dropped
    repeats          samples taken so far that equal the one before: many mean that the chip renews its data more
                     slowly than it is read, or nothing moves
    """

    name = "bma220"
    doubt = note = ""

    def __init__(self, range_g: int) -> None:
        self.mps2_per_count = mps2_per_count(range_g)
        self.anomalies = 0
        self.repeats = 0
        self._t_us = array("q")
        self._data = bytearray()
        self._last = b""

    unread = UNREAD_CHIP

    @property
    def counts(self) -> dict[str, int]:
        """Samples with a low bit set, and samples that equal the one before."""
        return {"odd_bits": self.anomalies, "repeated_samples": self.repeats}

    def feed(self, t_us: int, data: bytes) -> None:
        """Take one sample of three bytes read at ``t_us``. BadReply (and nothing taken) on any other length."""
        if len(data) != SAMPLE_BYTES:
            raise BadReply(f"a BMA220 sample is {SAMPLE_BYTES} bytes (X, Y, Z), not {len(data)}")
        self._t_us.append(t_us)
        self._data += data

    def flush(self) -> None:
        """Nothing is held back."""

    def take(self) -> AccelerationBlock:
        """Decode everything fed since the last call; an empty block when that was nothing."""
        t_us = np.array(self._t_us, dtype=np.int64)
        raw = np.frombuffer(self._last + bytes(self._data), dtype=np.int8).reshape(-1, SAMPLE_BYTES)
        self.repeats += int(np.count_nonzero((raw[1:] == raw[:-1]).all(axis=1)))
        self._t_us = array("q")
        self._data = bytearray()
        raw = raw[len(raw) - len(t_us):]
        self.anomalies += int(np.count_nonzero((raw & 3).any(axis=1)))
        self._last = raw[-1:].tobytes() or self._last
        counts = raw >> 2
        clipped = ((counts == -32) | (counts == 31)).any(axis=1)
        return AccelerationBlock(t_us, counts.astype(np.float64) * self.mps2_per_count, clipped)


def _choose(name: str, value: int, known: Iterable[int]) -> None:
    """SettingsError unless ``value``, of whatever type a file gave, is one of ``known``."""
    if value not in tuple(known):
        raise SettingsError(f"{name} is one of {', '.join(map(str, sorted(known)))}, not {value}")


class _Bma220(Accelerometer[Bma220Config]):
    """The BMA220 on an I2C bus, or as a recorded drive that is played in real time."""

    name = "bma220"
    title = "BMA220"
    settings = Bma220Config
    event_bytes = SAMPLE_BYTES

    def place(self, settings: Bma220Config) -> str:
        return f"/dev/i2c-{settings.i2c_bus}" if isinstance(settings.i2c_bus, int) else str(settings.i2c_bus)

    def source(self, settings: Bma220Config, machine: Machine) -> Source:
        return chip_source(_bus_opener(settings.i2c_bus, machine), settings, machine.now_us, machine.sleep)

    def decoder(self, settings: Bma220Config, upright_axis: int) -> Bma220Decoder:
        return Bma220Decoder(settings.range_g)

    def readings(self, settings: Bma220Config) -> ReadingQuality:
        """Coarse steps. Noise is taken to be white before the chip's filter, of the width that goes with the rate: of
        another one a recording does not say, and it has to give the same rows."""
        hz, usual_hz = (Bma220Config(oversample=times).filter_hz for times in (settings.reads, 1))
        return ReadingQuality(NOISE_MPS2 * sqrt(hz / usual_hz), mps2_per_count(settings.range_g), settings.reads)

    def others(self, settings: Bma220Config) -> OtherSettings:
        """The next ranges up to 8 g, beyond which its steps hide all but the roughest roads, and more reads."""
        ranges = [range_g for range_g in sorted(RANGE_CODES) if range_g <= LARGEST_USEFUL_G]
        larger = [range_g for range_g in ranges if range_g > settings.range_g]
        smaller = [range_g for range_g in ranges if range_g < settings.range_g]
        reads = USUAL_OVERSAMPLE if settings.reads < USUAL_OVERSAMPLE else LARGEST_OVERSAMPLE
        return OtherSettings(
            wider=f"range_g: {larger[0]}" if larger else "",
            finer=tuple((f"range_g: {range_g}", 31 * mps2_per_count(range_g)) for range_g in smaller),
            oftener=f"oversample: {reads}{_FAST_BUS * (reads > USUAL_OVERSAMPLE)}" if reads > settings.reads else "")

    def facts(self, settings: Bma220Config) -> dict[str, Any]:
        return {"verified": True, "range_g": settings.range_g, "mps2_per_count": mps2_per_count(settings.range_g),
                "bandwidth_hz": settings.filter_hz, "oversample": settings.reads}

    def header(self, settings: Bma220Config) -> dict[str, Any]:
        return {"range_g": settings.range_g, "oversample": settings.reads}

    def recorded(self, said: RecordedWords, settings: Bma220Config, is_given: bool) -> Bma220Config:
        """Range and rate are the recording's; one that says nothing of the rate was read 100 times a second."""
        return replace(settings, range_g=said.whole("range_g", settings.range_g),
                       oversample=said.whole("oversample", 1))

    def simulated(self, settings: Bma220Config, accel_mps2: npt.NDArray[np.float64]) -> list[bytes]:
        """Three register bytes per reading: six bits in two's complement, to the left."""
        counts = np.clip(np.rint(accel_mps2 * (32 / settings.range_g / STANDARD_GRAVITY_MPS2)), -32, 31).astype(np.int8)
        registers = (counts << 2).tobytes()
        return [registers[k: k + SAMPLE_BYTES] for k in range(0, len(registers), SAMPLE_BYTES)]

    def advice(self, state: str) -> str:
        return "check its four wires (3.3 V, ground, SDA, SCL) and that I2C is on (sudo raspi-config)"


def chip_source(open_bus: Callable[[], I2cBus], settings: Bma220Config, now_us: Callable[[], int],
                sleep: Callable[[float], None]) -> ChipSource:
    """One burst of the chip on that bus per poll, at its sampling rate."""
    pace = Deadlines(US_PER_S // settings.rate_hz, now_us, sleep)
    return ChipSource("bma220", open_bus, lambda bus: Bma220(bus, settings, sleep), now_us, pace)


def _bus_opener(bus: int | Path, machine: Machine) -> Callable[[], I2cBus]:
    if isinstance(bus, int):
        return lambda: machine.open_i2c(bus, REGISTER_STEP)

    def play() -> I2cBus:
        from drivers.dump import open_dump
        from drivers.played_bus import PlayedBus, PlayedRecording

        with open_dump(bus) as reader:
            events = [event for event in reader if event.source == "bma220"]
        return PlayedBus(Bma220Chip(), PlayedRecording(events, machine.now_us, None))

    return play


ACCELEROMETER = _Bma220()
