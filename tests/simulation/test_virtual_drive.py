"""Virtual drives through their functions: the road that is made, the way over it, what is felt and what is refused."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from logger.profiles.track import Track
from logger.roads.obstacles import speed_bump
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.simulation.virtual_drive import (
    AFTER_S,
    SENSOR,
    Obstacle,
    SensorErrors,
    SimulatedRuns,
    as_sensed,
    at_one_speed,
    motion_along,
    response,
    with_obstacles,
)
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

FLAT = Track(30.0, np.zeros(2), 5.0)
BUMP = {"start_m": 15.0, "height_m": 0.08, "width_m": 3.6}
CAR = read_vehicle(vehicle_file("rav4-2009"))
STRUCTURE = structure_of(CAR)
OUTPUTS = {SENSOR: body_point(STRUCTURE, 0.0, 0.0)}


def test_an_obstacle_lies_where_it_was_put() -> None:
    road = with_obstacles(FLAT, [Obstacle("bump", BUMP, "")])
    at_m = road.start_m + road.spacing_m * np.arange(len(road.elevation_m))
    assert (road.start_m, road.end_m) == (FLAT.start_m, pytest.approx(FLAT.end_m))
    assert road.elevation_m == pytest.approx(speed_bump(at_m, **BUMP))
    assert with_obstacles(FLAT, []) is FLAT


@pytest.mark.parametrize(("name", "parameters", "complaint"), [
    ("wall", {}, "asked: expected one of bump, plate"), ("bump", {"start_m": 9.0}, "asked: expected bump:start_m=M"),
    ("bump", BUMP | {"start_m": 34.0}, "asked: expected it on the road, 5 to 35 m, found 34 to 37.6 m"),
    ("step", {"start_m": 5.0, "height_m": 0.1}, "asked: expected some road before it, from 5 m on"),
])
def test_an_obstacle_that_cannot_be_is_refused(name: str, parameters: dict[str, float], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        with_obstacles(FLAT, [Obstacle(name, parameters, "asked")])


def test_a_motion_is_the_integral_of_its_speed() -> None:
    motion = motion_along(np.array([1.0, 3.0, 4.0]), np.array([0.0, 10.0, 10.0]), 7.0, 50.0)
    assert (motion.time_s[0], motion.time_s[-1], len(motion.time_s)) == (1.0, pytest.approx(4.0), 151)
    assert (motion.distance_m[0], motion.distance_m[100], motion.distance_m[-1]) == pytest.approx((7.0, 17.0, 27.0))
    knots = at_one_speed(FLAT, 3.0, 10.0)
    assert knots[0][-1] == pytest.approx(3.3 + AFTER_S)
    with pytest.raises(ValueError, match=r"expected a drive of 0\.01 to 5000 s, found 0 s"):
        motion_along(np.zeros(2), np.ones(2), 0.0, 100.0)


def test_effects_that_do_next_to_nothing_leave_the_response_as_it_was() -> None:
    road = with_obstacles(FLAT, [Obstacle("bump", BUMP, "")])
    motion = motion_along(*at_one_speed(road, 2.94, 8.0), road.start_m, 100.0)
    plain = response(compose(CAR), OUTPUTS, road, motion, 100.0)[0][SENSOR]
    gain = chosen(shipped_effects()["sensor_gain"], {"gain": 1.0})
    columns, recorded = response(compose(CAR, (gain,)), OUTPUTS, road, motion, 100.0)
    assert np.abs(columns[SENSOR] - plain).max() < 2e-3 * np.abs(plain).max()
    assert recorded.distance_m == pytest.approx(motion.distance_m)


def test_a_stretched_distance_comes_with_a_stretched_speed() -> None:
    motion = motion_along(*at_one_speed(FLAT, 2.94, 8.0), 0.0, 100.0)
    scale = chosen(shipped_effects()["speed_scale"], {"scale": 1.05})
    _, recorded = response(compose(CAR, (scale,)), OUTPUTS, FLAT, motion, 100.0)
    assert recorded.speed_mps == pytest.approx(1.05 * motion.speed_mps)
    assert np.diff(recorded.distance_m) == pytest.approx(1.05 * np.diff(motion.distance_m))


def test_a_sensor_adds_noise_of_one_seed_and_rounds() -> None:
    still = np.zeros(4000)
    assert as_sensed(still, SensorErrors()) is still
    noisy = as_sensed(still, SensorErrors(0.2))
    assert noisy.std() == pytest.approx(0.2, rel=0.05)
    assert np.array_equal(noisy, as_sensed(still, SensorErrors(0.2)))
    assert set(np.unique(as_sensed(still, SensorErrors(0.2, 0.5)))) <= {-1.0, -0.5, 0.0, 0.5, 1.0}


def test_runs_in_other_steps_share_what_is_under_the_wheels() -> None:
    road = Track(0.05, 0.01 * np.sin(0.7 * np.arange(1000)))
    runs = SimulatedRuns([Run("run", 100.0, np.zeros(400), 0.1 * np.arange(400), np.full(400, 10.0), road)], 500.0)
    finer = runs.in_steps(1000.0)
    expected = runs.predict(compose(CAR))
    assert np.array_equal(finer.predict(compose(CAR), rough=True), expected) and len(runs._passages[0]) == 1
    assert not np.array_equal(finer.predict(compose(CAR)), expected) and len(runs._passages[0]) == 2


def test_a_long_run_keeps_a_few_ways_over_its_road_only() -> None:
    """A fit asks for many ways, millimetres apart: the last ones are kept, but not six of ten minutes."""
    distance_m = 10.0 * np.arange(60_000) / 100.0
    run = Run("run", 100.0, np.zeros(60_000), distance_m, np.full(60_000, 10.0), FLAT)
    runs = SimulatedRuns([run], 500.0)
    tracemalloc.start()
    try:
        for error_m in np.linspace(0.0, 0.01, 5):
            runs.predict(compose(CAR), [np.full(60_000, error_m)])
        kept_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert kept_bytes < 40e6  # the run has seven columns of 0.5 MB, and one way over it takes 15 MB
