"""What a fake accelerometer is: a device in simulated time, on wires that ``Machine`` hands to its source.

It is written from the data sheet: it takes nothing from the driver but the dataclass of the settings, so that a driver
whose scale, order of bytes or registers are wrong disagrees with it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from drivers.hardware import Machine

Vector = npt.NDArray[np.float64]


class Clock:
    """Time that passes where somebody sleeps; listeners are called before it does."""

    def __init__(self, now_us: int = 50_000_000) -> None:
        self.now_us = now_us
        self.listeners: list[Callable[[int], None]] = []

    def __call__(self) -> int:
        return self.now_us

    def sleep(self, seconds: float) -> None:
        """Let it pass."""
        self.now_us += max(0, round(seconds * 1e6))
        for listener in self.listeners:
            listener(self.now_us)


@dataclass(frozen=True)
class DataSheet:
    """What the data sheet says of readings at some settings.

    rate_hz          samples a second
    step_mps2        of one count [m/s2]; 0: finer than the noise
    noise_mps2       r.m.s. of a reading on the 100 Hz grid [m/s2]: least and most that the sheet, or the lack of one,
                     lets a driver say
    saturates_mps2   end of the range [m/s2]
    bandwidth_hz     of the device's own filter [Hz]; None: it has none that is known
    """

    rate_hz: float
    step_mps2: float
    noise_mps2: tuple[float, float]
    saturates_mps2: float
    bandwidth_hz: float | None = None


@dataclass(frozen=True)
class Example:
    """Bytes of one sample as the data sheet gives them, and what they mean.

    settings    of the accelerometer
    event       bytes of the sample; such events come ``interval_us`` apart [us]
    first       event before all others; empty: none
    accel_mps2  along the sensor's X, Y, Z [m/s2]
    """

    settings: Any
    event: bytes
    accel_mps2: tuple[float, float, float]
    clipped: bool = False
    interval_us: int = 10_000
    first: bytes = b""


class Fake(ABC):
    """One device.

    accel      what it feels at a time [us]: X, Y, Z [m/s2], gravity in it; may be changed at any time
    settings   of the accelerometer, for this fake
    variants   settings that it is tried with, the usual ones first; each reading of the data sheet in one of them
    examples   bytes out of the data sheet
    wrong      what the status says (a pattern) when another device sits in its place
    """

    name: ClassVar[str]
    variants: ClassVar[tuple[Any, ...]]
    examples: ClassVar[tuple[Example, ...]]
    wrong: ClassVar[str]

    def __init__(self, folder: Path, clock: Clock, settings: Any = None) -> None:
        self.folder = folder
        self.clock = clock
        self.settings = self.variants[0] if settings is None else settings
        self.accel: Callable[[int], Vector] = lambda t_us: np.array([0.0, 0.0, 9.80665])
        clock.listeners.append(self.advance)

    @property
    @abstractmethod
    def sheet(self) -> DataSheet:
        """What the data sheet says of it with these settings."""

    @property
    @abstractmethod
    def state(self) -> dict[Any, Any]:
        """What it holds of its settings now; empty: it holds none."""

    @abstractmethod
    def machine(self) -> Machine: ...

    @abstractmethod
    def advance(self, now_us: int) -> None:
        """Time has passed until then: take the samples that are due."""

    @abstractmethod
    def unplug(self) -> None: ...

    @abstractmethod
    def plug(self) -> None: ...

    @abstractmethod
    def lose_settings(self) -> None:
        """A dip of its supply: it goes on answering, with the settings that it has after power-on."""

    @abstractmethod
    def replace_by_another(self) -> None:
        """Another device sits there from the next time it is opened."""
