"""A curve of a motion that rests for half of the time, as a decay does that has died away, has one point at rest."""

from logger.lab.laws.families import force_by_travel


def test_a_motion_that_rests_for_half_of_the_time_has_one_point_at_rest() -> None:
    law = force_by_travel.FAMILY._free("curve", [0.0, 0.01, 0.03], 5.0)
    assert law.places == (-0.03, -0.01, 0.01, 0.03)
