"""Single bumps, stretches of other roughness and misplaced windows: drives of the simulation in time."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from logger.dsp.weightings.wk import WEIGHTING
from logger.estimation.sensor_noise import Sensor
from logger.estimation.streaming import RoadEstimator, WindowEstimate
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.roads.iri import rectified_slope, window_iri
from logger.roads.obstacles import speed_bump
from logger.roads.sections import SectionWindows, WindowErrors, even_edges, sections
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

from ..support.drives.linear_drive import drive
from ..support.drives.measured import Accelerometer, iso_road, steady_drive
from ..support.slow import release, slow

FINE, COARSE = Sensor(0.05, 0.0), Sensor(0.1, 0.613)
WINDOW_M, SPACING_M, BUMP_M = 7.62, 0.05, 300.3
RAV4 = structure_of(read_vehicle(vehicle_file("rav4-2009")))


def an_iso_road(iri: float, length_m: float, seed: int) -> np.ndarray:
    count = round(length_m / SPACING_M)
    if iri == 0:
        return np.zeros(count)
    return iso8608.generate(iso8608.gd_n0_from_iri(iri), length_m + 1, SPACING_M, seed)[:count]


def driven(road: np.ndarray, speed_mps: float) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration and distance (n,) of a drive to 20 m before the road's end."""
    time_s = np.arange(0, (len(road) * SPACING_M - 20) / speed_mps, 0.01)
    output = body_point(RAV4)
    return drive(RAV4, [output], Track(SPACING_M, road), time_s, speed_mps * time_s)[:, 0], speed_mps * time_s


