"""How numbers are written, and what repeats along the way."""

from __future__ import annotations

import numpy as np
import pytest

from logger.lab.beside import Beside
from logger.lab.prediction import Run
from logger.lab.quantities import chance, measured, numbers_of, unit_of
from logger.lab.unexplained import turns_of
from logger.store.effect_file import shipped_effects
from logger.vehicle.effect import chosen

from compared import beside_with


@pytest.mark.parametrize(("value", "error", "words"), [
    (84.7, 3.9, "85 ± 4"), (84.7, 1.44, "84.7 ± 1.4"), (2546650.3, 47294.2, "2.55e6 ± 0.05e6"),
    (0.4021, 0.0049, "0.402 ± 0.005"), (23088.0, 230.0, "23100 ± 200"), (1.234e-5, 2e-7, "1.23e-5 ± 0.02e-5"),
    (1.2345, None, "1.23"), (5.0, float("inf"), "5"), (0.0, 0.0, "0"),
])
def test_a_value_has_the_digits_that_it_deserves(value: float, error: float | None, words: str) -> None:
    assert measured(value, error) == words


def test_units_are_the_ends_of_names() -> None:
    for name, unit in (("friction_force_n", "N"), ("cubic_stiffness_n_per_m3", "N/m3"), ("offset_m", "m"),
                       ("tire_damping_n_s_per_m", "N s/m"), ("knee_velocity_m_per_s", "m/s"), ("gain", "")):
        assert unit_of(name) == unit
    one = chosen(shipped_effects()["dry_friction"], {"friction_force_n": 85.2},
                 standard_errors={"friction_force_n": 4.1})
    assert numbers_of(one) == "friction_force_n 85 ± 4 N, transition_velocity_m_per_s 0 m/s"
    assert [chance(p) for p in (1e-30, 2e-4, 1.0)] == ["below 1e-9", "0.0002", "100%"]


def _with_turns(radius_m: float) -> Beside:
    def shaken(run: Run, _model: object, rng: np.random.Generator) -> np.ndarray:
        return 0.05 * np.sin(run.distance_m / radius_m) + rng.normal(0, 0.03, run.count)

    return beside_with(shaken)


def test_what_a_wheel_does_in_each_turn_is_found_and_noise_is_not() -> None:
    turns = turns_of(_with_turns(0.31))
    assert turns is not None and turns.found
    assert 1 / (2 * np.pi * turns.at_per_m) == pytest.approx(0.31, rel=0.02)
    assert "A wheel of 0.31 m radius" in turns.sentence
    noise = [turns_of(beside_with(lambda run, _, rng: rng.normal(0, 0.03, run.count), seed)) for seed in range(10)]
    assert not [one for one in noise if one is None or one.found]
