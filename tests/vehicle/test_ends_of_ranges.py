"""An effect whose numbers have run to the end of what they may be is distinguished from one that is there."""

from __future__ import annotations

import pytest

from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.effect import chosen

EFFECTS = shipped_effects()


def test_a_shape_at_the_end_of_its_range_is_no_effect() -> None:
    bending, roll = EFFECTS["body_bending"], EFFECTS["roll"]
    usual = {"frequency_hz": 21.0, "damping_ratio": 0.05, "participation": 0.5}
    assert not chosen(bending, usual).at_bound
    assert chosen(bending, usual | {"frequency_hz": 60.0}).at_bound
    assert chosen(bending, usual | {"damping_ratio": 0.003}).at_bound
    assert not chosen(bending, usual | {"participation": 10.0}).at_bound  # a strength, which may be large
    shapes = {one.name: one.high for one in roll.parameters}
    bandwidth = EFFECTS["sensor_bandwidth"]
    assert chosen(bandwidth, {"cutoff_hz": 2000.0, "order": 2.0}).at_bound  # where it does nothing
    assert not chosen(bandwidth, {"cutoff_hz": 0.6, "order": 2.0}).at_bound
    assert chosen(bandwidth, {"cutoff_hz": 0.5, "order": 2.0}).at_bound  # nothing of it was measured
    assert [chosen(EFFECTS["play"], {"half_gap_m": gap_m}).at_bound for gap_m in (0.019, 0.02)] == [False, True]
    assert not chosen(roll, shapes).at_bound  # it has no strength that could make up for a shape


STRENGTHS = [(name, one.name) for name, effect in EFFECTS.items() for one in effect.parameters
             if one.null is not None and not one.low < one.null < one.high]


@pytest.mark.parametrize(("name", "strength"), STRENGTHS)
def test_a_strength_is_at_its_weakest_at_one_end_and_not_where_it_is_usual(name: str, strength: str) -> None:
    one = next(one for one in EFFECTS[name].parameters if one.name == strength)
    ends = [one.at_weakest_bound(value) for value in (one.low, one.high)]
    assert sorted(ends) == [False, True] and ends[0] == (one.null == one.low)
    assert not any(one.at_weakest_bound(value) for value in (one.start, *one.trials))
    weakest = one.coordinate(one.low if ends[0] else one.high)
    tenth = one.value(weakest + 0.1 * (one.coordinate(one.start) - weakest))
    assert not one.at_weakest_bound(tenth)  # whatever its unit


def test_friction_of_the_body_alone_is_no_friction_that_could_be_no_weaker() -> None:
    friction = EFFECTS["frame_friction"]
    assert not chosen(friction, {"friction_force_n": 0.0, "body_friction_force_n": 0.5}).at_bound
    assert not chosen(friction, {"friction_force_n": 0.5}).at_bound
    assert chosen(friction, {"friction_force_n": 0.0, "body_friction_force_n": 0.0}).at_bound


def test_a_shift_as_far_as_it_may_be_is_no_shift() -> None:
    late = EFFECTS["time_offset"]
    assert [chosen(late, {"delay_s": delay_s}).at_bound for delay_s in (-2.0, -0.3, 0.0, 2.0)] == [
        True, False, False, True]
