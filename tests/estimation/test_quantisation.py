"""Readings as bounds, against posteriors by brute force."""

import numpy as np
import pytest
from scipy.stats import norm

from logger.estimation.quantisation import GaussianReadings, bounds, improved, standing_for, unexplained, without_own
from logger.estimation.sensor_noise import Sensor

COARSE = Sensor(noise_rms_mps2=0.1, step_mps2=0.6)
GRID = np.linspace(-6.0, 6.0, 24_001)


def exact(deviation: float, low: np.ndarray, high: np.ndarray, sensor: Sensor) -> tuple[float, float]:
    """Mean and standard deviation of one acceleration that was read several times, by summing over a grid."""
    log_posterior = norm.logpdf(GRID, scale=deviation)
    for below, above in zip(low, high, strict=True):
        ends = [(end - GRID) / sensor.noise_rms_mps2 for end in (below, above)]
        mirrored = [np.where(ends[0] > 0, -end, end) for end in ends]  # differences in the lower tail keep their digits
        log_posterior = log_posterior + np.log(np.abs(norm.cdf(mirrored[1]) - norm.cdf(mirrored[0])) + 1e-300)
    posterior = np.exp(log_posterior - log_posterior.max())
    posterior /= posterior.sum()
    mean = float(posterior @ GRID)
    return mean, float(np.sqrt(posterior @ (GRID - mean) ** 2))


def by_rounds(
    deviation: float, reading: np.ndarray, at_end: np.ndarray, sensor: Sensor, rounds: int = 60
) -> tuple[float, float]:
    """The same as the estimator finds it, with the exact solution of this tiny problem in between."""
    readings = GaussianReadings(reading, np.full(len(reading), sensor.variance_mps2_2))
    low, high = bounds(reading, at_end, sensor.step_mps2)
    for _ in range(rounds):
        variance = 1 / (deviation**-2 + (1 / readings.variance).sum())
        mean = variance * (readings.value_mps2 / readings.variance).sum()
        readings = improved(readings, low, high, *without_own(readings, np.full(len(reading), mean), variance),
                            sensor.noise_rms_mps2**2)
    return mean, np.sqrt(variance)


@pytest.mark.parametrize("deviation", [0.05, 0.3, 1.5])
@pytest.mark.parametrize(
    "steps",
    [(0,), (1,), (0, 0, 0), (0,) * 20, (0, 1), (0, 1, 0, 1, 1, 0), (0,) * 9 + (1,), (2, 2, 3)],
    ids=["once", "once, off", "thrice", "never toggles", "toggles once", "toggles", "at times", "off"],
)
def test_one_acceleration_read_again_and_again(deviation: float, steps: tuple[int, ...]) -> None:
    reading = COARSE.step_mps2 * np.array(steps, dtype=float)
    here = np.zeros(len(reading))
    mean, spread = exact(deviation, *bounds(reading, here, COARSE.step_mps2), COARSE)
    found_mean, found_spread = by_rounds(deviation, reading, here, COARSE)
    assert found_mean == pytest.approx(mean, abs=0.12 * spread)
    assert found_spread == pytest.approx(spread, rel=0.12)


