"""The numbers behind a summary, against simulated truth and dense algebra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy import stats

from logger.fleet.car_biases import Elimination, RoadPasses, Variances, car_biases
from logger.fleet.road_map import SEGMENT_M, RoadMap, block_of, cell_keys, cells, pieces_of, section_of
from logger.fleet.summary import Sums, road_figures, significant
from logger.geodesy import EARTH_RADIUS_M, ground_distance_m

SESSION_STD, PASS_STD = 0.05, 0.1


@dataclass(frozen=True)
class Drawn:
    """Passes of cars over roads, in sessions, and the truth that they were drawn from."""

    passes: RoadPasses
    log_gain: np.ndarray
    level: np.ndarray
    growth: np.ndarray

    @property
    def years(self) -> np.ndarray:
        return self.passes.years


def drawn_passes(cars: int, roads: int, sessions: int, mean_size: float, seed: int = 1, noise: float = 1.0) -> Drawn:
    """Sessions of unequal length, each along roads that follow one another; a quarter of the cars came late, and roads
    decay in stretches of ten."""
    rng = np.random.default_rng(seed)
    log_gain = rng.normal(0, 0.08, cars)
    log_gain -= log_gain.mean()
    level = rng.uniform(1, 6, roads)
    growth = np.repeat(rng.choice([0.0, 0.1], -(-roads // 10), p=[0.7, 0.3]), 10)[:roads]
    car, years = rng.integers(cars, size=sessions), rng.uniform(0, 2, sessions)
    years = np.where(car < cars // 4, 1 + years / 2, years)
    size = np.clip(rng.lognormal(np.log(mean_size) - 0.5, 1.0, sessions).astype(int), 1, roads)
    session = np.repeat(np.arange(sessions), size)
    along = np.arange(len(session)) - np.repeat(np.cumsum(size) - size, size)
    road = (rng.integers(roads, size=sessions)[session] + along) % roads
    error = SESSION_STD * rng.normal(size=sessions)[session] + PASS_STD * rng.normal(size=len(session))
    iri = level[road] * (1 + growth[road] * (years[session] - 1)) * np.exp(log_gain[car[session]]) * (1 + noise * error)
    assert len(np.unique(road)) == roads
    return Drawn(RoadPasses(road, session, car, np.ones(len(road)), iri, years[session]), log_gain, level, growth)


def test_biases_means_and_changes_have_the_errors_that_they_say() -> None:
    cars, roads = 60, 800
    drawn = drawn_passes(cars, roads, 2000, 20.0)
    found = car_biases(drawn.passes, cars)
    error = (np.log(found.gain) - drawn.log_gain) / found.log_std
    assert 0.8 < error.std() < 1.2
    assert found.growth_per_year == pytest.approx(0.03, abs=0.01)
    assert found.session_std == pytest.approx(SESSION_STD, rel=0.1)
    assert found.pass_std == pytest.approx((SESSION_STD**2 + PASS_STD**2) ** 0.5, rel=0.05)
    road, car, t = drawn.passes.road, drawn.passes.car, drawn.years
    free = drawn.passes.iri / found.gain[car]

    def by_road(weight: np.ndarray) -> np.ndarray:
        return np.bincount(road, weight, roads)

    count = np.zeros((roads, cars))
    np.add.at(count, (road, car), 1.0)
    sums = Sums(by_road(np.ones(len(t))), by_road(t), by_road(t * t), by_road(free), by_road(free * t),
                by_road(free * free), count**2 @ found.log_std**2)
    figures = road_figures(sums, found.pass_std)
    true = drawn.level * (1 + drawn.growth * (sums.years / sums.passes - 1))
    assert (np.abs(figures.iri_m_per_km - true) < 2 * figures.iri_std_m_per_km).mean() == pytest.approx(0.95, abs=0.025)
    slope = drawn.level * drawn.growth
    z = (figures.trend_m_per_km_per_year - slope) / figures.trend_std_m_per_km_per_year
    assert (np.abs(z) < 2).mean() == pytest.approx(0.95, abs=0.025)
    called = significant(figures.p_value, 0.05)
    assert (drawn.growth[called] == 0).mean() < 0.08
    power = stats.norm.sf(2.5 - slope / figures.trend_std_m_per_km_per_year)[drawn.growth > 0]
    assert called[drawn.growth > 0].mean() == pytest.approx(power.mean(), abs=0.12)


@pytest.mark.slow
def test_two_standard_errors_hold_the_bias_of_95_cars_in_a_hundred() -> None:
    """Few sessions of a car, so that what was fitted takes many degrees of freedom; 600 cars in all."""
    z = []
    for seed in range(30):
        drawn = drawn_passes(20, 200, 300, 25.0, seed)
        found = car_biases(drawn.passes, 20)
        z.append((np.log(found.gain) - drawn.log_gain) / found.log_std)
    z = np.concatenate(z)
    assert (np.abs(z) < 2).mean() == pytest.approx(0.9545, abs=3 * (0.9545 * 0.0455 / len(z)) ** 0.5)
    assert (z**2).mean() ** 0.5 == pytest.approx(1.0, abs=3 / (2 * len(z)) ** 0.5)


def test_readings_without_noise_give_the_gains() -> None:
    drawn = drawn_passes(12, 100, 150, 30.0, noise=0.0)
    found = car_biases(drawn.passes, 12)
    assert np.allclose(np.log(found.gain), drawn.log_gain, atol=1e-4)
    assert found.pass_std < 1e-3


def dense(drawn: Drawn, cars: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns of cars and time, of roads' levels, and of sessions."""
    passes = drawn.passes
    rows, n = np.arange(len(passes.road)), len(passes.road)
    of_cars, of_roads = np.zeros((n, cars + 1)), np.zeros((n, len(drawn.level)))
    of_sessions = np.zeros((n, len(passes.car_of_session)))
    of_cars[rows, passes.car] = of_roads[rows, passes.road] = of_sessions[rows, passes.session] = 1.0
    of_cars[:, -1] = passes.years
    return of_cars, of_roads, of_sessions


