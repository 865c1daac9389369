"""Roughness that differs from place to place, against exact posteriors and evidence of dense algebra."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from logger.estimation.car_response import CarResponse
from logger.estimation.local_variance import LocalRoughness, RelativeVariance, mean_resolved
from logger.estimation.road_solver import Block, TimeGrid
from logger.estimation.road_spectrum import RoadSpectrum
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

SPACING_M, COUNT, SPEED_MPS, NOISE_MPS2 = 0.1524, 1024, 18.0, 0.06
ROAD = RoadSpectrum.of_iri(3.0)
RAV4 = structure_of(read_vehicle(vehicle_file("rav4-2009")))


@cache
def a_grid() -> TimeGrid:
    return TimeGrid(CarResponse(LinearCar(RAV4, body_point(RAV4))), COUNT, 100.0)


@cache
def a_block() -> tuple[Block, np.ndarray, np.ndarray]:
    """A drive of ten seconds, its matrix B (t, count) column by column, and where the road was read."""
    block = Block(a_grid(), SPEED_MPS / 100 * np.arange(COUNT), SPACING_M, 7.62)
    unit = np.fft.rfft(np.eye(block.count), axis=1)
    matrix = np.array([block.driven(row * block.wave_factors(ROAD)) for row in unit]).T
    return block, matrix, block.seen(weights() > 0) > 0


def weights() -> np.ndarray:
    weight = np.full(COUNT, NOISE_MPS2**-2)
    weight[:250] = 0.0
    return weight


def read(variance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Readings (t,) of a road whose innovations have these variances."""
    block, matrix, _ = a_block()
    return matrix @ (np.sqrt(variance) * rng.standard_normal(block.count)) + rng.normal(0, NOISE_MPS2, COUNT)


def settled(reading: np.ndarray, rounds: int = 12) -> RelativeVariance:
    """What is learnt of a block from nothing, round by round."""
    block, _, seen = a_block()
    local = LocalRoughness(SPACING_M)
    start = None
    for _ in range(rounds):
        variance = local.at(0, block.count).variance
        solution = block.solve(reading, weights(), ROAD, variance, 12, start)
        start = solution.waves
        local.learn(0, np.fft.irfft(start, block.count), variance, solution.gain, seen.astype(float))
    return local.at(0, block.count)


def log_evidence(reading: np.ndarray, variance: np.ndarray) -> float:
    """log N(y; 0, B D B' + drift + noise) of what was read."""
    _, matrix, _ = a_block()
    drift = a_grid().drift.T
    covariance = (matrix * variance) @ matrix.T + (drift / a_grid().drift_precision) @ drift.T
    used = weights() > 0
    covariance = (covariance + NOISE_MPS2**2 * np.eye(COUNT))[np.ix_(used, used)]
    y = reading[used]
    return float(-0.5 * np.linalg.slogdet(covariance)[1] - 0.5 * y @ np.linalg.solve(covariance, y))


