"""A speed bump and a step as tires meet them, in closed form, with what changes when they change.

Problem: an obstacle whose height, width or place is to be found moves a little with every step of a fit, and a profile
of samples would move in jumps. Solution: a tire's average over its patch, and the mean of that over a step of the way,
are differences of the shape's first and second integral along the road. Both have formulas, and so have their
derivatives by each number; nothing is sampled.

What passes is described as ``TirePath`` does it: an elevation at each place, and a mean from each place to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Integral = Callable[[Array], Array]

# A shorter patch is taken for one of this length, and over a shorter step the mean is that of its ends [m].
_LEAST_PATCH_M = 1e-3
_SHORT_STEP_M = 1e-4
# 38.1 mm of 4.4.5 and 150 mm by 2.60 m of 4.4.3 are usual; these are not.
LARGEST_HEIGHT_M = 1.0
LARGEST_WIDTH_M = 50.0


@dataclass(frozen=True)
class ObstaclePath:
    """Something on a flat road that begins at ``start_m``, from ``length_m`` on stays at ``after_m``, and has these
    integrals along the road from its beginning on, ``scale`` times, averaged over a patch."""

    start_m: float
    length_m: float
    after_m: float
    first: Integral
    second: Integral
    scale: float
    patch_m: float

    def step_means(self, distance_m: Array) -> tuple[Array, Array]:
        """As ``TirePath.step_means``: elevation (N,) and mean (N - 1,) from each place to the next [m]."""
        half = max(self.patch_m, _LEAST_PATCH_M) / 2
        along = distance_m - self.start_m
        low, high = np.minimum(along[:-1], along[1:]), np.maximum(along[:-1], along[1:])
        near = (high > -half) & (low < self.length_m + half)
        elevation = np.where(along > self.length_m / 2, self.after_m, 0.0)
        mean = np.where(low > self.length_m / 2, self.after_m, 0.0)
        if near.any():
            part = slice(int(np.argmax(near)), len(near) - int(np.argmax(near[::-1])) + 1)
            x = along[part]
            at = (self.first(x + half) - self.first(x - half)) / (2 * half)
            rise = np.diff(self.second(x + half) - self.second(x - half)) / (2 * half)
            step = np.diff(x)
            short = np.abs(step) < _SHORT_STEP_M
            elevation[part] = at
            mean[part.start : part.stop - 1] = np.where(short, (at[1:] + at[:-1]) / 2, rise / np.where(short, 1, step))
        return self.scale * elevation, self.scale * mean


@dataclass(frozen=True)
class Bump:
    """One period of a raised cosine (Eq 4.41 and 4.42 of Blum 2015, over distance) [m].

    ValueError for a width that is not above 0, or a bump out of all proportion.
    """

    start_m: float
    height_m: float
    width_m: float

    def __post_init__(self) -> None:
        _check_height(self.height_m)
        if not 0 < self.width_m <= LARGEST_WIDTH_M:
            raise ValueError(f"bump: expected a width above 0 and up to {LARGEST_WIDTH_M:g} m, found {self.width_m:g}")

    @property
    def length_m(self) -> float:
        """From where it begins to where the road is as it will stay [m]."""
        return self.width_m

    def path(self, patch_m: float) -> ObstaclePath:
        """What tires of this patch [m] meet."""
        return self._path(self._level, self._area, self.height_m, patch_m)

    def slopes(self, patch_m: float) -> dict[str, ObstaclePath]:
        """Derivatives of that by each number."""
        return {
            "start_m": self._path(self._minus_shape, self._minus_level, self.height_m, patch_m),
            "height_m": self._path(self._level, self._area, 1.0, patch_m),
            "width_m": self._path(self._level_by_width, self._area_by_width, self.height_m, patch_m),
        }

    def _path(self, first: Integral, second: Integral, scale: float, patch_m: float) -> ObstaclePath:
        return ObstaclePath(self.start_m, self.width_m, 0.0, first, second, scale, patch_m)

    def _inside(self, x: Array) -> tuple[Array, Array]:
        """Places cut off at both ends of the bump, and the phase there."""
        cut = np.clip(x, 0.0, self.width_m)
        return cut, 2 * np.pi / self.width_m * cut

    def _minus_shape(self, x: Array) -> Array:
        return -0.5 * (1 - np.cos(self._inside(x)[1]))

    def _level(self, x: Array) -> Array:
        cut, phase = self._inside(x)
        return 0.5 * (cut - self.width_m / (2 * np.pi) * np.sin(phase))

    def _minus_level(self, x: Array) -> Array:
        return -self._level(x)

    def _area(self, x: Array) -> Array:
        cut, phase = self._inside(x)
        wave = self.width_m / (2 * np.pi)
        return 0.25 * cut**2 + 0.5 * wave**2 * (np.cos(phase) - 1) + 0.5 * self.width_m * (np.maximum(x, cut) - cut)

    def _level_by_width(self, x: Array) -> Array:
        cut, phase = self._inside(x)
        return 0.5 * (cut / self.width_m * np.cos(phase) - np.sin(phase) / (2 * np.pi))

    def _area_by_width(self, x: Array) -> Array:
        cut, phase = self._inside(x)
        inside = self.width_m / (2 * np.pi**2) * (np.cos(phase) - 1) + cut / (2 * np.pi) * np.sin(phase)
        return 0.5 * inside + 0.5 * (np.maximum(x, cut) - cut)


@dataclass(frozen=True)
class RoadStep:
    """A joint after which the road stays higher, or with a negative height lower (4.4.5 of Blum 2015) [m]."""

    start_m: float
    height_m: float

    def __post_init__(self) -> None:
        _check_height(self.height_m)

    @property
    def length_m(self) -> float:
        """It has none."""
        return 0.0

    def path(self, patch_m: float) -> ObstaclePath:
        """What tires of this patch [m] meet."""
        return ObstaclePath(self.start_m, 0.0, 1.0, _ramp, _parabola, self.height_m, patch_m)

    def slopes(self, patch_m: float) -> dict[str, ObstaclePath]:
        """Derivatives of that by each number."""
        return {
            "start_m": ObstaclePath(self.start_m, 0.0, 0.0, _minus_edge, _minus_ramp, self.height_m, patch_m),
            "height_m": ObstaclePath(self.start_m, 0.0, 1.0, _ramp, _parabola, 1.0, patch_m),
        }


Obstacle = Bump | RoadStep


def _minus_edge(x: Array) -> Array:
    return -(x >= 0).astype(np.float64)


def _ramp(x: Array) -> Array:
    return np.maximum(x, 0.0)


def _minus_ramp(x: Array) -> Array:
    return -np.maximum(x, 0.0)


def _parabola(x: Array) -> Array:
    return 0.5 * np.maximum(x, 0.0) ** 2


def _check_height(height_m: float) -> None:
    if not 0 < abs(height_m) <= LARGEST_HEIGHT_M:
        raise ValueError(f"expected a height other than 0, within {LARGEST_HEIGHT_M:g} m, found {height_m:g}")
