"""The stream of windows: splitting, holes, halts and ends, other cars and windows, and a drive of known truth.

Readings come from the simulation in time, which shares nothing with the estimator but the car's matrices.
"""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.estimation import batch
from logger.estimation.sensor_noise import Sensor
from logger.estimation.streaming import BALANCED_LAG_S, LAG_S, SLOWEST_WAVE_HZ, RoadEstimator, RoadPiece, WindowEstimate
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.roads.iri import rectified_slope, window_iri
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import Structure, body_point

from ..support.drives.linear_drive import drive
from ..support.slow import release, slow

FINE, COARSE = Sensor(0.05, 0.0981), Sensor(0.1, 0.613)
WINDOW_M, LEAD_M = 7.62, 20.0


@cache
def car(name: str) -> Structure:
    return structure_of(read_vehicle(vehicle_file(name)))


@dataclass(frozen=True)
class Driven:
    """Acceleration without noise and distance, (n,), and the exact IRI of each window from 0."""

    accel_mps2: np.ndarray
    distance_m: np.ndarray
    exact: np.ndarray

    def read(self, sensor: Sensor, seed: int = 0) -> np.ndarray:
        felt = self.accel_mps2 + 9.81 + sensor.noise_rms_mps2 * np.random.default_rng(seed).standard_normal(
            len(self.accel_mps2)
        )
        return np.round(felt / sensor.step_mps2) * sensor.step_mps2 if sensor.step_mps2 else felt


def way(knots: list[tuple[float, float]]) -> np.ndarray:
    """Distances at 100 Hz of a drive with its speed given at some instants, corners rounded over a second."""
    time_s = np.arange(round(knots[-1][0] * 100)) / 100
    rough = np.interp(np.arange(-50, len(time_s) + 50) / 100, *np.array(knots).T)
    speed = np.convolve(rough, np.ones(101) / 101, mode="valid")
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) / 100)])


@cache
def driven(
    knots: tuple[tuple[float, float], ...], iri: float = 3.0, seed: int = 1, name: str = "rav4-2009",
    ahead_m: float = 0.0, window_m: float = WINDOW_M,
) -> Driven:
    distance_m = way(list(knots))
    road = iso8608.generate(iso8608.gd_n0_from_iri(iri), distance_m[-1] + LEAD_M + 30, 0.05, seed)
    outputs = [body_point(car(name), ahead_m)]
    accel = drive(car(name), outputs, Track(0.05, road, -LEAD_M), np.arange(len(distance_m)) / 100, distance_m)[:, 0]
    count = int(distance_m[-1] / window_m)
    edges = LEAD_M + window_m * np.arange(count + 1)
    return Driven(accel, distance_m, window_iri(rectified_slope(road, 0.05), 0.05, edges) if count else np.empty(0))


def steady(speed_mps: float, seconds: float = 40.0) -> tuple[tuple[float, float], ...]:
    return ((0.0, speed_mps), (seconds, speed_mps))


def an_estimator(sensor: Sensor = FINE, name: str = "rav4-2009", ahead_m: float = 0.0, window_m: float = WINDOW_M
                 ) -> RoadEstimator:
    return RoadEstimator(LinearCar(car(name), body_point(car(name), ahead_m)), sensor, window_m)


def estimated(
    estimator: RoadEstimator, reading: np.ndarray, distance_m: np.ndarray, usable: np.ndarray | None = None,
    at_end: np.ndarray | None = None,
) -> list[WindowEstimate]:
    """All windows of a drive, which must come in order and without gaps, each with numbers or with flags."""
    everywhere = np.ones(len(reading), dtype=bool)
    found = estimator.push(reading, everywhere if usable is None else usable,
                           np.zeros(len(reading)) if at_end is None else at_end, distance_m)
    found += estimator.finish()
    assert all(later.number == one.number + 1 for one, later in pairwise(found))
    for one in found:
        assert 0 <= one.resolved <= 1
        assert one.flags <= {"faint", "unsettled"}
        assert bool(one.flags) == np.isnan(one.iri_m_per_km) == np.isnan(one.iri_std_m_per_km)
        assert one.flags or (one.iri_m_per_km > 0 and one.iri_std_m_per_km > 0)
    return found


def flags_of(found: list[WindowEstimate]) -> list[str]:
    return ["+".join(sorted(one.flags)) for one in found]


