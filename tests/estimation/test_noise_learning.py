"""Learning of the noise: against exact log evidence by summing over grids, dense algebra, and drives of known noise."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from logger.estimation.car_response import SteadyMotion
from logger.estimation.quantisation import GaussianReadings, bounds, cavity, improved, without_own
from logger.estimation.sensor_noise import (
    NoiseBelief,
    NoiseLearner,
    Sensor,
    interval_evidence,
    parked_evidence,
    residual_evidence,
)
from logger.estimation.streaming import RoadEstimator
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

from ..support.drives.linear_drive import drive
from ..support.slow import release, slow

STEP = 0.6
GRID = np.linspace(-6.0, 6.0, 48_001)
H = 1e-3


def log_share(mean: np.ndarray, variance: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """log Z, from the tail in which it keeps its digits."""
    ends = [(end - mean) / np.sqrt(variance) for end in (low, high)]
    mirrored = [np.where(ends[0] > 0, -end, end) for end in ends]
    return np.log(np.abs(norm.cdf(mirrored[1]) - norm.cdf(mirrored[0])))


@pytest.mark.parametrize("noise", [0.05, 0.2, 0.7])
def test_the_evidence_is_the_log_probability(noise: float) -> None:
    rng = np.random.default_rng(1)
    expected, others = rng.uniform(-1, 1, 40), rng.uniform(0.001, 0.3, 40)
    low = STEP * (np.round((expected + rng.normal(0, 0.5 * np.sqrt(others + noise**2))) / STEP) - 0.5)
    found = interval_evidence(expected, others, low, low + STEP, np.log([noise]))
    assert found == pytest.approx(log_share(expected, others + noise**2, low, low + STEP).sum(), rel=1e-4)


@pytest.mark.parametrize("noise", [0.08, 0.3])
def test_the_evidence_is_largest_at_the_noise_that_was_drawn(noise: float) -> None:
    rng = np.random.default_rng(2)
    expected, others = rng.uniform(-1, 1, 100_000), rng.uniform(0.01, 0.03, 100_000)
    low = STEP * (np.round((expected + rng.normal(0, np.sqrt(others + noise**2))) / STEP) - 0.5)
    log_noise = np.log(noise) + np.array([-0.2, -0.1, 0.0, 0.1, 0.2])
    assert np.argmax(interval_evidence(expected, others, low, low + STEP, log_noise)) == 2


def test_readings_that_never_leave_a_step_tell_small_noises_not_apart() -> None:
    middle, half = np.zeros(500), STEP / 2
    found = interval_evidence(middle, middle + 1e-4, middle - half, middle + half, np.log([0.01, 0.05, 0.3, 0.6]))
    assert found[0] == pytest.approx(found[1], abs=1e-3)
    assert found[1] > found[2] + 100 > found[3] + 200


def test_the_evidence_of_residuals_is_that_of_as_many_normal_numbers() -> None:
    residual, at = np.random.default_rng(3).normal(0, 0.2, 400), np.log(0.15)
    square = float(residual @ residual)
    log_noise = np.log([0.1, 0.15, 0.2, 0.3])
    exact = norm.logpdf(residual[:, None], scale=np.exp(log_noise)).sum(axis=0)
    found = residual_evidence(square / np.exp(2 * at) - 400, 400, at, log_noise)
    assert found - found[0] == pytest.approx(exact - exact[0])


@pytest.mark.parametrize("noise", [0.2, *slow(0.1, 0.4)])
@pytest.mark.parametrize("deviation", [0.3, 1.0])
def test_settled_rounds_give_the_slope_of_the_exact_evidence(noise: float, deviation: float) -> None:
    """One acceleration read 30 times, its evidence by summing over a grid of accelerations."""
    rng = np.random.default_rng(round(100 * noise))
    slopes = []
    for _ in range(8):
        true = deviation * rng.standard_normal()
        drawn = np.clip(rng.standard_normal(30), -2, 2)  # what is farther out is taken for a hole
        reading = STEP * np.round((true + noise * drawn) / STEP)
        low, high = bounds(reading, np.zeros(30), STEP)

        def evidence(log_noise: float, low: np.ndarray = low, high: np.ndarray = high) -> float:
            likely = norm.logpdf(GRID, scale=deviation)
            for value, times in zip(*np.unique(low, return_counts=True), strict=True):
                share = np.diff(norm.cdf([(value - GRID) / np.exp(log_noise),
                                          (value + high[0] - low[0] - GRID) / np.exp(log_noise)]), axis=0)[0]
                likely = likely + times * np.log(np.maximum(share, 1e-300))
            return float(np.log(np.sum(np.exp(likely - likely.max()))) + likely.max())

        sensor = Sensor(noise, STEP)
        readings = GaussianReadings(reading, np.full(len(reading), sensor.variance_mps2_2))
        for _ in range(80):
            variance = 1 / (deviation**-2 + (1 / readings.variance).sum())
            fitted = np.full(30, variance * (readings.value_mps2 / readings.variance).sum())
            expected, others = without_own(readings, fitted, variance)
            readings = improved(readings, low, high, expected, others, sensor.noise_rms_mps2**2)
        at = np.log(noise)
        either = interval_evidence(expected, others, low, high, np.array([at - H, at + H]))
        found = (either[1] - either[0]) / (2 * H)
        slopes.append((found, (evidence(at + H) - evidence(at - H)) / (2 * H)))
    found_slopes, exact = np.array(slopes).T
    assert np.sqrt(np.mean((found_slopes - exact) ** 2)) < 0.1 * np.sqrt(np.mean(exact**2)) + 0.1


def test_nothing_read_says_nothing() -> None:
    none = np.empty(0)
    assert interval_evidence(none, none, none, none, np.log([0.1, 0.2])) == pytest.approx([0.0, 0.0])


def smooth_motion(count: int) -> SteadyMotion:
    """White up to a tenth of the rate of 1 Hz, then it falls."""
    f_hz = np.fft.rfftfreq(count)
    psd = 1 / (1 + (f_hz / 0.1) ** 4)
    return SteadyMotion(0.6 * psd / psd.mean(), 1.0)


def test_even_readings_leave_what_algebra_says() -> None:
    motion = SteadyMotion(np.full(129, 0.08), 1.0)
    variance = np.geomspace(0.01, 0.5, 256)
    others, even = cavity(motion, variance)
    assert others == pytest.approx(np.full(256, 0.04), rel=0.01)
    assert cavity(motion, np.full(256, 0.02))[1] == pytest.approx(np.full(256, 0.02), rel=0.01)
    assert even.min() > variance.min() and even.max() < variance.max()


@pytest.mark.parametrize("clustered", [0.0, 8.0])
def test_uneven_readings_leave_what_dense_algebra_says(clustered: float) -> None:
    """A process that is known to be smooth, read well here and badly there, one by one or for some time."""
    rng = np.random.default_rng(3)
    count = 800
    motion = smooth_motion(count)
    lag = np.abs(np.arange(count)[:, None] - np.arange(count))
    covariance = np.fft.irfft(motion.psd) * motion.rate_hz / 2
    prior = covariance[np.minimum(lag, count - lag)] + 1e-12 * np.eye(count)
    walk = np.exp(-0.5 * (lag / clustered) ** 2) @ rng.normal(size=count) if clustered else rng.normal(size=count)
    variance = 0.1 * np.exp(1.5 * walk / walk.std())

    inverse = np.linalg.inv(prior + np.diag(variance))
    exact = 1 / np.diag(inverse) - variance
    found, each = cavity(motion, variance)
    assert np.log(found / exact).mean() == pytest.approx(0.0, abs=0.1)
    assert np.log(found / exact).std() < 0.6 * np.log(exact).std()
    by_mean_precision = 1 / motion.covariance_left(1 / np.mean(1 / variance))[0]
    assert by_mean_precision > 1.1 * np.mean(1 / exact + 1 / variance)

    freedom = np.trace(prior @ inverse) / count
    assert np.mean(motion.resolved_per_reading(each)) == pytest.approx(freedom, rel=0.06)
    assert motion.resolved_per_reading(1 / np.mean(1 / variance)) > 1.15 * freedom


@pytest.mark.parametrize("counts", [(1000,), (400, 600), (5, 990, 5)])
def test_a_parked_car_is_evidence_against_larger_noises_alone(counts: tuple[int, ...]) -> None:
    """Above its largest value as summing over fine levels gives it; below, all noises are alike."""
    noise, steps = np.geomspace(0.03, 1.0, 60), np.arange(len(counts))
    level = np.linspace(-0.5, len(counts) - 0.5, 20_001)[:, None]
    exact = []
    for one in noise:
        away = (steps - level) / one
        share = norm.sf(np.abs(away) - 0.5 / one) - norm.sf(np.abs(away) + 0.5 / one)
        by_level = np.log(np.maximum(share, 1e-30)) @ np.array(counts)
        exact.append(by_level.max() + np.log(np.exp(by_level - by_level.max()).mean()))
    at = int(np.argmax(exact))
    found = parked_evidence(steps, np.array(counts), np.log(noise))
    assert found[at:] == pytest.approx(np.array(exact[at:]), abs=0.15)
    assert found[:at] == pytest.approx(np.full(at, found[at]))


# --- what is believed ---


USUAL = NoiseBelief.guessed(0.1)


def test_a_drive_of_quadratic_stretches() -> None:
    """Each says where it would have the noise, with the scatter that its information allows."""
    rng = np.random.default_rng(4)
    off = []
    for _ in range(40):
        learner = NoiseLearner(USUAL, USUAL, 0.0)
        for _ in range(60):
            says = np.log(0.15) + rng.normal(0, 30**-0.5)
            learner.take(-15 * (learner.log_noise - says) ** 2)
        off.append((learner.belief.log_mean - np.log(0.15)) / learner.belief.log_std)
    assert learner.stretches == 60
    assert abs(np.mean(off)) < 0.5
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 1.3


def test_a_drive_s_first_stretches_count_as_its_last() -> None:
    """A noise is a constant of the sensor: at the end the same is believed of it, in whatever order it was heard."""
    says = np.log(0.1) + np.linspace(-0.5, 0.5, 30)
    ahead, back = (NoiseLearner(USUAL, USUAL, STEP) for _ in range(2))
    for one, other in zip(says, says[::-1], strict=True):
        ahead.take(-10 * (ahead.log_noise - one) ** 2)
        back.take(-10 * (back.log_noise - other) ** 2)
    assert ahead.belief.log_mean == pytest.approx(back.belief.log_mean, abs=1e-9)
    assert ahead.belief.log_std == pytest.approx(back.belief.log_std, rel=1e-9)


def test_stretches_that_disagree_more_than_they_should_make_it_less_certain() -> None:
    calm, wild = (NoiseLearner(USUAL, USUAL, 0.0) for _ in range(2))
    for number in range(60):
        for learner, off in ((calm, 0.05), (wild, 2.0)):
            learner.take(-10 * (learner.log_noise - USUAL.log_mean - off * (-1) ** number) ** 2)
    assert wild.belief.log_std > 2 * calm.belief.log_std


@pytest.mark.parametrize("usual", [0.02, 0.1, 0.5])
def test_a_noise_is_found_at_once_from_far_off(usual: float) -> None:
    """Evidence bends where the noise is and not where one begins: steps by slope and bend there crawl (0.16 a stretch
    at 4 g from three times the noise)."""
    rng = np.random.default_rng(5)
    begin = NoiseBelief.guessed(usual)
    learner = NoiseLearner(begin, begin, STEP)
    for _ in range(8):
        expected = rng.uniform(-1, 1, 200)
        low = STEP * (np.round((expected + rng.normal(0, 0.15, 200)) / STEP) - 0.5)
        learner.take(interval_evidence(expected, np.full(200, 1e-3), low, low + STEP, learner.log_noise))
    assert learner.belief.noise_rms_mps2 == pytest.approx(0.15, rel=0.2)


def test_an_upper_bound_leaves_the_belief_below_it_as_it_was() -> None:
    learner = NoiseLearner(USUAL, USUAL, STEP)
    for _ in range(50):
        learner.take(-np.exp(4 * (learner.log_noise - np.log(0.3))))
    assert 0.04 < learner.belief.noise_rms_mps2 < 0.1
    assert 0.5 < learner.belief.log_std <= 1.0


def readings_of_a_stand(noise: float, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Steps and how many of so many readings were on each, of a level within a step and a noise, in steps."""
    found = np.rint(0.2 + noise * np.random.default_rng(seed).standard_normal(count))
    steps = np.arange(found.min(), found.max() + 1)
    return steps, np.array([np.count_nonzero(found == one) for one in steps], dtype=np.float64)


