"""What was passed over for a simpler effect, tried again when the others are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from logger.lab import diagnosis
from logger.lab.candidates import Tried, every_choice
from logger.lab.diagnosis import diagnose
from logger.lab.fitting import Problem
from logger.lab.nuisance import Tolerance
from logger.simulation.simulated_runs import SimulatedRuns
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen

from ..support.lab.runs_with_residual import CAR, a_run, measuring

EFFECTS = shipped_effects()


def tried(name: str, gain: float, numbers: int) -> Tried:
    one = chosen(EFFECTS[name], EFFECTS[name].usual)
    state: Any = SimpleNamespace(effects=(one,))
    nothing: Any = None
    return Tried(EFFECTS[name], state, gain, 0.0, 0.1, numbers, 1, 0.0, nothing)


BRACKET, BENDING = tried("sensor_mount_resonance", 5000.0, 2), tried("body_bending", 5040.0, 3)


class Model:
    """One whose only merit is what it gains over another."""

    def __init__(self, one: Tried, gain: float, at_an_end: bool = False) -> None:
        place = SimpleNamespace(effect=one.effect, at_an_end=at_an_end)
        self.gain, self.state = gain, SimpleNamespace(effects=(place,))

    def left_by(self, better: Model) -> float:
        return better.gain - self.gain


def reconsidered(monkeypatch: pytest.MonkeyPatch, taken: Any, gain: float, at_an_end: bool = False) -> Any:
    """What stands where the bracket did, when any other in its place gains so much."""
    monkeypatch.setattr(diagnosis, "_with_other",
                        lambda problem, now, place, rival: Model(rival, now.gain + gain, at_an_end))
    nothing: Any = None
    now: Any = Model(taken.tried, 0.0)
    return diagnosis._reconsidered(nothing, now, [taken], 0, lambda words: None)[1][0]


def test_an_effect_has_each_of_its_choices_and_its_own_first() -> None:
    bending = chosen(EFFECTS["body_bending"], EFFECTS["body_bending"].usual | {"ends_move": 1.0, "frequency_hz": 17.0})
    choices = every_choice(bending)
    assert [one.values["ends_move"] for one in choices] == [1.0, 0.0]
    assert {one.values["frequency_hz"] for one in choices} == {17.0}
    lift = chosen(EFFECTS["wheel_lift"], {})
    assert [one.values for one in every_choice(lift)] == [{}]


def test_what_has_the_numbers_of_the_one_that_was_taken_and_more_was_passed_over() -> None:
    people, tires = tried("occupant", 4000.0, 3), tried("tire_damping", 3000.0, 1)
    assert diagnosis._passed_over(BRACKET, [BENDING, BRACKET, people, tires]) == (BENDING, people)
    assert diagnosis._passed_over(tires, [BENDING, BRACKET, tires]) == (BENDING,)
    assert diagnosis._passed_over(BENDING, [BENDING, BRACKET]) == ()


@pytest.mark.parametrize("rivals", [(), (BENDING,)])
def test_what_explains_clearly_more_in_the_end_takes_the_place(
        monkeypatch: pytest.MonkeyPatch, rivals: tuple[Tried, ...]) -> None:
    taken = diagnosis._Taken(BRACKET, rivals, (BENDING,), 7)
    clearly = reconsidered(monkeypatch, taken, 900.0)
    assert clearly.tried is BENDING and BRACKET not in clearly.rivals and clearly.count == 7
    alike = reconsidered(monkeypatch, taken, 40.0)
    assert alike.tried is BRACKET and alike.rivals == (BENDING,)
    at_an_end = reconsidered(monkeypatch, taken, 900.0, at_an_end=True)
    assert at_an_end.tried is BRACKET and at_an_end.rivals == rivals


def test_a_simpler_one_takes_the_place_if_it_explains_no_less(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = diagnosis._Taken(BENDING, (BRACKET,), (), 7)
    assert reconsidered(monkeypatch, taken, -5.0).tried is BRACKET
    assert reconsidered(monkeypatch, taken, -5.0).rivals == (BENDING,)
    assert reconsidered(monkeypatch, taken, -50.0).tried is BENDING


def test_only_a_model_that_is_astray_spares_what_moves_it() -> None:
    astray, near, unknown = (SimpleNamespace(judged_error=error, unexplained=100.0)
                             for error in (0.8, 0.6, float("nan")))
    late, gain = EFFECTS["time_offset"], EFFECTS["sensor_gain"]
    bases: Any = astray, near, unknown
    assert [diagnosis._least_of_left(one, late) for one in bases] == pytest.approx([0.0, 10.0, 10.0])
    assert [diagnosis._least_of_left(one, gain) for one in bases] == pytest.approx([10.0, 10.0, 10.0])


@pytest.mark.slow
def test_bending_that_a_bracket_stood_in_for_is_found_beside_tires() -> None:
    hidden = [chosen(EFFECTS["body_bending"], EFFECTS["body_bending"].usual | {
                  "frequency_hz": 27.8, "damping_ratio": 0.066, "participation": -1.24}),
              chosen(EFFECTS["tire_damping"], {"tire_damping_n_s_per_m": 500.0})]
    plain = [a_run(f"run{i}", speed, 40.0, i) for i, speed in enumerate((7.0, 12.0, 18.0))]
    rng = np.random.default_rng(8)
    runs = SimulatedRuns([measuring(run, one + rng.normal(0, 0.05, run.count)) for run, one in zip(
        plain, SimulatedRuns(plain).predict(compose(CAR, hidden)), strict=True)], 500.0)
    names = ("body_bending", "sensor_mount_resonance", "tire_damping", "sensor_gain")
    found = diagnose(Problem(runs, CAR, Tolerance(), firm=True), {name: EFFECTS[name] for name in names})
    assert set(found.verdict) == {"body_bending", "tire_damping"} and not found.unexplained
