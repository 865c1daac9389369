"""A drive's readings and fixes, as they come, into what they show of the receiver's delay and the sensor's mounting.

Readings are kept for a block of ``BLOCK_S`` only; a block begins with a fix and is done once the readings are
``WAIT_S`` past its end, for fixes come late. How readings and fixes are split between calls changes nothing.

Mounting. Problem: a sensor is bolted on tilted, the wrong axis is named in the settings, a bracket comes loose: the
roughness is wrong and nothing shows it. Solution: the mean of what is felt over minutes of driving is gravity, for
acceleration, curves and hills come to little; the direction that goes with the car's speed is forward
(``receiver_delay``). Stretches of a drive are compared with what was before.
"""

from dataclasses import dataclass
from math import degrees, hypot, radians

import numpy as np

from logger.arrays import Array
from logger.estimation.receiver_delay import (
    BLOCK_S,
    DELAYS_S,
    DelayEstimate,
    DelayInformation,
    Stretch,
    block_information,
    estimate,
    forward_of,
    with_block,
)

WAIT_S = 5.0
PART_BLOCKS = 6
"""So many blocks together are compared with what was before: four minutes of driving."""
LONGEST_READINGS = 100_000
LONGEST_SILENCE_S = 60.0
"""Of the sensor: the fixes that came in it are of no use."""
_BEFORE_S = float(DELAYS_S[-1]) + 0.1
_AFTER_S = 0.1 - float(DELAYS_S[0])
TILT_DEG = 10.0
ZERO_ERROR_DEG = 2.0
"""So much tilt a zero offset of 0.35 m/s2 feigns; within it nothing is said of tilt."""
WRONG_AXIS_DEG = 45.0
MOVED_DEG = 6.0
TURNED_DEG = 15.0
DEVIATIONS = 5.0
"""Curves and hills are no noise: 4 of these are met now and then. Of ways by speeds and by places (``SpeedCheck``) 4
raise no false alarm in 10 h of town: a margin of one."""
LEAST_GRAVITY_MPS2 = 1.0
"""A sensor that feels less is dead, and says nothing of how it sits."""


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
    size = float(np.linalg.norm(gravity)) or 1.0
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
        return f"gravity is felt along {felt}, not along {word}: set vertical_axis: {felt}, or turn the sensor"
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


class DriveAlignment:
    """column, sign    of the sensor's axis that is set to point up

    ``moved`` says how the sensor came loose, and when; empty: it did not. ``kept_readings`` are in memory.
    """

    def __init__(self, column: int, sign: float) -> None:
        self._column = column
        self._sign = sign
        self._readings: list[tuple[Array, Array]] = []
        self.kept_readings = 0
        self._fixes: list[tuple[float, float]] = []
        self._known = DelayInformation.none()
        self._part = DelayInformation.none()
        self._means: list[Array] = []
        self._before: Sitting | None = None
        self._first_s: float | None = None
        self._found: DelayEstimate | None = None
        self.moved = ""

    def take_readings(self, time_s: Array, accel: Array) -> None:
        """The next readings: times (n,) [s] and three axes (n, 3). Those that are not after the last ones, or are no
        numbers, are left out."""
        known = np.isfinite(accel).all(axis=1)
        if not known.all():
            time_s, accel = time_s[known], accel[known]
        if self._readings and len(time_s):
            later = time_s > self._readings[-1][0][-1]
            time_s, accel = time_s[later], accel[later]
        if not len(time_s):
            return
        self._readings.append((time_s, accel))
        self.kept_readings += len(time_s)
        if not self._fixes:
            self._forget(float(time_s[-1]) - WAIT_S)
        while self._fixes and time_s[-1] >= self._fixes[0][0] + BLOCK_S + WAIT_S:
            self._end_block()
        if self.kept_readings > LONGEST_READINGS:
            self._fixes.clear()
            self._forget(float(time_s[-1]))

    def take_fix(self, time_s: float, speed_mps: float) -> None:
        """The next fix, late by the delay that is sought [s, m/s]."""
        if self._fixes and time_s - self._fixes[0][0] > BLOCK_S + LONGEST_SILENCE_S:
            self._fixes.clear()
        if not self._fixes or time_s > self._fixes[-1][0]:
            self._fixes.append((time_s, speed_mps))

    def estimate(self) -> DelayEstimate:
        """The delay and forward, as far as they are known by now."""
        if self._found is None:
            self._found = estimate(self._known)
        return self._found

    @property
    def complaints(self) -> tuple[str, ...]:
        """What is wrong with the mounting, in words."""
        seen = self._before or (sitting(np.array(self._means), None, None) if len(self._means) > 2 else None)
        tilted = tilt_complaint(seen, self._column, self._sign) if seen is not None else ""
        return tuple(words for words in (self.moved, tilted) if words)

    def _end_block(self) -> None:
        begin_s = self._fixes[0][0]
        end_s = begin_s + BLOCK_S
        count = sum(time_s < end_s for time_s, _ in self._fixes)
        fixes, self._fixes = np.array(self._fixes[:count]), self._fixes[count:]
        time_s = np.concatenate([part[0] for part in self._readings])
        accel = np.concatenate([part[1] for part in self._readings])
        low, high = np.searchsorted(time_s, [begin_s - _BEFORE_S, end_s + _AFTER_S])
        stretch = Stretch(time_s[low:high], accel[low:high], fixes[:, 0], fixes[:, 1])
        block = block_information(self._known, stretch)
        if block is not None:
            self._found = None
            self._known = with_block(self._known, block)
            self._part = with_block(self._part, block)
            self._means.append(block.mean)
            self._first_s = begin_s if self._first_s is None else self._first_s
            if len(self._means) == PART_BLOCKS:
                self._end_part(end_s)
        self._forget(min(end_s, float(time_s[-1]) - WAIT_S))

    def _end_part(self, end_s: float) -> None:
        """Compare a part with what was before; after a sensor has moved, start over."""
        forward, std_rad = forward_of(self._part, self._known)
        now = sitting(np.array(self._means), forward, std_rad)
        self._means, self._part = [], DelayInformation.none()
        words = has_moved(self._before, now) if self._before is not None else ""
        if words and self._first_s is not None:
            self.moved = f"{words} {(end_s - self._first_s) / 60:.0f} min after the drive began: fasten it"
            self._known, self._before = DelayInformation.none(), None
            return
        self._before = now if self._before is None else self._joined(self._before, now)

    def _joined(self, before: Sitting, now: Sitting) -> Sitting:
        """All that was before, by now: a slow drift is no jolt, so the latest counts by its share of three."""
        gravity = before.gravity + (now.gravity - before.gravity) / 3
        found = estimate(self._known)
        return Sitting(gravity, before.gravity_std_rad, found.forward, found.forward_std_rad)

    def _forget(self, until_s: float) -> None:
        while self._readings and self._readings[0][0][-1] < until_s - _BEFORE_S - 1.0:
            self.kept_readings -= len(self._readings.pop(0)[0])
