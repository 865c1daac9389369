"""Speed bumps: single obstacles that no spectrum of a road describes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def speed_bump(
    distance_m: npt.ArrayLike, start_m: float, height_m: float, width_m: float
) -> npt.NDArray[np.float64]:
    """Elevation of a speed bump at the given distances [m], zero outside of it.

    One whole period of a raised cosine (Eq 4.41 of Blum 2015 with time written as distance over speed, Eq 4.42).
    ValueError unless the width is above 0.
    """
    if not width_m > 0:
        raise ValueError(f"expected a width above 0 m, found {width_m:g} m")
    along = (np.asarray(distance_m, dtype=float) - start_m) / width_m
    inside = (along >= 0) & (along < 1)
    return np.where(inside, 0.5 * height_m * (1 - np.cos(2 * np.pi * along)), 0.0)