@pytest.mark.parametrize("count", [1000, 60_000, 240_000])
def test_however_long_a_stand_it_only_bounds_the_noise(count: int) -> None:
    """What shakes an idling car is not the sensor's: less stays possible, and what was learned stays known."""
    shaken = NoiseLearner(USUAL, USUAL, STEP)
    shaken.take(parked_evidence(*readings_of_a_stand(0.25 / STEP, count, 1), shaken.log_noise - np.log(STEP)))
    assert shaken.belief.noise_rms_mps2 < 0.25
    assert abs(shaken.belief.log_mean - USUAL.log_mean) < 1.5 * shaken.belief.log_std
    rng = np.random.default_rng(2)
    learned = NoiseLearner(USUAL, USUAL, STEP)
    for _ in range(60):
        expected = rng.uniform(-1, 1, 200)
        low = STEP * (np.round((expected + rng.normal(0, 0.3, 200)) / STEP) - 0.5)
        learned.take(interval_evidence(expected, np.full(200, 1e-3), low, low + STEP, learned.log_noise))
    before = learned.belief
    learned.take(parked_evidence(*readings_of_a_stand(0.3 / STEP, count, 3), learned.log_noise - np.log(STEP)))
    assert abs(learned.belief.log_mean - before.log_mean) < 2 * before.log_std
    assert learned.belief.log_std < 2 * before.log_std


