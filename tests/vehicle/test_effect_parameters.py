"""Numbers of effects as fits move them: by name, within bounds, and their derivatives."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from logger.arrays import Complex
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.effect import Parameter, Scale, SensorEffect, chosen
from logger.vehicle.named_parameters import (
    FreeParameter,
    coordinates_of,
    free_number,
    free_parameter_named,
    free_parameters_of,
    slope_of,
    steps_of,
    with_coordinates,
)

EFFECTS = shipped_effects()
USUAL = [chosen(effect, effect.usual) for effect in EFFECTS.values()]


def test_every_number_that_moves_is_found_by_its_name() -> None:
    for free in free_parameters_of(USUAL):
        one = USUAL[free.effect].effect
        assert free_parameter_named(USUAL, f"{one.name}.{one.parameters[free.parameter].name}") == free
    assert free_parameter_named(USUAL, "sprung_mass_kg") is None


def test_what_a_number_may_be_is_said_in_words() -> None:
    one = Parameter("order", 1.0, 1.0, 4.0, None, Scale.LINEAR, (), "how steep")
    for choices, words in (((), "1 to 4"), ((1.0, 2.0), "1 or 2"), ((1.0, 2.0, 4.0), "one of 1, 2, 4")):
        assert replace(one, choices=choices).allowed == words


def test_what_needs_a_road_is_not_for_a_rig() -> None:
    car = read_vehicle(vehicle_file("rav4-2009"))
    assert "driven by time" in str(EFFECTS["speed_scale"].obstacle_on(car, False, timed=True, pushed=False))
    assert EFFECTS["speed_scale"].obstacle_on(car, False, timed=False, pushed=False) is None
    assert EFFECTS["dry_friction"].obstacle_on(car, False, timed=True, pushed=False) is None


def test_an_effect_is_at_a_bound_by_its_shape_and_not_by_its_strength() -> None:
    people = EFFECTS["occupant"]
    highest = {one.name: one.high for one in people.parameters}
    assert not chosen(people, people.usual).at_bound
    assert chosen(people, people.usual | {"frequency_hz": highest["frequency_hz"]}).at_bound
    assert not chosen(people, people.usual | {"mass_kg": highest["mass_kg"]}).at_bound
    friction, rate = EFFECTS["dry_friction"], "transition_velocity_m_per_s"
    for coulombs in (0.0, 1e-6):  # as it is when nothing is said, or nearly
        assert not chosen(friction, friction.usual | {rate: coulombs}).at_bound
    assert chosen(friction, friction.usual | {rate: 0.1}).at_bound  # a valve's


def test_every_number_is_free_from_where_it_stands() -> None:
    for free in free_parameters_of(USUAL):
        parameter = USUAL[free.effect].effect.parameters[free.parameter]
        value = USUAL[free.effect].values[parameter.name]
        one = free_number(USUAL, free)
        assert (one.start, one.low, one.high) == (value, parameter.low, parameter.high)
        assert one.weakest_at(one.start) > 0


def test_coordinates_there_and_back() -> None:
    free_parameters = free_parameters_of(USUAL)
    back = with_coordinates(USUAL, free_parameters, coordinates_of(USUAL, free_parameters))
    for one, other in zip(back, USUAL, strict=True):
        assert dict(one.values) == pytest.approx(dict(other.values))


def test_slopes_are_those_of_the_coordinates() -> None:
    for effect, parameter in (("dry_friction", 0), ("sensor_gain", 0), ("top_mount_compliance", 0)):
        one = EFFECTS[effect].parameters[parameter]
        step = 1e-6 * one.start
        rise = one.coordinate(one.start + step) - one.coordinate(one.start - step)
        assert slope_of(one, one.start) == pytest.approx(rise / (2 * step), rel=1e-6)


def test_a_strength_that_is_large_may_be_known_as_roughly_as_a_size() -> None:
    friction = free_number([chosen(EFFECTS["dry_friction"], {"friction_force_n": 60.0})], FreeParameter(0, 0))
    assert friction.weakest_at(10.0) * friction.unit == pytest.approx(30.0)
    assert friction.weakest_at(600.0) * friction.unit == pytest.approx(300.0)


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
    free_parameters = free_parameters_of(effects)
    assert [free.parameter for free in free_parameters] == [0, 1]
    assert steps_of(effects, free_parameters) == pytest.approx([0.02 * 0.1 * 20, 0.02 * 0.1 * 3])
    assert effects[0].at_bound and not chosen(Own(), {"mass_kg": 1.0, "width_m": 1.0, "fixed_hz": 5.0}).at_bound
