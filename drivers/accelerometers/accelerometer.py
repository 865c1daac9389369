"""What an accelerometer is to the rest of the program: one object per file, offered as ``ACCELEROMETER``.

Problem: an accelerometer shows up in the settings, in the live service, in recordings and their replay, and in what
``ridelog status`` advises; a branch on its name at each of these places is forgotten at one of them. Solution: each of
these places asks this object.

The bytes of a live source, with their times, are all that a decoder gets: what was recorded from the source replays to
the same samples.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from drivers.catalogue import CatalogueError
from drivers.hardware import Machine
from drivers.readings import AccelerationBlock, Kind, RecordedWords
from drivers.sources import SerialSource, Source, serial_advice

SERIAL_WAIT_S = 0.5
SERIAL_NOISE_MPS2 = 0.05
"""R.m.s. noise of a sensor that samples by its own clock, on the 100 Hz grid, where nothing states it."""

Settings = TypeVar("Settings")


class Decoder(Protocol):
    """Bytes with their arrival time in, samples out; after ``flush`` the next ``take`` gives all.

    name      of the events that it reads
    doubt     what is wrong with the samples that come, and what to do; empty: nothing
    note      how they come, where a person should know of it though nothing is wrong; empty: as they should
    counts    what came in so far, by name
    unread    what arrives and what to do, where bytes arrive and none becomes a sample

    ``feed`` raises BadReply for bytes that are none of this device's, and has then taken nothing.
    """

    name: str

    @property
    def doubt(self) -> str: ...
    @property
    def note(self) -> str: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def unread(self) -> str: ...
    def feed(self, t_us: int, data: bytes) -> None: ...
    def flush(self) -> None: ...
    def take(self) -> AccelerationBlock: ...


@dataclass(frozen=True)
class ReadingQuality:
    """What single readings are.

    noise_mps2    r.m.s. noise of a reading, before it is rounded [m/s2], above 0; on the 100 Hz grid for a source that
                  samples by its own clock
    step_mps2     one count of a reading at the rate at which it is read [m/s2]; 0: below twice the noise, which blurs
                  it, or not known
    oversample    readings a second over 100, for a source that is read by the host's clock; 1 for one that samples by
                  its own: its decoder finds the rate

    The BMA220 at +-2 g has counts of 0.61 m/s2 and a noise of 0.1: its step is 0.61, whatever its ``oversample``. The
    ADXL345 has counts of 0.038 and a noise of 0.042: its step is 0.
    """

    noise_mps2: float
    step_mps2: float = 0.0
    oversample: int = 1


@dataclass(frozen=True)
class OtherSettings:
    """Settings that would suit another road better, as a settings file has them; empty: there is none.

    wider      of a larger range
    finer      of smaller ones, the smallest first, each with the reading from which on it would stand at its end [m/s2]
    oftener    of more readings per sample
    """

    wider: str = ""
    finer: tuple[tuple[str, float], ...] = ()
    oftener: str = ""


def setting(default: Any, kind: Kind) -> Any:
    """A field of an accelerometer's settings: its default, and what may stand there in a settings file."""
    return field(default=default, metadata={"kind": kind})


class Accelerometer(ABC, Generic[Settings]):
    """One kind of accelerometer.

    name          in settings and recordings; the file is called so
    title         what people call it
    settings      frozen dataclass of its settings (``setting``); SettingsError for values that cannot be
    event_bytes   size of one event; None: any
    """

    name: ClassVar[str]
    title: ClassVar[str]
    settings: type[Settings]
    event_bytes: int | None = None

    @property
    def keys(self) -> Mapping[str, Kind]:
        """What may stand at each of its settings in a settings file. CatalogueError for one that does not say it."""
        if bare := [one.name for one in fields(self.settings) if "kind" not in one.metadata]:  # type: ignore[arg-type]
            raise CatalogueError(f"{self.name}: expected each of its settings to be made by setting, found {bare[0]}")
        return {one.name: one.metadata["kind"] for one in fields(self.settings)}  # type: ignore[arg-type]

    def check_chosen(self, settings: Settings) -> None:
        """SettingsError where nothing can be made of these settings, once this is the chosen accelerometer."""

    @abstractmethod
    def place(self, settings: Settings) -> str:
        """Where it is, for people: ``/dev/i2c-1``."""

    @abstractmethod
    def source(self, settings: Settings, machine: Machine) -> Source:
        """The live device; nothing is opened yet."""

    @abstractmethod
    def decoder(self, settings: Settings, upright_axis: int) -> Decoder:
        """A new decoder of its events. ``upright_axis``: 0, 1, 2, the sensor's axis along which gravity is felt.
        SettingsError for settings that cannot be."""

    @abstractmethod
    def readings(self, settings: Settings) -> ReadingQuality:
        """What single readings are."""

    def others(self, settings: Settings) -> OtherSettings:
        """What could be set instead."""
        return OtherSettings()

    @abstractmethod
    def facts(self, settings: Settings) -> dict[str, Any]:
        """What lies beside each log about it: scale, filter, and as ``verified`` whether hardware has confirmed it."""

    def header(self, settings: Settings) -> dict[str, Any]:
        """What a recording's first line says about it, beside driver and vertical axis."""
        return {}

    def recorded(self, said: RecordedWords, settings: Settings, is_given: bool) -> Settings:
        """Settings for the replay of a recording, by what its header ``said``. What is in the bytes is always the
        header's; the rest is that of ``settings``: those given for this replay, or the defaults. SettingsError for
        what cannot be."""
        return settings

    def simulated(self, settings: Settings, accel_mps2: npt.NDArray[np.float64]) -> list[bytes]:
        """Readings (n, 3) [m/s2] as the bytes of n events, for drives that are simulated. NotImplementedError where its
        events are not single readings."""
        raise NotImplementedError(f"{self.name}: its events are not single readings")

    @abstractmethod
    def advice(self, state: str) -> str:
        """What to look at when it is ``absent``, ``retrying`` or ``silent``."""


class SerialAccelerometer(Accelerometer[Settings]):
    """One whose bytes come on a serial port: what was recorded of it can be sent through a real wire.

    lines    what the header of a recording says whose bytes are lines ``x,y,z`` in g; None: it does not read such
    """

    lines: ClassVar[Mapping[str, Any] | None] = None

    @abstractmethod
    def line(self, settings: Settings) -> tuple[str, int]:
        """Path of the port, and its baud rate."""

    def place(self, settings: Settings) -> str:
        return self.line(settings)[0]

    def source(self, settings: Settings, machine: Machine) -> Source:
        port, baud = self.line(settings)
        return SerialSource(self.name, lambda: machine.open_serial(port, baud), machine.now_us, SERIAL_WAIT_S,
                            machine.sleep)

    def advice(self, state: str) -> str:
        return serial_advice(state)
