"""Cars for the examination of the lab, from Newton's laws alone.

Problem: a laboratory that looks for missing physics cannot be judged by its own simulator: a mistake in it would sit in
the measurement as well as in the model and never show. So this one shares no code and no way of writing with it.

Solution: a rigid body on one, two or four corners. Every corner is a wheel, and whatever acts between two points is one
force law of their distance and its rate. Accelerations are sums of forces over masses; fourth-order Runge-Kutta at
4 kHz steps them. All coordinates count from static equilibrium, so that gravity appears only as the static tire loads
that a wheel must lose before it lifts. Up, forward, left, nose up and left side up are positive.

Dry friction comes in two kinds. "stick" is Coulomb's set-valued law: after each step the friction impulses, at most
force times step, are sought that bring the sliding to rest (Moreau's time stepping; Jean, Comput. Methods Appl. Mech.
Engrg. 177, 1999), by Gauss-Seidel sweeps. "tanh" is the law of force * tanh(rate / 2 mm/s).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import NDArray

from .corner_laws import (
    ABSORBER,
    INNER,
    INSIDE,
    SLIP_MPS,
    absorber_force,
    damper_force,
    force_by_travel,
    force_with_memory,
)

Array = NDArray[np.float64]

GRAVITY_MPS2 = 9.80665
STEP_S = 1 / 4000
_STIFFEST = 1.2  # fastest rate of decay times step: Runge-Kutta is stable to 2.78

_CORNER = np.dtype([(name, np.float64) for name in (
    "ahead", "left", "mass", "spring", "cubic", "clearance", "stop", "bump", "rebound", "knee", "slope", "square",
    "mount", "gap", "rubber", "rubber_damper", "bushing", "bushing_yield", "friction", "tire", "tire_cubic",
    "tire_damper", "load", "gas", "by_place", "stribeck", "stribeck_mps", "droop", "droop_stop", "droop_damper",
    "inertance", "inerter_spring", "inerter_damper", "inerter_square", "absorber", "absorber_spring", "absorber_damper",
    "sky", "sky_most",
)])
_BODY = np.dtype([(name, np.float64) for name in (
    "mass", "pitch", "roll", "seat_mass", "seat_spring", "seat_damper", "tow_mass", "tow_spring", "tow_damper",
    "tow_ahead", "bend_omega", "bend_zeta", "bend_gain", "fade", "fade_s", "heat", "heat_s", "warm", "warm_s", "slip",
)])
# Places in the state: heave, pitch, roll, bending, seat, trailer, wheels; their rates; then the inner states of all
# corners, kind by kind (``corner_laws``).
_HEAVE, _PITCH, _ROLL, _BEND, _SEAT, _TOW, _WHEELS = range(7)


@dataclass(frozen=True)
class Axle:
    """One end of a car; of a half car, one side of it."""

    cg_distance_m: float
    unsprung_mass_kg: float
    suspension_stiffness_n_per_m: float
    suspension_damping_n_s_per_m: float
    tire_stiffness_n_per_m: float


@dataclass(frozen=True)
class Car:
    """The car that the vehicle file knows: a quarter car stands on ``front`` alone."""

    model: str
    sprung_mass_kg: float
    pitch_inertia_kg_m2: float
    front: Axle
    rear: Axle | None
    contact_patch_m: float

    @property
    def wheelbase_m(self) -> float:
        return self.front.cg_distance_m + self.rear.cg_distance_m if self.rear else 0.0


@dataclass(frozen=True)
class Physics:
    """What a car has beyond its vehicle file, on the list of effects or not. The defaults mean: nothing.

    Forces, masses and rates are those of one side of the car.
    """

    tire_damping: float = 0.0
    tire_cubic: float = 0.0
    wheel_lift: bool = False
    rebound_to_bump: float = 1.0
    knee_mps: float = np.inf
    slope_ratio: float = 1.0
    damper_square: float = 0.0
    friction_front_n: float = 0.0
    friction_rear_n: float = 0.0
    friction_law: str = "stick"
    cubic: float = 0.0
    clearance_m: float = np.inf
    stop: float = 0.0
    mount: float = 0.0
    mount_gap_m: float = 0.0
    rubber: float = 0.0
    rubber_s: float = 1.0
    bushing: float = 0.0
    bushing_yield_m: float = 1.0
    fade: float = 0.0
    fade_s: float = 1.0
    payload_kg: float = 0.0
    seat_mass_kg: float = 0.0
    seat_hz: float = 0.0
    seat_zeta: float = 0.0
    cg_shift_m: float = 0.0
    sensor_ahead_m: float | None = None
    bend_hz: float = 0.0
    bend_zeta: float = 0.0
    bend_gain: float = 0.0
    tow_mass_kg: float = 0.0
    tow_hz: float = 0.0
    tow_zeta: float = 0.0
    tow_behind_axle_m: float = 0.0
    patch_m: float | None = None
    track_m: float | None = None
    roll_inertia_kg_m2: float = 0.0
    gas_height_m: float = np.inf
    damping_by_place_per_m2: float = 0.0
    stribeck_n: float = 0.0
    stribeck_mps: float = 0.05
    droop_m: float = np.inf
    droop_stop: float = 0.0
    droop_damper: float = 0.0
    inertance_kg: float = 0.0
    inerter_spring: float = 0.0
    inerter_damper: float = 0.0
    inerter_square: float = 0.0
    absorber_kg: float = 0.0
    absorber_hz: float = 0.0
    absorber_zeta: float = 0.0
    sky: float = 0.0  # of a semi-active damper, by the body's own speed ...
    sky_most: float = 0.0  # ... and at most by the rate of the suspension
    firmer: float = 0.0  # share by which the dampers are firmer at high speed, and softer at low
    firmer_at_mps: float = 15.0
    heat_per_j: float = 0.0  # what a joule that the dampers turn into heat takes from the logarithm of their damping
    heat_s: float = 1.0
    warm: float = 0.0  # share by which the tires stiffen
    warm_s: float = 1.0
    driveline_mps2: float = 0.0
    driveline_per_m: float = 0.0
    flat_m: float = 0.0  # depth of a flat spot of the front tire
    flat_length_m: float = 0.2
    unround_m: float = 0.0  # a heavy spot: its centrifugal force over tire stiffness, at one radian per second
    tire_radius_m: float = 0.31

    @property
    def sensor_m(self) -> float:
        """How far ahead of the true centre of gravity the sensor is."""
        return -self.cg_shift_m if self.sensor_ahead_m is None else self.sensor_ahead_m


@dataclass(frozen=True)
class Ready:
    """A car as the integrator wants it."""

    body: NDArray[np.void]
    corners: NDArray[np.void]
    sticks: bool
    behind_front_m: Array = field(repr=False)  # per corner: how far behind the front axle
    on_right: NDArray[np.bool_] = field(repr=False)


def assemble(car: Car, extra: Physics) -> Ready:
    """Put the parts together: corners, static loads, and sides if the car can roll."""
    full = extra.track_m is not None
    sides = ((0.5 * extra.track_m, False), (-0.5 * extra.track_m, True)) if full else ((0.0, False),)
    count = len(sides)
    body = np.zeros(1, _BODY)[0]
    body["mass"] = count * (car.sprung_mass_kg + extra.payload_kg)
    body["pitch"] = count * car.pitch_inertia_kg_m2 if car.rear else np.inf
    body["roll"] = extra.roll_inertia_kg_m2 if full else np.inf
    omega = 2 * np.pi * np.array([extra.seat_hz, extra.tow_hz, extra.bend_hz])
    body["seat_mass"] = count * extra.seat_mass_kg
    body["seat_spring"] = body["seat_mass"] * omega[0] ** 2
    body["seat_damper"] = 2 * extra.seat_zeta * omega[0] * body["seat_mass"]
    body["tow_mass"] = count * extra.tow_mass_kg
    body["tow_spring"] = body["tow_mass"] * omega[1] ** 2
    body["tow_damper"] = 2 * extra.tow_zeta * omega[1] * body["tow_mass"]
    body["bend_omega"], body["bend_zeta"] = omega[2], extra.bend_zeta
    # Per side or for both: the sum of forces and the mass that divides it double together.
    body["bend_gain"] = extra.bend_gain / (count * car.sprung_mass_kg)
    body["fade"], body["fade_s"] = extra.fade, extra.fade_s
    body["heat"], body["heat_s"] = extra.heat_per_j / count, extra.heat_s
    body["warm"], body["warm_s"] = extra.warm, extra.warm_s
    friction = (extra.friction_front_n, extra.friction_rear_n)
    sticks = extra.friction_law == "stick" and max(friction) > 0
    body["slip"] = 0.0 if sticks else SLIP_MPS
    axles = [(car.front, car.front.cg_distance_m - extra.cg_shift_m, friction[0])]
    if car.rear:
        axles.append((car.rear, -car.rear.cg_distance_m - extra.cg_shift_m, friction[1]))
        body["tow_ahead"] = -car.rear.cg_distance_m - extra.cg_shift_m - extra.tow_behind_axle_m
    else:
        axles[0] = (car.front, 0.0, friction[0])
    corners = np.zeros(len(axles) * count, _CORNER)
    places = [(axle, ahead, dry, left, right) for axle, ahead, dry in axles for left, right in sides]
    for corner, (axle, ahead, dry, left, _) in zip(corners, places, strict=True):
        _fit(corner, axle, extra)
        corner["ahead"], corner["left"], corner["friction"] = ahead, left, dry
        corner["load"] = np.inf
        if extra.wheel_lift:
            corner["load"] = GRAVITY_MPS2 * (axle.unsprung_mass_kg + _share(car, extra, ahead))
    return Ready(
        body, corners, sticks,
        np.array([0.0 if place[0] is car.front else car.wheelbase_m for place in places]),
        np.array([place[4] for place in places]),
    )


def _share(car: Car, extra: Physics, ahead_m: float) -> float:
    """The mass that one corner carries at rest [kg]: moments about the other axle."""
    here = car.sprung_mass_kg + extra.payload_kg + extra.seat_mass_kg
    if car.rear is None:
        return here + extra.tow_mass_kg
    base, front = car.wheelbase_m, ahead_m > 0
    arm = car.rear.cg_distance_m + extra.cg_shift_m
    tow = -extra.tow_behind_axle_m
    on_front = (here * arm + extra.tow_mass_kg * tow) / base
    return on_front if front else here + extra.tow_mass_kg - on_front


def _fit(corner: np.void, axle: Axle, extra: Physics) -> None:
    """The laws of one corner."""
    damping = axle.suspension_damping_n_s_per_m
    corner["mass"] = axle.unsprung_mass_kg
    corner["spring"], corner["cubic"] = axle.suspension_stiffness_n_per_m, extra.cubic
    corner["clearance"], corner["stop"] = extra.clearance_m, extra.stop
    corner["bump"] = 2 * damping / (1 + extra.rebound_to_bump)
    corner["rebound"] = 2 * damping - corner["bump"]
    corner["knee"], corner["slope"] = extra.knee_mps, extra.slope_ratio
    corner["square"] = extra.damper_square
    corner["mount"], corner["gap"] = extra.mount, extra.mount_gap_m
    corner["rubber"], corner["rubber_damper"] = extra.rubber, extra.rubber * extra.rubber_s
    corner["bushing"], corner["bushing_yield"] = extra.bushing, extra.bushing_yield_m
    corner["tire"], corner["tire_cubic"] = axle.tire_stiffness_n_per_m, extra.tire_cubic
    corner["tire_damper"] = extra.tire_damping
    corner["gas"], corner["by_place"] = 1 / extra.gas_height_m, extra.damping_by_place_per_m2
    corner["stribeck"], corner["stribeck_mps"] = extra.stribeck_n, extra.stribeck_mps
    corner["droop"], corner["droop_stop"], corner["droop_damper"] = extra.droop_m, extra.droop_stop, extra.droop_damper
    corner["inertance"], corner["inerter_spring"] = extra.inertance_kg, extra.inerter_spring
    corner["inerter_damper"], corner["inerter_square"] = extra.inerter_damper, extra.inerter_square
    omega = 2 * np.pi * extra.absorber_hz
    corner["absorber"], corner["absorber_spring"] = extra.absorber_kg, extra.absorber_kg * omega**2
    corner["absorber_damper"] = 2 * extra.absorber_zeta * omega * extra.absorber_kg
    corner["sky"], corner["sky_most"] = extra.sky, extra.sky_most


@njit(**INSIDE)
def _dissipated(state, corners, health):
    """The power [W] that all dampers turn into heat, where nothing is in series with them."""
    n = corners.size
    m = _WHEELS + n
    power = 0.0
    for i in range(n):
        c = corners[i]
        v = state[m + _WHEELS + i] - state[m + _HEAVE] - c.ahead * state[m + _PITCH] - c.left * state[m + _ROLL]
        power += v * damper_force(v, health * c.bump, health * c.rebound, c.knee, c.slope)
    return power


@njit(**INSIDE)
def _rates(state, out, body, corners, road, road_rate, dry, health, warmth):
    """d(state)/dt into ``out``; ``dry`` is each corner's present friction force, ``health`` what fading and the
    driving speed made of the dampers, ``warmth`` what warming made of the tires."""
    n = corners.size
    m = _WHEELS + n
    inner = 2 * m
    heave = turn = tilt = together = 0.0
    for i in range(n):
        c = corners[i]
        wheel, wheel_rate = state[_WHEELS + i], state[m + _WHEELS + i]
        x = wheel - state[_HEAVE] - c.ahead * state[_PITCH] - c.left * state[_ROLL]
        climb = state[m + _HEAVE] + c.ahead * state[m + _PITCH] + c.left * state[m + _ROLL]
        v = wheel_rate - climb
        force = force_by_travel(x, v, c) + dry[i] + force_with_memory(state, out, c, x, v, inner + i, n, health)
        if c.friction > 0 and body.slip > 0:
            force += c.friction * np.tanh(v / body.slip)
        if c.sky > 0 and climb * v < 0:  # semi-active: a damper that pulls only the way that it can
            force += np.sign(v) * min(c.sky * abs(climb), c.sky_most * abs(v))
        hung = absorber_force(state, out, c, wheel, wheel_rate, inner + i, n)
        squash = road[i] - wheel
        tire = warmth * c.tire * squash + c.tire_cubic * squash**3 + c.tire_damper * (road_rate[i] - wheel_rate)
        if tire < -c.load:
            tire = -c.load
        out[_WHEELS + i] = wheel_rate
        out[m + _WHEELS + i] = (tire - force + hung) / c.mass
        heave += force
        turn += c.ahead * force
        tilt += c.left * force
        together += force
    for j in range(_WHEELS):
        out[j] = state[m + j]
    out[m + _SEAT] = out[m + _TOW] = out[m + _BEND] = 0.0
    if body.seat_mass > 0:
        pull = (body.seat_spring * (state[_SEAT] - state[_HEAVE])
                + body.seat_damper * (state[m + _SEAT] - state[m + _HEAVE]))
        heave += pull
        out[m + _SEAT] = -pull / body.seat_mass
    if body.tow_mass > 0:
        pull = (body.tow_spring * (state[_TOW] - state[_HEAVE] - body.tow_ahead * state[_PITCH])
                + body.tow_damper * (state[m + _TOW] - state[m + _HEAVE] - body.tow_ahead * state[m + _PITCH]))
        heave += pull
        turn += body.tow_ahead * pull
        out[m + _TOW] = -pull / body.tow_mass
    if body.bend_gain != 0:
        out[m + _BEND] = (body.bend_gain * together - 2 * body.bend_zeta * body.bend_omega * state[m + _BEND]
                          - body.bend_omega**2 * state[_BEND])
    out[m + _HEAVE] = heave / body.mass
    out[m + _PITCH] = turn / body.pitch
    out[m + _ROLL] = tilt / body.roll


@njit(**INSIDE)
def _rub(state, dry, body, corners, dt):
    """Correct the friction forces so that each corner sticks if it can, and the rates with them."""
    n = corners.size
    m = _WHEELS + n
    for _ in range(12):
        for i in range(n):
            c = corners[i]
            v = (state[m + _WHEELS + i] - state[m + _HEAVE] - c.ahead * state[m + _PITCH]
                 - c.left * state[m + _ROLL])
            ease = 1 / c.mass + 1 / body.mass + c.ahead**2 / body.pitch + c.left**2 / body.roll
            wanted = dry[i] + v / (ease * dt)
            wanted = min(max(wanted, -c.friction), c.friction)
            push = (wanted - dry[i]) * dt
            dry[i] = wanted
            state[m + _WHEELS + i] -= push / c.mass
            state[m + _HEAVE] += push / body.mass
            state[m + _PITCH] += push * c.ahead / body.pitch
            state[m + _ROLL] += push * c.left / body.roll
            state[m + _BEND] += push * body.bend_gain


@njit(**INSIDE)
def _go_along(trial, state, by, rates):
    for j in range(trial.size):
        trial[j] = state[j] + by * rates[j]


@njit(cache=True, error_model="numpy", nogil=True)
def integrate(body, corners, road, road_rate, dt, sticks, first, keep, firmness):
    """Runge-Kutta over roads (2 N + 1, corners) given at every half step, from the state ``first``; ``firmness`` (N,):
    how firm the dampers are in each step, of one.

    Returns the rates of heave, pitch and bending after every step (N + 1, 3), and all states if ``keep``.
    """
    n = corners.size
    size = 2 * (_WHEELS + n) + INNER * n
    m = _WHEELS + n
    steps = (road.shape[0] - 1) // 2
    motion = np.zeros((steps + 1, 3))
    states = np.zeros((steps + 1 if keep else 1, size))
    state, trial = first.copy(), np.zeros(size)
    k1, k2, k3, k4 = np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size)
    dry = np.zeros(n)
    health = warmth = 1.0
    heat = 0.0
    for step in range(steps + 1):
        motion[step, 0] = state[m + _HEAVE]
        motion[step, 1] = state[m + _PITCH]
        motion[step, 2] = state[m + _BEND]
        if keep:
            for j in range(size):
                states[step, j] = state[j]
        if step == steps:
            break
        if body.fade > 0:
            health = 1 - body.fade * (1 - np.exp(-step * dt / body.fade_s))
        if body.heat > 0:
            heat += dt * (body.heat * _dissipated(state, corners, health) - heat / body.heat_s)
            health = np.exp(-heat)
        if body.warm > 0:
            warmth = 1 + body.warm * (1 - np.exp(-step * dt / body.warm_s))
        h, fit = 2 * step, health * firmness[step]
        _rates(state, k1, body, corners, road[h], road_rate[h], dry, fit, warmth)
        _go_along(trial, state, 0.5 * dt, k1)
        _rates(trial, k2, body, corners, road[h + 1], road_rate[h + 1], dry, fit, warmth)
        _go_along(trial, state, 0.5 * dt, k2)
        _rates(trial, k3, body, corners, road[h + 1], road_rate[h + 1], dry, fit, warmth)
        _go_along(trial, state, dt, k3)
        _rates(trial, k4, body, corners, road[h + 2], road_rate[h + 2], dry, fit, warmth)
        for j in range(size):
            state[j] += dt / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j])
        if sticks:
            _rub(state, dry, body, corners, dt)
    return motion, states


def finer(ready: Ready, step_s: float) -> int:
    """Into how many parts a step must be cut for the steepest friction and the stiffest mount."""
    corners = ready.corners
    slopes = np.minimum(corners["slope"], 1.0) * np.minimum(corners["bump"], corners["rebound"])
    steepest = float(np.max(corners["mount"] / slopes))
    if not ready.sticks:
        steepest = max(steepest, float(np.max(corners["friction"] / corners["mass"])) * 1.2 / SLIP_MPS)
    steepest = max(steepest, float(np.max(corners["stribeck"] / corners["mass"])) * 1.2 / SLIP_MPS)
    return max(1, int(np.ceil(steepest * step_s / _STIFFEST)))


def ride(ready: Ready, road: Array, road_rate: Array, step_s: float, keep: bool = False, firmness: Array | None = None,
         ) -> tuple[Array, Array]:
    """Drive over wheel paths (2 N + 1, corners) [m], [m/s], from rest on their first elevation.

    Returns rates (N + 1, 3) of heave [m/s], pitch [rad/s], bending [m/s] and, if asked, all states.
    """
    n = ready.corners.size
    first = np.zeros(2 * (_WHEELS + n) + INNER * n)
    start = road[0]
    first[_WHEELS:_WHEELS + n] = start
    absorbers = 2 * (_WHEELS + n) + ABSORBER * n
    first[absorbers:absorbers + n] = start
    places = np.column_stack([np.ones(n), ready.corners["ahead"], ready.corners["left"]])
    first[:3] = np.linalg.lstsq(places, start, rcond=None)[0]
    first[_SEAT] = first[_HEAVE]
    first[_TOW] = first[_HEAVE] + ready.body["tow_ahead"] * first[_PITCH]
    if firmness is None:
        firmness = np.ones((len(road) - 1) // 2)
    return integrate(ready.body, ready.corners, road, road_rate, step_s, ready.sticks, first, keep, firmness)
