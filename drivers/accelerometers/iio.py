"""Any accelerometer for which the Linux kernel has a driver (Industrial I/O, IIO).

Problem: the kernel knows some hundred chips; each would need a driver here. Solution: its interface is read instead. In
the best case its buffer gives scans with a time each (``in_timestamp``, on the monotonic clock); without it the times
are recovered from when the scans came; without a buffer the raw values are read one by one, 100 times a second, each at
the time of its read. Which of these it is, the recording says, and ``status`` says where there is no buffer.

What the bytes mean is only known once a device is there, and another one may be plugged in later. So the first event,
and one every ``DESCRIBE_US``, is a description (``_iio_device``): a JSON object. All others begin with a letter: ``s``,
then scans as the kernel gave them, or ``p``, then the three raw values as text. The kernel is asked again for its
description every ``CHECK_US``: when it is another one, the device has lost its settings. What a chip forgets without
the kernel's notice shows nowhere but in the readings.
"""

import json
import os
from contextlib import suppress
from dataclasses import dataclass, replace
from math import hypot, sqrt
from typing import Any

import numpy as np

from drivers.accelerometers import _iio_device
from drivers.accelerometers.accelerometer import (
    SERIAL_NOISE_MPS2,
    SERIAL_WAIT_S,
    Accelerometer,
    ReadingQuality,
    setting,
)
from drivers.errors import BadReply, NotPresent, SettingsLost
from drivers.hardware import Machine
from drivers.readings import (
    UNREAD_CHIP,
    US_PER_S,
    AccelerationBlock,
    Decimal,
    Event,
    OrNone,
    RecordedWords,
    Text,
    Whole,
)
from drivers.sample_clock import DatedSamples, UndatedSamples
from drivers.sources import Deadlines, SerialSource, Source

CHECK_US = US_PER_S
DESCRIBE_US = 10 * US_PER_S
LONGEST_QUEUED_US = 10 * US_PER_S  # more than a buffer of BUFFER_S holds
SCANS, VALUES, DESCRIPTION = b"s", b"p", b"{"


_STEP_MPS2, _NOISE_MPS2 = (1e-6, 10.0), (1e-4, 1.0)  # From and to: what a step and a noise may be


@dataclass(frozen=True)
class IioConfig:
    """``device``: name of the chip or of its folder, or ``auto``; ``rate_hz``: asked of it; ``scale_mps2``: the step
    that it is set to, None leaves it; ``noise_mps2``: of the chip on the 100 Hz grid, r.m.s."""

    device: str = setting(_iio_device.AUTO, Text())
    rate_hz: int = setting(200, Whole(100, 1000))
    scale_mps2: float | None = setting(None, OrNone("auto", Decimal(*_STEP_MPS2)))
    noise_mps2: float = setting(SERIAL_NOISE_MPS2, Decimal(*_NOISE_MPS2))


