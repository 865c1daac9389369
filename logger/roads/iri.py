"""International Roughness Index of a measured profile, exactly as defined.

The IRI is the mean rectified slope between body and wheel of the Golden Car at 80 km/h (Eq 2.8 of Blum 2015). A
program that integrates it with ordinary steps gets another number; the standard says how: the profile is a straight
line between samples, so each step of the car is taken exactly by its state-transition matrix (ASTM E1926; Sayers,
"On the calculation of International Roughness Index from longitudinal road profile", TRR 1501, 1995; World Bank
Technical Paper 46).

What is meant here, where sources differ:

- The 250 mm tire average is the slope from a sample to the one 250 mm ahead of it (Sayers). Eq 2.7 of the
  dissertation prints the sum around the other way. As in Sayers' program the base is the whole number of samples
  nearest to 250 mm, so from about 167 mm of spacing on it is a single step, which is no average.
- The car starts with the mean slope of the first 11 m (ASTM), not of 0.5 s.
- The sum runs over end points of the steps. A window that cuts through a step takes its share of it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.vehicle.quarter_car import GOLDEN_CAR, structure
from logger.vehicle.state_space import held_step, recursion

Array = npt.NDArray[np.float64]

STANDARD_SPEED_MPS = 80 / 3.6
START_M = 11.0
TIRE_BASE_M = 0.25


def rectified_slope(elevation_m: npt.ArrayLike, spacing_m: float) -> Array:
    """Rectified slope |z_s' - z_u'| of the Golden Car, one value per step of the profile [m/m].

    elevation_m    (n,) elevations at uniform spacing [m]
    spacing_m      [m]

    Value i is that at the end of the step from sample i to i + 1. There are n - k of them, k being the samples of the
    tire's base (1 from about 167 mm of spacing on). ValueError if the profile is shorter than 11 m or not finite.
    """
    elevation = np.asarray(elevation_m, dtype=float)
    if elevation.ndim != 1 or not np.isfinite(elevation).all():
        raise ValueError("the profile must be a row of finite elevations")
    if not spacing_m > 0 or (len(elevation) - 1) * spacing_m < START_M * (1 - 1e-9):
        raise ValueError(f"the profile must be at least {START_M:g} m long")
    base = max(1, int(TIRE_BASE_M / spacing_m + 0.5))
    slope = (elevation[base:] - elevation[:-base]) / (base * spacing_m)

    transition, gain = held_step(*structure(GOLDEN_CAR).state_space(), spacing_m / STANDARD_SPEED_MPS)
    first = int(START_M / spacing_m + 0.5)
    start_slope = (elevation[first] - elevation[0]) / (first * spacing_m)
    # Driven by the road's slope instead of its elevation, the states (body, wheel, and their rates) are slopes too.
    states = recursion(transition, slope[:, None] * gain[:, 0], np.array([start_slope, start_slope, 0.0, 0.0]))
    return np.abs(states[:, 0] - states[:, 1])


def iri(elevation_m: npt.ArrayLike, spacing_m: float) -> float:
    """IRI of a whole profile [m/km]. Arguments and errors as in ``rectified_slope``."""
    return float(1000.0 * rectified_slope(elevation_m, spacing_m).mean())


def window_iri(slope: Array, spacing_m: float, edges_m: npt.ArrayLike) -> Array:
    """IRI between neighbouring edges [m/km].

    slope      what ``rectified_slope`` gave for the whole profile, so that no window starts the car anew
    edges_m    (w + 1,) increasing distances from the profile's first sample [m]; returns (w,)

    ValueError if an edge lies outside the profile, or edges do not increase.
    """
    edges = np.asarray(edges_m, dtype=float)
    steps = edges / spacing_m
    if (np.diff(edges) <= 0).any() or steps[0] < -1e-9 or steps[-1] > len(slope) + 1e-6:
        raise ValueError(f"window edges must increase within 0 ... {len(slope) * spacing_m:g} m")
    total = np.concatenate([[0.0], np.cumsum(slope)])
    return 1000.0 * np.diff(np.interp(steps, np.arange(len(total)), total)) / np.diff(steps)