def stretches() -> np.ndarray:
    """Smooth and rough stretches of 25 m: deviations a factor of four apart."""
    place = SPACING_M * np.arange(a_block()[0].count)
    return np.where(place // 25 % 2 == 0, 0.25, 4.0)


def pothole() -> np.ndarray:
    variance = np.ones(a_block()[0].count)
    variance[700:706] = 400.0
    return variance


def test_nothing_known_is_as_rough_everywhere() -> None:
    found = LocalRoughness(SPACING_M).at(-500, 40)
    assert found.variance.tolist() == [1.0] * 40 and found.log_error.tolist() == [0.0] * 40


def near(count: int) -> np.ndarray:
    """(count, count) weights of neighbours, a Gaussian of 1.5 m on a closed grid."""
    apart = np.abs(np.arange(count)[:, None] - np.arange(count))
    weight: np.ndarray = np.exp(-0.5 * (np.minimum(apart, count - apart) * SPACING_M / 1.5) ** 2)
    return weight


@pytest.mark.slow
@pytest.mark.parametrize("variance_of", [stretches, pothole])
def test_one_round_is_mackays_with_the_exact_posterior(variance_of: Callable[[], np.ndarray]) -> None:
    """d is sum v^2 over sum (1 - S_ii / d_i), S the posterior covariance, both over neighbours and with the weight of
    four points that say 1; of its logarithm 0.6 is taken over."""
    block, matrix, seen = a_block()
    before = variance_of()
    reading = read(before, np.random.default_rng(1))
    posterior = np.linalg.inv(matrix.T @ (weights()[:, None] * matrix) + np.diag(1 / before))
    innovations = posterior @ (matrix.T @ (weights() * reading))
    reported = 1 - np.diag(posterior) / before
    exact = (4 + near(block.count) @ (innovations**2 * seen)) / (4 + near(block.count) @ (reported * seen))
    expected = 0.6 * np.log(exact) + 0.4 * np.log(before)

    local = LocalRoughness(SPACING_M)
    gain = block.solve(reading, weights(), ROAD, before, 1).gain
    local.learn(0, innovations, before, gain, seen.astype(float))
    found = np.log(local.at(0, block.count).variance)
    inside = np.flatnonzero(seen)[40:-40]
    assert np.std((expected - np.log(before))[inside]) > 0.4  # there is something to learn
    assert found[inside] == pytest.approx(expected[inside], abs=0.05)


@pytest.mark.parametrize("variance_of", [stretches, pothole])
@pytest.mark.parametrize("seed", [10, 11])
def test_what_is_settled_on_explains_the_readings(variance_of: Callable[[], np.ndarray], seed: int) -> None:
    """Of the evidence that the true variances gain over a road as rough everywhere, most is gained."""
    reading = read(variance_of(), np.random.default_rng(seed))
    even, found, true = (
        log_evidence(reading, variance)
        for variance in (np.ones(a_block()[0].count), settled(reading).variance, variance_of())
    )
    assert true - even > 100
    assert found - even > 0.75 * (true - even)


def test_a_gaussian_road_stays_as_rough_everywhere() -> None:
    scatter, scores = [], []
    for seed in range(8):
        found = settled(read(np.ones(a_block()[0].count), np.random.default_rng(100 + seed)))
        log_variance = np.log(found.variance[a_block()[2]])
        assert np.abs(log_variance).max() < 1.2
        scatter.append(log_variance)
        scores.append(log_variance / np.sqrt(found.log_error[a_block()[2]]))
    assert abs(np.mean(scatter)) < 0.1 and np.std(scatter) < 0.35
    assert np.sqrt(np.mean(np.square(scores))) == pytest.approx(1.0, abs=0.25)


def test_the_error_of_a_road_that_changes_slowly() -> None:
    """Log d as a random curve over some ten metres with a deviation of 0.8: off by about as much as is said."""
    block, _, seen = a_block()
    scores = []
    for seed in range(8):
        rng = np.random.default_rng(200 + seed)
        curve = np.fft.rfft(rng.standard_normal(block.count)) * np.exp(-0.5 * (block.wave_number_cpm * 40) ** 2)
        log_variance = np.fft.irfft(curve, block.count)
        log_variance *= 0.8 / log_variance.std()
        found = settled(read(np.exp(log_variance), rng))
        scores.append((np.log(found.variance) - log_variance)[seen] / np.sqrt(found.log_error[seen]))
    assert abs(np.mean(scores)) < 0.5  # a mean of variances is above that of their logarithms
    assert 0.7 < np.sqrt(np.mean(np.square(scores))) < 1.6


def test_what_is_learnt_is_kept_by_place() -> None:
    """Points have their numbers whatever block they lie in; what no block has seen yet is as rough as any."""
    rng = np.random.default_rng(3)
    local, gain = LocalRoughness(SPACING_M), np.full(129, 1e3)
    innovations = rng.standard_normal(256) * np.repeat([1.0, 5.0], 128)
    local.learn(-40, innovations, np.ones(256), gain, np.ones(256))
    whole = local.at(-40, 256)
    assert whole.variance[160:240].min() > 3 > whole.variance[40:100].max()
    part = local.at(60, 400)
    assert (part.variance[:156] == whole.variance[100:]).all() and (part.variance[156:] == 1.0).all()
    assert (part.log_error[:156] == whole.log_error[100:]).all() and (part.log_error[156:] == 0.0).all()
    assert (local.at(-1000, 100).variance == 1.0).all()


def test_readings_that_tell_nothing_teach_nothing() -> None:
    local = LocalRoughness(SPACING_M)
    local.learn(0, np.zeros(256), np.full(256, 1.0), np.full(129, 1e-9), np.ones(256))
    assert local.at(0, 256).variance == pytest.approx(np.ones(256), rel=1e-6)
    local.learn(0, np.zeros(256), np.full(256, 7.0), np.full(129, 1e3), np.zeros(256))
    assert local.at(0, 256).variance.tolist() == [1.0] * 256


@pytest.mark.parametrize("variance", [
    np.ones(300), np.full(300, 3.7), 4.0 ** np.sin(np.arange(300) / 20), np.where(np.arange(300) == 150, 900.0, 0.3),
])
def test_mean_reported_is_the_mean_over_points(variance: np.ndarray) -> None:
    gain = np.geomspace(1e-4, 1e4, 41)
    direct = (variance[:, None] * gain / (1 + variance[:, None] * gain)).mean(axis=0)
    tolerance = 1e-12 if np.ptp(variance) == 0 else 2e-3
    assert mean_resolved(gain, variance) == pytest.approx(direct, abs=tolerance)
    assert mean_resolved(gain, np.empty(0)) == pytest.approx(gain / (1 + gain))


def scatter_of_what_is_learnt(true_variance: np.ndarray, learns: bool) -> float:
    """Of log d over the road that was read, mean over the last of twelve drives."""
    block, _, seen = a_block()
    rng = np.random.default_rng(5)
    local = LocalRoughness(SPACING_M)
    found = []
    for drive in range(12):
        reading, start = read(true_variance, rng), None
        for turn in range(4):
            variance = local.at(0, block.count).variance if turn else np.ones(block.count)
            solution = block.solve(reading, weights(), ROAD, variance, 12, start)
            start = solution.waves
            local.learn(0, np.fft.irfft(start, block.count), variance, solution.gain, seen.astype(float), 1.0,
                        learns and turn == 3)
        if drive > 8:
            found.append(np.log(local.at(0, block.count).variance[seen]).std())
    return float(np.mean(found))


@pytest.mark.slow
def test_that_a_road_is_gaussian_is_learnt_and_that_it_is_patchy_is_kept() -> None:
    block, _, _ = a_block()
    even = np.ones(block.count)
    patchy = np.where(np.arange(block.count) // 60 % 3 == 0, 6.0, 1.0)
    assert scatter_of_what_is_learnt(even, learns=True) < 0.5 * scatter_of_what_is_learnt(even, learns=False)
    assert scatter_of_what_is_learnt(patchy, learns=True) > 0.9 * scatter_of_what_is_learnt(patchy, learns=False)


def test_what_readings_are_about_a_point_is_weighed_as_its_innovation_shows_in_them() -> None:
    block, matrix, seen = a_block()
    lag = np.arange(COUNT)[:, None] - np.arange(COUNT)
    row = np.exp(-0.5 * (lag / 30) ** 2) @ np.random.default_rng(6).standard_normal(COUNT)
    power = matrix**2
    exact = (row @ power / power.sum(axis=0))[seen]
    inner = slice(60, -60)
    assert np.corrcoef(block.about(row)[seen][inner], exact[inner])[0, 1] > 0.97
    assert block.about(np.full(COUNT, 0.3)) == pytest.approx(np.full(block.count, 0.3))


def test_an_even_block_counts_against_scatter_no_more_than_a_patchy_one_for_it() -> None:
    """Slow waves alone are resolved, so that chance makes means scatter much; one block shows none at all."""
    count = 1024
    rng = np.random.default_rng(7)
    gain = np.where(np.arange(count // 2 + 1) < 12, 1e4, 1e-9)
    slow = np.fft.irfft(np.fft.rfft(rng.standard_normal(count)) * (gain > 1), count)
    patchy = slow * np.where(np.arange(count) // 100 % 3 == 0, 3.0, 0.3)
    even = np.full(count, float(slow.std()))
    local = LocalRoughness(SPACING_M)
    for innovations in [even, patchy] * 30:
        local.learn(0, innovations, np.ones(count), gain, np.ones(count), learns=True)
    fresh = LocalRoughness(SPACING_M)
    fresh.learn(0, patchy, np.ones(count), gain, np.ones(count))
    scatter, unlearnt = (float(np.log(one.at(0, count).variance).std()) for one in (local, fresh))
    assert scatter > 0.5 * unlearnt