def bits(found: list[WindowEstimate]) -> list[tuple[object, ...]]:
    return [(one.number, one.iri_m_per_km.hex(), one.iri_std_m_per_km.hex(), one.resolved, one.flags) for one in found]


# --- truth -----------------------------------------------------------------------------------------------------------

TOWN = (
    (0, 0), (4, 0), (12, 13), (40, 15), (46, 0), (58, 0), (64, 12), (90, 14), (95, 3), (101, 11), (125, 12), (130, 0),
    (160, 0), (170, 20), (215, 24), (225, 15), (250, 17), (258, 0), (262, 0), (274, 22), (340, 25),
)


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "least_r2"), [(FINE, 0.9), (COARSE, 0.75)])
def test_five_kilometres_of_town_and_road(sensor: Sensor, least_r2: float) -> None:
    drives = [driven(TOWN, iri, seed) for seed, iri in enumerate((1.5, 4.0))]
    assert sum(one.distance_m[-1] for one in drives) > 9000
    exact, estimate, std, given = [], [], [], 0
    for one in drives:
        found = estimated(an_estimator(sensor), one.read(sensor), one.distance_m)
        assert len(found) >= len(one.exact) - 1
        known = [window for window in found if not window.flags and window.number < len(one.exact)]
        given += len(known)
        exact += [one.exact[window.number] for window in known]
        estimate += [window.iri_m_per_km for window in known]
        std += [window.iri_std_m_per_km for window in known]
    truth, found_iri = np.array(exact), np.array(estimate)
    assert given > 0.9 * sum(len(one.exact) for one in drives)
    assert 1 - np.mean((found_iri - truth) ** 2) / truth.var() > least_r2
    assert found_iri.mean() == pytest.approx(truth.mean(), rel=0.05)
    score = np.abs(found_iri - truth) / np.array(std)
    # A coarse sensor hardly feels the smooth road, and its error there is one of the level, too wide if anything.
    assert 0.583 < np.mean(score < 1) < (0.783 if sensor is FINE else 0.85)
    assert np.mean(score < 2) == pytest.approx(0.954, abs=0.05)


@pytest.mark.parametrize(
    ("name", "ahead_m"), [("golden-car", 0.0), ("rav4-2009-full", 0.5), *slow(("rav4-2009", 1.2), ("rav4-2009", -1.0))]
)
def test_other_cars_and_places_of_the_sensor(name: str, ahead_m: float) -> None:
    one = driven(steady(16.0), 3.0, 4, name, ahead_m)
    found = estimated(an_estimator(FINE, name, ahead_m), one.read(FINE), one.distance_m)
    known = [window for window in found if not window.flags]
    assert len(known) > 0.95 * len(found)
    truth = np.array([one.exact[window.number] for window in known])
    score = [(window.iri_m_per_km - exact) / window.iri_std_m_per_km
             for window, exact in zip(known, truth, strict=True)]
    assert np.sqrt(np.mean(np.square(score))) < 1.5
    assert np.mean([window.iri_m_per_km for window in known]) == pytest.approx(truth.mean(), rel=0.05)


@pytest.mark.parametrize("window_m", [3.0, 100.0, *slow(7.62, 10.0, 10.01, 30.48)])
def test_windows_of_any_length(window_m: float) -> None:
    one = driven(steady(20.0), 3.0, 2, window_m=window_m)
    found = estimated(an_estimator(window_m=window_m), one.read(FINE), one.distance_m)
    assert len(one.exact) - 1 <= len(found) <= len(one.exact)
    known = [window for window in found if not window.flags]
    assert len(known) > 0.9 * len(found)
    truth = np.array([one.exact[window.number] for window in known])
    off = np.array([window.iri_m_per_km for window in known]) - truth
    assert np.sqrt(np.mean(off**2)) < 1.6 * np.mean([window.iri_std_m_per_km for window in known]) + 0.05


@pytest.mark.slow
def test_a_longer_window_is_known_better() -> None:
    one = driven(steady(20.0), 3.0, 2)
    spread = [
        np.nanmean([w.iri_std_m_per_km for w in estimated(an_estimator(window_m=m), one.read(FINE), one.distance_m)])
        for m in (3.0, 7.62, 30.48, 100.0)
    ]
    assert spread == sorted(spread, reverse=True) and spread[0] > 3 * spread[-1]