@pytest.mark.parametrize("deviation", [0.2, 0.5])
@pytest.mark.parametrize("steps", [(0, 0, 0, 0), (0, 1, 0, 1), (0, 0, 0, 1), (1, 1, 1, 1)])
def test_an_error_that_all_reads_share_blurs_their_steps_no_more_than_those_of_one(
    deviation: float, steps: tuple[int, ...]
) -> None:
    """By integration over the acceleration with its error: nearer to it than one error four times as large for each."""
    noise, error_variance = 0.02, 0.07**2
    low, high = bounds(COARSE.step_mps2 * np.array(steps) - 0.1, np.zeros(4), COARSE.step_mps2)
    both_mean, both_spread = exact(np.sqrt(deviation**2 + error_variance), low, high,
                                   Sensor(noise, COARSE.step_mps2))
    share = deviation**2 / (deviation**2 + error_variance)
    exactly = share * both_mean, np.sqrt((share * both_spread) ** 2 + (1 - share) * deviation**2)

    def off(blurs: float, beside: float) -> float:
        """Errors of mean, in standard deviations, and of the logarithm of that."""
        readings = GaussianReadings((low + high) / 2, np.full(4, 0.1))
        for _ in range(300):
            variance = 1 / (deviation**-2 + (1 / readings.variance).sum())
            mean = variance * (readings.value_mps2 / readings.variance).sum()
            readings = improved(readings, low, high, *without_own(readings, np.full(4, mean), variance),
                                noise**2 + blurs, beside, reads=4)
        return float(abs(mean - exactly[0]) / exactly[1] + abs(np.log(np.sqrt(variance) / exactly[1])))

    assert off(0.0, error_variance) < 0.9 * off(4 * error_variance, 0.0)


@pytest.mark.parametrize("deviation", [0.3, 1.0])
@pytest.mark.parametrize("noise", [0.02, 0.06, 0.14, 0.3])
@pytest.mark.parametrize("reads", [2, 4, 8])
def test_reads_of_one_acceleration_on_one_step_are_one_bound(deviation: float, noise: float, reads: int) -> None:
    """By integration; each for itself, eight reads with little noise would know it a quarter better than they can."""
    sensor = Sensor(noise, COARSE.step_mps2)
    reading = np.full((1, reads), -0.1)
    low, high = bounds(reading[0], np.zeros(reads), sensor.step_mps2)
    same = standing_for(reading, np.ones((1, reads), dtype=bool), sensor)
    readings = GaussianReadings(reading[0], np.full(reads, 0.1))
    for _ in range(300):
        variance = 1 / (deviation**-2 + (1 / readings.variance).sum())
        mean = variance * (readings.value_mps2 / readings.variance).sum()
        apart = without_own(readings, np.full(reads, mean), variance, same)
        readings = improved(readings, low, high, *apart, noise**2, same=same, reads=reads)
    exact_mean, spread = exact(deviation, low, high, sensor)
    assert mean == pytest.approx(exact_mean, abs=0.03 * spread)
    assert np.sqrt(variance) == pytest.approx(spread, rel=0.06)


@pytest.mark.parametrize("at_end", [-1.0, 1.0])
@pytest.mark.parametrize(("count", "tolerance"), [(1, 0.02), (5, 0.35)])
def test_a_reading_at_the_end_of_the_range_is_a_bound_on_one_side(at_end: float, count: int, tolerance: float) -> None:
    """The same bound five times leaves a posterior with an edge, which a Gaussian can only roughly be."""
    reading, ends = np.full(count, at_end * 1.2), np.full(count, at_end)
    low, high = bounds(reading, ends, COARSE.step_mps2)
    assert np.isinf(high if at_end > 0 else low).all() and np.isfinite(low if at_end > 0 else high).all()
    mean, spread = exact(1.5, low, high, COARSE)
    found_mean, found_spread = by_rounds(1.5, reading, ends, COARSE)
    assert abs(mean) > 1.2  # it may well be further out than what was read
    assert found_mean == pytest.approx(mean, abs=0.12 * spread)
    assert found_spread == pytest.approx(spread, rel=tolerance)


