"""What the box says of roads before and after ``ridelog learn-car``, beside a box that knows the car.

    python -m tests.benchmarks.learned_replay [--cars 0-1] [--mph 25,45] [--km 2.4]

Each car (``support.drives.unmeasured_car.some_car``) is learned from twenty minutes of ordinary drives, its wheelbase
1 % off, with a BMA220. Then it drives on, over roads whose level changes (``changing_roads.sectioned_road``), and
``ridelog replay`` reads the recorded bytes with each vehicle: R2, bias, and the windows of 25 ft within one and two
standard errors. Places are right and the noise is known, and the box is told both: with the metre of its settings the
true car's windows would be called less certain than they are. All windows of a generic car have one bias, so that a few
cars say little of its standard errors: these are judged by the bias of ``DRAWN`` cars (``unknown_car.iri_ratio``).

Goals: R2 within 0.02 of the true car's; within one and two standard errors 64 to 72 and 93 to 97 % of the windows, with
``generic`` 60 to 85 and 93 to 99 % of the cars.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from logger.api.learn_car import learn_car
from logger.estimation.car_response import LOG_WAVES, WAVE_NUMBERS_CPM, CarResponse
from logger.estimation.iri_posterior import slope_knowledge
from logger.estimation.road_spectrum import COMMON_ROAD
from logger.identification.unknown_car import CarKnowledge, iri_ratio, reading_power
from logger.store.formats.vehicle_file import CarModel, write_model
from logger.units import MPH_MPS, STANDARD_GRAVITY_MPS2, WINDOW_M
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.published_cars import generic_car
from logger.vehicle.uncertain import cars_off

from ..support.drives.measured import GRID_HZ, steady_drive
from ..support.drives.unmeasured_car import BMA220, mixed, some_car, written
from .changing_roads import sectioned_road, sensor_of
from .default_settings import STEADY, print_way, replayed, write_dump
from .estimator import LEAD_S
from .figures import Figures
from .learn_car import LEVEL, ahead_of_middle_m, truth

FIRST_SEED, DRAWN = 730_000, 100


def generic_deviations(mph: float) -> np.ndarray:
    """Bias of the IRI of drawn cars (c,) with ``generic`` of their wheelbase, in standard errors that the box says."""
    vehicle, errors = generic_car(2.7)
    car, off = known_vehicle(vehicle, ()), cars_off(vehicle, (), errors)
    speed, psd = mph * MPH_MPS, COMMON_ROAD.psd_of(LOG_WAVES)
    response = CarResponse(car.at(speed, WAVE_NUMBERS_CPM, psd), [one.at(speed, WAVE_NUMBERS_CPM, psd) for one in off])
    variance = BMA220.noise_mps2**2 + BMA220.step_mps2**2 / 12
    std = slope_knowledge(response, speed, COMMON_ROAD, variance, 100.0, WINDOW_M, 1).vehicle_std
    found = []
    for seed in range(DRAWN):
        drawn = some_car(seed)
        any_car = CarKnowledge(drawn.wheelbase_m)
        powers = (reading_power(any_car, x, speed) for x in (any_car.mean, truth(drawn)))
        found.append(np.log(iri_ratio(*powers, speed, variance / 50, LEVEL)) / std)
    return np.array(found)


def main() -> int:
    """Print all figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--cars", default="0-1")
    parser.add_argument("--mph", default="25,45")
    parser.add_argument("--km", type=float, default=2.4)
    asked = parser.parse_args()
    low, _, high = asked.cars.partition("-")
    found: dict[str, list] = {"true": [], "learned": [], "generic": []}
    for seed in range(int(low), int(high or low) + 1):
        car = some_car(seed)
        wheelbase_m = car.wheelbase_m * (1 + 0.01 * (-1) ** seed)
        true = CarKnowledge(car.wheelbase_m).car(truth(car), car.mass_kg, "true")
        with TemporaryDirectory() as name:
            folder = Path(name)
            runs = written(folder / "drives", mixed(car, 50_000 + seed, 300.0, BMA220))
            learn_car(runs, wheelbase_m, sensor=ahead_of_middle_m(car)).write(folder / "learned.yaml")
            write_model(folder / "true.yaml", CarModel(true), "")
            settings = {"true": f"vehicle: {folder / 'true.yaml'}\n",
                        "learned": f"vehicle: {folder / 'learned.yaml'}\n",
                        "generic": f"vehicle: generic\nwheelbase_m: {wheelbase_m:.3f}\n"}
            for mph in map(float, asked.mph.split(",")):
                rng = np.random.default_rng([FIRST_SEED, seed, round(mph)])
                road = sectioned_road(FIRST_SEED + 100 * seed + round(mph), 2.0, 1000 * asked.km)
                drive = steady_drive(true, road, mph * MPH_MPS, LEAD_S, GRID_HZ)
                noise_mps2 = sensor_of(2, BMA220.noise_mps2, 1).noise_mps2
                felt = drive.accel_mps2 + STANDARD_GRAVITY_MPS2 + noise_mps2 * rng.standard_normal(
                    len(drive.accel_mps2))
                known = (f"accelerometer: {{noise_mps2: {noise_mps2}}}\n"
                         f"gps: {{latency_s: {STEADY.latency_s}, place_std_m: 0}}\n")
                for way, vehicle in settings.items():
                    own = folder / f"{way}-{mph:g}"
                    own.mkdir()
                    write_dump(own / "drive.dump", drive, felt, 2, STEADY, np.random.default_rng(seed))
                    found[way].append(replayed(own, drive, vehicle + known))
                    print_way(f"car {seed}, {mph:g} mph, {way}", found[way][-1:])
    figures = Figures()
    r2 = {way: print_way(f"all, {way}", parts) for way, parts in found.items()}
    figures.at_least("R2 with the learned car beside the true one", r2["learned"] - r2["true"], -0.02, "")
    exact, estimate, std = (np.concatenate([getattr(one, name) for one in found["learned"]])
                            for name in ("exact", "estimate", "std"))
    generic = np.concatenate([generic_deviations(mph) for mph in map(float, asked.mph.split(","))])
    for way, deviations, ranges in (("learned: windows", (estimate - exact) / std, ((0.64, 0.72), (0.93, 0.97))),
                                    ("generic: cars", generic, ((0.6, 0.85), (0.93, 0.99)))):
        for times, (least, most) in enumerate(ranges, 1):
            share = float(np.mean(np.abs(deviations) <= times))
            figures.at_least(f"{way} within {times} standard errors", share, least, "share")
            figures.at_most(f"{way} within {times} standard errors", share, most, "share")
    return figures.missed


if __name__ == "__main__":
    sys.exit(bool(main()))
