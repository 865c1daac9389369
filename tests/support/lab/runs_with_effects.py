"""Runs of cars that have what their model lacks, as folders, for the tests of the lab's commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats.drive_file import write_drive, write_profile
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen

from .runs_with_residual import CAR, RATE_HZ, a_run

SPEEDS_MPS = (7.0, 15.0)
FEW = ("roll", "sensor_gain", "sensor_offset", "time_offset")
"""Enough candidates to choose among, few enough, and linear, to be quick."""

OWN = '''
from logger.vehicle.effects.sensor_offset import SensorOffset


class Bracket(SensorOffset):
    name = "long_bracket"
    title = "the sensor sits on a long bracket"
    source = "my own"
    shown_by = "drive a smooth road"


EFFECT = Bracket()
'''
"""A user's own effect, which does what one of ridelog's does."""


def named(name: str, **values: float) -> Sequence[Chosen]:
    """One effect of ridelog's."""
    return [chosen(shipped_effects()[name], values)]


def out_of_balance(run: Run) -> npt.NDArray[np.float64]:
    """What a wheel of 0.33 m radius that is out of balance shakes the sensor with (n,) [m/s2]."""
    return np.asarray(0.002 * run.speed_mps**2 * np.sin(run.distance_m / 0.33))


def write_runs(folder: Path, effects: Sequence[Chosen], lasts_s: float = 20.0, noise_mps2: float = 0.03,
               more: Callable[[Run], npt.NDArray[np.float64]] | None = None) -> list[str]:
    """Two runs of a car with effects, and of whatever more shakes the sensor: their folders."""
    car, rng = compose(CAR, effects), np.random.default_rng(5)
    folders = []
    for index, speed_mps in enumerate(SPEEDS_MPS):
        run = a_run(f"run{index + 1}", speed_mps, lasts_s, index + 3)
        measured = SimulatedRuns([run]).predict(car)[0] + rng.normal(0, noise_mps2, run.count)
        if more is not None:
            measured = measured + more(run)
        to = folder / run.name
        to.mkdir(parents=True)
        write_drive(to / "drive.csv", {"t_s": np.arange(run.count) / RATE_HZ, "accel_z_mps2": measured,
                                       "speed_mps": run.speed_mps, "distance_m": run.distance_m})
        write_profile(to / "profile.csv", run.track)
        folders.append(str(to))
    return folders
