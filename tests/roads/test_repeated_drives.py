"""Repeated drives combined: beside a town whose truth is known, and beside sums that are done by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from logger.geodesy import EARTH_RADIUS_M
from logger.roads.repeated_drives import (
    Passes,
    Scatter,
    changes,
    false_discovery,
    means,
    passes_of,
    place_key,
    scatter_of,
    trends,
    way_and_cell,
)
from logger.roads.road_matching import (
    AGAINST,
    ALONG,
    NO_WAY,
    RoadNetwork,
    Trace,
    lay,
    measures,
    on_route,
    route_network,
)
from logger.roads.sections import WindowErrors

from ..support.drives.parallel_town import WINDOW_M, judged, town_drives

PLACES = [(46.5, 6.5), (-33.9, 151.2), (52.0, 179.9995), (-17.0, -179.9995), (0.0, 0.0), (69.0, -150.0)]


def line(lat_deg: float, lon_deg: float, east_m: np.ndarray, north_m: np.ndarray, t_s: float = 0.0) -> Trace:
    """A drive through places east and north of one, at 10 m/s."""
    lon = lon_deg + np.degrees(east_m / EARTH_RADIUS_M) / np.cos(np.radians(lat_deg))
    step = np.hypot(np.diff(east_m), np.diff(north_m))
    distance = np.concatenate([[0.0], np.cumsum(step)])
    return Trace(lat_deg + np.degrees(north_m / EARTH_RADIUS_M), (lon + 180.0) % 360.0 - 180.0, distance,
                 t_s + distance / 10.0)


@pytest.mark.parametrize("lat_deg, lon_deg", PLACES)
def test_the_same_street_is_one_way_and_directions_are_two(lat_deg: float, lon_deg: float) -> None:
    at_m = WINDOW_M * np.arange(80)
    there = line(lat_deg, lon_deg, at_m, 0 * at_m)
    again = line(lat_deg, lon_deg, at_m + 1.0, 0 * at_m + 1.5, 1e5)
    back = line(lat_deg, lon_deg, at_m[::-1], 0 * at_m + 3.5, 2e5)
    aside = line(lat_deg, lon_deg, at_m, 0 * at_m + 20.0, 3e5)
    found = lay(RoadNetwork(), [there, again, back, aside])
    assert [np.unique(one.way).tolist() for one in found] == [[0], [0], [1], [2]]
    np.testing.assert_allclose(found[0].along_m, at_m + WINDOW_M / 2)
    np.testing.assert_allclose(np.diff(found[1].along_m), WINDOW_M, rtol=0.01)


def test_a_drive_that_passes_a_place_twice_is_laid_over_itself() -> None:
    corners = np.array([[0, 0], [300, 0], [300, 200], [0, 200], [0, 0], [300, 0], [300, 60]], float)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    at_m = np.arange(0.0, length[-1], WINDOW_M)
    drive = line(46.5, 6.5, np.interp(at_m, length, corners[:, 0]), np.interp(at_m, length, corners[:, 1]))
    found = lay(RoadNetwork(), [drive])[0]
    first, second = (at_m > 20) & (at_m < 280), (at_m > 1020) & (at_m < 1280)
    assert set(found.way[first]) == set(found.way[second])
    assert len(set(found.way[(at_m > 20) & (at_m < 980)])) == 1
    assert np.abs(found.along_m[second] - (at_m[second] - 1000.0 + WINDOW_M / 2)).max() < WINDOW_M


@pytest.mark.slow
def test_lanes_of_a_town_are_distinguished() -> None:
    drives = town_drives(8, 400, seed=4)
    network = RoadNetwork()
    seen = judged(drives, lay(network, [one.trace for one in drives]), network)
    assert len(seen.wrong) > 1000
    assert seen.wrong.mean() < 0.01
    assert seen.missed < 0.25 * seen.repeats


def test_keys_say_their_way_and_cell() -> None:
    way, along_m = np.array([0, 5, 5, NO_WAY, 70_000]), np.array([0.0, -3.0, 262.0, np.nan, 1e6])
    key = place_key(way, along_m, 25.0)
    assert key[3] == -1
    ways, cells = way_and_cell(key[[0, 1, 2, 4]])
    assert ways.tolist() == [0, 5, 5, 70_000]
    assert cells.tolist() == [0, -1, 10, 40_000]


def test_lengths_of_cells_add_up_to_the_windows() -> None:
    rng = np.random.default_rng(1)
    start = np.cumsum(rng.uniform(5, 10, 200))
    end = start + rng.uniform(4, 60, 200)
    way, drive = rng.integers(0, 4, 200), rng.integers(0, 3, 200)
    found = passes_of(way, start, end, drive, np.zeros(200), np.ones(200), alone(np.ones(200)), 25.0)
    assert found.known_m.sum() == pytest.approx((end - start).sum())
    for number in range(3):
        assert found.known_m[found.drive == number].sum() == pytest.approx((end - start)[drive == number].sum())


def alone(std: np.ndarray) -> WindowErrors:
    """Errors that nothing shares."""
    return WindowErrors(std, *np.zeros((3, len(std))))


def test_what_all_drives_of_a_car_share_stays_in_a_mean_and_is_in_no_change() -> None:
    errors = WindowErrors(np.full(8, 0.5), np.zeros(8), np.full(8, 0.4), np.zeros(8))
    passes = Passes(np.ones(8, np.int64), np.arange(8), 1e7 * np.arange(8.0), np.full(8, 3.0), errors, np.full(8, 25.0))
    assert means(passes, Scatter(0.0, 0.0)).iri_std_m_per_km == pytest.approx((0.3**2 / 8 + 0.4**2) ** 0.5)
    assert changes(passes, Scatter(0.0, 0.0), 3.5e7, 25.0).change_std_m_per_km == pytest.approx((2 * 0.3**2 / 4) ** 0.5)


def test_errors_that_all_drives_over_a_place_have_alike_stay_in_its_mean() -> None:
    """Three drives over 900 cells: half of the variance of each error is that of the place."""
    rng = np.random.default_rng(9)
    of_place, of_pass = rng.standard_normal((1, 900)), rng.standard_normal((3, 900))
    value = (3.0 + 0.3 * (of_place + of_pass) / np.sqrt(2)).T.ravel()
    passes = Passes(np.repeat(np.arange(900), 3), np.tile(np.arange(3), 900), 1e7 * np.tile(np.arange(3.0), 900), value,
                    alone(np.full(2700, 0.3)), np.full(2700, 25.0))
    scatter = scatter_of(passes)
    assert scatter.alike == pytest.approx(0.5, abs=0.06)
    assert scatter.drive == scatter.passes == 0.0
    found = means(passes, scatter)
    off = (found.iri_m_per_km - 3.0) / found.iri_std_m_per_km
    assert np.sqrt(np.mean(off**2)) == pytest.approx(1.0, abs=0.08)
    # What is alike is in no difference; that the rest is smaller than told is not used against a road.
    assert changes(passes, scatter, 1.5e7, 25.0).change_std_m_per_km == pytest.approx(0.3 * np.sqrt(1 + 1 / 2))


def test_a_mean_is_weighted_by_its_errors() -> None:
    passes = Passes(np.array([1, 1, 9]), np.array([0, 1, 0]), np.array([0.0, 10.0, 5.0]), np.array([2.0, 4.0, 3.0]),
                    alone(np.array([0.1, 0.2, 0.3])), np.full(3, 25.0))
    found = means(passes, Scatter(0.0, 0.0))
    # 2 weighs four times what 4 weighs.
    np.testing.assert_allclose(found.iri_m_per_km, [2.4, 3.0])
    np.testing.assert_allclose(found.iri_std_m_per_km, [0.1 * 0.8**0.5, 0.3])


def random_passes(rng: np.random.Generator, drives: int, cells: int, drive: float, own: float, single: float,
                  growth: np.ndarray | float = 0.0) -> tuple[Passes, np.ndarray]:
    """Drives a month apart over all cells, and the truth of the first."""
    truth = rng.uniform(2, 5, cells)
    number, cell = np.divmod(np.arange(drives * cells), cells)
    level = (truth + growth * np.arange(drives)[:, None]).ravel()
    value = level * (1 + np.repeat(rng.normal(0, drive, drives), cells) + rng.normal(0, single, drives * cells))
    value = value + own * level * rng.normal(size=len(level))
    order = np.lexsort((number, cell))
    return Passes(cell[order], number[order], 2.6e6 * number[order], value[order], alone((own * level)[order]),
                  np.full(len(order), 25.0)), truth


def test_scatter_between_drives_is_found() -> None:
    rng = np.random.default_rng(2)
    found = [scatter_of(random_passes(rng, 12, 300, 0.06, 0.1, 0.05)[0]) for _ in range(10)]
    assert np.mean([one.drive**2 for one in found])**0.5 == pytest.approx(0.06, rel=0.2)
    assert np.mean([one.passes for one in found]) == pytest.approx(0.05, rel=0.1)
    alone = random_passes(rng, 1, 50, 0.06, 0.1, 0.05)[0]
    assert np.isnan(scatter_of(alone).drive)


def test_p_values_are_even_where_nothing_changed() -> None:
    rng = np.random.default_rng(3)
    found = []
    for _ in range(60):
        passes, _ = random_passes(rng, 8, 40, 0.05, 0.1, 0.03)
        found.append(changes(passes, Scatter(0.05, 0.03), 4 * 2.6e6, 25.0).p_value[0])
        found.append(trends(passes, Scatter(0.05, 0.03)).p_value[1])
    assert stats.kstest(found, "uniform").pvalue > 0.01


def test_the_mean_change_of_a_route_has_a_standard_error_that_holds() -> None:
    """Eight drives over 40 cells that became 0.3 m/km rougher on average: what drives differ by does not fall with the
    cells."""
    rng = np.random.default_rng(7)
    growth, scatter = np.linspace(0.0, 0.15, 40), Scatter(0.05, 0.03)
    off, told = [], []
    for _ in range(200):
        passes, _ = random_passes(rng, 8, 40, 0.05, 0.1, 0.03, growth)
        found = changes(passes, scatter, 4 * 2.6e6, 25.0)
        off.append(found.mean_m_per_km - 4 * growth.mean())
        told.append(found.mean_std_m_per_km)
    assert np.std(off) == pytest.approx(np.mean(told), rel=0.12)
    assert abs(np.mean(off)) < 3 * np.mean(told) / np.sqrt(200)
    one = passes.of(passes.key == 3)
    alone_there = changes(one, scatter, 4 * 2.6e6, 25.0)
    assert alone_there.mean_m_per_km == pytest.approx(alone_there.change_m_per_km[0], rel=0.01)
    assert alone_there.mean_std_m_per_km == pytest.approx(alone_there.change_std_m_per_km[0], rel=0.02)
    nowhere = changes(passes, scatter, 1e9, 25.0)
    assert not len(nowhere.key) and np.isnan(nowhere.mean_m_per_km)


def test_errors_of_cells_on_different_ways_are_not_one_error() -> None:
    """What neighbouring windows have alike, on 40 ways of a cell each: it falls by the root of their number."""
    std = []
    for count in (1, 40):
        key = place_key(np.repeat(np.arange(count), 2), np.full(2 * count, 10.0), 20.0)
        drive, none = np.tile([0, 1], count), np.zeros(2 * count)
        errors = WindowErrors(none + 0.2, none + 0.15, none, none)
        passes = Passes(key, drive, 9.0 * drive, none + 2.0, errors, none + 20.0)
        std.append(changes(passes, Scatter(0.0, 0.0), 5.0, 20.0).mean_std_m_per_km)
    assert std[1] == pytest.approx(std[0] / np.sqrt(40), rel=1e-6)


def test_a_cell_that_a_period_covers_in_part_is_no_change() -> None:
    """Cells of 1 and 9 m/km that stay what they are; the later drive ends 10 m into the second."""
    key = place_key(np.zeros(4, np.intp), np.array([50.0, 50.0, 150.0, 150.0]), 100.0)
    drive, time_s, iri = np.array([0, 1, 0, 1]), np.array([0.0, 9.0, 0.0, 9.0]), np.array([1.0, 1.0, 9.0, 9.0])
    passes = Passes(key, drive, time_s, iri, WindowErrors.undivided(np.full(4, 0.05)), np.array([100.0] * 3 + [10.0]))
    assert changes(passes, Scatter(0.0, 0.0), 5.0, 100.0).mean_m_per_km == pytest.approx(0.0, abs=1e-12)


def test_what_got_worse_is_found_and_little_else() -> None:
    rng = np.random.default_rng(4)
    growth = np.where(np.arange(200) < 20, 0.4, 0.0)
    passes, _ = random_passes(rng, 10, 200, 0.02, 0.05, 0.02, growth)
    found = changes(passes, scatter_of(passes), 5 * 2.6e6, 25.0)
    worse = (found.false_share < 0.05) & (found.change_m_per_km > 0)
    assert worse[:20].mean() > 0.95
    assert worse[20:].sum() <= 4
    slope = trends(passes, scatter_of(passes))
    np.testing.assert_allclose(slope.per_year_m_per_km[:20].mean(), 0.4 * 365.25 * 86_400 / 2.6e6, rtol=0.1)


def test_false_discovery_is_scipys() -> None:
    p_value = np.random.default_rng(5).uniform(size=50)**2
    np.testing.assert_allclose(false_discovery(p_value), stats.false_discovery_control(p_value))


@pytest.mark.parametrize("lat_deg, lon_deg", PLACES[:4])
def test_measures_of_a_route(lat_deg: float, lon_deg: float) -> None:
    corner = line(lat_deg, lon_deg, np.array([0.0, 400.0, 400.0]), np.array([0.0, 0.0, 300.0]))
    measure_m = measures(corner.lat_deg, corner.lon_deg, 5000.0, None)
    np.testing.assert_allclose(measure_m, [5000.0, 5400.0, 5700.0], atol=0.05)
    network = route_network(corner.lat_deg, corner.lon_deg, measure_m)
    at_m = WINDOW_M * np.arange(40) + 30.0
    along = on_route(network, line(lat_deg, lon_deg, at_m, 0 * at_m + 2.0))
    assert (along.direction == ALONG).all()
    np.testing.assert_allclose(along.measure_m, 5000.0 + at_m, atol=0.5)
    against = on_route(network, line(lat_deg, lon_deg, at_m[::-1], 0 * at_m - 2.0))
    assert (against.direction == AGAINST).all()
    np.testing.assert_allclose(against.measure_m, 5000.0 + at_m[::-1], atol=0.5)
    aside = on_route(network, line(lat_deg, lon_deg, at_m, 0 * at_m + 60.0))
    assert (aside.direction == 0).all()


def test_kilometre_posts_hold_between_them() -> None:
    corner = line(46.5, 6.5, np.array([0.0, 1000.0]), np.zeros(2))
    posts = line(46.5, 6.5, np.array([700.0, 200.0]), np.array([3.0, -3.0]))
    found = measures(corner.lat_deg, corner.lon_deg, None, None, np.column_stack([posts.lat_deg, posts.lon_deg]),
                     np.array([2000.0, 1490.0]))
    np.testing.assert_allclose(found, [1290.0, 2300.0], atol=0.05)
    with pytest.raises(ValueError, match="increasing numbers"):
        measures(corner.lat_deg, corner.lon_deg, None, None, np.column_stack([posts.lat_deg, posts.lon_deg]),
                 np.array([1490.0, 2000.0]))