# --- splitting -------------------------------------------------------------------------------------------------------

@cache
def in_one_go(coarse: bool) -> list[tuple[object, ...]]:
    one, sensor = driven(((0, 9), (12, 15), (20, 0), (24, 0), (36, 14))), COARSE if coarse else FINE
    return bits(estimated(an_estimator(sensor), one.read(sensor), one.distance_m))


@pytest.mark.slow
@pytest.mark.parametrize("coarse", [False, True])
@settings(max_examples=5)
@given(cuts=st.lists(st.integers(0, 3600), max_size=12))
def test_any_split_gives_the_same_bits(coarse: bool, cuts: list[int]) -> None:
    one, sensor = driven(((0, 9), (12, 15), (20, 0), (24, 0), (36, 14))), COARSE if coarse else FINE
    reading, estimator = one.read(sensor), an_estimator(sensor)
    found = []
    for low, high in zip([0, *sorted(cuts)], [*sorted(cuts), len(reading)], strict=True):
        part = slice(low, high)
        found += estimator.push(reading[part], np.ones(high - low, dtype=bool), np.zeros(high - low),
                                one.distance_m[part])
    assert bits(found + estimator.finish()) == in_one_go(coarse)


def test_windows_come_a_few_seconds_after_they_were_driven() -> None:
    one, estimator = driven(steady(20.0)), an_estimator()
    reading = one.read(FINE)
    seen: dict[int, float] = {}
    for low in range(0, 3900, 50):
        part = slice(low, low + 50)
        for window in estimator.push(reading[part], np.ones(50, dtype=bool), np.zeros(50), one.distance_m[part]):
            seen[window.number] = (low + 50) / 100 - (window.number + 1) * WINDOW_M / 20.0
    late = np.array([seen[number] for number in seen if number > 30])
    assert late.min() > LAG_S - 0.011 and late.max() < LAG_S + 2.5


def test_the_desk_knows_a_place_better_with_as_much_behind_it_as_before_it() -> None:
    sensor, one = Sensor(0.3, 0.0), driven(steady(31.0, 61.5))
    known_car, reading = LinearCar(car("rav4-2009"), body_point(car("rav4-2009"))), one.read(sensor)
    stream, desk = ([window.iri_m_per_km for window in estimated(
        RoadEstimator(known_car, sensor, WINDOW_M, lag_s=lag_s), reading, one.distance_m)]
        for lag_s in (LAG_S, BALANCED_LAG_S))
    assert batch.estimated(known_car, sensor, WINDOW_M, reading, one.distance_m)[0].iri_m_per_km.tolist() == desk
    assert np.isfinite(desk).sum() == np.isfinite(stream).sum() >= len(one.exact) - 1
    off, less_off = (np.nanmean((np.array(found)[:len(one.exact)] - one.exact) ** 2) for found in (stream, desk))
    assert less_off < 0.99 * off


def test_a_second_drive_is_numbered_by_its_own_distance() -> None:
    one, estimator = driven(steady(20.0, 15.0)), an_estimator()
    reading = one.read(FINE)
    first = estimated(estimator, reading, one.distance_m)
    second = estimated(estimator, reading, one.distance_m + 1000 * WINDOW_M - 3.0)
    assert first[0].number == 0 and second[0].number == 1000
    assert len(second) in (len(first) - 1, len(first))


# --- starts, holes, halts, ends --------------------------------------------------------------------------------------

def test_nothing_at_all() -> None:
    estimator = an_estimator()
    empty = np.empty(0)
    assert estimator.finish() == []
    assert estimator.push(empty, np.empty(0, dtype=bool), empty, empty) == []
    assert estimator.finish() == [] and estimator.finish() == []


@pytest.mark.parametrize("count", [1, 2, 199, 200, 201, 900, *slow(1500)])
@pytest.mark.parametrize("sensor", [FINE, *slow(COARSE)])
def test_drives_shorter_than_a_block(count: int, sensor: Sensor) -> None:
    one = driven(steady(20.0))
    found = estimated(an_estimator(sensor), one.read(sensor)[:count], one.distance_m[:count])
    assert len(found) == int(one.distance_m[count - 1] / WINDOW_M)
    if count >= 900:
        assert sum(not window.flags for window in found) > 0.7 * len(found)