def read(accel_mps2: np.ndarray, sensor: Sensor, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    felt = accel_mps2 + 9.81 + rng.uniform(0, 1) + sensor.noise_rms_mps2 * rng.standard_normal(len(accel_mps2))
    return np.round(felt / sensor.step_mps2) * sensor.step_mps2 if sensor.step_mps2 else felt


def estimated(
    sensor: Sensor, reading: np.ndarray, distance_m: np.ndarray, window_m: float = WINDOW_M, place_std_m: float = 0.0
) -> list[WindowEstimate]:
    estimator = RoadEstimator(LinearCar(RAV4, body_point(RAV4)), sensor, window_m, place_std_m, vehicle_error=0.0)
    found = estimator.push(reading, np.ones(len(reading), dtype=bool), np.zeros(len(reading)), distance_m)
    return found + estimator.finish()


def test_a_delay_that_is_not_known_counts_by_the_speed() -> None:
    """0.1 s are 1.5 m at 15 m/s."""
    _, accel, distance_m = bumpy(1.0, 0.05, 1.0, 15.0)
    reading = read(accel, FINE, 1)
    late = RoadEstimator(LinearCar(RAV4, body_point(RAV4)), FINE, WINDOW_M, vehicle_error=0.0, late_std_s=0.1)
    everywhere = np.ones(len(reading), dtype=bool)
    found = late.push(reading, everywhere, np.zeros(len(reading)), distance_m) + late.finish()
    off = {one.number: one for one in estimated(FINE, reading, distance_m, place_std_m=1.5)}
    for one in found:
        assert one.iri_m_per_km == pytest.approx(off[one.number].iri_m_per_km, nan_ok=True)
        assert one.iri_std_m_per_km == pytest.approx(off[one.number].iri_std_m_per_km, rel=0.01, nan_ok=True)


def exact_iri(road: np.ndarray, window_m: float = WINDOW_M) -> np.ndarray:
    """(n,) of every whole window of a road."""
    edges = window_m * np.arange(int((len(road) - 10) * SPACING_M / window_m))
    return window_iri(rectified_slope(road, SPACING_M), SPACING_M, edges)


@cache
def bumpy(iri: float, height_m: float, length_m: float, speed_mps: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Road, acceleration and distance of a drive over one bump, or one dip, on a road of this IRI."""
    road = an_iso_road(iri, 500, 3)
    road = road + np.sign(height_m) * speed_bump(SPACING_M * np.arange(len(road)), BUMP_M, abs(height_m), length_m)
    return road, *driven(road, speed_mps)


BUMPS = [(iri, *bump, speed_mps, *sensor) for bump in ((0.08, 2.0), (0.05, 1.0), (-0.04, 0.6))
         for speed_mps in (9.0, 15.0, 22.0) for sensor in ((FINE, 0.1), (COARSE, 0.15)) for iri in (0.0, 1.0)]
"""Every bump at every speed with every sensor, on a flat road and on another: on one of them sooner."""
SOONER = [(number + number // 2 + number // 4) % 2 == 0 for number in range(len(BUMPS))]


@pytest.mark.parametrize(("iri", "height_m", "length_m", "speed_mps", "sensor", "tolerance"), [
    param for one, sooner in zip(BUMPS, SOONER, strict=True) for param in (slow if sooner else release)(one)])
def test_a_lone_bump(
    iri: float, height_m: float, length_m: float, speed_mps: float, sensor: Sensor, tolerance: float
) -> None:
    """The IRI of the window with the bump; one far behind it says nothing of it."""
    road, accel, distance_m = bumpy(iri, height_m, length_m, speed_mps)
    found = {one.number: one for one in estimated(sensor, read(accel, sensor, 1), distance_m)}
    number, exact = int(BUMP_M / WINDOW_M), exact_iri(road)
    if height_m < 0:  # a pothole of 4 cm, driven over slowly, is two or three steps of a coarse sensor
        tolerance = 0.12 if sensor is FINE else 0.3
    assert exact[number] > 8
    assert found[number].iri_m_per_km == pytest.approx(exact[number], rel=tolerance)
    assert abs(found[number].iri_m_per_km - exact[number]) < 2.5 * found[number].iri_std_m_per_km
    after = found[number + 12]
    assert after.flags == {"faint"} or after.iri_m_per_km < max(1.0, 2 * exact[number + 12])


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "least_r2", "bias"), [(FINE, 0.97, 0.2), (COARSE, 0.87, 0.5)])
def test_stretches_four_times_as_rough_as_others(sensor: Sensor, least_r2: float, bias: float) -> None:
    """Every 45 m it changes. A coarse sensor hardly feels the smooth ones."""
    exact, estimate, std = [], [], []
    for seed in range(3):
        smooth = an_iso_road(1.5, 900, 30 + seed)
        gain = np.where(SPACING_M * np.arange(len(smooth)) // 45 % 2, 4.0, 1.0)
        road = np.concatenate([[0.0], np.cumsum(np.diff(smooth) * gain[1:])])
        accel, distance_m = driven(road, 15.0)
        true = exact_iri(road)
        for one in estimated(sensor, read(accel, sensor, seed), distance_m):
            if not one.flags and 3 < one.number < len(true):
                exact.append(true[one.number])
                estimate.append(one.iri_m_per_km)
                std.append(one.iri_std_m_per_km)
    truth, found = np.array(exact), np.array(estimate)
    is_rough = truth > 3.0
    assert len(truth) > 250
    assert 1 - np.mean((found - truth) ** 2) / truth.var() > least_r2
    assert found[is_rough].mean() == pytest.approx(truth[is_rough].mean(), rel=0.05)
    assert found[~is_rough].mean() == pytest.approx(truth[~is_rough].mean(), rel=bias)
    score = np.abs(found - truth) / np.array(std)
    assert np.mean(score < 2) > (0.93 if sensor is FINE else 0.86)


@pytest.mark.slow
@pytest.mark.parametrize(("window_m", "place_std_m"),
                         [*release((WINDOW_M, 2.0)), (WINDOW_M, 0.5), (4 * WINDOW_M, 2.0)])
def test_a_misplaced_window_is_as_uncertain_as_windows_on_either_side_differ(
        window_m: float, place_std_m: float) -> None:
    """On three roads that are eight times as rough every other 150 m, whose windows that far behind and that far ahead
    are estimated from shifted distances: half of what lies between them, window by window and as a root mean square."""
    added, differences = [], []
    for seed in (7, 8, 9):
        smooth = an_iso_road(1.0, 1500, seed)
        gain = np.where(SPACING_M * np.arange(len(smooth)) // (20.4 * WINDOW_M) % 2, 8.0, 1.0)
        accel, distance_m = driven(np.concatenate([[0.0], np.cumsum(np.diff(smooth) * gain[1:])]), 15.0)
        reading = read(accel, FINE, 1)
        exact, misplaced = (estimated(FINE, reading, distance_m, window_m, std) for std in (0.0, place_std_m))
        assert [one.iri_m_per_km for one in exact] == [one.iri_m_per_km for one in misplaced]
        shifted = (estimated(FINE, reading, distance_m + shift_m, window_m) for shift_m in (place_std_m, -place_std_m))
        behind, ahead = ({one.number: one.iri_m_per_km for one in drive} for drive in shifted)
        for sure, less_sure in zip(exact, misplaced, strict=True):
            if sure.number > 5 and sure.number in behind and sure.number in ahead:
                added.append(less_sure.iri_std_m_per_km**2 - sure.iri_std_m_per_km**2)
                differences.append((ahead[sure.number] - behind[sure.number]) ** 2 / 4)
    assert len(added) > 3 * 1400 / window_m - 30
    assert np.sqrt(np.mean(added)) == pytest.approx(np.sqrt(np.mean(differences)), rel=0.2)
    assert np.corrcoef(np.sqrt(added), np.sqrt(differences))[0, 1] > 0.6


@pytest.mark.slow
@pytest.mark.parametrize("sensor", [FINE, pytest.param(COARSE, marks=[pytest.mark.release, pytest.mark.xfail(
    strict=True, reason="with coarse steps, on roads of one level, 77 % lie within one standard error: too large")])])
def test_errors_cover_windows_that_are_misplaced(sensor: Sensor) -> None:
    """The distance is off by another metre or so on each of twenty-four drives over roads of IRI 2 to 10."""
    rng = np.random.default_rng(5)
    scores, blind = [], []
    for seed, iri in enumerate((2.0, 4.5, 10.0)):
        road = an_iso_road(iri, 400, 40 + seed)
        accel, distance_m = driven(road, 17.0)
        reading, exact = read(accel, sensor, seed), exact_iri(road)
        unaware = estimated(sensor, reading, distance_m)
        for _ in range(8):
            found = estimated(sensor, reading, distance_m + rng.standard_normal(), place_std_m=1.0)
            known = [one for one in found if not one.flags and 4 <= one.number < len(exact)]
            off = np.array([one.iri_m_per_km - exact[one.number] for one in known])
            scores.append(off / [one.iri_std_m_per_km for one in known])
            rates = {one.number: one.iri_std_m_per_km for one in unaware}
            blind.append([one / rates.get(each.number, np.inf) for one, each in zip(off, known, strict=True)])
    score = np.abs(np.concatenate(scores))
    assert np.mean(score < 1) == pytest.approx(0.683, abs=0.08)
    assert np.mean(score < 2) == pytest.approx(0.954, abs=0.04)
    without = np.sqrt(np.mean(np.square(np.concatenate(blind))))
    assert without > (1.2 if sensor is FINE else 1.05)  # the place's error is not small here


def changing(seed: int) -> np.ndarray:
    """A road whose slopes get e times as steep or as flat, every 20 to 300 m or so."""
    rng = np.random.default_rng(seed)
    slope = np.diff(an_iso_road(2.0, 1500, 60 + seed))
    changes = np.append(0, np.cumsum(np.exp(rng.uniform(np.log(20), np.log(300), 30))) / SPACING_M).astype(int)
    gain = np.exp(rng.choice((-0.5, 0.5), len(changes)))
    slope *= gain[np.searchsorted(changes, np.arange(len(slope)), side="right") - 1]
    return np.append(0.0, np.cumsum(slope - slope.mean()))


@pytest.mark.slow
def test_sections_of_roads_that_change_have_right_standard_errors() -> None:
    """Eight drives: errors over their standard errors."""
    whole, alone = [], []
    for seed in range(8):
        road = changing(seed)
        accel, distance_m = driven(road, (9.0, 15.0, 22.0, 30.0)[seed % 4])
        found = estimated(COARSE, read(accel, COARSE, seed), distance_m)
        start_m = WINDOW_M * np.array([one.number for one in found])
        iri = np.array([one.iri_m_per_km for one in found])
        errors = WindowErrors(*np.array([(one.iri_std_m_per_km, one.iri_level_std_m_per_km, one.iri_common_std_m_per_km,
                                          one.iri_place_std_m_per_km) for one in found]).T)
        exact = exact_iri(road)[[one.number for one in found]]
        for chosen, into in ((errors, whole), (WindowErrors(errors.std, *np.zeros((3, len(iri)))), alone)):
            nothing = np.zeros(len(iri))
            off = sections(SectionWindows(start_m, start_m + WINDOW_M, nothing + 1, iri - exact, chosen, nothing),
                           start_m[0] + even_edges(float(start_m[-1] - start_m[0]), 21 * WINDOW_M))
            known = off.known_m > 20 * WINDOW_M
            into.append((off.iri_m_per_km / off.iri_std_m_per_km)[known])
    spread, independent = (float(np.sqrt(np.mean(np.concatenate(one) ** 2))) for one in (whole, alone))
    print(f"errors of 0.1 mi over their standard errors: {spread:.2f} (right: 1); as if windows shared nothing: "
          f"{independent:.2f}")
    assert 0.75 < spread < 1.25 < independent


@pytest.mark.slow
def test_the_ride_of_roads_that_change_is_not_taken_for_a_harder_one() -> None:
    """Mean a_w of eight drives, and how often the true one lies within its errors; the weighting by its formula."""
    rows = []
    for seed in range(8):
        accel, distance_m = driven(changing(seed), (9.0, 15.0, 22.0, 30.0)[seed % 4])
        estimator = RoadEstimator(LinearCar(RAV4, body_point(RAV4)), COARSE, WINDOW_M, ride_response=WEIGHTING.response)
        reading, nothing = read(accel, COARSE, seed), np.zeros(len(accel))
        found = estimator.push(reading, nothing == 0, nothing, distance_m) + estimator.finish()
        after = np.append(accel, np.zeros(2000))
        waves = np.fft.rfft(after) * WEIGHTING.response(np.fft.rfftfreq(len(after), 0.01))
        squares = np.fft.irfft(waves, len(after)) ** 2
        sums = np.append(0.0, np.cumsum(squares))
        for one in found:
            low, high = np.searchsorted(distance_m, WINDOW_M * np.array([one.number, one.number + 1]))
            rows.append((np.sqrt((sums[high] - sums[low]) / (high - low)), one.ride.a_w.value, one.ride.a_w.std))
    true, value, std = np.array([row for row in rows if np.isfinite(row).all()]).T
    off = np.abs(value - true) / std
    print(f"a_w {value.mean() / true.mean() - 1:+.1%}, in one {np.mean(off < 1):.2f}, in two {np.mean(off < 2):.2f}")
    assert value.mean() == pytest.approx(true.mean(), rel=0.03)
    assert 0.6 < np.mean(off < 1) < 0.8
    assert np.mean(off < 2) > 0.92


@pytest.mark.slow
def test_stretches_that_steps_hide_do_not_change_the_waviness_of_the_others() -> None:
    """Three drives; two quarters of each road are so smooth that steps of 2.45 m/s2 show next to nothing of them."""
    found: list[float] = []
    for seed in range(3):
        even = iso_road(2.5, 1200.0, seed + 5)
        gain = np.repeat(np.exp([0.75, -1.0, 1.25, -0.5]), len(even.elevation_m) // 4)
        slope = np.diff(even.elevation_m, append=even.elevation_m[0]) * gain
        road = replace(even, elevation_m=np.cumsum(slope - slope.mean()), gain=gain)
        ride = steady_drive(read_vehicle(vehicle_file("rav4-2009")), road, 18.0, 16.0)
        reading, _ = Accelerometer("8 g", 0.15, 2.45).read(ride.accel_mps2, np.random.default_rng(seed))
        estimator = RoadEstimator(LinearCar(RAV4, body_point(RAV4)), Sensor(0.15, 2.45), WINDOW_M)
        nothing = np.zeros(len(reading))
        for part in np.array_split(np.arange(len(reading)), 20):
            estimator.push(reading[part], nothing[part] == 0, nothing[part], (ride.place_m - ride.place_m[0])[part])
            found.append(estimator.road.level_at(0, 2)[0].waviness)
    print(f"waviness {np.mean(found):.3f}, right 2")
    assert np.mean(found) == pytest.approx(2.0, abs=0.08)