def test_two_neighbours_that_go_together() -> None:
    """Two accelerations of correlation 0.8, both read on the same step, by summing over a plane."""
    prior = 0.5**2 * np.array([[1.0, 0.8], [0.8, 1.0]])
    reading = np.full(2, COARSE.step_mps2)
    low, high = bounds(reading, np.zeros(2), COARSE.step_mps2)
    axis = np.linspace(-2.5, 2.5, 801)
    likelihood = norm.cdf((high[0] - axis) / 0.1) - norm.cdf((low[0] - axis) / 0.1)
    plane = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    distance = np.einsum("...i,ij,...j", plane, np.linalg.inv(prior), plane)
    posterior = np.exp(-0.5 * distance) * likelihood[:, None] * likelihood
    alone = posterior.sum(axis=1) / posterior.sum()
    mean = alone @ axis
    readings = GaussianReadings(reading, np.full(len(reading), COARSE.variance_mps2_2))
    for _ in range(40):
        covariance = np.linalg.inv(np.linalg.inv(prior) + np.diag(1 / readings.variance))
        fitted = covariance @ (readings.value_mps2 / readings.variance)
        readings = improved(readings, low, high, *without_own(readings, fitted, covariance[0, 0]),
                            COARSE.noise_rms_mps2**2)
    assert fitted == pytest.approx([mean, mean], abs=0.005)
    assert np.sqrt(covariance[0, 0]) == pytest.approx(np.sqrt(alone @ (axis - mean) ** 2), rel=0.02)


def test_staying_on_a_step_tells_more_than_noise_of_its_width_would() -> None:
    """Twenty readings on one step against a smooth prior: the acceleration is inside the step, and known no better."""
    reading = np.zeros(20)
    mean, spread = by_rounds(1.5, reading, np.zeros(20), COARSE)
    as_noise = np.sqrt(COARSE.variance_mps2_2 / 20)
    assert mean == pytest.approx(0.0, abs=1e-9)
    assert 1.5 * as_noise < spread < 0.5 * COARSE.step_mps2


def test_toggling_tells_the_edge() -> None:
    """Half the readings on either side of an edge: the acceleration is at the edge, known better than by its noise."""
    reading = COARSE.step_mps2 * np.tile([0.0, 1.0], 10)
    mean, spread = by_rounds(1.5, reading, np.zeros(20), COARSE)
    assert mean == pytest.approx(0.5 * COARSE.step_mps2, abs=1e-3)
    assert spread < COARSE.noise_rms_mps2


@pytest.mark.parametrize("off", [0.0, 3.0, 50.0, -1e4])
def test_a_solution_far_from_the_readings_stays_finite(off: float) -> None:
    reading = np.array([0.0, 0.6])
    low, high = bounds(reading, np.zeros(2), COARSE.step_mps2)
    readings = GaussianReadings(reading, np.full(len(reading), COARSE.variance_mps2_2))
    for _ in range(5):
        readings = improved(readings, low, high, *without_own(readings, reading + off, 1e-4), COARSE.noise_rms_mps2**2)
        assert np.isfinite(readings.value_mps2).all() and (readings.variance > 0).all()


def test_rounding_counts_as_noise_where_no_bounds_are_known() -> None:
    assert COARSE.variance_mps2_2 == pytest.approx(0.1**2 + 0.6**2 / 12)


@pytest.mark.parametrize(("noise", "step", "coarse"), [(0.05, 0.0, False), (0.05, 0.0981, False), (0.1, 0.613, True)])
def test_a_sensor_is_coarse_when_its_noise_does_not_blur_its_steps(noise: float, step: float, coarse: bool) -> None:
    assert Sensor(noise, step).is_coarse is coarse


def test_what_noise_explains_is_not_unexplained() -> None:
    """Accelerations known exactly: the readings' noise takes some of them over an edge. Off by half a metre per second
    squared as well, about that is missed, less what the width of a step hides."""
    rng = np.random.default_rng(2)
    true = rng.uniform(-4, 4, 20_000)
    reading = 0.6 * np.round((true + 0.1 * rng.standard_normal(20_000)) / 0.6)
    low, high = bounds(reading, np.zeros(20_000), 0.6)
    assert unexplained(true, low, high, COARSE.noise_rms_mps2**2) == 0.0
    assert 0.3**2 < unexplained(true + rng.choice([-0.7, 0.7], 20_000), low, high, COARSE.noise_rms_mps2**2) < 0.7**2
    assert unexplained(true + 100.0, low, high, COARSE.noise_rms_mps2**2) == pytest.approx(100.0**2, rel=0.01)
    assert unexplained(true[:0], low[:0], high[:0], COARSE.noise_rms_mps2**2) == 0.0
