"""Modes out of drives in cars that differ from the file that is given: how many are the car's own, within their errors.

``python -m tests.benchmarks.modes_of_drives [DRIVES]`` simulates so many drives (default: 5) in each of four cars whose
springs, dampers, masses and inertias are off by 20 per cent, at 8 to 28 m/s on roads of classes A to D and waviness 1.8
to 2.2, and compares the modes with the eigenvalues of the car that was driven.
"""

from __future__ import annotations

import sys

import numpy as np

from logger.modal.driven_car import car_modes, fitted_names
from logger.vehicle.models import structure_of
from logger.vehicle.modes import modes
from logger.vehicle.named_parameters import read
from ridelog import random_road, read_vehicle, simulate

CARS = ("golden-car", "rav4-2009", "ford-escort", "sedan-2015")
INVENTED, WITHIN_TWO = 0, 0.95  # modes farther than 4 standard errors from any; share of the rest within 2


def main(drives: int) -> int:
    """Print the figures beside the goals."""
    errors, refused = [], 0
    for name in CARS:
        for seed in range(drives):
            generator, given = np.random.default_rng(100 + seed), read_vehicle(name)
            true = given.with_numbers({one: read(given.vehicle, one) * float(np.exp(0.2 * generator.standard_normal()))
                                       for one in fitted_names(given.vehicle)})
            speed_mps, iso_class = float(generator.uniform(8, 28)), str(generator.choice(list("ABCD")))
            road = random_road(iso_class=iso_class, length_m=70 * speed_mps, seed=seed,
                               waviness=float(generator.uniform(1.8, 2.2)))
            run = simulate(true, road, speed_mps, noise_mps2=0.02, seed=seed)
            try:
                found = car_modes(given.vehicle, run.accel_z_mps2, run.speed_mps, np.ones(len(run.time_s), bool),
                                  run.rate_hz).modes
            except ValueError as error:
                refused += 1
                print(f"{name} {seed}: {error}")
                continue
            own = [(one.frequency_hz, one.damping_ratio) for one in modes(structure_of(true.vehicle))]
            errors += [min(max(abs(hz - one.frequency_hz) / one.frequency_std_hz,
                               abs(ratio - one.damping_ratio) / one.damping_std) for hz, ratio in own) for one in found]
    off = np.array(errors)
    invented, within = int((off > 4).sum()), float((off < 2).mean())
    print(f"{len(off)} modes of {len(CARS) * drives} drives, {refused} refused")
    print(f"farther than 4 standard errors from any of the car's: {invented} (goal: {INVENTED})")
    print(f"within 2: {within:.0%} (goal: {WITHIN_TWO:.0%})")
    return int(invented > INVENTED or within < WITHIN_TWO)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 5))
