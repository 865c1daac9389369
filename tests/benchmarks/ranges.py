"""Which range and how many readings a sample suit which road: what ``ridelog status`` advises by.

    python -m tests.benchmarks.ranges [--mph 20,40,60] [--iri 2,5,14,20,30,45] [--draws 1]

A BMA220 with its usual noise on roads as profilers find them (potholes, bumps, patches), exact places: R2 of 25 ft
windows, their bias, the windows with a clipped reading, those that hide (``faint``), and those with an estimate.
"""

from __future__ import annotations

import argparse
from itertools import product

import numpy as np

from drivers.accelerometers.bma220 import NOISE_MPS2
from logger.estimation.sensor_noise import Sensor
from logger.estimation.streaming import RoadEstimator
from logger.units import MPH_MPS, STANDARD_GRAVITY_MPS2, WINDOW_M
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import half_car
from logger.vehicle.structure import body_point

from ..support.drives.measured import GRID_HZ, Accelerometer, measured_like_road, steady_drive
from .estimator import LEAD_S, on_grid, r2, rav4
from .noise import wider

FIRST_SEED = 970_000
LENGTH_M = 900.0
SETTINGS = ((2, 1), (2, 4), (4, 1), (4, 4), (4, 8), (8, 4), (8, 8))


def driven(level: float, mph: float, range_g: int, reads: int, seed: int) -> np.ndarray:
    """Windows (n, 4): exact IRI, estimate, whether a reading was clipped, whether it hides."""
    noise = NOISE_MPS2 * wider(reads)
    chip = Accelerometer(f"{range_g} g", noise, range_g * STANDARD_GRAVITY_MPS2 / 32, reads, (-32, 31))
    road = measured_like_road(level, LENGTH_M, FIRST_SEED + seed)
    drive = steady_drive(rav4(), road, mph * MPH_MPS, LEAD_S, GRID_HZ * reads)
    _, each, clipped = on_grid(drive, chip, np.random.default_rng([FIRST_SEED, seed, range_g]))
    place_m = drive.place_m[::reads][: len(each)]
    structure = half_car(rav4())
    estimator = RoadEstimator(LinearCar(structure, body_point(structure)), Sensor(noise, chip.step_mps2), WINDOW_M,
                              reads=reads)
    at_end = np.where(clipped, np.sign(each - np.median(each)), 0.0)
    found = estimator.push(each, np.ones(each.shape, dtype=np.bool_), at_end, place_m - place_m[0]) + estimator.finish()
    cut = np.zeros(found[-1].number + 2)
    window = np.floor((place_m - place_m[0]) / WINDOW_M).astype(int)
    np.maximum.at(cut, np.minimum(window, len(cut) - 1), clipped.reshape(len(each), -1).max(axis=1))
    begin_m = place_m[0] + WINDOW_M * np.array([one.number for one in found])
    columns = [road.iri(begin_m, begin_m + WINDOW_M), [one.iri_m_per_km for one in found],
               cut[[one.number for one in found]], ["faint" in one.flags for one in found]]
    return np.column_stack(columns).astype(np.float64)[begin_m > 0]


def main() -> None:
    """Print a line for each cell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)

    def numbers(text: str) -> list[float]:
        return [float(one) for one in text.split(",")]

    parser.add_argument("--mph", type=numbers, default=[20.0, 40.0, 60.0])
    parser.add_argument("--iri", type=numbers, default=[2.0, 5.0, 14.0, 20.0, 30.0, 45.0])
    parser.add_argument("--draws", type=int, default=1, help="roads of each roughness")
    asked = parser.parse_args()
    print(f"{'':34s}{'R2':>7s}{'bias':>7s}{'clipped':>9s}{'hidden':>8s}{'given':>7s}")
    for mph, level, (range_g, reads) in product(asked.mph, asked.iri, SETTINGS):
        exact, estimate, cut, hidden = np.concatenate(
            [driven(level, mph, range_g, reads, seed) for seed in range(asked.draws)]).T
        known = np.isfinite(estimate)
        bias = estimate[known].mean() / exact[known].mean() - 1 if known.any() else np.nan
        name = f"{mph:g} mph, IRI {level:g}, {range_g} g, {reads} reads"
        print(f"{name:34s}{r2(estimate[known], exact[known]):7.3f}{bias:+7.1%}{cut.mean():9.1%}{hidden.mean():8.1%}"
              f"{known.mean():7.0%}", flush=True)


if __name__ == "__main__":
    main()
