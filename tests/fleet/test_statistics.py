"""The numbers behind a summary, against simulated truth and dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from logger.fleet.car_biases import car_biases, shared_by_session
from logger.fleet.road_cells import SEGMENT_M, block_of, cell_keys, cells, section_of
from logger.fleet.road_figures import Sums, road_figures, significant
from logger.fleet.road_map import RoadMap, pieces_of
from logger.geodesy import EARTH_RADIUS_M, ground_distance_m


def passes(cars: int, roads: int, count: int, noise: float, seed: int = 1) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    log_gain = rng.normal(0, 0.08, cars)
    log_gain -= log_gain.mean()
    level, growth = rng.uniform(1, 6, roads), rng.choice([0.0, 0.1], roads, p=[0.7, 0.3])
    road, car, years = rng.integers(roads, size=count), rng.integers(cars, size=count), rng.uniform(0, 2, count)
    years = np.where(car < cars // 4, 1 + years / 2, years)  # some cars came late
    iri = level[road] * (1 + growth[road] * (years - 1)) * np.exp(log_gain[car]) * (1 + noise * rng.normal(size=count))
    return {"log_gain": log_gain, "level": level, "growth": growth, "road": road, "car": car, "years": years,
            "iri": iri}


def sums_of(drawn: dict[str, np.ndarray], cars: int) -> tuple[np.ndarray, ...]:
    pair, code = np.unique(drawn["road"] * cars + drawn["car"], return_inverse=True)
    return (pair // cars, pair % cars, np.bincount(code).astype(float), np.bincount(code, drawn["iri"]),
            np.bincount(code, drawn["years"]))


def test_biases_means_and_changes_have_the_errors_that_they_say() -> None:
    cars, roads = 60, 800
    drawn = passes(cars, roads, 40_000, 0.15)
    road, car, count, iri, years = sums_of(drawn, cars)
    found = car_biases(road, car, cars, count, iri, years)
    error = (np.log(found.gain) - drawn["log_gain"]) / found.log_std
    assert 0.7 < error.std() < 1.3
    assert found.growth_per_year == pytest.approx(0.03, abs=0.01)
    assert found.pass_std == pytest.approx(0.15, rel=0.05)
    free = drawn["iri"] / found.gain[drawn["car"]]

    def by_road(weight: np.ndarray) -> np.ndarray:
        return np.bincount(drawn["road"], weight, roads)

    t = drawn["years"]
    sums = Sums(by_road(np.ones(len(t))), by_road(t), by_road(t * t), by_road(free), by_road(free * t),
                by_road(free * free), np.bincount(road, count**2 * found.log_std[car] ** 2, roads))
    figures = road_figures(sums, found.pass_std)
    true = drawn["level"] * (1 + drawn["growth"] * (sums.years / sums.passes - 1))
    assert (np.abs(figures.iri_m_per_km - true) < 2 * figures.iri_std_m_per_km).mean() == pytest.approx(0.95, abs=0.025)
    slope = drawn["level"] * drawn["growth"]
    z = (figures.trend_m_per_km_per_year - slope) / figures.trend_std_m_per_km_per_year
    assert (np.abs(z) < 2).mean() == pytest.approx(0.95, abs=0.025)
    called = significant(figures.p_value, 0.05)
    assert (drawn["growth"][called] == 0).mean() < 0.08
    power = stats.norm.sf(2.5 - slope / figures.trend_std_m_per_km_per_year)[drawn["growth"] > 0]
    assert called[drawn["growth"] > 0].mean() == pytest.approx(power.mean(), abs=0.12)


def test_biases_are_those_of_a_dense_generalised_linear_model() -> None:
    """Iteratively reweighted least squares over all roads and cars at once."""
    cars, roads = 4, 9
    road, car, count, iri, years = sums_of(passes(cars, roads, 120, 0.1, seed=5), cars)
    found = car_biases(road, car, cars, count, iri, years)
    design = np.zeros((len(road), roads + cars + 1))
    design[np.arange(len(road)), road] = design[np.arange(len(road)), roads + car] = 1.0
    design[:, -1] = years / count
    beta = np.linalg.lstsq(design, np.log(iri / count), rcond=None)[0]
    for _ in range(60):
        expected = np.exp(design @ beta)
        root = np.sqrt(count)
        beta += np.linalg.lstsq(design * root[:, None], root * (iri / count / expected - 1), rcond=None)[0]
    log_gain = beta[roads : roads + cars]
    assert np.allclose(np.log(found.gain), log_gain - log_gain.mean(), atol=1e-7)
    assert found.growth_per_year == pytest.approx(beta[-1], abs=1e-7)


def test_cars_that_share_no_road_are_compared_with_none() -> None:
    road, car = np.array([0, 0, 1, 1, 2]), np.array([0, 1, 0, 1, 2])
    found = car_biases(road, car, 4, np.full(5, 9.0), 9 * np.array([2.0, 2.2, 3.0, 3.3, 5.0]), np.zeros(5))
    assert found.known.tolist() == [True, True, False, False]
    assert found.gain == pytest.approx([1 / 1.1**0.5, 1.1**0.5, 1, 1])
    assert found.log_std[2] == pytest.approx(np.log(1.1) / 2**0.5)


def test_what_sessions_share_is_found() -> None:
    rng = np.random.default_rng(1)
    sessions, size = 3000, 20
    each = 0.05 * rng.normal(size=(sessions, 1)) + 0.1 * rng.normal(size=(sessions, size))
    found = shared_by_session(np.arange(sessions) % 50, np.full(sessions, float(size)), each.sum(axis=1),
                              (each**2).sum(axis=1))
    assert found**0.5 == pytest.approx(0.05, rel=0.05)


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