def test_standing_all_the_time_gives_no_window() -> None:
    assert estimated(an_estimator(), np.full(6000, 9.81), np.full(6000, 12.0)) == []


def test_a_stop_of_minutes_costs_its_window_only() -> None:
    one = driven(((0, 12), (25, 12), (30, 0), (210, 0), (216, 12), (240, 12)))
    found = estimated(an_estimator(), one.read(FINE), one.distance_m)
    stopped = int(one.distance_m[12_000] / WINDOW_M)
    without = [window.number for window in found if window.flags]
    assert stopped in without and set(without) <= {stopped - 1, stopped, stopped + 1}
    assert all(window.flags == {"faint"} for window in found if window.flags)


@pytest.mark.parametrize(("garbage", "sensor"), [
    *slow((0.0, FINE), (np.nan, COARSE), (1e4, FINE)), *release((0.0, COARSE), (np.nan, FINE), (1e4, COARSE))])
def test_a_hole_in_the_readings(garbage: float, sensor: Sensor) -> None:
    """Windows in it are unsettled, those far from it as they were, whatever stands in the hole."""
    one = driven(steady(15.0, 50.0))
    reading, usable = one.read(sensor), np.ones(5000, dtype=bool)
    whole = estimated(an_estimator(sensor), reading, one.distance_m)
    usable[2400:2700] = False
    reading[~usable] = garbage
    found = estimated(an_estimator(sensor), reading, one.distance_m, usable)
    assert [window.number for window in found] == [window.number for window in whole]
    begin, end = one.distance_m[[2400, 2700]] / WINDOW_M
    inside = [window for window in found if begin <= window.number and window.number + 1 <= end]
    assert inside and all(window.flags == {"unsettled"} for window in inside)
    for window, before in zip(found, whole, strict=True):
        if window.number < begin - 15.0 * (LAG_S + 2.1) / WINDOW_M:  # those that were taken before it
            assert bits([window]) == bits([before])
        if window.number > end + 6 and not before.flags:
            assert window.iri_m_per_km == pytest.approx(before.iri_m_per_km, abs=before.iri_std_m_per_km)


def test_readings_that_begin_late() -> None:
    """Half a minute of driving unread is unsettled, not faint."""
    one = driven(steady(15.0, 60.0))
    usable = np.arange(6000) >= 3000
    found = estimated(an_estimator(), one.read(FINE), one.distance_m, usable)
    begun = one.distance_m[3000] / WINDOW_M
    assert all(window.flags == {"unsettled"} for window in found if window.number + 1 < begun)
    assert not any(window.flags for window in found if window.number > begun + 2)


@pytest.mark.parametrize("sensor", [FINE, *slow(COARSE)])
def test_a_hole_from_standing_into_the_drive_makes_no_smooth_road(sensor: Sensor) -> None:
    """What was driven unread says nothing about the level: as if it had not been driven at all."""
    one = driven(((0, 0), (9, 0), (17, 15), (60, 15)))
    reading, usable = one.read(sensor), np.ones(6000, dtype=bool)
    whole = {window.number: window for window in estimated(an_estimator(sensor), reading, one.distance_m)}
    usable[1000:2500] = False
    found = estimated(an_estimator(sensor), reading, one.distance_m, usable)
    begin, end = one.distance_m[[2700, 3700]] / WINDOW_M
    after = [window for window in found if begin <= window.number < end]
    assert len(after) >= 19 and not any(window.flags for window in after)
    mean, expected = (np.mean([of.iri_m_per_km for of in some])
                      for some in (after, [whole[window.number] for window in after]))
    assert mean == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("sensor", [FINE, *slow(COARSE)])
def test_clipped_readings_do_not_flatten_the_road(sensor: Sensor) -> None:
    """A range that the road leaves now and then: bounds or no readings, and a similar IRI either way."""
    one = driven(steady(18.0), 6.0, 3)
    free = one.read(sensor)
    bottom, top = (sensor.step_mps2 * round((9.81 + end) / sensor.step_mps2) for end in (-1.5, 1.5))
    reading = np.clip(free, bottom, top)
    at_end = (reading == top).astype(float) - (reading == bottom)
    assert 0.01 < np.mean(at_end != 0) < 0.2
    whole, clipped, blind = (
        np.nanmean([w.iri_m_per_km for w in estimated(an_estimator(sensor), *rest)])
        for rest in ((free, one.distance_m), (reading, one.distance_m, None, at_end), (reading, one.distance_m))
    )
    assert clipped == pytest.approx(whole, rel=0.07)
    assert abs(clipped - whole) < abs(blind - whole) + 0.05 * whole