class IioSource:
    """The events of one device: scans where the kernel collects them, or single values."""

    name = "iio"
    dropped = 0
    waiting_since_us = None

    def __init__(self, settings: IioConfig, machine: Machine) -> None:
        self._settings = settings
        self._machine = machine
        self._device: _iio_device.IioDevice | None = None
        self._scans = SerialSource(self.name, self._open_node, machine.now_us, SERIAL_WAIT_S, machine.sleep)
        self._deadlines = Deadlines(US_PER_S // _iio_device.POLLED_HZ, machine.now_us, machine.sleep)
        self._values: list[int] = []
        self._description: dict[str, Any] = {}
        self._checked_us = self._described_us = self._opened_us = 0
        self._scan_bytes = 0
        self._carry = b""

    @property
    def missed(self) -> int:
        """Single values that were not read in time."""
        return self._deadlines.missed

    @property
    def note(self) -> str:
        """How it is read, where that is not by its buffer."""
        if self._device is None or not self._device.why_polled:
            return ""
        return (f"read value by value, {_iio_device.POLLED_HZ} times a second, as {self._device.why_polled}: readings "
                "come less evenly, and some may come twice (see docs/installation.md)")

    def open(self) -> None:
        settings = self._settings
        self._device = _iio_device.IioDevice(self._machine.root, settings.device, settings.rate_hz, settings.scale_mps2)
        self._description = self._device.describe()
        self._scan_bytes = _iio_device.understood(self._description).scan_bytes
        self._carry = b""
        self._checked_us = self._opened_us = self._machine.now_us()
        self._described_us = -DESCRIBE_US
        if not self._device.why_polled:
            self._scans.open()
            return
        try:
            for axis in _iio_device.AXES:
                path = self._device.path / f"in_accel_{axis}_raw"
                self._values.append(os.open(path, os.O_RDONLY | os.O_CLOEXEC))
        except OSError as error:
            raise NotPresent(f"{self._device.path.name}: {error.strerror}") from error

    def poll(self) -> list[Event]:
        """What has come, after the description where it is time for that."""
        device = self._device
        if device is None:
            raise NotPresent("the accelerometer is not open")
        now_us = self._machine.now_us()
        if now_us - self._checked_us >= CHECK_US:
            self._checked_us = now_us
            if device.describe() != self._description:
                raise SettingsLost(f"{device.path.name} no longer has the settings that it was started with")
        events = self._poll_values() if device.why_polled else self._poll_scans()
        if events and events[0].t_us - self._described_us >= DESCRIBE_US:
            begins = self._described_us < self._opened_us
            self._described_us = events[0].t_us
            text = json.dumps({"begins": begins, **self._description}, separators=(",", ":")).encode()
            events.insert(0, Event(events[0].t_us, self.name, text))
        return events

    def rest(self) -> None:
        if self._values:
            self._deadlines.wait()
        else:
            self._scans.rest()

    def flush(self) -> list[Event]:
        return []

    def close(self) -> None:
        """Stop the buffer if it was started here, and let go."""
        values, self._values = self._values, []
        device, self._device = self._device, None
        for descriptor in values:
            with suppress(OSError):
                os.close(descriptor)
        with suppress(OSError):
            self._scans.close()
        if device is not None:
            device.close()

    def _open_node(self) -> _iio_device.ScanPort:
        assert self._device is not None
        return _iio_device.ScanPort(self._device.node, self._machine.wait_readable)

    def _poll_values(self) -> list[Event]:
        t_us = self._machine.now_us()
        try:
            texts = [os.pread(descriptor, 32, 0).strip() for descriptor in self._values]
        except OSError as error:
            raise NotPresent(f"the IIO device has gone: {error.strerror}") from error
        return [Event(t_us, self.name, VALUES + b" ".join(texts))]

    def _poll_scans(self) -> list[Event]:
        """Whole scans; the kernel gives no others, but nothing says so."""
        size = self._scan_bytes
        events = []
        for event in self._scans.poll():
            data = self._carry + event.data
            whole = len(data) - len(data) % size
            self._carry = data[whole:]
            if whole:
                events.append(event._replace(data=SCANS + data[:whole]))
        return events


class IioDecoder:
    """Events of ``IioSource`` in, samples with their times out."""

    name = "iio"

    def __init__(self, settings: IioConfig) -> None:
        self._settings = settings
        self._layout: _iio_device.ScanLayout | None = None
        self._dated: DatedSamples | None = None
        self._blocks: list[AccelerationBlock] = []
        self._ended = self._begins = False
        self._arrived_us: int | None = None
        self._undescribed = self._values = 0
        self._before = dict.fromkeys(("samples", "lost", "resyncs", "undated"), 0)

    @property
    def doubt(self) -> str:
        """What is wrong with the samples that come; empty: nothing."""
        layout = self._layout
        if layout is None:
            return ""
        step_mps2 = max(abs(scale) for scale in layout.scale)
        if step_mps2 > 2 * self._settings.noise_mps2 and self._settings.scale_mps2 is None:
            return (f"one step of {layout.name} is {step_mps2:.3g} m/s2, which hides smooth roads: set scale_mps2 to a "
                    f"finer one (see in_accel_scale_available), or to {step_mps2:.6g}, if you accept it")
        if self._dated is None:
            return ""
        return self._dated.doubt("Check the rate of its trigger (sampling_frequency), and what else keeps the computer "
                                 "busy")

    @property
    def note(self) -> str:
        """How the samples come; empty: as they should."""
        return self._dated.note if self._dated is not None else ""

    unread = UNREAD_CHIP

    @property
    def counts(self) -> dict[str, int]:
        now = self._dated.counts if self._dated is not None else {}
        found = {key: count + now.get(key, 0) for key, count in self._before.items()}
        return {**found, "samples": found["samples"] + self._values, "undescribed": self._undescribed}

    def feed(self, t_us: int, data: bytes) -> None:
        """Take an event. BadReply (and nothing taken) for one that cannot be."""
        kind, rest = data[:1], data[1:]
        if kind == DESCRIPTION:
            description = _iio_device.read_description(data)
            self._describe(_iio_device.understood(description))
            self._begins |= description.get("begins") is True
        elif self._layout is None:
            self._undescribed += 1
        elif kind == SCANS and self._dated is not None:
            self._take_scans(t_us, rest, self._layout, self._dated)
        elif kind == VALUES and self._layout.polled:
            self._take_values(t_us, rest, self._layout)
        else:
            raise BadReply("an IIO event: expected a description, or what it announces")

    def flush(self) -> None:
        """No more will come: the next ``take`` gives all."""
        self._ended = True

    def take(self) -> AccelerationBlock:
        """The samples whose times are certain by now."""
        if self._dated is not None:
            if self._ended:
                self._dated.flush()
            self._blocks.append(self._dated.take())
        blocks, self._blocks = self._blocks, []
        if not blocks:
            return AccelerationBlock(np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty(0, dtype=np.bool_))
        if len(blocks) == 1:
            return blocks[0]
        return AccelerationBlock(
            np.concatenate([block.t_us for block in blocks]), np.concatenate([block.accel_mps2 for block in blocks]),
            np.concatenate([block.clipped for block in blocks]), blocks[-1].rate_hz)

    def _describe(self, layout: _iio_device.ScanLayout) -> None:
        """A device, the same as before or another one."""
        if layout == self._layout:
            return
        if self._dated is not None:
            self._before = {key: count for key, count in self.counts.items() if key in self._before}
            self._before["samples"] -= self._values
            self._dated.flush()
            self._blocks.append(self._dated.take())
        self._layout = layout
        self._dated = None if layout.polled else DatedSamples(layout.rate_hz)

    def _take_scans(self, t_us: int, data: bytes, layout: _iio_device.ScanLayout, dated: DatedSamples) -> None:
        if not data or len(data) % layout.scan_bytes:
            raise BadReply(f"an IIO event of {len(data)} bytes: expected scans of {layout.scan_bytes}")
        scans = np.frombuffer(data, dtype=np.uint8).reshape(-1, layout.scan_bytes)
        arrivals_us = np.full(len(scans), t_us, dtype=np.int64)
        if layout.timestamp is not None:
            earliest_us = t_us - LONGEST_QUEUED_US if self._arrived_us is None else self._arrived_us
            taken_us = np.maximum.accumulate(layout.timestamp.values(scans) // 1000)
            arrivals_us = np.clip(taken_us, min(earliest_us, t_us), t_us)
        self._arrived_us = int(arrivals_us[-1])
        begins, self._begins = self._begins, False
        raw = np.stack([axis.values(scans) for axis in layout.axes], axis=1)
        dated.add(UndatedSamples(begins, arrivals_us, layout.accel_mps2(raw), layout.clipped(raw),
                          np.ones(len(scans), dtype=np.bool_)))

    def _take_values(self, t_us: int, data: bytes, layout: _iio_device.ScanLayout) -> None:
        try:
            raw: _iio_device.Integers = np.array([[int(word) for word in data.split()]], dtype=np.int64)
        except (ValueError, OverflowError):
            raw = np.empty((1, 0), dtype=np.int64)
        if raw.shape != (1, 3):
            raise BadReply("an IIO event: expected three whole numbers")
        self._values += 1
        self._blocks.append(AccelerationBlock(np.array([t_us], dtype=np.int64), layout.accel_mps2(raw),
                                              layout.clipped(raw), float(_iio_device.POLLED_HZ)))


class _Iio(Accelerometer[IioConfig]):
    """The kernel's interface."""

    name = "iio"
    title = "IIO accelerometer"
    settings = IioConfig

    def place(self, settings: IioConfig) -> str:
        return f"/sys/bus/iio/devices ({settings.device})"

    def source(self, settings: IioConfig, machine: Machine) -> Source:
        """By the buffer or value by value, as it turns out."""
        return IioSource(settings, machine)

    def decoder(self, settings: IioConfig, upright_axis: int) -> IioDecoder:
        return IioDecoder(settings)

    def readings(self, settings: IioConfig) -> ReadingQuality:
        """As the settings say; a step that they leave to the device is taken for finer than the noise. Several readings
        to each on the 100 Hz grid blur a step into noise."""
        step_mps2, each = settings.scale_mps2 or 0.0, settings.rate_hz / 100
        if each > 1:
            return ReadingQuality(hypot(settings.noise_mps2, step_mps2 / sqrt(12 * each)))
        return ReadingQuality(settings.noise_mps2, step_mps2)

    def facts(self, settings: IioConfig) -> dict[str, Any]:
        """What the settings ask for: the rest is the kernel's, and in the recording."""
        return {"verified": False, "device": settings.device, "rate_hz": settings.rate_hz,
                "mps2_per_count": settings.scale_mps2, "noise_mps2": settings.noise_mps2}

    def header(self, settings: IioConfig) -> dict[str, Any]:
        """What is not in the events."""
        return {"rate_hz": settings.rate_hz, "scale_mps2": settings.scale_mps2, "noise_mps2": settings.noise_mps2}

    def recorded(self, said: RecordedWords, settings: IioConfig, is_given: bool) -> IioConfig:
        """Rate and step are the recording's, the noise that of the settings where they are given."""
        noise_mps2 = said.number("noise_mps2", settings.noise_mps2, *_NOISE_MPS2)
        return replace(settings, rate_hz=said.whole("rate_hz", settings.rate_hz, 1),
                       scale_mps2=said.number_or_none("scale_mps2", settings.scale_mps2, *_STEP_MPS2),
                       noise_mps2=settings.noise_mps2 if is_given else noise_mps2)

    def advice(self, state: str) -> str:
        return ("check that the kernel has it (ls /sys/bus/iio/devices; dmesg), its overlay in "
                "/boot/firmware/config.txt, and its wires")


ACCELEROMETER = _Iio()
