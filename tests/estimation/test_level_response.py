"""Coarse steps that hide a slow drive: the level comes to rest, and at the right one. Drives of the simulation in time,
where the car's response to the road is not the estimator's own."""

import numpy as np
import pytest

from logger.estimation.car_response import CarResponse
from logger.estimation.recursive_road import FollowedRoad
from logger.estimation.road_solver import ENTRY_S, Block, TimeGrid
from logger.estimation.road_spectrum import COMMON_ROAD
from logger.estimation.sensor_noise import Sensor
from logger.estimation.time_grid import RATE_HZ, RoadSamples
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

from ..support.drives.linear_drive import drive

RAV4 = structure_of(read_vehicle(vehicle_file("rav4-2009")))
SENSOR, SPEED_MPS, SPACING_M = Sensor(0.05, 1.226), 8.94, 0.1524
COUNT, HOP = 2048, 200


def levels(iri: float, in_a_step: float, seed: int) -> np.ndarray:
    """Mean log level of a block over a common road's, after each of ten solutions more of the same readings, at the
    end of 25 blocks of a drive on a road of this IRI, with gravity so far in a step."""
    track = Track(0.05, iso8608.generate(iso8608.gd_n0_from_iri(iri), 700.0, 0.05, seed))
    time_s = np.arange(COUNT + 24 * HOP) / RATE_HZ
    output = body_point(RAV4)
    felt = drive(RAV4, [output], track, time_s, SPEED_MPS * time_s)[:, 0]
    felt = felt + SENSOR.noise_rms_mps2 * np.random.default_rng(seed).standard_normal(len(felt))
    reading = SENSOR.step_mps2 * np.round(felt / SENSOR.step_mps2 + in_a_step)
    grid = TimeGrid(CarResponse(LinearCar(RAV4, output)), COUNT, RATE_HZ)
    road, read = FollowedRoad(SENSOR, SPACING_M, 0.0), np.arange(COUNT) >= ENTRY_S * RATE_HZ
    found: list[float] = []
    for last in [*range(COUNT, len(time_s) + 1, HOP), *[len(time_s)] * 10]:
        part = slice(last - COUNT, last)
        column = reading[part, None]
        samples = RoadSamples(column, np.ones(column.shape, bool), np.zeros(column.shape), SPEED_MPS * time_s[part])
        if last > COUNT and not found:
            road.move_on(samples.of(slice(COUNT - HOP, COUNT)))
        block = Block(grid, samples.distance_m, SPACING_M, 50 * SPACING_M)
        road.solved(block, samples, read)
        seen = np.flatnonzero(block.seen(read))
        level, _ = road.level_at(round(block.start_m / SPACING_M) + int(seen[0]), len(seen))
        if last == len(time_s):
            found.append(level.log_level - COMMON_ROAD.log_level)
    return np.array(found[1:])


@pytest.mark.slow
@pytest.mark.parametrize(("iri", "in_a_step"), [(2.5, 0.5), (5.0, 0.0), (5.0, 0.5)])
def test_a_level_that_steps_hide_comes_to_rest_where_it_is_right(iri: float, in_a_step: float) -> None:
    """With the curvature of bounds that stay, steps run in circles or stop half way; with the degrees of freedom of
    readings spread evenly, the level is too low where the evidence is flat. True: of the road's IRI, squared."""
    rest = np.array([levels(iri, in_a_step, seed) for seed in (1, 2)])
    true = 2 * np.log(iri / 2.5)
    print(f"level {np.round(rest[:, -1], 2)}, true {true:.2f}; moves {np.ptp(rest[:, -4:], axis=1).max():.3f}")
    assert np.ptp(rest[:, -4:], axis=1).max() < 0.1
    assert rest[:, -1].mean() == pytest.approx(true, abs=0.4)
