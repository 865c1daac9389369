"""A car by Newton's laws, force by force, integrated by SciPy: the judge of the simulation, sharing nothing with it.

Wheel by wheel: the body's end over it moves with heave, pitch and roll; spring and damper press between that end and
the wheel; the tire presses between the wheel and the road. The road under a tire is a spline's integral over the patch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from logger.vehicle.vehicle import Vehicle

FAR_M = 60.0


@dataclass(frozen=True)
class Wheel:
    ahead_m: float
    left_m: float
    mass_kg: float
    k: float
    c: float
    tire: float
    column: int


@dataclass(frozen=True)
class Told:
    """Motions (N,) or, of the wheels, (N, w)."""

    body_mps2: np.ndarray
    pitch_radps2: np.ndarray
    roll_radps2: np.ndarray
    wheel_mps2: np.ndarray
    travel_m: np.ndarray
    tire_m: np.ndarray


def wheels_of(vehicle: Vehicle) -> list[Wheel]:
    half_m = (vehicle.track_width_m or 0.0) / 2
    sides = ((half_m, 0), (-half_m, 1)) if half_m else ((0.0, 0),)
    ends = [(vehicle.front, 1)] + ([(vehicle.rear, -1)] if vehicle.rear else [])
    return [
        Wheel(sign * axle.cg_distance_m, left_m, axle.unsprung_mass_kg, axle.suspension_stiffness_n_per_m,
              axle.suspension_damping_n_s_per_m, axle.tire_stiffness_n_per_m, column)
        for axle, sign in ends for left_m, column in sides
    ]


def road_under(
    start_m: float, spacing_m: float, elevation_m: np.ndarray, patch_m: float
) -> Callable[[np.ndarray], np.ndarray]:
    """Mean of the straight lines between the samples over a patch centred at a distance; flat outside."""
    x = start_m + spacing_m * np.arange(len(elevation_m))
    x = np.concatenate([[x[0] - FAR_M], x, [x[-1] + FAR_M]])
    line = make_interp_spline(x, np.concatenate([elevation_m[:1], elevation_m, elevation_m[-1:]]), k=1)
    if patch_m == 0:
        return line
    area, ends_m = line.antiderivative(), (patch_m / 2, -patch_m / 2)

    def mean(distance: np.ndarray) -> np.ndarray:
        ahead, behind = area(np.add.outer(ends_m, distance))
        return np.asarray((ahead - behind) / patch_m)

    return mean


def judge(
    vehicle: Vehicle, roads: list[Callable[[np.ndarray], np.ndarray]], distance: Callable[[np.ndarray], np.ndarray],
    time_s: np.ndarray, rtol: float = 1e-7,
) -> Told:
    """What the car does at the times, the front tires being at ``distance(time)`` of the left and right road.

    With this ``rtol`` its own error is 5e-6 of the motion or less, against 1e-10 (the kinks of a road end every step
    before the tolerance does).
    """
    wheels = wheels_of(vehicle)
    w = len(wheels)
    a, left, mu, k, c, kt = (np.array([getattr(one, name) for one in wheels])
                             for name in ("ahead_m", "left_m", "mass_kg", "k", "c", "tire"))
    column = np.array([one.column % len(roads) for one in wheels])
    m, pitch_i, roll_i = vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2 or np.inf, vehicle.roll_inertia_kg_m2
    roll_i, b = roll_i or np.inf, vehicle.track_width_m or 1.0
    bars = [axle.anti_roll_stiffness_n_m_per_rad for axle in (vehicle.front, vehicle.rear) if axle and w == 4]

    def under(t: np.ndarray) -> np.ndarray:
        front = distance(t)
        found = np.empty((w, *np.shape(front)))
        for number, road in enumerate(roads):
            found[column == number] = road(np.add.outer(a[column == number] - a[0], front))
        return found

    def accelerations(y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of body, pitch and roll (3, ...) and of the wheels (w, ...); and the suspensions' extension."""
        heights, rates = y[: 3 + w], y[3 + w:]

        def extension(q: np.ndarray) -> np.ndarray:
            return q[0] + np.multiply.outer(a, q[1]) + np.multiply.outer(left, q[2]) - q[3:]

        x, across = extension(heights), (slice(None),) + (None,) * (y.ndim - 1)
        force = k[across] * x + c[across] * extension(rates)  # pulls the body down, the wheel up
        for axle, bar in enumerate(bars):
            twist = bar * (x[2 * axle] - x[2 * axle + 1]) / b**2
            force[2 * axle] += twist
            force[2 * axle + 1] -= twist
        body = -np.array([force.sum(axis=0) / m, (a[across] * force).sum(axis=0) / pitch_i,
                          (left[across] * force).sum(axis=0) / roll_i])
        return body, (force - kt[across] * (heights[3:] - z)) / mu[across], x

    def rates(y: np.ndarray, z: np.ndarray) -> np.ndarray:
        body, wheel, _ = accelerations(y, z)
        return np.concatenate([y[3 + w:], body, wheel])

    # All of it is linear: what one state or one height does, a unit of it shows.
    states = 2 * (3 + w)
    by_state = rates(np.eye(states), np.zeros((w, states)))
    by_height = rates(np.zeros((states, w)), np.eye(w))

    def derivative(t: float, y: np.ndarray) -> np.ndarray:
        return np.asarray(by_state @ y + by_height @ under(np.asarray(t)))

    start = under(np.asarray(time_s[0]))
    # Standing still: the plane through the road under the wheels, if they are all in one; tests take care of that.
    plane, *_ = np.linalg.lstsq(np.stack([np.ones(w), a, left], axis=1), start, rcond=None)
    rest = np.concatenate([plane, start, np.zeros(3 + w)])
    found = solve_ivp(derivative, (time_s[0], time_s[-1]), rest, "DOP853", time_s, rtol=rtol, atol=1e-13, max_step=4e-3)
    z = under(time_s)
    body, wheel, travel = accelerations(found.y, z)
    return Told(*body, wheel.T, travel.T, (found.y[3:3 + w] - z).T)
