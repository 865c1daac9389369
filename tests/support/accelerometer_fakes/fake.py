"""What a fake accelerometer is: a device in simulated time, on wires that ``Machine`` hands to its source."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from drivers.machine import Machine

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


class Fake(ABC):
    """One device.

    accel      what it feels at a time [us]: X, Y, Z [m/s2], gravity in it; may be changed at any time
    settings   of the accelerometer, for this fake
    saturates_mps2   beyond this it is at the end of its range
    wrong      what the status says (a pattern) when another device sits in its place
    """

    name: ClassVar[str]
    saturates_mps2: ClassVar[float]
    wrong: ClassVar[str]

    def __init__(self, folder: Path, clock: Clock) -> None:
        self.folder = folder
        self.clock = clock
        self.accel: Callable[[int], Vector] = lambda t_us: np.array([0.0, 0.0, 9.80665])
        clock.listeners.append(self.advance)

    @property
    @abstractmethod
    def settings(self) -> Any: ...

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
    def replace_by_another(self) -> None:
        """Another device sits there from the next time it is opened."""
