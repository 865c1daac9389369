"""Roughness that differs from place to place, against exact posteriors and evidence of dense algebra."""

import tracemalloc
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from logger.estimation.car_response import CarResponse
from logger.estimation.road_solver import Block, TimeGrid
from logger.estimation.road_spectrum import RoadSpectrum
from logger.estimation.roughness import LENGTHS_M, RoadLevels, resolved_shares
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

from ..support.slow import slow

SPACING_M, COUNT, SPEED_MPS, NOISE_MPS2 = 0.1524, 1024, 18.0, 0.06
DRIFT = 0.05**2
ROAD = RoadSpectrum.of_iri(2.5)  # as rough as the common road
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


def learn(found: RoadLevels, innovations: np.ndarray, log_before: np.ndarray, gain: np.ndarray,
          seen: np.ndarray | None = None, first: int = 0, learns: bool = False) -> None:
    """What a block says from its ``first`` point on; all of it was seen where nothing is said of that."""
    read = np.ones(len(innovations)) if seen is None else seen.astype(float)
    found.learn(first, innovations, log_before, resolved_shares(log_before, gain, read), read, learns)


def settled(reading: np.ndarray, rounds: int = 16) -> RoadLevels:
    """What is learned of a block from nothing, round by round."""
    block, _, seen = a_block()
    found, start = RoadLevels(SPACING_M), None
    for _ in range(rounds):
        log_variance = found.solved_with(0, block.count)
        solution = block.solve(reading, weights(), ROAD, np.exp(log_variance), DRIFT, 12, start)
        start = solution.waves
        learn(found, np.fft.irfft(start, block.count), log_variance, solution.gain, seen)
    return found


def log_evidence(reading: np.ndarray, variance: np.ndarray) -> float:
    """log N(y; 0, B D B' + drift + noise) of what was read."""
    _, matrix, _ = a_block()
    drift = a_grid().drift.T
    covariance = (matrix * variance) @ matrix.T + (drift / a_grid().drift_precision(DRIFT)) @ drift.T
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


def test_nothing_known_is_a_common_road() -> None:
    found = RoadLevels(SPACING_M)
    assert found.at(-500, 40).tolist() == [0.0] * 40 and found.solved_with(7, 3).tolist() == [0.0] * 3


def near(count: int) -> np.ndarray:
    """(count, count) weights of neighbours, a Gaussian of 1 m on a closed grid."""
    apart = np.abs(np.arange(count)[:, None] - np.arange(count))
    weight: np.ndarray = np.exp(-0.5 * (np.minimum(apart, count - apart) * SPACING_M) ** 2)
    return weight


@pytest.mark.parametrize("variance_of", [stretches, *slow(pothole)])
def test_one_round_is_newtons_with_the_exact_posterior(variance_of: Callable[[], np.ndarray]) -> None:
    """From the posterior covariance S of dense algebra, r = 1 - S_ii / d_i: the level by one step of the evidence of a
    Student t on the posterior of a Gaussian process, then the scale by MacKay's fixed point with four points that say
    1, of whose logarithm 0.6 is taken over."""
    block, matrix, seen = a_block()
    before = variance_of()
    reading = read(before, np.random.default_rng(1))
    precision = matrix.T @ (weights()[:, None] * matrix)
    posterior = np.linalg.inv(precision + np.diag(1 / before))
    innovations = posterior @ (matrix.T @ (weights() * reading))
    resolved = 1 - np.diag(posterior) / before
    share = posterior @ precision  # of what is true at each point, in what is found
    freedom = np.einsum("ij,ji->i", share, share)
    around = near(block.count)
    power, taken, own, squares = (around @ (row * seen) for row in (
        innovations**2, resolved, freedom, innovations**2 - (resolved - freedom) * before))

    size = round(8.0 / SPACING_M)
    cells = np.arange(block.count) // size
    cells = cells - cells[np.flatnonzero(seen)[0]]
    inside = cells >= 0
    each = seen / around[0].sum()
    slope = np.bincount(cells[inside], (2 * (squares - own) / (4 + squares) * each)[inside])
    bend = np.bincount(cells[inside], (2 * own / (4 + own) * each)[inside])
    apart_m = size * SPACING_M * np.abs(np.subtract.outer(np.arange(len(bend)), np.arange(len(bend))))
    prior = np.tensordot([0.05, 0.15, 1.8**2], np.exp(-apart_m / LENGTHS_M[:, None, None]), 1)
    level = np.clip(np.linalg.solve(np.linalg.inv(prior) + np.diag(bend), slope), -0.7, 0.7)
    scale = (4 + power[inside] * np.exp(-level[cells[inside]])) / (4 + taken[inside])
    expected = level[cells[inside]] + 0.6 * np.log(scale) + 0.4 * (np.log(before[inside]) - level[cells[inside]])

    found, gain = RoadLevels(SPACING_M), block.solve(reading, weights(), ROAD, before, DRIFT, 1).gain
    learn(found, innovations, np.log(before), gain, seen)
    chosen = np.flatnonzero(seen)[40:-40]
    expected = expected[chosen - np.flatnonzero(inside)[0]]
    assert np.std(expected - np.log(before[chosen])) > 0.3  # there is something to learn
    assert found.solved_with(0, block.count)[chosen] == pytest.approx(expected, abs=0.08)


