"""How a sensor sits in the car, from what it feels while driving: gravity shows which way is up, braking shows which
way is forward.

Problem: a sensor is bolted on tilted, the wrong axis is named in the settings, a bracket comes loose: the roughness is
wrong and nothing shows it. Solution: the mean of what is felt over minutes of driving is gravity, for acceleration,
curves and hills come to little; the direction that goes with the car's speed is forward (``receiver_delay``). Stretches
of a drive are compared with what was before.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, hypot, radians

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

TILT_DEG = 10.0
ZERO_ERROR_DEG = 2.0
"""So much tilt a zero offset of 0.35 m/s2 feigns; within it nothing is said of tilt."""
WRONG_AXIS_DEG = 45.0
MOVED_DEG = 6.0
TURNED_DEG = 15.0
DEVIATIONS = 5.0
"""Curves and hills are no noise: 4 of these are met now and then."""
LEAST_GRAVITY_MPS2 = 1.0
"""A sensor that feels less is dead, and says nothing of how it sits."""
TINY_MPS2 = 1e-12


@dataclass(frozen=True)
class Sitting:
    """A stretch of driving: mean of the readings (3,), and its error as an angle [rad]; forward (3,), a unit vector,
    and its error about the vertical [rad]; None: not known."""

    gravity: Array
    gravity_std_rad: float
    forward: Array | None = None
    forward_std_rad: float | None = None


def sitting(means: Array, forward: Array | None, forward_std_rad: float | None) -> Sitting:
    """Of blocks with mean readings (n, 3), n at least 2."""
    gravity = means.mean(axis=0)
    size = max(float(np.linalg.norm(gravity)), TINY_MPS2)
    up = gravity / size
    across = means - np.outer(means @ up, up)
    error = float(np.sqrt(np.sum((across - across.mean(axis=0)) ** 2) / (len(means) - 1) / len(means)))
    return Sitting(gravity, error / size, forward, forward_std_rad)


def angle_rad(one: Array, other: Array) -> float:
    """Between two directions (3,), 0 to pi."""
    return float(np.arctan2(np.linalg.norm(np.cross(one, other)), one @ other))


def axis_word(direction: Array) -> str:
    """The sensor's axis nearest to a direction (3,): ``+x``."""
    column = int(np.argmax(np.abs(direction)))
    return f"{'-' if direction[column] < 0 else '+'}{'xyz'[column]}"


def heading_deg(forward: Array, column: int, sign: float) -> float:
    """Mounting angle about the vertical axis (column and sign): how far forward is turned, counterclockwise from above,
    from the sensor's next axis (x for z, y for x, z for y), -180 to 180."""
    ahead = np.eye(3)[(column + 1) % 3]
    up = sign * np.eye(3)[column]
    return degrees(float(np.arctan2(forward @ np.cross(up, ahead), forward @ ahead)))


def tilt_complaint(now: Sitting, column: int, sign: float) -> str:
    """What is wrong with the axis that is set to point up (its column and sign); empty: nothing, or it feels no
    gravity."""
    if np.linalg.norm(now.gravity) < LEAST_GRAVITY_MPS2:
        return ""
    word = f"{'-' if sign < 0 else '+'}{'xyz'[column]}"
    tilt_deg = degrees(angle_rad(now.gravity, sign * np.eye(3)[column]))
    std_deg = hypot(degrees(now.gravity_std_rad), ZERO_ERROR_DEG)
    if tilt_deg > WRONG_AXIS_DEG:
        felt = axis_word(now.gravity)
        return f"gravity is felt along {felt}, not along {word}: set vertical_axis: {felt}, or mount it as it was meant"
    if tilt_deg > TILT_DEG + std_deg:
        return f"it is tilted by {tilt_deg:.0f} ± {std_deg:.0f} degrees: mount it level"
    return ""


def has_moved(before: Sitting, now: Sitting) -> str:
    """How a sensor sits otherwise than before, in words; empty: it does not, or no gravity is felt."""
    if min(np.linalg.norm(before.gravity), np.linalg.norm(now.gravity)) < LEAST_GRAVITY_MPS2:
        return ""
    tilted = angle_rad(before.gravity, now.gravity)
    if tilted > max(radians(MOVED_DEG), DEVIATIONS * hypot(before.gravity_std_rad, now.gravity_std_rad)):
        return f"it has tilted by {degrees(tilted):.0f} degrees"
    if before.forward is None or now.forward is None:
        return ""
    turned = angle_rad(before.forward, now.forward)
    error = hypot(before.forward_std_rad or 0.0, now.forward_std_rad or 0.0)
    if turned > max(radians(TURNED_DEG), DEVIATIONS * error):
        return f"it has turned by {degrees(turned):.0f} degrees"
    return ""