@pytest.mark.parametrize(("sensor", "speed_mps"), [(FINE, 0.7), *slow((FINE, 0.3), (COARSE, 1.3))])
def test_at_a_crawl_it_says_faint(sensor: Sensor, speed_mps: float) -> None:
    one = driven(steady(speed_mps, 100.0))
    found = estimated(an_estimator(sensor), one.read(sensor), one.distance_m)
    assert found and set(flags_of(found)) == {"faint"}


@pytest.mark.parametrize("level_mps2", [9.81, 9.81 + 0.5 * COARSE.step_mps2])
def test_rounding_alone_is_no_road(level_mps2: float) -> None:
    """Gravity in the middle of a step reads the same all the time; near an edge noise alone makes it toggle."""
    step = COARSE.step_mps2
    middle = round(level_mps2 / step) * step + (0.5 * step if level_mps2 > 10 else 0.0)
    felt = middle + COARSE.noise_rms_mps2 * np.random.default_rng(0).standard_normal(5000)
    reading = np.round(felt / step) * step
    assert np.mean(reading == reading[0]) == pytest.approx(0.5 if level_mps2 > 10 else 1.0, abs=0.05)
    found = estimated(an_estimator(COARSE), reading, 0.2 * np.arange(5000.0))
    assert np.mean([bool(window.flags) for window in found]) > 0.8
    assert all(window.iri_m_per_km < 1.0 for window in found if not window.flags)


