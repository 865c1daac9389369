"""Noise that falls or rises with frequency is told from what grows with the motion, on records made by chance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from logger.lab.diagnosis import diagnose
from logger.lab.likelihood.growing_power import growing_power
from logger.report.diagnosis_text import summary
from logger.runs import Run
from logger.simulation.simulated_runs import SimulatedRuns

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
    assert "louder at some frequencies" in " ".join(summary(found))


def test_physics_that_nothing_explains_is_no_noise() -> None:
    runs = secret_runs([hidden("damper_asymmetry", rebound_to_bump_ratio=2.0)], lasts_s=40.0)
    found = diagnose(posterior_of(runs), FEW)
    assert found.unexplained and not found.coloured
