"""Noise that falls or rises with frequency is no motion of the car: on records made by chance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.signal import lfilter

from logger.api.lab.diagnose import diagnosis_summary
from logger.lab.diagnosis import diagnose
from logger.lab.likelihood.noise_floor import growing_power, steady_power
from logger.lab.residuals.unexplained import is_monotonic, rising_levels
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns

from ...support.lab.runs_with_residual import measuring
from ...support.lab.secret_runs import EFFECTS, FINE_HZ, hidden, posterior_of, secret_runs

FEW = {name: EFFECTS[name] for name in ("sensor_gain", "sensor_offset", "tire_damping")}
LEVELS = np.array([1.0, 4.0, 0.25])


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_what_grows_with_the_motion_is_found_within_its_error(share: float) -> None:
    rng = np.random.default_rng(5)
    off = []
    for _ in range(60):
        motion = rng.gamma(2.0, 0.5, (50, 3))
        power = LEVELS * (1 - share + share * motion) * rng.gamma(5.0, 0.2, (50, 3))
        grows, errors = growing_power(power, motion)
        off.append((grows - share * LEVELS) / errors)
    assert abs(np.mean(off)) < 0.3
    assert 0.7 < np.std(off) < 1.3


def test_motion_that_never_changes_says_nothing() -> None:
    _, errors = growing_power(np.ones((50, 2)), np.ones((50, 2)))
    assert np.isinf(errors).all()


@pytest.mark.parametrize("varies", [1e-6, 1e-8, 1e-15])
def test_motion_that_hardly_varies_says_next_to_nothing(varies: float) -> None:
    rng = np.random.default_rng(1)
    motion, power = 1 + varies * rng.standard_normal((40, 1)), rng.gamma(5.0, 0.2, (40, 1))
    grows, errors = growing_power(power, motion)
    assert errors > 0.01 / varies and abs(grows) < 5 * errors
    assert steady_power(power, motion) == 0


@pytest.mark.slow
def test_noise_falls_or_rises_throughout_and_a_hum_does_not() -> None:
    rng = np.random.default_rng(4)
    freedom = np.linspace(40.0, 300.0, 20)
    for slope in (-1.5, 0.0, 0.8):
        levels = np.exp(slope * np.linspace(0, 2, 20)) * rng.gamma(freedom / 2, 2 / freedom, (200, 20))
        assert np.mean([is_monotonic(one, freedom) for one in levels]) > 0.95
        humming = levels * np.where(np.arange(20) == 12, 4.0, 1.0)
        assert not any(is_monotonic(one, freedom) for one in humming)


def test_the_nearest_levels_that_rise_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(9)
    for _ in range(20):
        levels, weights = rng.gamma(2.0, 1.0, 8), rng.uniform(0.5, 3.0, 8)
        steps = lsq_linear(np.sqrt(weights)[:, None] * np.tri(8), np.sqrt(weights) * levels,
                           ([-np.inf, *[0.0] * 7], np.inf), tol=1e-12)
        assert rising_levels(levels, weights) == pytest.approx(np.cumsum(steps.x), abs=1e-5)


@pytest.mark.slow
def test_a_sensor_whose_noise_has_a_colour_lacks_no_physics() -> None:
    runs = secret_runs(seed=2, lasts_s=40.0)
    rng = np.random.default_rng(7)

    def louder(run: Run) -> np.ndarray:
        noise = lfilter([1.0], [1.0, -0.7], rng.standard_normal(run.count))
        return run.measured_mps2 + 0.2 * noise / np.std(noise)

    louder_runs = SimulatedRuns([measuring(run, louder(run)) for run in runs.runs], FINE_HZ)
    found = diagnose(posterior_of(louder_runs), FEW)
    assert found.coloured and not found.unexplained and not found.verdict
    assert found.noise.deviation_mps2 == pytest.approx(0.2, rel=0.2)
    assert "louder at some frequencies" in " ".join(diagnosis_summary(found))


@pytest.mark.slow
def test_physics_that_nothing_explains_is_no_noise() -> None:
    runs = secret_runs([hidden("damper_asymmetry", rebound_to_bump_ratio=2.0)], lasts_s=40.0)
    found = diagnose(posterior_of(runs), FEW)
    assert found.unexplained and not found.coloured
