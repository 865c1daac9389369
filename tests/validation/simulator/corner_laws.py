"""The force laws of one corner of a car: what acts between body and wheel, by their distance and its rate.

Inner states are kept kind by kind, corner by corner: mount, rubber, bushing, inerter and its rate, absorber and its
rate. ``at`` is the place of this corner's first one in the state, ``n`` the number of corners.
"""

from __future__ import annotations

import numpy as np
from numba import njit

SLIP_MPS = 0.002
INSIDE = {"cache": True, "error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Of what compiled code alone calls: ways in from Python take as long to compile."""
_RUBBER, _BUSHING, _INERTER, ABSORBER, INNER = 1, 2, 3, 5, 7


@njit(cache=True, error_model="numpy", inline="always")
def damper_force(rate, bump, rebound, knee, slope):
    """Force of a damper on the body at a compression rate: two slopes, each smaller beyond the knee."""
    speed = abs(rate)
    shape = speed if speed <= knee else knee + slope * (speed - knee)
    return bump * shape if rate >= 0 else -rebound * shape


@njit(cache=True, error_model="numpy", inline="always")
def damper_rate_of(force, bump, rebound, knee, slope):
    """The rate at which the same damper gives this force."""
    shape = force / bump if force >= 0 else -force / rebound
    speed = shape if shape <= knee else knee + (shape - knee) / slope
    return speed if force >= 0 else -speed


@njit(**INSIDE)
def force_by_travel(x, v, c):
    """Springs, stops, quadratic damping, and friction that falls with the rate (Stribeck)."""
    force = c.spring * x + c.cubic * x * x * x + c.square * v * abs(v)
    if x > c.clearance:
        force += c.stop * (x - c.clearance)
    if x < -c.droop:
        force += min(c.droop_stop * (x + c.droop) + c.droop_damper * v, 0.0)
    if c.gas > 0:  # a column as stiff as the spring at rest, without heat: (1 - x / h)^-1.4, never below 0.15 h
        force += c.spring * ((max(1 - c.gas * x, 0.15) ** -1.4 - 1) / (1.4 * c.gas) - x)
    if c.stribeck > 0:
        force += c.stribeck * np.tanh(v / SLIP_MPS) * (0.4 + 0.6 * np.exp(-((v / c.stribeck_mps) ** 2)))
    return force


@njit(**INSIDE)
def force_with_memory(state, out, c, x, v, at, n, health):
    """The damper, on its mount if it has one, rubber, bushing and inerter; their rates go into ``out``."""
    here = health * (1 + c.by_place * x * x)
    bump, rebound = here * c.bump, here * c.rebound
    if c.mount > 0:
        strain = x - state[at]
        strain = max(strain - c.gap, 0.0) + min(strain + c.gap, 0.0)
        force = c.mount * strain
        out[at] = damper_rate_of(force, bump, rebound, c.knee, c.slope)
    else:
        force = damper_force(v, bump, rebound, c.knee, c.slope)
        out[at] = v
    for k in range(_RUBBER, ABSORBER):
        out[at + k * n] = 0.0
    if c.rubber > 0:
        pull = c.rubber * (x - state[at + _RUBBER * n])
        out[at + _RUBBER * n] = pull / c.rubber_damper
        force += pull
    if c.bushing > 0:
        bent = state[at + _BUSHING * n]
        out[at + _BUSHING * n] = v - 0.5 * (abs(v) * bent + v * abs(bent)) / c.bushing_yield
        force += c.bushing * bent
    if c.inertance > 0:
        flow, pull = state[at + (_INERTER + 1) * n], c.inerter_spring * (x - state[at + _INERTER * n])
        lost = c.inerter_damper * flow + c.inerter_square * flow * abs(flow)
        out[at + _INERTER * n], out[at + (_INERTER + 1) * n] = flow, (pull - lost) / c.inertance
        force += pull
    return force


@njit(**INSIDE)
def absorber_force(state, out, c, wheel, wheel_rate, at, n):
    """What a mass that hangs on the wheel by a spring and a damper does to it; its rates go into ``out``."""
    place, rate = at + ABSORBER * n, at + (ABSORBER + 1) * n
    out[place] = out[rate] = 0.0
    if c.absorber == 0:
        return 0.0
    pull = c.absorber_spring * (state[place] - wheel) + c.absorber_damper * (state[rate] - wheel_rate)
    out[place], out[rate] = state[rate], -pull / c.absorber
    return pull
