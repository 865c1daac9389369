"""A ride, shared by the tests of comfort."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy import signal

RATE_HZ = 100


@cache
def _body_acceleration(speed_mps: float, seed: int, seconds: float = 30.0, finer: int = 20) -> np.ndarray:
    """A quarter car over a random road with 30 mm bumps of 0.4 m, sampled at 100 Hz, some noise added [m/s2]."""
    rng = np.random.default_rng(seed)
    step_s = 1.0 / (RATE_HZ * finer)
    step_m = speed_mps * step_s
    count = round(seconds / step_s)
    # slope spectrum of an ISO 8608 road with 128e-6 m3 at 0.1 cycle/m
    slope = rng.standard_normal(count) * np.sqrt((2 * np.pi * 0.1) ** 2 * 128e-6 / (2 * step_m))
    road = np.cumsum(slope) * step_m
    from_bump = np.arange(count) * step_m % 97.3 - 50.0
    road += np.where(np.abs(from_bump) < 0.2, 0.03 * np.cos(np.pi * from_bump / 0.4), 0.0)
    contact = max(1, round(0.25 / step_m))
    road = signal.lfilter(np.ones(contact) / contact, 1, road - road[0])
    body, wheel, spring, damper, tire = 400.0, 45.0, 22e3, 1800.0, 200e3
    A = [
        [0, 1, 0, 0],
        [-spring / body, -damper / body, spring / body, damper / body],
        [0, 0, 0, 1],
        [spring / wheel, damper / wheel, -(spring + tire) / wheel, -damper / wheel],
    ]
    car = signal.StateSpace(A, [[0], [0], [0], [tire / wheel]], [A[1]], [[0]])
    _, response, _ = signal.lsim(car, road, np.arange(count) * step_s)
    return response[::finer] + 0.05 * rng.standard_normal(len(response[::finer]))


@pytest.fixture(scope="session")
def body_acceleration() -> Callable[[float, int], np.ndarray]:
    """Acceleration [m/s2] of a car's body at a speed [m/s] for a seed, at 100 Hz."""
    return _body_acceleration
