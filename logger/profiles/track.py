"""A road as a car's tires meet it.

Problem: a profile is samples, and a tire does not read samples. It averages the road over its contact patch, each
wheel at a place of its own, and a simulation in steps of time also wants to know what passed under it between two
instants: at 30 m/s that is several samples and all their corners.

Solution: between samples the road is a straight line, and before and after them it is flat at its end elevations.
Then the average over the patch is made of parabolas, and the integral of that along the road is made of cubics.
``TirePath`` holds them, so that every average, over a patch or over a patch and a step of the way, is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from logger.arrays import ROUNDING, Array

# A patch shorter than this is a point, and the mean over a shorter step that of its two ends: averages over less would
# drown in rounding, and no profile is so fine.
POINT_M = 1e-4
MOST_STEPS = 5_000_000  # what a simulation may hold in memory at once
_KEPT_PATHS = 3


class Stance(Protocol):
    """Where wheels (w,) stand, behind the front and left of the middle, their patch [m]; or a mass on a base."""

    @property
    def behind_m(self) -> Array: ...

    @property
    def left_m(self) -> Array: ...

    @property
    def contact_patch_m(self) -> float: ...

    @property
    def on_base(self) -> bool: ...


class Alteration(Protocol):
    """How a road differs from its profile, or a force from its record; equal for two that differ alike."""

    def __call__(self, sampling: float, samples: Array, /) -> Array:
        """What acts (n,), of what was written (n,): elevations [m] at this spacing [m], or a force [N] at this rate."""

    def __hash__(self) -> int: ...


Alterations = tuple[Alteration, ...]
"""What is done to a profile, or to each force, one after the other; nothing: what acts is what was written."""


@dataclass(frozen=True, eq=False)
class Way:
    """The way of a car in fine steps of time, (M,) each: where the front tires stand [m], and when, from the first
    sample of the record on [s]; and which one it is of the runs that are looked at together, from 0 on."""

    distance_m: Array
    time_s: Array
    run: int = 0


class WheelTracks(Protocol):
    """What moves the wheels of cars: a road that they drive along, or a rig that they stand on, driven by time."""

    @property
    def timed(self) -> bool: ...

    def under_wheels(self, way: Way, stance: Stance) -> tuple[Array, Array]:
        """Elevations (M, w) under the wheels on a way, and their means (M - 1, w) over each step [m]."""

    @property
    def acts_on(self) -> tuple[tuple[str, ...], ...]:
        """The parts of a car that each of the forces acts on, which push it besides; on roads there are none."""

    def as_it_is(self, surface: Alterations, actuators: Alterations) -> WheelTracks:
        """The road itself, where it differs from its profile, and the forces that act, where they differ from their
        records."""


@dataclass(frozen=True, eq=False)
class Track:
    """One or two wheel tracks along a road.

    spacing_m      between samples, above 0 [m]
    elevation_m    (n,), or (n, 2) for the left and the right track [m]
    start_m        where the first sample lies [m]

    ValueError for a spacing or an elevation that is not finite, or of another shape, or no sample at all.
    """

    spacing_m: float
    elevation_m: Array
    start_m: float = 0.0

    timed = False
    acts_on: ClassVar[tuple[tuple[str, ...], ...]] = ()

    def __post_init__(self) -> None:
        if not 0 < self.spacing_m < np.inf or not np.isfinite(self.start_m):
            raise ValueError(f"track: expected a spacing above 0 m and a start, found {self.spacing_m}, {self.start_m}")
        shape = self.elevation_m.shape
        if len(shape) not in (1, 2) or shape[0] == 0 or shape[1:] not in ((), (2,)):
            raise ValueError(f"track: expected elevations of shape (n,) or (n, 2), found {shape}")
        if not np.isfinite(self.elevation_m).all():
            raise ValueError("track: expected finite elevations")

    @cached_property
    def _paths(self) -> dict[float, tuple[TirePath, ...]]:
        """What tires of the last few patches met: fits ask for the same ones hundreds of times."""
        return {}

    @cached_property
    def _resurfaced(self) -> dict[Alterations, Track]:
        """The roads of the last few surfaces."""
        return {}

    @property
    def end_m(self) -> float:
        """Where the last sample lies [m]."""
        return self.start_m + self.spacing_m * (len(self.elevation_m) - 1)

    @property
    def two_tracks(self) -> bool:
        """Whether the road is known under the right wheels too."""
        return self.elevation_m.ndim == 2

    def under_wheels(self, way: Way, stance: Stance) -> tuple[Array, Array]:
        """As ``WheelTracks``: each wheel meets the road where it stands."""
        paths = self.tire_paths(stance.contact_patch_m)
        wheels = [(paths[-1] if left_m < 0 else paths[0]).step_means(way.distance_m - behind_m)
                  for behind_m, left_m in zip(stance.behind_m, stance.left_m, strict=True)]
        return np.stack([one for one, _ in wheels], axis=1), np.stack([mean for _, mean in wheels], axis=1)

    def as_it_is(self, surface: Alterations, actuators: Alterations) -> Track:
        """As ``WheelTracks``."""
        if not surface:
            return self
        known = self._resurfaced.get(surface)  # another thread may put others in its place at any time
        if known is None:
            columns = self.elevation_m.reshape(len(self.elevation_m), -1).T
            for one in surface:
                columns = np.stack([one(self.spacing_m, column) for column in columns])
            known = Track(self.spacing_m, columns.T.reshape(self.elevation_m.shape), self.start_m)
            for old in [*self._resurfaced][:-_KEPT_PATHS + 1]:
                self._resurfaced.pop(old, None)
            self._resurfaced[surface] = known
        return known

    def begun(self, later_s: float) -> Track:
        """The same for a record that begins so much later [s]: a road stays where it is."""
        return self

    def under_axle(self, way: Way, behind_m: float, patch_m: float) -> Array:
        """Elevations (M,) under an axle so far behind the front one, tracks averaged [m]."""
        height = self.averaged(way.distance_m - behind_m, patch_m)
        return np.asarray(height.reshape(len(height), -1).mean(axis=1))

    def tire_paths(self, patch_m: float) -> tuple[TirePath, ...]:
        """What tires of this patch [m, 0 or more] meet on each track: one path, or the left and the right one."""
        known = self._paths.get(patch_m)  # another thread may put others in its place at any time
        if known is None:
            columns = self.elevation_m.reshape(len(self.elevation_m), -1).T
            known = tuple(TirePath(self.start_m, self.spacing_m, column, patch_m) for column in columns)
            for old in [*self._paths][:-_KEPT_PATHS + 1]:
                self._paths.pop(old, None)
            self._paths[patch_m] = known
        return known

    def averaged(self, distance_m: npt.ArrayLike, patch_m: float) -> Array:
        """Mean elevation over a patch centred at each distance (m,), exact: (m,), or (m, 2) for two tracks [m]."""
        means = [path.elevation(np.asarray(distance_m, dtype=float)) for path in self.tire_paths(patch_m)]
        return means[0] if self.elevation_m.ndim == 1 else np.stack(means, axis=-1)


class TirePath:
    """Elevations (n,) at start_m, start_m + spacing_m, ..., averaged over a contact patch [m].

    ValueError for a patch below 0, OverflowError for one that no memory holds, which a fit may try. The pieces are
    [knot, next knot) of the average. A patch that is no whole number of spacings puts two knots in each spacing, one
    where its front edge and one where its rear edge passes a sample.
    """

    def __init__(self, start_m: float, spacing_m: float, elevation_m: Array, patch_m: float) -> None:
        if not patch_m >= 0:
            raise ValueError(f"expected a contact patch of 0 m or more, found {patch_m}")
        if patch_m > MOST_STEPS * spacing_m:
            raise OverflowError(f"expected a contact patch that is a part of a road, found {patch_m} m")
        self._spacing_m = spacing_m
        self._base_m = float(elevation_m.mean())
        heights = elevation_m - self._base_m
        if patch_m < POINT_M:
            heights = np.concatenate([heights[:1], heights, heights[-1:]])
            self._origin_m, self._second = start_m - spacing_m, 0.0
            slope = np.append(np.diff(heights), 0.0) / spacing_m
            self._pieces = _pieces(heights, slope, np.zeros_like(slope), np.full(len(heights), spacing_m))
            self._cells = len(heights)
            return
        whole = int(patch_m / spacing_m + ROUNDING)
        part = max(patch_m / spacing_m - whole, 0.0)
        self._second = part if part > ROUNDING else 0.0
        # Cell 0 lies before the first knot that matters, the last cell after the last one: both are flat.
        self._origin_m = start_m - patch_m / 2 - spacing_m
        self._cells = len(heights) + whole + 3
        height, slope = _averages(heights, spacing_m, patch_m, whole, self._second, self._cells)
        widths = np.array([self._second, 1.0 - self._second] if self._second else [1.0]) * spacing_m
        width = np.tile(widths, self._cells)
        bend = np.append(np.diff(slope) / width[:-1], 0.0)
        self._pieces = _pieces(height, slope, bend, width)

    def elevation(self, distance_m: Array) -> Array:
        """Mean over the patch centred at each distance [m], any shape."""
        along, (_, height, slope, bend) = self._locate(distance_m)
        return self._base_m + height + along * (slope + along * (0.5 * bend))

    def step_means(self, distance_m: Array) -> tuple[Array, Array]:
        """Elevation (N,) at the distances (N,) and its mean (N - 1,) over the way from each to the next [m]."""
        along, (integral, height, slope, bend) = self._locate(distance_m)
        elevation = height + along * (slope + along * (0.5 * bend))
        integral = integral + along * (height + along * (0.5 * slope + along * (bend / 6)))
        step = np.diff(distance_m)
        short = np.abs(step) < POINT_M
        mean = np.diff(integral) / np.where(short, 1.0, step)
        if short.any():
            mean[short] = 0.5 * (elevation[:-1] + elevation[1:])[short]
        return self._base_m + elevation, self._base_m + mean

    def _locate(self, distance_m: Array) -> tuple[Array, Array]:
        """How far into its piece each distance lies [m], and the piece's coefficients, (4, ...)."""
        place = (distance_m - self._origin_m) / self._spacing_m
        cell = np.clip(np.floor(place), 0, self._cells - 1)
        along = place - cell
        piece = cell.astype(np.intp)
        if self._second:
            beyond = along >= self._second
            piece = 2 * piece + beyond
            along = along - self._second * beyond
        return along * self._spacing_m, self._pieces.take(piece, axis=1)


