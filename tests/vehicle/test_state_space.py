"""Exact steps against scipy's, and blocks against one step at a time."""

import numpy as np
import pytest
from scipy import linalg, signal

from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.models import GOLDEN_CAR, half_car, quarter_car
from logger.vehicle.structure import driven_outputs, mass_on_base, matrix_exponential, recursion, straight_step

A, B = half_car(read_vehicle(vehicle_file("rav4-2009"))).state_space()


@pytest.mark.parametrize("step_s", [1e-5, 1e-3, 0.02, 0.5])
def test_matrix_exponential_agrees_with_scipy(step_s: float) -> None:
    assert matrix_exponential(A * step_s) == pytest.approx(linalg.expm(A * step_s), rel=1e-9, abs=1e-10)
    assert matrix_exponential(np.zeros((3, 3))) == pytest.approx(np.eye(3))


def test_steps_agree_with_scipy() -> None:
    none = np.zeros((1, 8)), np.zeros((1, 2))
    f, g, *_ = signal.cont2discrete((A, B, *none), 0.01, method="zoh")
    time = np.arange(300) * 0.01
    road = np.cumsum(np.random.default_rng(5).standard_normal((300, 2)), axis=0) * 1e-3
    _, _, expected = signal.lsim((A, B, np.eye(8), np.zeros((8, 2))), road, time, interp=True)
    transition, at_start, at_end = straight_step(A, B, 0.01)
    assert transition == pytest.approx(f, abs=1e-9)
    assert at_start + at_end == pytest.approx(g, abs=1e-9)
    states = recursion(transition, road[:-1] @ at_start.T + road[1:] @ at_end.T, np.zeros(8))
    assert states == pytest.approx(expected[1:], abs=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 31, 35, 36, 37, 200])
def test_stretches_equal_single_steps(count: int) -> None:
    transition, *_ = straight_step(*quarter_car(GOLDEN_CAR).state_space(), 0.01)
    rng = np.random.default_rng(count)
    drive, state = rng.standard_normal((count, 4)), rng.standard_normal(4)
    states = recursion(transition, drive, state)
    assert states.shape == (count, 4)
    for row, force in zip(states, drive, strict=True):
        state = transition @ state + force
        assert row == pytest.approx(state, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 300])
def test_outputs_equal_those_of_single_steps(count: int) -> None:
    transition, at_start, at_end = straight_step(A, B, 0.003)
    rng = np.random.default_rng(count)
    gain, observe = np.hstack([at_start, at_end]), rng.standard_normal((3, 8))
    inputs, state = rng.standard_normal((count, 4)), rng.standard_normal(8)
    found = driven_outputs(transition, gain, observe, inputs, state)
    assert found.shape == (count + 1, 3)
    for row, force in zip(found, [*inputs, np.zeros(4)], strict=True):
        assert row == pytest.approx(observe @ state, rel=1e-9, abs=1e-9)
        state = transition @ state + gain @ force


@pytest.mark.parametrize(("stiffness_n_per_m", "damping_n_s_per_m", "per_s"), [
    (0.0, 200.0, 2.0), (0.0, 0.0, 0.0), (1e4, 20.0, 0.1), (1.0, 200.0, 1.0 - 0.99**0.5)])
def test_the_slowest_motion_of_a_mass_is_that_of_its_poles_not_its_place_where_no_spring_holds_it(
        stiffness_n_per_m: float, damping_n_s_per_m: float, per_s: float) -> None:
    mass = mass_on_base(100.0, stiffness_n_per_m, damping_n_s_per_m)
    assert mass.slowest_decay_per_s == pytest.approx(per_s, rel=1e-9, abs=1e-12)
