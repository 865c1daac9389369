"""How far a ride stays open because more noise would explain its readings too: beside drives estimated with other
noises, and counts of readings as a chip gave them."""

from functools import cache

import numpy as np
import pytest

from logger.estimation.batch import Estimable, assess, estimated
from logger.estimation.car_response import CarResponse
from logger.estimation.recursive_road import FollowedRoad
from logger.estimation.road_solver import Block, TimeGrid
from logger.estimation.sensor_noise import NoiseBelief, Sensor
from logger.estimation.streaming import RoadEstimator
from logger.estimation.time_grid import RoadSamples
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

from ..support.drives.linear_drive import drive

RAV4 = vehicle_file("rav4-2009")
STRUCTURE = structure_of(read_vehicle(RAV4))
CAR = LinearCar(STRUCTURE, body_point(STRUCTURE))
SPEED_MPS, SPACING_M, COUNT = 14.0, 0.1524, 2048
NOISE_MPS2 = 0.12
ALIKE, APART = 1.22, 0.3  # steps [m/s2]: readings toggle between two steps, or are on many
GRAVITY_MPS2 = 0.4 * ALIKE  # off the middle of a large step


@cache
def felt() -> tuple[np.ndarray, np.ndarray]:
    """Acceleration and distance of 60 s on a road of IRI 1.5."""
    road = Track(0.05, iso8608.generate(iso8608.gd_n0_from_iri(1.5), 900, 0.05, 8), -20.0)
    time_s = np.arange(6000) / 100
    return drive(STRUCTURE, [body_point(STRUCTURE)], road, time_s, SPEED_MPS * time_s)[:, 0], SPEED_MPS * time_s


def readings(step_mps2: float) -> np.ndarray:
    accel, _ = felt()
    noise = NOISE_MPS2 * np.random.default_rng(9).standard_normal(len(accel))
    return step_mps2 * np.round((accel + GRAVITY_MPS2 + noise) / step_mps2)


def on_other_steps(reading_mps2: np.ndarray, step_mps2: float) -> int:
    """Readings that are on none of the two commonest steps."""
    counts: dict[int, int] = {}
    for one in reading_mps2.tolist():
        counts[round(one / step_mps2)] = counts.get(round(one / step_mps2), 0) + 1
    return sum(sorted(counts.values())[:-2])


def mean_iri(step_mps2: float, believed_mps2: float) -> float:
    reading, way = readings(step_mps2), felt()[1]
    estimator = RoadEstimator(CAR, Sensor(believed_mps2, step_mps2), 7.62)
    found = estimator.push(reading, np.ones(len(way), dtype=bool), np.zeros(len(way)), way)
    return float(np.nanmean([one.iri_m_per_km for one in found]))


def scaled(step_mps2: float, reading: np.ndarray, beyond_mps2: np.ndarray | float = 0.0) -> float:
    """Share by which the ride is open for each share of the noise, as the first block of readings has it."""
    before = NoiseBelief(np.log(NOISE_MPS2), 0.3)
    road = FollowedRoad(Sensor(NOISE_MPS2, step_mps2), SPACING_M, 0.05, before)
    usable, way = np.ones(COUNT, dtype=bool), felt()[1][:COUNT]
    block = Block(TimeGrid(CarResponse(CAR), COUNT, 100.0), way, SPACING_M, 7.62)
    column = (reading[:COUNT] - beyond_mps2)[:, None]
    road.solved(block, RoadSamples(column, usable[:, None], np.zeros((COUNT, 1)), way), usable, beyond_mps2)
    assert road.noise is not None
    return road.scale_log_std / road.noise.log_std


@pytest.mark.slow
@pytest.mark.parametrize(("step_mps2", "toggles"), [(ALIKE, True), (APART, False)])
def test_the_ride_is_open_as_far_as_another_noise_makes_another_ride(step_mps2: float, toggles: bool) -> None:
    other = on_other_steps(readings(step_mps2)[:COUNT], step_mps2)
    assert (other < 3) if toggles else (other > 100)
    less, more = 0.8, 1.25
    change = mean_iri(step_mps2, more * NOISE_MPS2) / mean_iri(step_mps2, less * NOISE_MPS2)
    found = np.log(change) / np.log(more / less)
    stated = scaled(step_mps2, readings(step_mps2))
    assert stated == pytest.approx(abs(found), abs=0.35 if toggles else 0.15)  # twice the r.m.s. of such drives


def test_the_desk_counts_how_well_the_noise_is_known() -> None:
    """In all windows as the same share of the IRI, and where the steps blur that share is small."""
    shares = []
    for step_mps2 in (ALIKE, 0.5):
        reading, way = readings(step_mps2)[:3000], felt()[1][:3000]
        sure, unsure = (estimated(CAR, Sensor(NOISE_MPS2, step_mps2), 7.62, reading, way, noise_log_std=std)[0]
                        for std in (0.0, 0.3))
        assert np.array_equal(sure.iri_m_per_km, unsure.iri_m_per_km, equal_nan=True)
        known = np.isfinite(sure.iri_m_per_km)
        added = np.sqrt(unsure.iri_std_m_per_km**2 - sure.iri_std_m_per_km**2)[known]
        shares.append(float(np.mean(added / sure.iri_m_per_km[known])))
    alike = scaled(ALIKE, readings(ALIKE))
    assert shares[0] == pytest.approx(0.3 * alike, rel=0.3)
    assert shares[1] < 0.3 * shares[0]


@pytest.mark.slow
def test_an_assessment_whose_noise_was_learned_is_less_sure_than_one_whose_noise_was_given() -> None:
    recorded, vehicle = Estimable(100.0, readings(ALIKE)[:2500], felt()[1][:2500], 0.0), read_vehicle(RAV4)
    learned = assess(recorded, vehicle, Sensor(NOISE_MPS2, ALIKE), 7.62, None, learns_noise=True)
    given = assess(recorded, vehicle, learned.sensor, 7.62, None)
    known = np.isfinite(given.windows.iri_m_per_km)
    assert known.any()
    assert (learned.windows.iri_std_m_per_km[known] > 1.001 * given.windows.iri_std_m_per_km[known]).all()


def test_what_is_taken_off_a_nonlinear_cars_readings_is_on_no_other_steps() -> None:
    reading = readings(ALIKE)
    beyond = 0.7 * ALIKE * np.sin(np.arange(COUNT) / 7)
    assert on_other_steps(reading[:COUNT] - beyond, ALIKE) > 50
    assert scaled(ALIKE, reading, beyond) == pytest.approx(scaled(ALIKE, reading))


def test_readings_may_lie_anywhere_on_their_scale() -> None:
    """Gravity taken off them leaves them half a step off zero, where rounding their number would be chance."""
    reading = readings(ALIKE)
    off = reading + 0.5 * ALIKE + 1e-12 * np.random.default_rng(1).standard_normal(len(reading))
    assert scaled(ALIKE, off) == pytest.approx(scaled(ALIKE, reading))