def _pieces(height: Array, slope: Array, bend: Array, width: Array) -> Array:
    """Integral up to each knot, and elevation, its slope and the slope's slope there: (4, pieces)."""
    gain = width * (height + width * (0.5 * slope + width * (bend / 6)))
    return np.stack([np.concatenate([[0.0], np.cumsum(gain[:-1])]), height, slope, bend])


def _averages(heights: Array, spacing_m: float, patch_m: float, whole: int, second: float, cells: int
              ) -> tuple[Array, Array]:
    """Elevation averaged over the patch, and its slope, at the knots in order.

    The patch is ``whole`` and ``second`` spacings long. At the first knot of a cell its front edge passes a sample, at
    the second one its rear edge.
    """
    before = whole + 3
    padded = np.concatenate([np.full(before, heights[0]), heights, np.full(whole + 4, heights[-1])])
    rise = np.diff(padded)
    area = spacing_m * np.concatenate([[0.0], np.cumsum(0.5 * (padded[:-1] + padded[1:]))])[:-1]
    padded = padded[:-1]

    def edge(sample: int, share: float) -> tuple[Array, Array]:
        """Elevation, and area up to there, ``share`` of a spacing beyond sample + 0, 1, 2, ... of the road."""
        part = slice(before + sample, before + sample + cells)
        z, dz = padded[part], rise[part]
        return z + share * dz, area[part] + spacing_m * share * (z + 0.5 * share * dz)

    edges = [(edge(-1, 0.0), edge(-2 - whole, 1.0 - second) if second else edge(-1 - whole, 0.0))]
    if second:
        edges.append((edge(-1, second), edge(-1 - whole, 0.0)))
    height = np.stack([(front[1] - rear[1]) / patch_m for front, rear in edges], axis=1)
    slope = np.stack([(front[0] - rear[0]) / patch_m for front, rear in edges], axis=1)
    return height.ravel(), slope.ravel()


