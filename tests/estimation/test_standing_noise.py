"""A sensor that stands still, against rounding done here, number by number."""

from decimal import ROUND_FLOOR, Decimal

import numpy as np
import pytest

from logger.estimation.noise_belief import NoiseBelief
from logger.estimation.standing_noise import independent_share, standing_noise

STEP = 0.613
UNKNOWN = NoiseBelief(np.log(0.1), 1.0)


def rounded(values: np.ndarray) -> np.ndarray:
    """To the nearest step, in decimal arithmetic."""
    step = Decimal(str(STEP))
    counts = [(Decimal(float(value)) / step + Decimal("0.5")).to_integral_value(ROUND_FLOOR) for value in values]
    return np.array([float(count * step) for count in counts])


def parked(noise: float, place: float, seed: int, count: int = 1000) -> np.ndarray:
    """Ten seconds with gravity ``place`` of a step off the middle of one."""
    rng = np.random.default_rng([seed, round(1000 * noise), round(100 * place) + 100])
    return rounded(STEP * (16 + place) + noise * rng.standard_normal(count))


@pytest.mark.parametrize("noise", [0.1, 0.15, 0.3, 0.8])
def test_a_chip_that_toggles_reveals_its_noise(noise: float) -> None:
    """At thirty places of the level, of which all toggle."""
    off, stds = [], []
    for seed, place in enumerate(np.linspace(-0.5, 0.5, 30)):
        if noise < 0.3 * STEP and abs(place) < 0.5 - 2 * noise / STEP:
            continue
        found = standing_noise(UNKNOWN, parked(noise, place, seed), STEP)
        off.append((found.log_mean - np.log(noise)) / found.log_std)
        stds.append(found.log_std)
    assert len(off) >= 10
    assert np.mean(np.abs(off) <= 2) >= 0.9
    assert abs(np.mean(off)) < 0.6
    assert np.median(stds) < 0.5 * UNKNOWN.log_std


def test_one_that_never_toggles_gives_a_bound_only() -> None:
    before = NoiseBelief(np.log(0.2), 1.0)
    reading = parked(0.03, 0.1, 1)
    assert np.ptp(reading) == 0
    found = standing_noise(before, reading, STEP)
    assert found.log_mean < before.log_mean
    assert found.log_std > 0.4  # it may be anything below
    assert np.log(0.03) > found.log_mean - 3 * found.log_std
    small = NoiseBelief(np.log(0.03), 0.1)
    same = standing_noise(small, reading, STEP)
    assert same.log_mean == pytest.approx(small.log_mean, abs=0.02)
    assert same.log_std == pytest.approx(small.log_std, rel=0.1)


def test_repeated_readings_count_once() -> None:
    once = parked(0.2, 0.3, 2, 600)
    four = np.repeat(once, 4)
    assert independent_share(four) == pytest.approx(0.25, rel=0.35)
    assert independent_share(once) > 0.6
    assert independent_share(np.zeros(100)) == 1.0
    alone, repeated = (standing_noise(UNKNOWN, row, STEP) for row in (once, four))
    assert repeated.log_mean == pytest.approx(alone.log_mean, abs=0.05)
    assert 0.8 * alone.log_std < repeated.log_std < 1.4 * alone.log_std


@pytest.mark.parametrize("steps", [-3, 5])
def test_which_step_it_stands_on_does_not_matter(steps: int) -> None:
    reading = parked(0.2, 0.4, 3)
    one, other = (standing_noise(UNKNOWN, reading + shift, STEP) for shift in (0.0, steps * STEP))
    assert other.log_mean == pytest.approx(one.log_mean, abs=1e-6)
    assert other.log_std == pytest.approx(one.log_std, abs=1e-6)


def test_too_little_or_a_car_that_moves_says_nothing() -> None:
    assert standing_noise(UNKNOWN, parked(0.2, 0.0, 4, 50), STEP) is UNKNOWN
    assert standing_noise(UNKNOWN, parked(10.0, 0.0, 5), STEP) is UNKNOWN
