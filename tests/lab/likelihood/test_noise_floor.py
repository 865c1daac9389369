"""The noise floor: found where it is white, where it went through the recorder's filter, and never below accuracy."""

import numpy as np
import pytest
from scipy.signal import firwin

from logger.lab.fitting import Problem, State
from logger.lab.likelihood.noise_floor import floor_error, noise_of
from logger.lab.nuisance import Tolerance
from logger.lab.stretches import Stretches
from logger.simulation.simulated_runs import SimulatedRuns

from ..support.lab.runs_with_residual import CAR, a_run, measuring


def found_for(noise: np.ndarray) -> tuple[float, float]:
    run = a_run("run", 12.0, len(noise) / 100.0, 3)
    problem = Problem(SimulatedRuns([run], 500.0), CAR, Tolerance(), whole=True)
    state = problem.start()
    predicted = state.predictions[0]
    problem = Problem(SimulatedRuns([measuring(run, predicted + noise)], 500.0), CAR, Tolerance(), whole=True)
    state = State((), state.logs, state.wander, [predicted])
    found = noise_of(problem, state)
    return found.deviation_mps2, floor_error(problem, found) * float(np.std((predicted + noise)[run.first:]))


@pytest.mark.parametrize("cut_hz", [None, 42.0])
def test_noise_is_found_before_and_behind_the_recorders_filter(cut_hz: float | None) -> None:
    noise = np.random.default_rng(1).normal(0, 0.05, 6000)
    if cut_hz is not None:
        noise = np.convolve(noise, firwin(101, cut_hz, fs=100.0), "same")
    deviation, from_error = found_for(noise)
    assert deviation == pytest.approx(0.05, rel=0.1)
    assert from_error == pytest.approx(deviation, rel=0.02)


def test_no_noise_is_taken_for_less_than_simulations_are_accurate() -> None:
    deviation, _ = found_for(np.random.default_rng(1).normal(0, 1e-9, 6000))
    assert 1e-4 < deviation < 1e-2


def test_filtered_noise_is_not_taken_for_as_little_as_its_quietest_band() -> None:
    lows, found = [], []
    for seed in range(12):
        noise = np.convolve(np.random.default_rng(seed).normal(0, 0.05, 3000), firwin(101, 42.0, fs=100.0), "same")
        found.append(found_for(noise)[0])
        lows.append(np.sqrt(min(Stretches(a_run("run", 12.0, 30.0, 3), whole=True).cells(noise).power)))
    assert np.mean(lows) < 0.045
    assert np.mean(found) == pytest.approx(0.05, rel=0.02)


def test_what_is_louder_than_filtered_noise_is_no_noise() -> None:
    noise = np.random.default_rng(1).normal(0, 0.05, 12000)
    loud = np.convolve(np.random.default_rng(2).normal(0, 0.1, 12000), firwin(201, (4.0, 20.0), fs=100.0,
                                                                              pass_zero=False), "same")
    both = np.convolve(noise + loud, firwin(101, 42.0, fs=100.0), "same")
    assert found_for(both)[0] == pytest.approx(0.05, rel=0.05)
