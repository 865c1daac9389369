"""Driver of the Analog Devices ADXL345, a three-axis accelerometer with 13 bits per axis, on I2C.

Problem: the chip samples by its own clock, whose rate is no more than nominal, into a buffer of 32 entries that gives
them without times; a buffer that ran over has lost the oldest; and after a dip of its supply the chip stands by.
Solution: the buffer (FIFO, in stream mode) is emptied some 20 times a second, its samples are dated
(``drivers.chip_bus``), and settings are read back in turn (``ChipSource``).

It runs in full resolution at +-16 g: one count is 3.9 mg at every range, and a smaller range would only clip sooner.

Facts: data sheet ADXL345, revision G [1]: device id 0xE5; addresses 0x53 and 0x1D (ALT ADDRESS pin); register map,
Table 19; output rates and bandwidth (half the rate), Table 7; noise, Table 1; FIFO, "FIFO" and register 0x39. A read of
the six data registers pops one entry, and has to take all six at once. 5 us have to lie between two such reads; on I2C
the addressing takes longer. Overrun is noted in INT_SOURCE whatever INT_ENABLE says, and cleared by reading data. The
same numbers stand in the Linux kernel's driver [2].

[1] https://www.analog.com/media/en/technical-documentation/data-sheets/ADXL345.pdf
[2] drivers/iio/accel/adxl345_core.c
"""

import logging
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivers.accelerometers.accelerometer import Accelerometer, ReadingQuality, setting
from drivers.chip_bus import (
    BufferedChip,
    BufferedDecoder,
    BufferState,
    Entries,
    Register,
    buffered_source,
    bus_fault,
    find_chip,
)
from drivers.errors import BadReply, DeviceError, SettingsError
from drivers.hardware import I2cBus, Machine
from drivers.readings import STANDARD_GRAVITY_MPS2, OneOf, RecordedWords, Whole
from drivers.sources import Source

ADDRESSES = (0x53, 0x1D)
DEVICE_ID = Register("device id", 0x00, reset_value=0xE5)
OFFSETS = tuple(Register(f"offset {axis}", address, 0x00, {"offset": (7, 0)})
                for axis, address in (("X", 0x1E), ("Y", 0x1F), ("Z", 0x20)))
RATE = Register("rate", 0x2C, 0x0A, {"LOW_POWER": (4, 4), "rate code": (3, 0)})
POWER = Register("power control", 0x2D, 0x00, {"link, AUTO_SLEEP": (5, 4), "measure": (3, 3), "sleep, wakeup": (2, 0)})
INTERRUPTS = Register("interrupt source", 0x30, 0x00, {"overrun": (0, 0)})
FORMAT = Register("data format", 0x31, 0x00,
                  {"SELF_TEST": (7, 7), "FULL_RES": (3, 3), "justify": (2, 2), "range": (1, 0)})
DATA_ADDRESS = 0x32
FIFO = Register("FIFO control", 0x38, 0x00, {"FIFO mode": (7, 6)})
FIFO_STATUS = Register("FIFO status", 0x39, 0x00, {"entries": (5, 0)})
OVERRUN, ENTRIES = INTERRUPTS.field("overrun"), FIFO_STATUS.field("entries")

BYPASS, STREAM = 0, 2
RATE_CODES = {200: 0x0B, 400: 0x0C, 800: 0x0D}  # [Hz]; at 100 what is above 50 Hz would fold into the pass band
FIFO_ENTRIES = 32
ENTRY_BYTES = 6
COUNTS_PER_G = 256
LARGEST_COUNT = 16 * COUNTS_PER_G - 1  # +-16 g in 13 bits
NOISE_MPS2 = 1.1 / COUNTS_PER_G * STANDARD_GRAVITY_MPS2  # Z at 100 Hz, 1.1 LSB r.m.s.; on the 100 Hz grid at any rate
TURN_ON_S = 0.0011  # and one sample (Table 1)

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Adxl345Config:
    """``i2c_bus`` is the N of /dev/i2c-N; ``rate_hz`` samples a second, each with a bandwidth of half of that."""

    i2c_bus: int = setting(1, Whole(0, 255))
    rate_hz: int = setting(200, OneOf(tuple(RATE_CODES)))

    def __post_init__(self) -> None:
        if self.rate_hz not in RATE_CODES:
            raise SettingsError(f"rate_hz is one of {', '.join(map(str, RATE_CODES))}, not {self.rate_hz}", "rate_hz")


