"""What a diagnosis says of effects that it cannot try."""

import pytest

from logger.lab import diagnosis
from logger.lab.fitting import Problem
from logger.lab.nuisance import Tolerance
from logger.lab.prediction import Runs
from logger.store.effect_file import shipped_effects
from logger.vehicle import stepping_loop
from logger.vehicle.effect import ForceEffect, chosen

from compared import CAR, a_run

EFFECTS = shipped_effects()


def problem() -> Problem:
    return Problem(Runs([a_run("run", 10.0, 20.0, 1)], 500.0), CAR, Tolerance())


def test_effects_that_cannot_be_tried_are_named_with_the_reason() -> None:
    present = [chosen(EFFECTS["sensor_gain"], {"gain": 1.1})]
    found = diagnosis._obstacles(problem(), EFFECTS, present)
    assert found == {"sensor_gain": "the model has it", "roll": EFFECTS["roll"].obstacle(CAR, False)}


def test_without_a_compiler_nonlinear_effects_are_not_tried_and_it_is_said_how_to_get_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(stepping_loop, "COMPILED", False)
    found = diagnosis._obstacles(problem(), EFFECTS, [])
    left_out = {name for name, why in found.items() if "lab extra" in why}
    assert left_out == {name for name, effect in EFFECTS.items() if isinstance(effect, ForceEffect)}