@pytest.mark.parametrize("variance_of", [stretches, pothole])
@pytest.mark.parametrize("seed", [10, *slow(11)])
def test_what_is_settled_on_explains_the_readings(variance_of: Callable[[], np.ndarray], seed: int) -> None:
    """Of the evidence that the true variances gain over a road as rough everywhere, most is gained."""
    reading = read(variance_of(), np.random.default_rng(seed))
    found = np.exp(settled(reading).solved_with(0, a_block()[0].count))
    even, found, true = (
        log_evidence(reading, variance) for variance in (np.ones(a_block()[0].count), found, variance_of()))
    assert true - even > 100
    assert found - even > 0.75 * (true - even)


def test_a_gaussian_road_stays_as_rough_everywhere() -> None:
    block, _, seen = a_block()
    scatter = []
    for seed in range(8):
        found = settled(read(np.ones(block.count), np.random.default_rng(100 + seed))).solved_with(0, block.count)
        assert np.abs(found[seen]).max() < 1.4
        scatter.append(found[seen])
    assert abs(np.mean(scatter)) < 0.15 and np.std(scatter) < 0.35


def scores_of(log_variance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Errors of the mean log variance over stretches of 8 m, in standard errors."""
    _, _, seen = a_block()
    found = settled(read(np.exp(log_variance), rng))
    off = found.at(0, len(log_variance)) - log_variance
    inside = np.flatnonzero(seen)
    firsts = range(inside[0], inside[-1] - 52, 52)
    return np.array([off[first:first + 52].mean() / found.log_std(first, 52) for first in firsts])


@pytest.mark.slow
def test_the_error_of_a_road_whose_processes_are_as_believed() -> None:
    """Log variance drawn from the prior: the processes, and a scale every 2.5 m as four points give it."""
    count, scores = a_block()[0].count, []
    apart_m = SPACING_M * np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    by_length = np.exp(-apart_m / LENGTHS_M[:, None, None])
    root = np.linalg.cholesky(np.tensordot(RoadLevels(SPACING_M).variances, by_length, 1))
    for seed in range(16):
        rng = np.random.default_rng(200 + seed)
        scale = np.repeat(np.log(4 / rng.chisquare(4, count // 16 + 1)), 16)[:count]
        scores.append(scores_of(np.clip(root @ rng.standard_normal(count), -3, 3) + scale, rng))
    score = np.concatenate(scores)
    assert abs(np.mean(score)) < 0.38  # a mean of variances is above that of their logarithms
    assert 0.6 < np.sqrt(np.mean(score**2)) < 1.3


@pytest.mark.parametrize("longest_lost_m", [0.0, 5.0, 10.0])
def test_the_mean_variance_of_a_gaussian_road_is_right_however_little_is_resolved(longest_lost_m: float) -> None:
    """By an exact Wiener filter for the waves that are longer: as steps hide the short ones of a slow drive."""
    count, true, gain_there = 4096, 0.5, 20.0
    rng, found = np.random.default_rng(4), RoadLevels(SPACING_M)
    gain = gain_there * (np.fft.rfftfreq(count, SPACING_M) * longest_lost_m < 1)
    means = []
    for _ in range(12):
        white = np.fft.rfft(np.sqrt(true) * rng.standard_normal(count) + rng.standard_normal(count)
                            / np.sqrt(gain_there))
        log_before = found.solved_with(0, count)
        strength = gain * np.exp(log_before.mean())
        innovations = np.fft.irfft(white * strength / (1 + strength), count)
        for _ in range(4):
            learn(found, innovations, log_before, gain)
        # log normal, of this mean logarithm and variance
        means.append(np.exp(found.at(0, count) + 0.5 * found.log_std(0, count) ** 2).mean())
    assert np.mean(means[4:]) == pytest.approx(true, rel=0.15)


def test_a_step_of_the_level_is_followed_within_some_metres() -> None:
    """Eight times smoother behind a joint of two surfaces: no roughness leaks into what comes 10 m after it."""
    block, _, seen = a_block()
    step = np.where(np.arange(block.count) < 600, 4.0, 0.5)
    behind = slice(600 + 66, np.flatnonzero(seen)[-1] - 66)
    found = [float(settled(read(step, np.random.default_rng(20 + seed))).at(0, block.count)[behind].mean())
             for seed in range(6)]
    assert np.mean(found) == pytest.approx(np.log(0.5), abs=0.35)


@pytest.mark.slow
def test_a_pothole_raises_no_level() -> None:
    """A hundred times the variance over 0.8 m: 15 m from it the road is as rough as without it."""
    block, _, _ = a_block()
    beside = [slice(700 - 200, 700 - 100), slice(700 + 106, 700 + 206)]
    with_hole, without = (
        np.mean([settled(read(variance, np.random.default_rng(30 + seed))).at(0, block.count)[part]
                 for seed in range(4) for part in beside])
        for variance in (pothole(), np.ones(block.count)))
    assert with_hole == pytest.approx(without, abs=0.15)


def learned_from(first: int, innovations: np.ndarray, found: RoadLevels) -> None:
    """A block that shows its innovations exactly, until it settles."""
    count = len(innovations)
    for _ in range(16):
        learn(found, innovations, found.solved_with(first, count), np.full(count // 2 + 1, 1e6), first=first)


def test_what_blocks_behind_have_shown_counts_as_if_all_were_one_block() -> None:
    """The filter that carries it is exact: the same levels and errors as from one long block."""
    size = round(8.0 / SPACING_M)
    innovations = np.random.default_rng(3).standard_normal(60 * size) * np.repeat([1.0, 3.0, 0.5], 20 * size)
    whole, parts = RoadLevels(SPACING_M), RoadLevels(SPACING_M)
    learned_from(0, innovations, whole)
    learned_from(0, innovations[:40 * size], parts)
    learned_from(24 * size, innovations[24 * size:], parts)
    inner = 42 * size, 16 * size
    assert parts.at(*inner) == pytest.approx(whole.at(*inner), abs=0.02)
    assert parts.log_std(*inner) == pytest.approx(whole.log_std(*inner), rel=0.02)
    alone = RoadLevels(SPACING_M)
    learned_from(24 * size, innovations[24 * size:], alone)
    assert abs(alone.at(24 * size, size) - whole.at(24 * size, size)).max() > 0.02  # it has no road behind it


def test_what_is_learned_is_kept_by_place() -> None:
    """Points have their numbers whatever block they lie in; what no block has seen yet goes on as the last one."""
    rng = np.random.default_rng(3)
    found = RoadLevels(SPACING_M)
    learned_from(-40, rng.standard_normal(512) * np.repeat([1.0, 5.0], 256), found)
    whole = found.solved_with(-40, 512)
    assert whole[300:480].mean() > whole[40:220].mean() + 2.5
    part = found.solved_with(60, 600)
    assert part[:412].tolist() == whole[100:].tolist() and part[460:].std() < 1e-9


def test_readings_that_tell_nothing_teach_nothing() -> None:
    found = RoadLevels(SPACING_M)
    learn(found, np.zeros(256), np.zeros(256), np.full(129, 1e-9))
    assert found.solved_with(0, 256) == pytest.approx(np.zeros(256), abs=1e-4)
    assert found.log_std(0, 100) == pytest.approx(np.sqrt(1.8**2 + 0.2 + 0.5), rel=0.05)
    learn(found, np.zeros(256), np.full(256, 2.0), np.full(129, 1e3), np.zeros(256))
    assert found.solved_with(0, 256) == pytest.approx(np.zeros(256), abs=1e-4)


def test_a_hole_that_was_looked_for_elsewhere_makes_no_road_smooth() -> None:
    """Innovations of a common road of which little is resolved, while one point was believed to be a large hole: it is
    not there. The level, and how much levels are believed to differ, stay."""
    rng, gain, found = np.random.default_rng(6), np.geomspace(1e-7, 0.3, 513), RoadLevels(SPACING_M)
    shares = np.sqrt(gain / (1 + gain))
    for number in range(30):
        innovations = np.fft.irfft(shares * np.fft.rfft(rng.standard_normal(1024)), 1024)
        believed = np.zeros(1024)
        believed[100 + 25 * number] = 16.0
        innovations[100 + 25 * number] = 0.0
        learn(found, innovations, believed, gain, learns=True)
    assert found.solved_with(0, 1024).mean() == pytest.approx(0.0, abs=1.0)
    assert found.variances.max() < 4


def test_less_power_than_expected_makes_a_road_as_much_smoother_as_more_makes_it_rougher() -> None:
    """Readings that resolve little, of a road as rough as believed: the mean over many draws stays where it is."""
    rng = np.random.default_rng(4)
    gain, share, found = np.full(513, 0.15), 0.15 / 1.15, []
    for _ in range(300):
        one = RoadLevels(SPACING_M)
        learn(one, np.sqrt(share) * rng.standard_normal(1024), np.zeros(1024), gain)
        found.append(one.solved_with(0, 1024).mean())
    assert np.mean(found) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("variance", [
    np.ones(300), np.full(300, 3.7), 4.0 ** np.sin(np.arange(300) / 20), np.where(np.arange(300) == 150, 900.0, 0.3),
])
def test_mean_reported_is_the_mean_over_points(variance: np.ndarray) -> None:
    gain = np.geomspace(1e-4, 1e4, 41)
    direct = (variance[:, None] * gain / (1 + variance[:, None] * gain)).mean(axis=0)
    tolerance = 1e-12 if np.ptp(variance) == 0 else 2e-3
    seen = np.append(np.ones(300), np.zeros(50))
    found = resolved_shares(np.append(np.log(variance), np.full(50, 3.0)), gain, seen)
    assert found.waves == pytest.approx(direct, abs=tolerance)


def learned_over_drives(variance: np.ndarray) -> tuple[float, RoadLevels]:
    """Scatter of the log variance over the road that was read, over the last of twelve drives; and what is believed."""
    block, _, seen = a_block()
    rng, scatter, found = np.random.default_rng(5), [], RoadLevels(SPACING_M)
    for drive in range(12):
        reading, start = read(variance, rng), None
        for left in reversed(range(4)):
            before = found.solved_with(0, block.count)
            solution = block.solve(reading, weights(), ROAD, np.exp(before), DRIFT, 12, start)
            start = solution.waves
            learn(found, np.fft.irfft(start, block.count), before, solution.gain, seen, learns=left == 0)
        if drive > 8:
            scatter.append(found.solved_with(0, block.count)[seen].std())
    return float(np.mean(scatter)), found


@pytest.mark.slow
def test_that_a_road_is_gaussian_is_learned_and_that_it_is_patchy_is_kept() -> None:
    even, patchy = np.ones(a_block()[0].count), np.where(np.arange(a_block()[0].count) // 60 % 3 == 0, 6.0, 1.0)
    scatter, believed = learned_over_drives(even)
    of_patches, of_patchy = learned_over_drives(patchy)
    assert scatter < 0.2 < 0.5 < of_patches
    # What patches of 9 m leave to the scale of a place is not the level's.
    assert 1.5 * believed.variances[:2].sum() < of_patchy.variances[:2].sum()


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
    found, fresh = RoadLevels(SPACING_M), RoadLevels(SPACING_M)
    for innovations in [even, patchy] * 30:
        learn(found, innovations, np.zeros(count), gain, learns=True)
    learn(fresh, patchy, np.zeros(count), gain)
    scatter, unlearned = (float(one.solved_with(0, count).std()) for one in (found, fresh))
    assert scatter > 0.5 * unlearned


@pytest.mark.slow
def test_a_place_that_jumps_costs_no_memory() -> None:
    """By 60 km within a block: what is far behind is carried, and matrices stay as small as of the longest block."""
    count = 400_000
    found, gain = RoadLevels(SPACING_M), np.full(count // 2 + 1, 1.0)
    innovations = np.random.default_rng(5).standard_normal(count)
    tracemalloc.start()
    learn(found, innovations, np.zeros(count), gain)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 150e6
    assert np.isfinite(found.at(0, count)).all()


@pytest.mark.parametrize("curvature", [0.2, 5.0])
def test_the_level_comes_to_rest_whatever_the_curvature_that_bounds_lead_to(curvature: float) -> None:
    """As bounds are found that stay for a while: with the curvature that they come to, steps would be five times too
    long and run in circles."""
    block, _, seen = a_block()
    found, gain = RoadLevels(SPACING_M), np.full(block.count // 2 + 1, 1.0)
    found.curvature = curvature
    noisy = 4 * np.random.default_rng(3).standard_normal(block.count)
    for _ in range(40):
        log_variance = found.solved_with(0, block.count)
        variance = np.exp(log_variance)
        learn(found, noisy * variance / (variance + 1), log_variance, gain, seen)
    assert found.moved < 0.01
    assert found.at(0, block.count)[seen].mean() == pytest.approx(np.log(15), abs=0.4)
