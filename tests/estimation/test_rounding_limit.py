"""The benchmark's sampler: where noise blurs the steps it says what the Wiener filter says that knows everything."""

import numpy as np

from logger.units import WINDOW_M

from ..benchmarks.estimator import LEAD_S, known_best, rav4
from ..benchmarks.rounding_limit import Lap, best_values
from ..support.drives.measured import GRID_HZ, Accelerometer, iso_road, steady_drive


def test_blurred_steps_are_noise() -> None:
    chip = Accelerometer("blurred", 0.1, 0.1)
    road = iso_road(3.0, 30 * WINDOW_M, 11, 2.0)
    drive = steady_drive(rav4(), road, 20.0, LEAD_S, GRID_HZ)
    readings, _ = chip.read(drive.accel_mps2, np.random.default_rng(1))
    speed_mps, lead = float(drive.speed_mps[0]), round(LEAD_S * GRID_HZ)
    lap = readings[lead: lead + round(road.length_m / speed_mps * GRID_HZ)]
    begin_m = np.arange(29) * WINDOW_M
    found = best_values(rav4(), Lap(road, speed_mps, lap - 0.05, lap + 0.05, 0.1), begin_m, begin_m + WINDOW_M, 300)
    wiener = known_best(rav4(), drive, chip, readings)(begin_m, begin_m + WINDOW_M)
    for chain in found:
        assert np.std(chain - wiener) < 0.15 * np.std(wiener)
        assert abs(chain.mean() / wiener.mean() - 1) < 0.03