def test_cars_and_their_covariance_are_those_of_dense_least_squares() -> None:
    cars, ridge = 5, 3.0
    drawn = drawn_passes(cars, 30, 40, 8.0, seed=2)
    weight = np.random.default_rng(1).uniform(0.2, 2.0, len(drawn.passes.road))
    found = Elimination(drawn.passes, cars, weight, ridge)
    of_cars, of_roads, of_sessions = dense(drawn, cars)
    growth = of_roads * found.time[:, None]
    of_cars[:, -1] = found.time
    design = np.hstack([of_cars, of_roads, growth])
    drawn_to_zero = np.zeros(design.shape[1])
    drawn_to_zero[-30:] = ridge * (weight @ of_roads) / of_roads.sum(axis=0)
    normal = design.T @ (weight[:, None] * design) + np.diag(drawn_to_zero)
    solver = (np.linalg.pinv(normal) @ (design.T * weight))[: cars + 1]
    solver[:cars] -= solver[:cars].mean(axis=0)
    values = np.random.default_rng(2).normal(size=len(weight))
    assert np.allclose(found.effects(values), solver @ values, atol=1e-9)
    spread = 0.3 * np.eye(len(weight)) + 0.2 * of_sessions @ of_sessions.T + 0.1 * growth @ growth.T
    assert np.allclose(found.covariance(0.3, 0.2, 0.1), solver @ spread @ solver.T, atol=1e-9)


def test_no_estimator_without_bias_would_be_much_nearer() -> None:
    """The limit of Cramer and Rao, for sessions of unequal length: generalised least squares with the true covariance
    of all passes."""
    cars, true = 10, Variances(PASS_STD**2, SESSION_STD**2, 0.003)
    drawn = drawn_passes(cars, 80, 150, 12.0)
    of_cars, of_roads, of_sessions = dense(drawn, cars)
    growth = of_roads * (drawn.years - 1.0)[:, None]
    covariance = (true.of_pass * np.eye(len(growth)) + true.of_session * of_sessions @ of_sessions.T
                  + true.of_growth * growth @ growth.T)
    design = np.hstack([of_cars, of_roads])
    of_all = np.linalg.pinv(design.T @ np.linalg.solve(covariance, design))[:cars, :cars]
    centre = np.eye(cars) - 1 / cars
    limit = np.diag(centre @ of_all @ centre).mean()

    def variance(weight: np.ndarray) -> float:
        spread = Elimination(drawn.passes, cars, weight, true.ridge).covariance(PASS_STD**2, SESSION_STD**2, 0.003)
        return float(np.diag(spread)[:-1].mean())

    ours, alike = variance(true.weights(drawn.passes)), variance(drawn.passes.count)
    assert limit < ours < 1.06 * limit
    assert alike > 1.15 * limit


