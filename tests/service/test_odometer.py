"""Distance and place between fixes, against motions whose answer is known by hand."""

from __future__ import annotations

from math import isclose

import numpy as np

from drivers.readings import Fix
from logger.geodesy import EARTH_RADIUS_M
from logger.service.timebase import Odometer, TimedFix

NORTH_DEG_PER_M = 180.0 / (np.pi * EARTH_RADIUS_M)


def knot(t_s: float, speed_mps: float, north_m: float, valid: bool = True) -> TimedFix:
    t_us = round(t_s * 1e6)
    fix = Fix(
        t_us=t_us,
        valid=valid,
        utc_us=None,
        time_of_day_us=None,
        lat_deg=39.0 + north_m * NORTH_DEG_PER_M,
        lon_deg=-76.9,
        speed_mps=speed_mps,
        course_deg=None,
        altitude_m=None,
        satellites=None,
        hdop=None,
    )
    return TimedFix(t_us, fix)


def seconds(*t_s: float) -> np.ndarray:
    return np.array([round(t * 1e6) for t in t_s], dtype=np.int64)


def test_uniform_acceleration_gives_the_textbook_distance() -> None:
    odometer = Odometer(bridge_s=10, stationary_mps=0.5)
    for t in range(11):
        odometer.add(knot(t, 2.0 * t, t * t))
    t_s = np.arange(1.0, 10.0, 0.37)
    travel = odometer.travel(seconds(*t_s))
    assert travel.known.all()
    assert not travel.bridged.any()
    np.testing.assert_allclose(travel.distance_m, t_s**2, atol=1e-4)
    np.testing.assert_allclose(travel.speed_mps, 2 * t_s, atol=1e-5)
    place = odometer.place(49.0, leg=0)
    assert place is not None
    assert isclose((place[0] - 39.0) / NORTH_DEG_PER_M, 49.0, abs_tol=0.01)


def test_short_loss_is_bridged_and_marked_long_loss_is_unknown() -> None:
    odometer = Odometer(bridge_s=10, stationary_mps=0.5)
    for t, north in ((0, 0), (1, 10), (6, 60), (7, 70), (27, 270), (28, 280)):
        odometer.add(knot(t, 10, north))
    travel = odometer.travel(seconds(0.5, 3, 6.5, 15, 27.5))
    assert travel.known.tolist() == [True, True, True, False, True]
    assert travel.bridged.tolist() == [False, True, False, False, False]
    assert isclose(travel.distance_m[1], 30.0)
    assert isclose(travel.distance_m[4], 75.0)  # what was travelled with known speed: 70 m, then half a second
    assert travel.leg.tolist() == [0, 0, 0, 0, 1]
    assert odometer.place(75.0, leg=1) is not None
    assert odometer.place(75.0, leg=0) is None


def test_before_the_first_fix_and_after_the_last_nothing_is_known() -> None:
    odometer = Odometer(bridge_s=10, stationary_mps=0.5)
    assert not odometer.travel(seconds(1, 2)).known.any()
    odometer.add(knot(5, 10, 0))
    odometer.add(knot(6, 10, 10))
    assert odometer.travel(seconds(4.9, 5, 6, 6.1)).known.tolist() == [False, True, True, False]


def test_noise_of_a_receiver_at_rest_makes_no_distance() -> None:
    odometer = Odometer(bridge_s=10, stationary_mps=0.5)
    rng = np.random.default_rng(3)
    for t in range(600):
        odometer.add(knot(t, float(rng.uniform(0, 0.4)), 0.0))
    assert odometer.total_m == 0.0


def test_a_lone_wild_fix_is_passed_over_and_a_lasting_one_believed() -> None:
    odometer = Odometer(bridge_s=10, stationary_mps=0.5)
    for t in range(5):
        odometer.add(knot(t, 10, 10 * t))
    odometer.add(knot(5, 90, 50))
    odometer.add(knot(6, 10, 5000))
    assert odometer.rejected_fixes == 2
    odometer.add(knot(7, 10, 70))
    assert isclose(odometer.total_m, 70.0)
    for t in range(8, 15):
        odometer.add(knot(t, 10, 5000 + 10 * t))
    assert odometer.last_t_us == 14_000_000
    # Nothing is known between the old place and the new: no distance, no place along the jump.
    travel = odometer.travel(seconds(6.5, 9.0, 13.5))
    assert travel.known.tolist() == [True, False, True]
    assert isclose(odometer.total_m, 100.0)


def test_invalid_fixes_are_passed_over() -> None:
    odometer = Odometer(bridge_s=10, stationary_mps=0.5)
    odometer.add(knot(0, 10, 0, valid=False))
    assert odometer.last_t_us is None


def test_forgetting_keeps_what_is_asked_for() -> None:
    odometer = Odometer(bridge_s=10, stationary_mps=0.5)
    for t in range(100):
        odometer.add(knot(t, 10, 10 * t))
    before = odometer.travel(seconds(80.25, 95.5))
    odometer.forget_before(80_250_000, 795.0)
    after = odometer.travel(seconds(80.25, 95.5))
    assert after.known.all()
    np.testing.assert_array_equal(before.distance_m, after.distance_m)
    assert odometer.place(795.0, leg=0) is not None
    assert odometer.place(100.0, leg=0) is None
