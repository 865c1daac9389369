"""Stretches, bands and weights: white noise of known level is measured at that level, and weighed to one."""

import numpy as np
import pytest

from logger.lab.fitting import Problem
from logger.lab.nuisance import Tolerance
from logger.lab.stretches import FIT_S, JUDGE_S, Stretches, Whitener, deviance, unseen_in
from logger.profiles.track import Track
from logger.runs import Run
from logger.simulation.simulated_runs import SimulatedRuns

from ..support.lab.runs_with_residual import CAR, a_run, measuring


def run_of(samples: int, rate_hz: float = 100.0) -> Run:
    zeros = np.zeros(samples)
    return Run("run", rate_hz, zeros, np.arange(samples) * 0.1, zeros + 10.0, Track(1.0, np.zeros(3)))


def test_two_thirds_of_the_time_are_fitted_and_the_rest_judges() -> None:
    stretches = Stretches(run_of(200 + 36 * 100))
    assert stretches.judges
    assert stretches.fit.sum() == pytest.approx(36 * 100 * FIT_S / (FIT_S + JUDGE_S))
    shorter = Stretches(run_of(200 + 12 * 100))
    assert shorter.judges
    assert shorter.fit.sum() == pytest.approx(7.5 * 100, abs=1)


@pytest.mark.parametrize("seconds", np.arange(4.0, 40.0, 0.7))
def test_what_judges_has_a_power_whatever_the_length(seconds: float) -> None:
    run = run_of(200 + round(seconds * 100))
    stretches = Stretches(run)
    noise = np.random.default_rng(2).normal(0, 0.05, run.count)
    cells = stretches.cells(noise, False)
    judged = cells.freedom.sum()
    assert (judged > 0) == stretches.judges == (~stretches.fit).any()
    assert stretches.judges or seconds < 18
    if judged:
        assert cells.freedom @ cells.power / judged == pytest.approx(0.05**2, rel=0.3)


def test_a_run_too_short_to_judge_is_fitted_whole() -> None:
    assert Stretches(run_of(200 + 1300)).judges
    stretches = Stretches(run_of(200 + 800))
    assert not stretches.judges
    assert stretches.fit.all()


@pytest.mark.parametrize("rate_hz", [100.0, 80.0, 200.0])
def test_white_noise_has_its_variance_in_every_band_and_where_it_is_quiet(rate_hz: float) -> None:
    samples = round(400 * rate_hz)
    noise = np.random.default_rng(1).normal(0, 0.05, samples)
    stretches = Stretches(run_of(samples, rate_hz))
    cells = stretches.cells(noise, None)
    deviations = (cells.power / 0.05**2 - 1) / np.sqrt(2 / cells.freedom)
    assert np.abs(deviations).max() < 4.0  # of some twenty bands
    power, freedom = stretches.quiet(noise)
    assert abs(power / 0.05**2 - 1) < 4 * np.sqrt(2 / freedom)


def test_weighed_noise_of_any_colour_has_the_power_of_its_bands() -> None:
    rng = np.random.default_rng(2)
    coloured = np.convolve(rng.normal(0, 1, 12_200), [1.0, 1.6, 0.8], "same")
    stretches = Stretches(run_of(12_200))
    cells = stretches.cells(coloured)
    white = Whitener(stretches, cells)(coloured)
    assert len(white) == stretches.fit.sum()
    in_bands = (stretches.edges_hz[-1] - stretches.edges_hz[0]) / 50.0
    assert (white**2).mean() == pytest.approx(in_bands, rel=0.05)
    assert (Whitener(stretches, cells, whole=True)(coloured)).shape == (12_000,)


def test_what_is_twice_as_strong_costs_the_logarithm_of_four_for_each_degree_of_freedom() -> None:
    noise = np.random.default_rng(3).normal(0, 0.05, 6000)
    stretches = Stretches(run_of(6000))
    once, twice = stretches.cells(noise, None), stretches.cells(2 * noise, None)
    assert deviance([twice]) - deviance([once]) == pytest.approx(np.log(4) * once.freedom.sum())


def test_what_no_fit_saw_is_of_the_runs_that_judge() -> None:
    short, long = Stretches(run_of(200 + 800)), Stretches(run_of(200 + 3600))
    assert [int(unseen.sum()) for unseen in unseen_in([short, long])] == [0, 1200]
    assert [int(unseen.sum()) for unseen in unseen_in([short])] == [800]


def test_what_is_left_counts_as_no_less_than_simulations_differ_by() -> None:
    stretches = Stretches(run_of(6000), least_mps2=0.01)
    quiet, loud = (np.random.default_rng(1).normal(0, size, 6000) for size in (1e-6, 1.0))
    assert np.allclose(stretches.cells(quiet).power, 0.01**2)
    assert stretches.cells(loud).power.min() > 0.1


@pytest.mark.parametrize("rate_hz", [49.6, 75.0, 99.5, 99.8, 99.99999, 100.00001, 101.0, 119.8, 174.0])
@pytest.mark.parametrize("seconds", [11.5, 12.0, 20.0, 33.0, 61.3])
def test_what_judges_has_a_power_whatever_the_rate(rate_hz: float, seconds: float) -> None:
    run = run_of(round(seconds * rate_hz), rate_hz)
    stretches = Stretches(run)
    noise = np.random.default_rng(2).normal(0, 0.05, run.count)
    cells = stretches.cells(noise, False)
    assert stretches.judges and (~stretches.fit).any()
    assert cells.freedom @ cells.power / cells.freedom.sum() == pytest.approx(0.05**2, rel=0.5)


def test_where_nothing_was_measured_that_could_judge_all_is_fitted() -> None:
    run = a_run("run", 10.0, 20.0, 1)
    measured = np.where(np.arange(run.count) < 1400, np.sin(np.arange(run.count)), 0.0)
    problem = Problem(SimulatedRuns([measuring(run, measured)], 500.0), CAR, Tolerance())
    assert not any(one.judges for one in problem.stretches)
    assert problem.judged_error(problem.start()) == pytest.approx(problem.error(problem.start()))