class Adxl345(BufferedChip):
    """One chip on a bus. ``sleep`` takes seconds. Every method but ``stop`` raises the DeviceError family, as
    ``Bma220`` does; after any, wait and call ``start`` again: it assumes nothing about the chip."""

    def __init__(self, bus: I2cBus, rate_hz: int, sleep: Callable[[float], None]) -> None:
        super().__init__("ADXL345", bus, (
            (FORMAT, {"FULL_RES": 1, "range": 3, "justify": 0, "SELF_TEST": 0}),  # 16 g
            (RATE, {"rate code": RATE_CODES[rate_hz], "LOW_POWER": 0}),
            (FIFO, {"FIFO mode": STREAM}),
            (POWER, {"measure": 1, "sleep, wakeup": 0, "link, AUTO_SLEEP": 0}),
        ), DATA_ADDRESS, ENTRY_BYTES)
        self._sleep = sleep
        self._rate_hz = rate_hz

    def start(self) -> int:
        """Find the chip, set it up with an empty buffer, and let it measure. Gives the address that it answers at."""
        self._chip = None
        self._lost = True
        chip = find_chip(self._bus, DEVICE_ID, ADDRESSES, "an ADXL345")
        try:
            POWER.update(self._bus, chip, {"measure": 0})
            for offset in OFFSETS:
                offset.update(self._bus, chip, {"offset": 0})
            FIFO.update(self._bus, chip, {"FIFO mode": BYPASS})  # empties the buffer
            self._write_settings(chip)
        except OSError as error:
            raise bus_fault(error, chip) from error
        self._sleep(TURN_ON_S + 1 / self._rate_hz)
        self._chip = chip
        log.info("ADXL345 runs at 0x%02X, %d samples a second", chip, self._rate_hz)
        return chip

    def _waiting(self, chip: int) -> BufferState:
        interrupts = INTERRUPTS.read(self._bus, chip)
        status = FIFO_STATUS.read(self._bus, chip)
        return BufferState(ENTRIES.extract(status), bool(OVERRUN.extract(interrupts)), bytes((interrupts, status)))

    def _marked(self, said: bytes, lost: bool) -> bytes:
        return bytes((OVERRUN.insert(said[0], int(lost)), said[1]))

    def stop(self) -> None:
        """Let the chip stand by. Never raises."""
        chip, self._chip = self._chip, None
        if chip is not None:
            with suppress(OSError, DeviceError):
                POWER.update(self._bus, chip, {"measure": 0})


class Adxl345Decoder(BufferedDecoder):
    """Answers of ``Adxl345.read``: INT_SOURCE, FIFO_STATUS, then X, Y, Z of each entry, low byte first."""

    name = "adxl345"

    def _decoded(self, data: bytes) -> Entries:
        count, rest = divmod(len(data) - 2, ENTRY_BYTES)
        if count < 1 or rest or ENTRIES.extract(data[1]) != count:
            raise BadReply(f"an ADXL345 answer of {len(data)} bytes: expected INT_SOURCE, FIFO_STATUS and its entries")
        counts = np.frombuffer(data, dtype="<i2", offset=2).reshape(-1, 3).astype(np.float64)
        return Entries(bool(OVERRUN.extract(data[0])), counts * (STANDARD_GRAVITY_MPS2 / COUNTS_PER_G),
                       np.asarray(((counts <= -LARGEST_COUNT - 1) | (counts >= LARGEST_COUNT)).any(axis=1)))


class _Adxl345(Accelerometer[Adxl345Config]):
    """The ADXL345 on an I2C bus."""

    name = "adxl345"
    title = "ADXL345"
    settings = Adxl345Config

    def place(self, settings: Adxl345Config) -> str:
        return f"/dev/i2c-{settings.i2c_bus}"

    def source(self, settings: Adxl345Config, machine: Machine) -> Source:
        """Looks that leave the buffer half empty."""
        return buffered_source(self.name, machine, settings.i2c_bus,
                               lambda bus: Adxl345(bus, settings.rate_hz, machine.sleep), settings.rate_hz,
                               FIFO_ENTRIES)

    def decoder(self, settings: Adxl345Config, upright_axis: int) -> Adxl345Decoder:
        return Adxl345Decoder(settings.rate_hz)

    def readings(self, settings: Adxl345Config) -> ReadingQuality:
        return ReadingQuality(NOISE_MPS2)

    def facts(self, settings: Adxl345Config) -> dict[str, Any]:
        """Scale and rate; no real chip has confirmed it yet."""
        return {"verified": False, "range_g": 16, "mps2_per_count": STANDARD_GRAVITY_MPS2 / COUNTS_PER_G,
                "bandwidth_hz": settings.rate_hz / 2, "rate_hz": settings.rate_hz}

    def header(self, settings: Adxl345Config) -> dict[str, Any]:
        return {"rate_hz": settings.rate_hz}

    def recorded(self, said: RecordedWords, settings: Adxl345Config, is_given: bool) -> Adxl345Config:
        return replace(settings, rate_hz=said.whole("rate_hz", settings.rate_hz))

    def advice(self, state: str) -> str:
        return ("check its wires (VCC and CS to 3.3 V, SDO to ground or 3.3 V, ground, SDA, SCL) and that I2C is on "
                "(sudo raspi-config)")


ACCELEROMETER = _Adxl345()
