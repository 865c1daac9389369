"""SimulatedRuns whose distances wander, against where they were truly driven."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.lab import wandering
from logger.lab.addition import add
from logger.lab.diagnosis import diagnose
from logger.lab.fitting import Problem
from logger.lab.nuisance import Tolerance, wander_of
from logger.lab.settling import aligned
from logger.lab.spread import with_spread
from logger.lab.verdict import summary, told
from logger.runs import Run
from logger.simulation.simulated_runs import SimulatedRuns
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen

from ..support.lab.runs_with_residual import CAR, a_run, measuring

NOISE_MPS2 = 0.05
EFFECTS = {name: shipped_effects()[name]
           for name in ("tire_damping", "speed_scale", "time_offset", "sensor_gain", "sensor_bandwidth")}
TIRES = chosen(EFFECTS["tire_damping"], {"tire_damping_n_s_per_m": 300.0})


def driven(effects: list[Chosen], speeds_mps: tuple[float, ...] = (8.0, 14.0)) -> list[Run]:
    """Drives of a car with these effects, with noise, where they truly were."""
    rng = np.random.default_rng(5)
    plain = [a_run(f"run{i}", speed, 40.0, i) for i, speed in enumerate(speeds_mps)]
    return [measuring(run, one + rng.normal(0, NOISE_MPS2, run.count))
            for run, one in zip(plain, SimulatedRuns(plain).predict(compose(CAR, effects)), strict=True)]


def with_wrong_speed(run: Run, deviation_mps: float, lasts_s: float, seed: int) -> Run:
    """The run with the integral of a speed that is off by coloured noise, which forgets itself in so long."""
    rng = np.random.default_rng(seed)
    kept = np.exp(-1 / run.rate_hz / lasts_s)
    off = np.empty(run.count)
    off[0] = rng.normal(0, deviation_mps)
    for i in range(1, run.count):
        off[i] = kept * off[i - 1] + rng.normal(0, deviation_mps * np.sqrt(1 - kept**2))
    wrong = np.concatenate([[0.0], np.cumsum(off[:-1])]) / run.rate_hz
    return replace(run, distance_m=run.distance_m + wrong, speed_mps=run.speed_mps + off)


def problem_of(runs: list[Run]) -> Problem:
    return Problem(SimulatedRuns(runs, 500.0), CAR, Tolerance(), firm=True)


# As far as a real signal is off (spread 0.08 m/s), from one reading to the next or for seconds.
@pytest.fixture(scope="module", params=[(0.08, 0.02), (0.08, 1.0), (0.08, 5.0)], ids=["rough", "1 s", "5 s"])
def wrong(request: pytest.FixtureRequest) -> tuple[float, float]:
    return request.param  # type: ignore[no-any-return]


def test_runs_are_laid_where_they_were_driven(wrong: tuple[float, float]) -> None:
    true = driven([])
    problem = problem_of([with_wrong_speed(run, *wrong, 3 + i) for i, run in enumerate(true)])
    laid = wandering.relaid(problem, aligned(problem, problem.start()), problem)
    state = wandering.aligned_anew(laid, problem.start())
    before, after = (max(np.sqrt(((one.distance_m - run.distance_m)[run.first:] ** 2).mean())
                         for one, run in zip(each.runs.runs, true, strict=True)) for each in (problem, laid))
    assert before > 0.02 and after < min(0.012, 0.5 * before)
    assert wandering.moved_m(problem, laid) > 0.02
    assert laid.tolerance == problem.tolerance
    undisturbed = Problem(SimulatedRuns(true, 500.0), CAR, Tolerance())
    assert laid.error(state) < 1.1 * undisturbed.error(problem_of(true).start())


@pytest.mark.slow
def test_a_distance_that_wanders_lacks_no_physics_and_hides_none(wrong: tuple[float, float]) -> None:
    for effects in ([], [TIRES]):
        runs = [with_wrong_speed(run, *wrong, 3 + i) for i, run in enumerate(driven(effects))]
        found = diagnose(problem_of(runs), EFFECTS)
        assert found.verdict == tuple(one.effect.name for one in effects) and not found.unexplained
        assert any("are off by more than usual" in line for line in summary(told(found, EFFECTS)))


def test_an_effect_is_added_where_the_runs_lie() -> None:
    runs = [with_wrong_speed(run, 0.08, 1.0, 3 + i) for i, run in enumerate(driven([TIRES]))]
    firm, loose = (Problem(SimulatedRuns(runs, 500.0), CAR, Tolerance(), whole=True, firm=firm)
                   for firm in (True, False))
    found = add(firm, loose, [], [chosen(EFFECTS["tire_damping"], {"tire_damping_n_s_per_m": 200.0})])
    floor = NOISE_MPS2 / np.sqrt(np.concatenate([run.measured_mps2[run.first:] ** 2 for run in runs]).mean())
    assert found.error_after < 1.05 * floor < found.error_as_written
    tires, name = found.effects[0], "tire_damping_n_s_per_m"
    assert abs(tires.values[name] - 300.0) < 3 * tires.standard_errors[name] < 150.0


@pytest.mark.parametrize("factor", [0.01, 0.04])
def test_one_factor_of_all_runs_is_told_from_their_wander(factor: float) -> None:
    problem = problem_of([with_wrong_speed(run, 0.05, 1.0, 3 + i) for i, run in enumerate(driven([]))])
    runs = [replace(run, distance_m=(1 + factor) * run.distance_m) for run in problem.runs.runs]
    wrong = problem.over(SimulatedRuns(runs, 500.0))
    laid, _ = wandering.lying(wrong, wrong.start())
    for one, run in zip(laid.runs.runs, driven([]), strict=True):
        left_m = one.distance_m - (1 + factor) * run.distance_m
        assert abs(np.polyfit(run.distance_m, left_m, 1)[0]) < 0.15 * factor


@pytest.mark.parametrize("effects", [[], [TIRES], [chosen(EFFECTS["speed_scale"], {"scale": 1.01})],
                                     [chosen(EFFECTS["time_offset"], {"delay_s": 0.06})]],
                         ids=["nothing", "an effect", "a factor", "a delay"])
def test_runs_that_do_not_wander_stay_where_they_were_recorded(effects: list[Chosen]) -> None:
    problem = problem_of(driven(effects))
    laid, state = wandering.lying(problem, problem.start())
    assert laid is problem
    assert problem.deviance(state) < problem.deviance(aligned(problem, problem.start())) + 2.0


@pytest.mark.slow
def test_a_factor_of_all_runs_is_found_beside_distances_that_wander() -> None:
    scale = chosen(EFFECTS["speed_scale"], {"scale": 1.01})
    runs = [with_wrong_speed(run, 0.05, 1.0, 3 + i) for i, run in enumerate(driven([scale]))]
    found = diagnose(problem_of(runs), EFFECTS)
    assert found.verdict[:1] == ("speed_scale",)
    assert found.after.effects[0].p.scale == pytest.approx(1.01, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("apart", [0.001, 0.004])
def test_runs_may_each_have_their_own_factor_and_start(apart: float) -> None:
    plain = driven([TIRES], (8.0, 14.0, 11.0, 17.0))
    runs = [replace(run, distance_m=(1 + share * apart) * run.distance_m + start)
            for run, share, start in zip(plain, (1.0, -0.8, 0.3, -0.5), (0.06, -0.04, 0.0, 0.09), strict=True)]
    found = diagnose(problem_of(runs), EFFECTS)
    assert found.verdict == ("tire_damping",) and not found.unexplained
    (tires,), _ = with_spread(found.problem, found.after, found.slopes)
    name = "tire_damping_n_s_per_m"
    assert abs(tires.values[name] - 300.0) < 2 * tires.standard_errors[name] < 70.0


def test_knots_go_through_what_is_straight_between_them() -> None:
    run = a_run("run", 10.0, 20.0, 1)
    wander = wander_of(run, Tolerance(knot_s=0.5))
    line_m = 0.3 - 0.002 * np.arange(run.count)
    k = wander.through(line_m, run)
    assert wander.moved_m(k) == pytest.approx(line_m, abs=1e-12)
    slopes = wander.slopes(np.sin(np.arange(run.count) / 7.0), run)
    assert slopes.times(k) == pytest.approx(k @ slopes.columns(), abs=1e-9)


def test_the_size_of_a_wander_is_found() -> None:
    problem = problem_of([with_wrong_speed(run, 0.08, 0.02, 3 + i) for i, run in enumerate(driven([]))])
    state = aligned(problem, problem.start())
    laid = wandering._best_size(problem, state, wandering._places(problem, state), (wandering._LARGE,), 2)
    found = laid.problem.tolerance
    assert found.wander_m == pytest.approx(0.08 * np.sqrt(2 * 0.02), rel=0.35)  # of coloured noise, integrated
    assert found.knot_s == 0.25


@pytest.mark.parametrize(("lasts_s", "knots_s"), [(150.0, (0.25, 0.5, 1.0)), (220.0, (0.5, 1.0)), (400.0, ())])
def test_longer_runs_have_fewer_knots(lasts_s: float, knots_s: tuple[float, ...]) -> None:
    problem = problem_of([a_run("run", 5.0, lasts_s, 1)])
    assert tuple(one for one in (0.25, 0.5, 1.0) if wandering._in_reach(problem, one)) == knots_s
