"""The lab: how long one diagnosis of four runs of a minute takes and how much memory, with all the effects there are;
and what a minute of driving costs a car with them."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from logger.profiles.track import Track
from logger.roads import iso8608
from logger.shipped import vehicle_file
from logger.store.formats.drive_file import write_drive, write_profile
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import Car, compose, recorded
from logger.vehicle.effect import Chosen, Effect, chosen
from logger.vehicle.simulate import Passage

from .figures import Figures

VEHICLE = "rav4-2009"
RATE_HZ, LASTS_S, NOISE_MPS2 = 100.0, 60.0, 0.05
SPEEDS_MPS = (7.0, 11.0, 15.0, 19.0)
GD_N0_CM3 = 256  # class C
HIDDEN: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    "nothing": {},
    "one effect": {"progressive_spring": {"cubic_stiffness_n_per_m3": 3e6}},
    "two effects": {"dry_friction": {"friction_force_n": 60.0}, "sensor_bandwidth": {"cutoff_hz": 18.0}},
}
GOAL_S, GOAL_MB, GOAL_MINUTE_MS = 60.0, 1000.0, 100.0
LINEAR_MINUTE_MS = 20.0
_KB_PER_MB = 1000.0


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    minutes(figures)
    for name, hidden in HIDDEN.items():
        with TemporaryDirectory() as folder:
            diagnosis(figures, name, drives(Path(folder), hidden))
    return 1 if figures.missed else 0


def usual(effect: Effect, values: Mapping[str, float]) -> Chosen:
    """With what is not given at its start."""
    return chosen(effect, effect.usual | dict(values))


def passage_of(speed_mps: float, seed: int) -> Passage:
    """A minute over a road of class C, at a speed that swings."""
    time_s = np.arange(round(LASTS_S * RATE_HZ)) / RATE_HZ
    speed = speed_mps * (1 + 0.1 * np.sin(2 * np.pi * time_s / 23.0))
    distance = np.concatenate([[0.0], np.cumsum(speed[:-1])]) / RATE_HZ
    return Passage(Track(0.05, iso8608.generate(GD_N0_CM3, distance[-1] + 20.0, 0.05, seed)), RATE_HZ, distance)


def drives(folder: Path, hidden: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Four runs of a car with effects, as folders."""
    rng = np.random.default_rng(1)
    car = compose(read_vehicle(vehicle_file(VEHICLE)),
                  [usual(shipped_effects()[name], values) for name, values in hidden.items()])
    runs = []
    for seed, speed_mps in enumerate(SPEEDS_MPS):
        passage, run = passage_of(speed_mps, seed), folder / f"run{seed + 1}"
        run.mkdir()
        accel = recorded(car, passage) + rng.normal(0, NOISE_MPS2, passage.count)
        write_drive(run / "drive.csv", {
            "t_s": np.arange(passage.count) / RATE_HZ, "accel_z_mps2": accel,
            "speed_mps": np.gradient(passage.distance_m) * RATE_HZ, "distance_m": passage.distance_m})
        write_profile(run / "profile.csv", passage.track)
        runs.append(str(run))
    return runs


def diagnosis(figures: Figures, name: str, runs: list[str]) -> None:
    """By the command, in a process of its own, whose memory is what the system says that it had at most."""
    command = [sys.executable, "-c", "from logger.commands.main import run; run()", "diagnose", "--json", "--vehicle",
               VEHICLE, *runs]
    started_s = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    taken_s = time.perf_counter() - started_s
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"diagnose left with {child.returncode}")
    figures.at_most(f"four minutes, {name} missing: diagnosis", taken_s, GOAL_S, "s")
    figures.at_most("  of the processor, for two cores", used.ru_utime + used.ru_stime, 2 * GOAL_S, "s")
    figures.at_most("  memory", used.ru_maxrss / _KB_PER_MB, GOAL_MB, "MB")


def minutes(figures: Figures) -> None:
    """A minute with each effect and with those that bend the laws together, the processor's time alone."""
    vehicle, passage = read_vehicle(vehicle_file(VEHICLE)), passage_of(15.0, 3)
    possible = [usual(one, {}) for one in shipped_effects().values() if one.obstacle(vehicle, False) is None]
    bending = [one for one in possible if compose(vehicle, [one]).bends_laws]
    linear = [one for one in possible if one not in bending]
    for name, some in (("linear", linear), ("nonlinear", bending)):
        goal_ms = LINEAR_MINUTE_MS if some is linear else GOAL_MINUTE_MS
        worst = max((minute_ms(compose(vehicle, [one]), passage), one.effect.name) for one in some)
        figures.at_most(f"a minute, {name}: {worst[1]}", worst[0], goal_ms, "ms")
        together = minute_ms(compose(vehicle, some), passage)
        figures.at_most(f"a minute, all {len(some)} {name} effects", together, goal_ms, "ms")


def minute_ms(car: Car, passage: Passage) -> float:
    """The best of some; of a body that has not passed before, as a passage keeps the motions of those that have."""
    taken = []
    for _ in range(5):
        fresh = replace(car, body=object())
        started_s = time.process_time()
        recorded(fresh, passage)
        taken.append(time.process_time() - started_s)
    return 1e3 * min(taken)


if __name__ == "__main__":
    sys.exit(main())
