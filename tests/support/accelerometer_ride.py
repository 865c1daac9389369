"""A car with one fake accelerometer and a receiver, in simulated time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from drivers.accelerometers import accelerometers
from drivers.dump import Event
from drivers.readings import GPS, AccelerationBlock
from logger.service import wiring
from logger.service.config import AccelerometerConfig, Config
from logger.service.event_core import EventCore
from logger.service.supervisor import Supervisor
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model

from .accelerometer_fakes import fakes
from .accelerometer_fakes.fake import Clock, Fake, Vector
from .drives.replay import Rows
from .faults.sensors import epoch

SPEED_MPS = 12.0


ROUGH_TONES_HZ = (1.3, 3.7, 7.1, 11.9)
ROUGH_MPS2 = 1.2


def rough(t_us: int) -> Vector:
    """A road of some tones, larger than a step of any sensor here, and gravity."""
    t_s = t_us / 1e6
    up = sum(np.sin(2 * np.pi * f_hz * t_s + f_hz) for f_hz in ROUGH_TONES_HZ)
    return np.array([0.3 * np.sin(t_s), 0.2 * np.cos(3 * t_s), 9.80665 + ROUGH_MPS2 * up])


def core_of(config: Config) -> tuple[EventCore, Rows]:
    """A service with these settings."""
    rows = Rows()
    sensor = wiring.instrument(config.accelerometer)
    pipeline = wiring.pipeline(config, sensor, wiring.car_of(config, read_model))
    return EventCore(sensor.decoder, wiring.gps_decoder(config), pipeline, rows), rows


class Ride:
    """The drive; what happens is kept."""

    def __init__(self, name: str, folder: Path, settings: Any = None) -> None:
        self.kind = accelerometers()[name]
        self.clock = Clock()
        self.fake: Fake = fakes()[name](folder, self.clock, settings)
        self.fake.accel = rough
        sections = AccelerometerConfig().sections | {name: self.fake.settings}
        self.config = Config(AccelerometerConfig(name, sections=sections), vehicle=vehicle_file("rav4-2009"))
        self.source = self.kind.source(self.fake.settings, self.fake.machine())
        self.supervisor = Supervisor(self.source, self.clock)
        self.events: list[Event] = []
        self.begin_us = self.clock.now_us
        self.seconds = 0

    def drive(self, seconds: float) -> Ride:
        """Let time pass."""
        until_us = self.clock.now_us + round(seconds * 1e6)
        while self.clock.now_us < until_us:
            self.events += self.supervisor.step()
            if self.supervisor.retry_at_us is None:
                self.source.rest()
            else:
                self.clock.sleep(0.1)
            while self.clock.now_us - self.begin_us > self.seconds * 1_000_000:
                data = epoch(self.seconds, SPEED_MPS, self.seconds * SPEED_MPS)
                self.events.append(Event(self.begin_us + self.seconds * 1_000_000, GPS, data))
                self.seconds += 1
        return self

    def parked(self) -> list[Event]:
        """The end: all events in order."""
        self.events += self.supervisor.close()
        return sorted(self.events, key=lambda event: event.t_us)

    def rows(self) -> Rows:
        """What the live service makes of it."""
        core, rows = core_of(self.config)
        for event in self.parked():
            core.feed(event)
        core.finish()
        return rows

    def samples(self, config: Config) -> AccelerationBlock:
        """What a decoder with these settings makes of its events."""
        decoder = wiring.instrument(config.accelerometer).decoder
        for event in self.parked():
            if event.source == self.kind.name:
                decoder.feed(event.t_us, event.data)
        decoder.flush()
        return decoder.take()