@pytest.mark.parametrize("sensor", [Sensor(0.05, 0.0), FINE])
def test_a_sensor_that_hangs(sensor: Sensor) -> None:
    found = estimated(an_estimator(sensor), np.full(6000, 9.81), 0.2 * np.arange(6000.0))
    assert all(window.flags == {"faint"} for window in found[len(found) // 2:])


@pytest.mark.parametrize(("sensor", "iri", "speed_mps"), [
    (FINE, 0.3, 12.0), (COARSE, 0.3, 12.0), (FINE, 100.0, 9.0),
    *slow((COARSE, 10.0, 45.0), (FINE, 10.0, 45.0), (FINE, 30.0, 20.0), (COARSE, 30.0, 20.0), (COARSE, 100.0, 9.0),
          (FINE, 100.0, 18.0), (COARSE, 100.0, 18.0))])
def test_smooth_rough_and_fast(sensor: Sensor, iri: float, speed_mps: float) -> None:
    one = driven(steady(speed_mps), iri, 6)
    found = estimated(an_estimator(sensor), one.read(sensor), one.distance_m)
    known = [window for window in found if not window.flags and window.number < len(one.exact)]
    if iri > 1 or sensor is FINE:
        assert len(known) > 0.8 * len(found)
        truth = np.mean([one.exact[window.number] for window in known])
        assert np.mean([window.iri_m_per_km for window in known]) == pytest.approx(truth, rel=0.12)
    else:
        assert all(window.iri_m_per_km < 1.0 for window in known)


# --- the road --------------------------------------------------------------------------------------------------------

def test_pieces_of_road_join_and_have_the_roads_shape() -> None:
    one = driven(steady(18.0), 4.0, 5, window_m=30.48)
    pieces: list[RoadPiece] = []
    structure = car("rav4-2009")
    estimator = RoadEstimator(LinearCar(structure, body_point(structure)), FINE, 30.48, on_road=pieces.append)
    estimated(estimator, one.read(FINE), one.distance_m)
    starts = np.array([piece.start_m for piece in pieces])
    lengths = np.array([piece.spacing_m * (len(piece.elevation_m) - 1) for piece in pieces])
    assert starts[1:] == pytest.approx(starts[:-1] + lengths[:-1])
    assert all(0.2 < piece.shortest_m < 3.0 < 10.0 < piece.longest_m for piece in pieces[3:])
    road = iso8608.generate(iso8608.gd_n0_from_iri(4.0), one.distance_m[-1] + LEAD_M + 30, 0.05, 5)
    correlations = []
    for piece in pieces[3:-3]:
        place = piece.start_m + piece.spacing_m * np.arange(len(piece.elevation_m))
        exact = np.interp(place, 0.05 * np.arange(len(road)) - LEAD_M, road)
        bent = [row - np.polyval(np.polyfit(place, row, 2), place) for row in (exact, piece.elevation_m)]
        correlations.append(np.corrcoef(*bent)[0, 1])
    assert np.median(correlations) > 0.85  # what is resolved by less than a half is missing


def test_no_piece_holds_waves_that_pass_as_slowly_as_a_sensor_drifts() -> None:
    one = driven(steady(4.0), 4.0, 5)
    pieces: list[RoadPiece] = []
    structure = car("rav4-2009")
    estimator = RoadEstimator(LinearCar(structure, body_point(structure)), FINE, WINDOW_M, on_road=pieces.append)
    estimated(estimator, one.read(FINE), one.distance_m)
    assert max(piece.longest_m for piece in pieces) == pytest.approx(4.0 / SLOWEST_WAVE_HZ, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("range_g", [*release(2), 4])
def test_reading_several_times_per_sample_gains_and_its_errors_are_right(range_g: int) -> None:
    """Slow drives over roads that hide in the steps: four readings per sample, each twice as noisy, against one. Taken
    as bounds their errors come out right; with their mean taken to have no steps they were too small by half."""
    step = 9.80665 * range_g / 32
    off: dict[int, list[float]] = {1: [], 4: []}
    squares: dict[int, list[float]] = {1: [], 4: []}
    for seed, (iri, offset) in enumerate([(3.0, 0.0), (8.0, 0.3), (3.0, 0.5), (8.0, -0.2)]):
        finer = 4
        seconds, speed_mps = 60.0, 9.0
        distance_m = speed_mps * np.arange(round(seconds * 100 * finer)) / (100 * finer)
        road = iso8608.generate(iso8608.gd_n0_from_iri(iri), distance_m[-1] + LEAD_M + 30, 0.05, 40 + seed)
        body = [body_point(car("rav4-2009"))]
        accel = drive(car("rav4-2009"), body, Track(0.05, road, -LEAD_M), np.arange(len(distance_m)) / (100 * finer),
                      distance_m)[:, 0]
        edges = LEAD_M + WINDOW_M * np.arange(int(distance_m[-1] / WINDOW_M) + 1)
        exact = window_iri(rectified_slope(road, 0.05), 0.05, edges)
        for reads, noise in ((1, 0.1), (4, 0.2)):
            rng = np.random.default_rng([seed, reads])
            felt = accel[::finer // reads] + 9.8 + offset * step
            reading = step * np.rint((felt + noise * rng.standard_normal(len(felt))) / step).reshape(-1, reads)
            structure = car("rav4-2009")
            estimator = RoadEstimator(LinearCar(structure, body_point(structure)), Sensor(noise, step), WINDOW_M,
                                      reads=reads)
            found = estimator.push(reading, np.ones(reading.shape, dtype=bool), np.zeros(reading.shape),
                                   distance_m[::finer]) + estimator.finish()
            errors = [(one.iri_m_per_km - exact[one.number], one.iri_std_m_per_km) for one in found if not one.flags]
            off[reads] += [abs(error) / std for error, std in errors]
            squares[reads] += [error**2 / iri**2 for error, _ in errors]
    shares = [float(np.mean(np.array(off[4]) <= times)) for times in (1, 2)]
    print(f"{range_g} g: in 1 and 2 {shares}, mean square {np.mean(squares[4]):.3f} of {len(squares[4])} against "
          f"{np.mean(squares[1]):.3f} of {len(squares[1])}")
    assert len(squares[4]) >= len(squares[1]) and np.mean(squares[4]) < 0.95 * np.mean(squares[1])
    assert 0.58 < shares[0] < 0.82 and shares[1] > 0.9


def test_several_readings_per_sample_that_are_no_bounds_are_refused() -> None:
    with pytest.raises(ValueError, match="one reading per sample"):
        RoadEstimator(LinearCar(car("rav4-2009"), body_point(car("rav4-2009"))), FINE, WINDOW_M, reads=4)