def test_within_a_service_that_runs_for_weeks_each_drive_begins_less_certain() -> None:
    learner = NoiseLearner(USUAL, USUAL, 0.0)
    for _ in range(40):
        learner.take(-100 * (learner.log_noise - np.log(0.2)) ** 2)
    driven = learner.belief
    learner.next_drive()
    assert learner.belief.log_mean == driven.log_mean
    assert learner.belief.log_std == pytest.approx(driven.next_drive().log_std)
    for _ in range(20):
        learner.take(-100 * (learner.log_noise - np.log(0.3)) ** 2)
    assert learner.belief.noise_rms_mps2 == pytest.approx(0.28, abs=0.03)


@settings(deadline=None)
@given(noise=st.floats(0.01, 1.0), share=st.floats(0.0, 2.0), std=st.floats(0.01, 0.1))
def test_rounding_is_taken_in_and_out_again(noise: float, share: float, std: float) -> None:
    belief = NoiseBelief(np.log(noise), std)
    back = belief.with_rounding(share * noise).without_rounding(share * noise)
    assert back.log_mean == pytest.approx(belief.log_mean, abs=1e-9)
    assert back.log_std == pytest.approx(std, rel=1e-9)
    assert belief.with_rounding(share * noise).noise_rms_mps2 ** 2 == pytest.approx(
        noise**2 * (1 + share**2 / 12), rel=1e-9)


