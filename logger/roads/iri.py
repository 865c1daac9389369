"""International Roughness Index of a measured profile, exactly as defined.

The IRI is the mean rectified slope between body and wheel of the Golden Car at 80 km/h (Eq 2.8 of Blum 2015). A
program that integrates it with ordinary steps gets another number; the standard says how: the profile is a straight
line between samples, so each step of the car is taken exactly (ASTM E1926; Sayers, "On the calculation of
International Roughness Index from longitudinal road profile", TRR 1501, 1995; World Bank Technical Paper 46).

What is meant here, where sources differ:

- The 250 mm tire average is the slope from a sample to the one 250 mm ahead of it (Sayers). Eq 2.7 of the
  dissertation prints the sum around the other way. As in Sayers' program the base is the whole number of samples
  nearest to 250 mm, so from about 167 mm of spacing on it is a single step, which is no average.
- The car starts with the mean slope of the first 11 m (ASTM), not of 0.5 s.
- The sum runs over end points of the steps; the last is the one whose tire base still lies on the profile. A window
  that cuts through a step takes its share of it.
- With two wheel tracks, MRI is the mean of the tracks' IRI and HRI the IRI of the tracks' mean (the half car, which
  does not feel roll). HRI is never above MRI.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor

import numpy as np
import numpy.typing as npt

from logger.roads.golden_car import START_M, GoldenCarFilter

Array = npt.NDArray[np.float64]

PER_KM = 1000.0
_NEARLY = 1e-6


def rectified_slope(elevation_m: npt.ArrayLike, spacing_m: float) -> Array:
    """Rectified slope |z_s' - z_u'| of the Golden Car, one value per step of the profile [m/m].

    elevation_m    (n,) elevations at uniform spacing [m]
    spacing_m      [m], at most 0.3 m

    Value i is that at the end of the step from sample i to i + 1. There are n - k of them, k being the samples of the
    tire's base (1 from about 167 mm of spacing on). This is ``GoldenCarFilter`` fed at once. ValueError if the
    profile is shorter than 11 m, too coarse or not finite.
    """
    car = GoldenCarFilter(spacing_m)
    elevation = np.asarray(elevation_m, dtype=float)
    length_m = (elevation.size - 1) * spacing_m
    if length_m < START_M * (1 - 1e-9):
        raise ValueError(f"expected a profile of at least {START_M:g} m, found {max(length_m, 0):.4g} m")
    return car.push(elevation)


def iri(elevation_m: npt.ArrayLike, spacing_m: float) -> float:
    """IRI of a whole profile [m/km]. Arguments and errors as in ``rectified_slope``."""
    return float(PER_KM * rectified_slope(elevation_m, spacing_m).mean())


def window_iri(slope: Array, spacing_m: float, edges_m: npt.ArrayLike) -> Array:
    """IRI between neighbouring edges [m/km].

    slope      what ``rectified_slope`` gave for the whole profile, so that no window starts the car from rest
    edges_m    (w + 1,) increasing distances from the profile's first sample [m]; returns (w,)

    ValueError if an edge lies outside the profile, or edges do not increase.
    """
    steps = [_steps(edge, spacing_m) for edge in np.asarray(edges_m, dtype=float)]
    if (np.diff(steps) <= 0).any() or steps[0] < 0 or steps[-1] > len(slope):
        raise ValueError(f"window edges must increase within 0 ... {len(slope) * spacing_m:g} m")
    return np.array([PER_KM * _mean_between(slope, *pair) for pair in pairwise(steps)])


@dataclass(frozen=True)
class IriWindow:
    """IRI [m/km] of one stretch, distances from the profile's first sample [m]. ``partial``: cut short by the end."""

    distance_start_m: float
    distance_end_m: float
    iri_m_per_km: float
    partial: bool


class IriWindows:
    """Cuts the slopes of ``GoldenCarFilter`` into windows of equal length; any split gives the same bits.

    ValueError unless a window holds at least one step.
    """

    def __init__(self, spacing_m: float, window_m: float) -> None:
        if not spacing_m <= window_m < float("inf"):
            raise ValueError(f"expected a window of at least the {spacing_m:g} m between samples, found {window_m:g} m")
        self._spacing_m = spacing_m
        self._window_m = window_m
        self._number = 0
        self._offset = 0
        self._count = 0
        self._blocks: list[Array] = []

    def push(self, slope: Array) -> list[IriWindow]:
        """The windows that the next rectified slopes (n,) [m/m] complete."""
        self._blocks.append(slope)
        self._count += len(slope)
        if self._count < self._edge(self._number + 1):
            return []
        waiting = np.concatenate(self._blocks)
        windows = []
        while self._count >= (stop := self._edge(self._number + 1)):
            windows.append(self._window(waiting, stop, (self._number + 1) * self._window_m, partial=False))
            self._number += 1
        kept = floor(self._edge(self._number)) - self._offset
        self._blocks = [waiting[kept:]]
        self._offset += kept
        return windows

    def finish(self) -> list[IriWindow]:
        """The last window, cut short by the end of the profile; none when the profile ends with a window."""
        if self._count <= self._edge(self._number):
            return []
        return [self._window(np.concatenate(self._blocks), self._count, self._count * self._spacing_m, partial=True)]

    def _edge(self, number: int) -> float:
        return _steps(number * self._window_m, self._spacing_m)

    def _window(self, waiting: Array, stop: float, end_m: float, partial: bool) -> IriWindow:
        start = self._edge(self._number)
        mean = _mean_between(waiting, start - self._offset, stop - self._offset)
        return IriWindow(self._number * self._window_m, end_m, PER_KM * mean, partial)


def _steps(distance_m: float, spacing_m: float) -> float:
    """Distance in steps; a whole number where rounding alone keeps it from being one."""
    steps = float(distance_m / spacing_m)
    return float(round(steps)) if abs(steps - round(steps)) < _NEARLY else steps


def _mean_between(slope: Array, start: float, stop: float) -> float:
    """Mean of the steps from ``start`` to ``stop``, which may lie within a step."""
    first, last = floor(start), ceil(stop)
    part = slope[first:last]
    total = part.sum() - (start - first) * part[0] - (last - stop) * part[-1]
    return float(total / (stop - start))
