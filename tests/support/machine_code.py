"""Machine code of the loops that step cars, kept on disk: tests that run side by side make each once, not once each."""

from __future__ import annotations

import fcntl
from pathlib import Path

import numpy as np

from logger.profiles.track import Track
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded
from logger.vehicle.effect import chosen
from logger.vehicle.simulate import Passage


def step_a_car() -> None:
    """A tenth of a second of the program's car, with an effect that needs the loop."""
    added = shipped_effects()["hysteresis"]
    made = compose(read_vehicle(vehicle_file("rav4-2009")), [chosen(added, added.usual)])
    recorded(made, Passage(Track(0.1, np.zeros(200)), 100.0, made.driven(5.0 + 0.1 * np.arange(10))))


def step_the_other_car() -> None:
    """A second of the examination's own simulator."""
    from ..validation.simulator.scene import Drive, Scene, clean_acceleration
    from .drives.road_sets import random_road, simulator_car

    drive = Drive(random_road(np.random.default_rng(1), 60.0, 0.1, "B", features=False), 1.0, 10.0, 20.0)
    clean_acceleration(Scene(simulator_car(), (drive,)), drive)


LOOPS = (step_a_car, step_the_other_car)


def make(folder: Path, worker: int) -> None:
    """Run each loop once, beginning with the worker's own; while another worker makes one, wait for it."""
    for number in range(len(LOOPS)):
        loop = LOOPS[(worker + number) % len(LOOPS)]
        with (folder / loop.__name__).open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            loop()
