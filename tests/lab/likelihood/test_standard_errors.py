"""Standard errors on the scales that fits move on, as those of the numbers themselves."""

import numpy as np
import pytest

from logger.lab.spread import with_errors
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.effect import chosen
from logger.vehicle.effect_parameters import moves_of


@pytest.mark.parametrize("name, key, value, error", [
    ("tire_damping", "tire_damping_n_s_per_m", 150.0, 50.0),
    ("tire_damping", "tire_damping_n_s_per_m", 0.0, 50.0),
    ("damper_asymmetry", "rebound_to_bump_ratio", 2.0, 100.0),
    ("damper_asymmetry", "rebound_to_bump_ratio", None, None),
])
def test_an_error_at_a_bound_is_not_halved(name: str, key: str, value: float | None, error: float | None) -> None:
    effect = shipped_effects()[name]
    parameter = next(one for one in effect.parameters if one.name == key)
    value = parameter.high if value is None else value
    error = 50.0 * parameter.high if error is None else error
    one = chosen(effect, {**effect.usual, key: value})
    (found,) = with_errors((one,), moves_of((one,)), np.full(len(effect.parameters), 50.0))
    assert found.standard_errors[key] == pytest.approx(error, rel=1e-3)
