"""Fits of the lab, on runs of the examination's own simulator: what was off is found, with errors that hold."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np
import pytest

from logger.lab.addition import add
from logger.lab.candidates import Base, fitted, misalignment, screened
from logger.lab.fitting import Problem
from logger.lab.nuisance import Tolerance, wander_of
from logger.lab.settling import settled
from logger.runs import Run
from logger.simulation.simulated_runs import SimulatedRuns
from logger.store.formats.drive_file import read_run
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.effect import Complex, Parameter, Scale, SensorEffect, chosen
from logger.vehicle.effect_parameters import moves_of, steps_apart, steps_of
from logger.vehicle.named_parameters import read
from logger.vehicle.vehicle import Vehicle

ROOT = Path(__file__).parents[2]
EFFECTS = shipped_effects()


@cache
def examined(
    kind: str, seed: int, effect: str | None = None, fine_hz: float = 500.0
) -> tuple[Vehicle, SimulatedRuns, dict]:
    """A case of the examination: its nominal vehicle, two of its runs, and the truth."""
    import subprocess
    import sys

    with TemporaryDirectory() as folder:
        named = [] if effect is None else ["--effect", effect]
        command = [sys.executable, "-m", "tests.validation.make", "--kind", kind, "--first-seed", str(seed), *named]
        subprocess.run([*command, "--out", f"{folder}/cases", "--truth", f"{folder}/truth"], cwd=ROOT, check=True,
                       capture_output=True)
        case = next(Path(folder, "cases").iterdir())
        truth = json.loads(next(Path(folder, "truth").iterdir()).read_text())
        runs = []
        for one in sorted(case.glob("run*"))[:2]:
            run = read_run(one)
            kept = slice(0, 3200)
            runs.append(Run(one.name, run.rate_hz, run.accel_z_mps2[kept], run.distance_m[kept], run.speed_mps[kept],
                            run.track))
        return read_vehicle(case / "vehicle.yaml"), SimulatedRuns(runs, fine_hz), truth


def true_number(truth: dict, name: str) -> float:
    found = truth["vehicle"]
    for part in name.split("."):
        found = found[part]
    return float(found)


def test_a_car_that_lacks_nothing_settles_at_the_noise_and_at_its_true_numbers() -> None:
    vehicle, runs, truth = examined("none", 3)
    problem = Problem(runs, vehicle, Tolerance(), whole=True)
    nominal = problem.start()
    state, _ = settled(problem, nominal)
    measured = np.concatenate([run.measured_mps2[run.first:] for run in runs.runs])
    noise = truth["noise"]["rms_mps2"] / np.sqrt((measured**2).mean())
    assert problem.error(state) < problem.error(nominal)
    assert problem.error(state) == pytest.approx(noise, rel=0.05)
    added = add(problem, problem, [], [])
    off = [(one.found - true_number(truth, one.name)) / one.found_standard_error for one in added.numbers]
    assert np.sqrt(np.mean(np.square(off))) < 1.6


def test_an_effect_is_found_with_its_number_and_its_error() -> None:
    vehicle, runs, truth = examined("one", 3, "damper_asymmetry")
    problem = Problem(runs, vehicle, Tolerance(), whole=True)
    base = Base.of(problem, *settled(problem, problem.start()))
    seen = misalignment(problem, base.state)
    (found,) = fitted(problem, base, screened(problem, base, EFFECTS["damper_asymmetry"], seen))
    assert found.gain > 100
    added = add(problem, problem, [], found.state.effects)
    ratio, true = added.effects[0].values["rebound_to_bump_ratio"], truth["effects"][0]["parameters"]
    error = added.effects[0].standard_errors["rebound_to_bump_ratio"]
    assert abs(ratio - true["rebound_to_bump_ratio"]) < max(4 * error, 0.02 * ratio)
    assert added.error_after < added.error_refitted < added.error_before
    assert read(added.vehicle, "sprung_mass_kg") == added.numbers[0].written


def test_a_null_effect_explains_nothing() -> None:
    vehicle, runs, _ = examined("none", 3)
    problem = Problem(runs, vehicle, Tolerance())
    base = Base.of(problem, *settled(problem, problem.start()))
    state = problem.predicted((chosen(EFFECTS["sensor_gain"], {"gain": 1.0}),), base.state.logs, base.state.wander,
                              base.slopes)
    assert problem.deviance(state) == pytest.approx(base.fitted, abs=1e-6)


def test_a_distance_that_wandered_is_put_right() -> None:
    vehicle, runs, _ = examined("none", 3)
    time_s = np.arange(runs.runs[0].count) / runs.runs[0].rate_hz
    off_m = 0.02 * np.sin(2 * np.pi * time_s / 30.0)
    moved = SimulatedRuns([replace(one, distance_m=one.distance_m - off_m[: one.count]) for one in runs.runs], 500.0)
    problem = Problem(moved, vehicle, Tolerance(), whole=True)
    still = Problem(runs, vehicle, Tolerance(), whole=True)
    state, _ = settled(problem, problem.start())
    as_it_was, _ = settled(still, still.start())
    found = problem.moved_m(state.wander)[0] - still.moved_m(as_it_was.wander)[0]
    kept = slice(runs.runs[0].first, None)
    assert np.std((found - off_m)[kept]) < 0.35 * np.std(off_m[kept])


def test_where_the_car_was_is_found_from_all_stretches_also_those_that_judge() -> None:
    vehicle, runs, _ = examined("none", 3)
    problem = Problem(runs, vehicle, Tolerance())
    state, slopes = settled(problem, problem.start())
    assert problem.deviance(breakdown(problem, state, slopes), fitted=False) < problem.deviance(state, fitted=False) + 1


def test_the_prior_of_the_wander_has_the_spread_it_was_given() -> None:
    run = examined("none", 3)[1].runs[0]
    tolerance = Tolerance(scale=1e-9)
    wander = wander_of(run, tolerance)
    covariance = np.linalg.inv(wander.precision)
    last = np.append(wander.basis[-1], [0.0, 0.0])
    lasts_s = run.count / run.rate_hz
    deviation_m = np.hypot(tolerance.start_m, tolerance.wander_m * lasts_s**0.5)
    assert np.sqrt(last @ covariance @ last) == pytest.approx(deviation_m, rel=0.02)


def test_a_late_clock_and_a_wrong_wheel_are_seen_before_any_fit() -> None:
    vehicle, runs, _ = examined("none", 3)
    late = SimulatedRuns([replace(one, measured_mps2=np.roll(one.measured_mps2, 6)) for one in runs.runs], 500.0)
    problem = Problem(late, vehicle, Tolerance())
    assert misalignment(problem, problem.start()).delay_s == pytest.approx(0.06, abs=0.006)
    scaled = SimulatedRuns([replace(one, distance_m=one.distance_m * 1.02, speed_mps=one.speed_mps * 1.02)
                            for one in runs.runs], 500.0)
    problem = Problem(scaled, vehicle, Tolerance())
    assert misalignment(problem, problem.start()).scale == pytest.approx(1.02, abs=0.004)


def test_how_far_two_sets_of_values_are_apart() -> None:
    bending = EFFECTS["body_bending"]
    here = {"frequency_hz": 20.0, "damping_ratio": 0.05, "participation": 0.5, "ends_move": 0.0}
    one = chosen(bending, here)
    assert steps_apart(one, one) == 0.0
    near = steps_apart(one, chosen(bending, here | {"frequency_hz": 20.2}))
    assert 0 < near < steps_apart(one, chosen(bending, here | {"frequency_hz": 21.0}))
    assert steps_apart(one, chosen(bending, here | {"ends_move": 1.0})) == np.inf
    assert steps_apart(chosen(EFFECTS["wheel_lift"], {}), chosen(EFFECTS["wheel_lift"], {})) == 0.0


def test_a_search_does_not_settle_what_is_far_from_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    vehicle, runs, _ = examined("one", 3, "damper_asymmetry")
    problem = Problem(runs, vehicle, Tolerance())
    plain, rounds = Problem.slopes, []
    monkeypatch.setattr(Problem, "slopes", lambda *given: (rounds.append(1), plain(*given))[1])
    state, _ = settled(problem, problem.start())
    thoroughly = len(rounds)
    rounds.clear()
    early, _ = settled(problem, problem.start(), worth=0.1)
    assert len(rounds) < thoroughly
    assert problem.deviance(state) <= problem.deviance(early) + 1.0


def test_a_rough_simulation_of_friction_tells_what_a_change_does() -> None:
    vehicle, runs, _ = examined("none", 3)
    problem = Problem(runs, vehicle, Tolerance())
    as_given = np.zeros(len(problem.nuisance.names))
    weak, strong = (problem.car([chosen(EFFECTS["dry_friction"], {"friction_force_n": force_n})], as_given)
                    for force_n in (60.0, 90.0))
    changes = [[there - here for here, there in zip(runs.predict(weak, rough=rough), runs.predict(strong, rough=rough),
                                                    strict=True)] for rough in (False, True)]
    fine, rough = (np.concatenate(one) for one in changes)
    assert 0 < np.sqrt(np.mean((rough - fine) ** 2)) < 0.2 * np.sqrt(np.mean(fine**2))


def own(name: str, start: float, low: float, high: float, trials: tuple[float, ...]) -> Parameter:
    return Parameter(name, start, low, high, low, Scale.LINEAR, trials, "of an own effect")


def test_numbers_that_begin_at_nothing_are_stepped_and_those_that_cannot_move_are_not() -> None:
    class Own(SensorEffect):
        name = "own"
        parameters = (own("mass_kg", 0.0, 0.0, 100.0, (20.0,)), own("width_m", 0.0, 0.0, 3.0, (0.0,)),
                      own("fixed_hz", 5.0, 5.0, 5.0, (5.0,)))

        def factor(self, p: SimpleNamespace, s: Complex) -> Complex:
            return np.ones_like(s)

    effects = [chosen(Own(), {"mass_kg": 0.0, "width_m": 0.0, "fixed_hz": 5.0})]
    moves = moves_of(effects)
    assert [move.parameter for move in moves] == [0, 1]
    assert steps_of(effects, moves) == pytest.approx([0.02 * 0.1 * 20, 0.02 * 0.1 * 3])
    assert effects[0].at_an_end and not chosen(Own(), {"mass_kg": 1.0, "width_m": 1.0, "fixed_hz": 5.0}).at_an_end
