"""Makes the drives of the lab's tutorial: ``python -m tests.support.drives.lab_drives FILE.zip``.

Two drives of forty seconds in a 2009 RAV4, over two poor town streets with speed bumps, slowly and less slowly. All of
it is simulated; what the car truly is says ``logger.demo``.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np

from logger.demo import LAB
from logger.files import make_folder, write_file
from logger.profiles.track import Track
from logger.roads.iso8608 import generate
from logger.roads.obstacles import speed_bump
from logger.shipped import vehicle_file
from logger.store.formats.drive_file import DRIVE, PROFILE, write_drive, write_profile
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded
from logger.vehicle.effect import chosen
from logger.vehicle.named_parameters import changed, read
from logger.vehicle.simulate import Passage

RATE_HZ, LASTS_S, SPACING_M = 100, 40, 0.1
_GD_N0_CM3 = 30.0
_NOISE_MPS2 = 0.05
_WANDER_M = 0.004  # of the distance signal, after one second
_BUMP_WIDTH_M = 3.6
_SWING, _SWING_S = 0.12, 23.0
LONG_AGO = (2015, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class DemoDrive:
    """A drive: its folder, mean speed, how far apart bumps are and how high, in turn."""

    name: str
    speed_mps: float
    every_m: float
    heights_m: tuple[float, ...]
    seed: int


PLANS = (DemoDrive("slow", 6.0, 36.0, (0.05, 0.08, 0.11), 1), DemoDrive("brisk", 11.0, 55.0, (0.04, 0.06, 0.07), 2))


def write_run(folder: Path, plan: DemoDrive) -> None:
    """Drive a plan and write it as a run."""
    rng = np.random.default_rng(plan.seed)
    time_s = np.arange(LASTS_S * RATE_HZ) / RATE_HZ
    speed = np.round(plan.speed_mps * (1 + _SWING * np.sin(2 * np.pi * time_s / _SWING_S + plan.seed)), 3)
    distance = np.round(np.concatenate([[0.0], np.cumsum(speed[:-1])]) / RATE_HZ, 3)
    wander = np.cumsum(rng.normal(0, _WANDER_M / np.sqrt(RATE_HZ), len(time_s)))
    smooth = np.convolve(np.pad(wander, RATE_HZ, "edge"), np.full(2 * RATE_HZ + 1, 1 / (2 * RATE_HZ + 1)), "valid")
    track = road(plan, float(distance[-1]) + 20.0)
    vehicle = read_vehicle(vehicle_file(LAB.vehicle))
    true = changed(vehicle, {name: factor * read(vehicle, name) for name, factor in LAB.off.items()})
    car = compose(true, [chosen(shipped_effects()[LAB.effect], LAB.values)])
    accel = recorded(car, Passage(track, RATE_HZ, distance + smooth)) + rng.normal(0, _NOISE_MPS2, len(time_s))
    make_folder(folder)
    write_drive(folder / DRIVE, {"t_s": time_s, "accel_z_mps2": np.round(accel, 3), "speed_mps": speed,
                                 "distance_m": distance})
    write_profile(folder / PROFILE, track)


def road(plan: DemoDrive, length_m: float) -> Track:
    """The street of a plan."""
    elevation = generate(_GD_N0_CM3, length_m, SPACING_M, plan.seed)
    place = SPACING_M * np.arange(len(elevation))
    for number, start_m in enumerate(np.arange(20.0, length_m - 30.0, plan.every_m)):
        elevation = elevation + speed_bump(place, start_m, plan.heights_m[number % len(plan.heights_m)], _BUMP_WIDTH_M)
    return Track(SPACING_M, np.round(elevation - elevation[0], 4))


def main() -> None:
    """Write the runs to the archive named on the command line."""
    made = BytesIO()
    with TemporaryDirectory() as folder, ZipFile(made, "w") as archive:
        for plan in PLANS:
            write_run(Path(folder) / plan.name, plan)
            for name in (DRIVE, PROFILE):
                # A date of its own, so that the archive is the same whenever it is made.
                entry = ZipInfo(f"{plan.name}/{name}", LONG_AGO)
                entry.compress_type = ZIP_DEFLATED
                archive.writestr(entry, (Path(folder) / plan.name / name).read_bytes())
    write_file(sys.argv[1], [made.getvalue()])


if __name__ == "__main__":
    main()