def test_the_next_drive_begins_a_little_less_certain() -> None:
    belief = NoiseBelief(np.log(0.15), 0.04)
    assert belief.log_std < belief.next_drive().log_std < 0.08
    assert belief.next_drive().log_mean == belief.log_mean
    assert NoiseBelief(0.0, 1.0).next_drive().log_std == 1.0
    assert belief.std_mps2 == pytest.approx(0.006)


# --- drives ---


@cache
def felt() -> tuple[np.ndarray, np.ndarray]:
    """Acceleration and distance of 70 s at 14 m/s on a road of IRI 2.5."""
    car = structure_of(read_vehicle(vehicle_file("rav4-2009")))
    road = Track(0.05, iso8608.generate(iso8608.gd_n0_from_iri(2.5), 1050, 0.05, 5), -20.0)
    time_s = np.arange(7000) / 100
    return drive(car, [body_point(car)], road, time_s, 14.0 * time_s)[:, 0], 14.0 * time_s


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "guess", "step"), [(0.2, 0.1, 0.613), (0.3, 0.1, 0.613), (0.12, 0.05, 0.0)])
def test_the_noise_of_a_drive_is_found(noise: float, guess: float, step: float) -> None:
    accel, way = felt()
    reading = accel + 9.81 + noise * np.random.default_rng(6).standard_normal(len(accel))
    if step:
        reading = step * np.round(reading / step)
    car = structure_of(read_vehicle(vehicle_file("rav4-2009")))
    before = NoiseBelief.guessed(guess)
    estimator = RoadEstimator(LinearCar(car, body_point(car)), Sensor(guess, step), 7.62, noise=before)
    estimator.push(reading, np.ones(len(way), dtype=bool), np.zeros(len(way)), way)
    found = estimator.road.noise
    assert found is not None
    assert found.log_std < 0.15
    assert abs(found.log_mean - np.log(noise)) < 2.5 * found.log_std
    taken = RoadEstimator(LinearCar(car, body_point(car)), Sensor(guess, step), 7.62)
    assert taken.road.noise is None


