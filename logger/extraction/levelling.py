"""Which way is up for a recorder that lies anyhow: gravity shows it.

Problem: a phone sits in its mount at any angle, its program may write g or m/s2, count all axes the other way round,
leave gravity out, and the phone may slip half way. Solution: over tens of seconds of driving what a recorder feels is
gravity, for braking, curves and hills come to little; a mean that outliers do not move is taken of the means of short
blocks. Its size shows the unit, its direction the vertical. An accelerometer at rest feels a push upwards of 1 g; a
program that writes the opposite does so for every acceleration, so along the direction in which gravity is felt both
read the same.

A turn in the mount is a lasting change of that direction that is larger than braking and curves can feign: within the
time that is compared a car changes its velocity by no more than ``_CHANGE_MPS``, and what is left is held against the
scatter of the blocks (``estimation.mounting``).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, radians

import numpy as np
import numpy.typing as npt

from logger.estimation.mounting import MOVED_DEG, angle_rad, has_moved, sitting
from logger.units import STANDARD_GRAVITY_MPS2

Array = npt.NDArray[np.float64]

BLOCK_S = 2.0
LEAST_PART_S = 10.0
"""What sat still for less than that says nothing of how it sat."""
GRAVITY_WITHIN = 0.05
"""Zero errors of 0.3 m/s2 and gains that are 2 % off are what phones have."""
NO_GRAVITY_MPS2 = 0.7
"""Less than that is braking and errors of zero (as ``GRAVITY_WITHIN``), and no gravity."""
_CHANGE_MPS = 25.0  # from 90 km/h to a halt
_ROUNDS = 30
_FINE_S = 0.2


@dataclass(frozen=True)
class Felt:
    """What is felt on the whole: the vector (axes,) in the unit of the record, its size, and how many m/s2 are one unit
    if that is gravity, in m/s2, g or thousandths of g; None: it is not."""

    mean: Array
    size: float
    unit_mps2: float | None


def felt(time_s: Array, samples: Array, unit_mps2: float | None = None) -> Felt:
    """Of samples (n, axes) at times (n,) [s], in a unit of so many m/s2; None: not known, the size of gravity shows
    it."""
    mean = steady_mean(block_means(time_s, samples, BLOCK_S)[1])
    size = float(np.linalg.norm(mean))
    units = (1.0, STANDARD_GRAVITY_MPS2, STANDARD_GRAVITY_MPS2 / 1000.0) if unit_mps2 is None else (unit_mps2,)
    fits = [one for one in units if abs(size * one / STANDARD_GRAVITY_MPS2 - 1.0) < GRAVITY_WITHIN]
    return Felt(mean, size, fits[0] if fits else None)


def block_means(time_s: Array, samples: Array, block_s: float) -> tuple[Array, Array]:
    """Middles (k,) [s] and means (k, axes) of blocks of so long, in which there are samples."""
    number = np.floor((time_s - time_s[0]) / block_s).astype(np.int64)
    there, first = np.unique(number, return_inverse=True)
    counts = np.bincount(first)
    means = np.stack([np.bincount(first, axis) / counts for axis in samples.T], axis=1)
    return time_s[0] + (there + 0.5) * block_s, means


def steady_mean(means: Array) -> Array:
    """The geometric median (axes,) of vectors (k, axes): half of them may be anything, and it turns as they turn.

    Source: E. Weiszfeld, Tohoku Mathematical Journal 43, 1937.
    """
    found = means.mean(axis=0)
    for _ in range(_ROUNDS):
        apart = np.linalg.norm(means - found, axis=1)
        weight = 1.0 / np.maximum(apart, 1e-6 * (apart.max() or 1.0) + 1e-12)
        found = weight @ means / weight.sum()
    return np.asarray(found)


def upwards(time_s: Array, samples: Array) -> tuple[Array, float]:
    """What of samples (n, axes) [m/s2] points up (n,), without gravity, and how far gravity lies from the nearest axis
    [rad]."""
    gravity = felt(time_s, samples).mean
    size = float(np.linalg.norm(gravity))
    up = gravity / size
    return samples @ up - size, float(np.arccos(min(1.0, np.abs(up).max())))


def turns(time_s: Array, samples: Array) -> list[tuple[float, str]]:
    """When a recorder turned in its mount [s], and by how much in words, in order of time."""
    at_s, means = block_means(time_s, samples, BLOCK_S)
    found = []
    for place, words in _turns(means):
        middle_s = 0.5 * (at_s[place - 1] + at_s[place])
        near = np.abs(time_s - middle_s) <= 2 * BLOCK_S
        found.append((_instant(time_s[near], samples[near]), words))
    return found


def _turns(means: Array, first: int = 0) -> list[tuple[int, str]]:
    """Blocks (k, 3) at which something else begins, counted from ``first``."""
    least = round(LEAST_PART_S / BLOCK_S)
    if len(means) < 2 * least:
        return []
    sizes = np.arange(1, len(means))[:, None]
    before = np.cumsum(means, axis=0)[:-1] / sizes
    after = np.cumsum(means[::-1], axis=0)[:-1][::-1] / sizes[::-1]
    apart = np.linalg.norm(after - before, axis=1) * np.sqrt(sizes * sizes[::-1])[:, 0]
    place = least + int(np.argmax(apart[least - 1 : len(means) - least]))
    sides = [sitting(one, None, None) for one in (means[:place], means[place:])]
    words = has_moved(*sides)
    shorter_s = min(place, len(means) - place) * BLOCK_S
    feigned = atan(_CHANGE_MPS / shorter_s / STANDARD_GRAVITY_MPS2)
    if not words or angle_rad(sides[0].gravity, sides[1].gravity) < max(radians(MOVED_DEG), feigned):
        return []
    return [*_turns(means[:place], first), (first + place, words), *_turns(means[place:], first + place)]


def _instant(time_s: Array, samples: Array) -> float:
    """The instant after which samples (n, 3) of some seconds are others than before [s]."""
    at_s, means = block_means(time_s, samples, _FINE_S)
    if len(at_s) < 3:
        return float(time_s.mean())
    left = [float(np.sum((one - one.mean(axis=0)) ** 2) + np.sum((other - other.mean(axis=0)) ** 2))
            for one, other in ((means[:place], means[place:]) for place in range(1, len(means)))]
    return float(0.5 * (at_s[(place := int(np.argmin(left)))] + at_s[place + 1]))
