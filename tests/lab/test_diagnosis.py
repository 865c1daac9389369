"""What a diagnosis says of effects that it cannot try, of what is left above the noise, and of runs too long."""

from types import SimpleNamespace

import numpy as np
import pytest

from logger.lab import diagnosis, wandering
from logger.lab.fitting import Problem
from logger.lab.likelihood.noise_floor import UNEXPLAINED, Noise
from logger.lab.nuisance import Tolerance
from logger.lab.stretches import Cells
from logger.profiles.track import Track
from logger.runs import Run
from logger.simulation.simulated_runs import SimulatedRuns
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.effect import chosen

from ..support.lab.runs_with_residual import CAR, a_run

EFFECTS = shipped_effects()


def problem() -> Problem:
    return Problem(SimulatedRuns([a_run("run", 10.0, 20.0, 1)], 500.0), CAR, Tolerance())


def test_effects_that_cannot_be_tried_are_named_with_the_reason() -> None:
    present = [chosen(EFFECTS["sensor_gain"], {"gain": 1.1})]
    found = diagnosis._obstacles(problem(), EFFECTS, present)
    assert found == {"sensor_gain": "the model has it", "roll": EFFECTS["roll"].obstacle(CAR, False)}


def excess_of(lasts_s: list[float], above: float, seed: int) -> float:
    """Of runs that are left with noise, so many times as loud as the sensor's (1 m/s2)."""
    rng = np.random.default_rng(seed)
    cells = [Cells(above**2 * rng.chisquare(2 * 1.75 * one, 21) / (2 * 1.75 * one), np.full(21, 2 * 1.75 * one))
             for one in lasts_s]
    left = SimpleNamespace(cells=lambda state, fitted: cells)
    return diagnosis._excess(left, None, Noise(1.0, 0.0))  # type: ignore[arg-type]


def test_noise_of_many_short_runs_is_no_excess() -> None:
    found = [excess_of([3.0] * 12, 1.0, seed) for seed in range(500)]
    assert sum(one > UNEXPLAINED for one in found) <= 3  # one in a thousand
    assert sum(one == UNEXPLAINED for one in found) > 50  # louder than that, and no more than by chance


def test_an_excess_is_that_of_the_run_where_it_is_most() -> None:
    assert all(excess_of([40.0, 60.0], 1.3, seed) == pytest.approx(0.3, abs=0.06) for seed in range(100))
    assert all(0.2 < excess_of([3.0] * 6, 1.5, seed) < 0.9 for seed in range(100))


def test_runs_too_long_to_be_followed_are_named() -> None:
    assert wandering.too_long(problem()) == []
    zeros = np.zeros(60_000)
    long = Run("long", 100.0, zeros, np.arange(60_000) * 0.1, zeros + 10.0, Track(1.0, np.zeros(3)))
    assert "too long" in wandering.too_long(Problem(SimulatedRuns([long], 500.0), CAR, Tolerance()))[0]