@pytest.mark.slow
def test_where_readings_toggle_the_error_of_the_noise_is_not_said_too_small() -> None:
    """A road of one level, IRI 1, and gravity on an edge: twice the noise on twice the road is nearly as probable. At
    one level for all noises they were 3.0, 5.9 and 2.5 of their standard errors off."""
    accel, way = felt()
    car, step, noise, off = structure_of(read_vehicle(vehicle_file("rav4-2009"))), 1.226, 0.15, []
    for seed in (10, 11, 12):
        drawn = noise * np.random.default_rng(seed).standard_normal(len(accel))
        reading = step * np.round((0.4 * accel + 8.5 * step + drawn) / step)
        estimator = RoadEstimator(LinearCar(car, body_point(car)), Sensor(0.1, step), 7.62,
                                  noise=NoiseBelief.guessed(0.1))
        estimator.push(reading, np.ones(len(way), dtype=bool), np.zeros(len(way)), way)
        found = estimator.road.noise
        assert found is not None
        off.append((found.log_mean - np.log(noise)) / found.log_std)
    assert np.sqrt(np.mean(np.square(off))) < 3.0


@pytest.mark.parametrize(("noise", "guess"), [(0.02, 0.3), (0.15, 0.3)])
def test_a_stand_bounds_the_noise_once_the_car_drives_off(noise: float, guess: float) -> None:
    """A chip that does not toggle has less than its steps would show; one that does is never found too quiet."""
    car = structure_of(read_vehicle(vehicle_file("rav4-2009")))
    step, count = 1.23, 4000
    reading = 8 * step + noise * np.random.default_rng(7).standard_normal(count)
    way = np.concatenate([np.zeros(3600), 0.01 * np.arange(400)])
    estimator = RoadEstimator(LinearCar(car, body_point(car)), Sensor(guess, step), 7.62,
                              noise=NoiseBelief.guessed(guess))
    everything = np.ones(count, dtype=bool), np.zeros(count)
    estimator.push(step * np.round(reading / step)[:3600], everything[0][:3600], everything[1][:3600], way[:3600])
    assert estimator.road.noise_stretches == 0
    estimator.push(step * np.round(reading / step)[3600:], everything[0][3600:], everything[1][3600:], way[3600:])
    assert estimator.road.noise_stretches == 1
    found = estimator.road.noise
    assert found is not None
    assert found.noise_rms_mps2 < 0.7 * guess
    assert found.log_mean + 2 * found.log_std > np.log(noise)


def test_a_car_that_swings_or_is_worked_at_bounds_nothing() -> None:
    car = structure_of(read_vehicle(vehicle_file("rav4-2009")))
    estimator = RoadEstimator(LinearCar(car, body_point(car)), Sensor(0.1, 0.6), 7.62, noise=USUAL)
    for swing_mps2, seconds in ((1.0, 3), (6.0, 20)):
        count = 100 * seconds
        reading = 0.6 * np.round(swing_mps2 * np.sin(2 * np.pi * 1.3 * np.arange(count) / 100) / 0.6)
        estimator.push(reading, np.ones(count, dtype=bool), np.zeros(count), np.zeros(count))
        estimator.finish()
    assert estimator.road.noise_stretches == 0


@pytest.mark.slow
@pytest.mark.parametrize("noise_steps", [0.28, *release(0.32), 0.38])
def test_the_few_readings_on_a_third_step_tell_the_noise(noise_steps: float) -> None:
    """A level at an edge, which toggles for any noise: the noise that makes most of what was read, known to be the true
    one, is found, though only some readings in a thousand tell."""
    rng = np.random.default_rng(round(100 * noise_steps))
    count = 40_000
    reading = np.rint(0.5 + noise_steps * rng.standard_normal(count))
    assert 5e-5 < np.mean((reading < 0) | (reading > 1)) < 0.02
    log_noise = np.log(np.linspace(0.15, 0.6, 451))
    evidence = interval_evidence(np.full(count, 0.5), np.full(count, 1e-6), reading - 0.5, reading + 0.5, log_noise)
    assert np.exp(log_noise[np.argmax(evidence)]) == pytest.approx(noise_steps, rel=0.04)