def test_cars_that_share_no_road_are_compared_with_none() -> None:
    """Two cars eight times over two roads, a third over a road of its own, a fourth nowhere."""
    road = np.append(np.tile([0, 1], 16), [2])
    car_of_session = np.append(np.repeat([0, 1], 8), [2])
    iri = np.where(road == 0, 2.0, 3.0) * np.where(car_of_session[np.arange(33) // 2] == 1, 1.1, 1.0)
    iri *= 1 + 0.01 * np.random.default_rng(1).normal(size=33)
    found = car_biases(RoadPasses(road, np.arange(33) // 2, car_of_session, np.full(33, 9.0), iri, np.zeros(33)), 4)
    assert found.known.tolist() == [True, True, False, False]
    assert found.gain == pytest.approx([1 / 1.1**0.5, 1.1**0.5, 1, 1], abs=0.01)
    assert found.log_std[2] == pytest.approx(np.log(1.1) / 2**0.5, abs=0.01)


@pytest.mark.parametrize("drives", range(1, 5))
@pytest.mark.parametrize("cars", range(1, 9))
def test_what_few_drives_cannot_show_is_empty_and_all_else_is_near_the_truth(cars: int, drives: int) -> None:
    """Each car over the same forty roads. By hand: a drive more than the first of each car is a repeat, one goes into
    the growth; six are left where the 5 % quantile of chi-square says that a standard deviation is known to a factor
    of two."""
    rng, sessions, roads = np.random.default_rng(100 * cars + drives), cars * drives, 40
    car_of_session, road = np.repeat(np.arange(cars), drives), np.tile(np.arange(roads), sessions)
    session, log_gain = np.repeat(np.arange(sessions), roads), rng.normal(0, 0.08, cars)
    error = SESSION_STD * rng.normal(size=sessions)[session] + PASS_STD * rng.normal(size=len(session))
    iri = rng.uniform(1, 6, roads)[road] * np.exp(log_gain[car_of_session[session]]) * (1 + error)
    years = rng.uniform(0, 1, sessions)
    found = car_biases(RoadPasses(road, session, car_of_session, np.ones(len(road)), iri, years[session]), cars)
    is_timed = drives > 1
    assert (found.repeats, found.needed) == (cars * (drives - 1), 6 + is_timed)
    enough = cars * (drives - 1) - 1 >= 6
    assert enough == (stats.chi2.ppf(0.05, max(cars * (drives - 1) - 1, 0) or 0.1) > (cars * (drives - 1) - 1) / 4 > 0)
    assert np.isfinite([found.pass_std, found.session_std, found.growth_per_year]).all() == enough
    assert found.known.all() == (enough and cars > 1)
    by_road = [np.bincount(road, iri * years[session]**power, roads) for power in (0, 1)]
    sums = Sums(np.full(roads, sessions * 1.0), np.full(roads, years.sum()), np.full(roads, (years**2).sum()), *by_road,
                np.bincount(road, iri**2, roads), np.zeros(roads))
    figures = road_figures(sums, found.pass_std)
    assert np.isfinite(figures.iri_m_per_km).all()
    assert np.isfinite(figures.iri_std_m_per_km).all() == np.isfinite(figures.p_value).all() == enough
    if enough:
        assert found.session_std < 3 * SESSION_STD
        assert (SESSION_STD**2 + PASS_STD**2) ** 0.5 / 2 < found.pass_std < 2 * (SESSION_STD**2 + PASS_STD**2) ** 0.5
        off = np.log(found.gain) - (log_gain - log_gain.mean())
        assert (np.abs(off) < 4 * found.log_std + 1e-9).all()


@pytest.mark.parametrize("lat_deg", [-65.0, 0.0, 42.36, 80.0])
def test_cells_have_their_size_everywhere(lat_deg: float) -> None:
    rng = np.random.default_rng(1)
    lat, lon = lat_deg + rng.uniform(-0.05, 0.05, 5000), rng.uniform(-180, 180, 5000)
    heading = rng.uniform(0, 360, 5000)
    keys = cell_keys(lat, lon, heading)
    where = cells(keys)
    off_m = [ground_distance_m(*one) for one in zip(lat, lon, where.lat_deg, where.lon_deg, strict=True)]
    assert 0.4 * SEGMENT_M < max(off_m) < 0.8 * SEGMENT_M
    turn = (heading - where.heading_deg + 180) % 360 - 180
    assert np.abs(turn).max() <= 22.5
    assert (block_of(section_of(keys)) == block_of(keys)).all() and (keys >= 0).all()
    assert (cell_keys(where.lat_deg, where.lon_deg, where.heading_deg) == keys).all()


def test_windows_are_laid_on_their_own_road_beside_a_parallel_one() -> None:
    """Two carriageways 15 m apart, both driven either way, and a receiver that is 3 m off for whole drives."""
    rng = np.random.default_rng(1)
    deg = 180 / np.pi / EARTH_RADIUS_M
    lines = [(np.array([50.0, 50.0]) + y * deg, np.array([8.0, 8.03])) for y in (0.0, 15.0)]
    lines += [(np.array([50.0 - 0.001, 50.0 + 0.001]), np.full(2, 8.0 + x)) for x in (0.01, 0.02)]
    roads = RoadMap(pieces_of(lines))
    drives, windows = 200, 250
    road, back = rng.integers(2, size=drives), rng.random(drives) < 0.5
    lon = np.linspace(8.0005, 8.0295, windows)
    lon = np.where(back[:, None], lon[::-1], lon)
    lat = 50.0 + (15.0 * road[:, None] + 3 * rng.normal(size=(drives, 1)) + rng.normal(size=(drives, windows))) * deg
    heading = np.where(back[:, None], 270.0, 90.0) + 5 * rng.normal(size=lat.shape)
    drive = np.repeat(np.arange(drives), windows)
    keys = roads.keys(lat.ravel(), lon.ravel(), heading.ravel(), drive)
    piece = (keys & ((1 << 62) - 1)) >> 1
    assert (roads.pieces.road[piece] != np.repeat(road, windows)).mean() < 0.01
    assert ((keys & 1) == np.repeat(~back, windows)).all()


def test_places_off_the_map_get_the_key_of_their_cell() -> None:
    roads = RoadMap(pieces_of([(np.array([50.0, 50.0]), np.array([8.0, 8.01]))]))
    place = np.array([50.01]), np.array([8.005]), np.array([90.0])
    assert (roads.keys(*place, np.zeros(1, dtype=np.intp)) == cell_keys(*place)).all()
