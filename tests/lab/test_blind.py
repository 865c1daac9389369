"""Which effects some runs could not show."""

from __future__ import annotations

import numpy as np

from logger.lab.blind import blind
from logger.lab.fitting import Problem
from logger.lab.nuisance import Tolerance
from logger.simulation.simulated_runs import SimulatedRuns
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.compose import compose

from ..support.lab.runs_with_residual import CAR, a_run, measuring

EFFECTS = [shipped_effects()[name] for name in ("tire_enveloping", "sensor_gain", "speed_scale")]


def test_another_contact_length_than_the_cars_own_shows_on_a_rough_road_driven_slowly() -> None:
    """Though the usual length is the car's own, or as good as its own after a refit."""
    run = a_run("slow", 5.0, 20.0, 3)
    model = SimulatedRuns([run]).predict(compose(CAR))[0]
    noise = np.random.default_rng(1).normal(0, 0.02, run.count)
    problem = Problem(SimulatedRuns([measuring(run, model + noise)]), CAR, Tolerance(), whole=True)
    logs = np.where(np.array(problem.nuisance.names) == "contact_patch_m", 0.003, 0.0)
    assert logs.any()
    state = problem.laid_out((), logs, problem.start().wander)
    assert blind(problem, state, problem.slopes(state), EFFECTS) == ()


def test_a_road_that_hardly_moves_the_car_hides_them_all() -> None:
    run = a_run("slow", 5.0, 20.0, 3)
    quiet = SimulatedRuns([run]).predict(compose(CAR))[0]
    noise = np.random.default_rng(1).normal(0, 40 * float(np.abs(quiet).max()), run.count)
    problem = Problem(SimulatedRuns([measuring(run, noise)]), CAR, Tolerance(), whole=True)
    state = problem.start()
    hidden = blind(problem, state, problem.slopes(state), EFFECTS)
    assert {one.effect.name for one in hidden} == {one.name for one in EFFECTS}
    assert [one.deviations for one in hidden] == sorted(one.deviations for one in hidden)
