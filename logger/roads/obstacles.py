"""Single obstacles on a road, which no spectrum describes, as elevations that are added to it.

All are functions of distance, so that they can be laid on any profile and on each other. A track lays straight lines
between its samples: an edge that is steep here is as steep there as one step of the track allows.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from logger.arrays import Array


def speed_bump(distance_m: npt.ArrayLike, start_m: float, height_m: float, width_m: float) -> Array:
    """Elevation of a speed bump at the given distances [m], zero outside of it.

    One whole period of a raised cosine (Eq 4.41 of Blum 2015 with time written as distance over speed, Eq 4.42).
    ValueError unless the width is above 0.
    """
    if not width_m > 0:
        raise ValueError(f"expected a width above 0 m, found {width_m:g} m")
    along = (np.asarray(distance_m, dtype=float) - start_m) / width_m
    inside = (along >= 0) & (along < 1)
    return np.where(inside, 0.5 * height_m * (1 - np.cos(2 * np.pi * along)), 0.0)



def step(distance_m: npt.ArrayLike, start_m: float, height_m: float) -> Array:
    """A kerb: from ``start_m`` on the road lies higher, or with a negative height lower [m]."""
    return np.where(np.asarray(distance_m, dtype=float) >= start_m, height_m, 0.0)


def ramp(distance_m: npt.ArrayLike, start_m: float, height_m: float, length_m: float) -> Array:
    """A straight rise over ``length_m``, after which the road stays up; down with a negative height [m].

    ValueError unless the length is above 0.
    """
    if not length_m > 0:
        raise ValueError(f"expected a length above 0 m, found {length_m:g} m")
    return height_m * np.clip((np.asarray(distance_m, dtype=float) - start_m) / length_m, 0.0, 1.0)


def plate(distance_m: npt.ArrayLike, start_m: float, height_m: float, length_m: float, edge_m: float = 0.0) -> Array:
    """Something flat that lies on the road: a cleat, a steel plate, a speed table with ramps of ``edge_m`` [m].

    The length counts from foot to foot. ValueError unless it is above 0 and holds both edges.
    """
    if not (length_m > 0 and 0 <= edge_m <= length_m / 2):
        raise ValueError(f"expected a length above 0 m with two edges in it, found {length_m:g} m with {edge_m:g} m")
    if edge_m == 0:
        return step(distance_m, start_m, height_m) - step(distance_m, start_m + length_m, height_m)
    end_m = start_m + length_m
    return ramp(distance_m, start_m, height_m, edge_m) - ramp(distance_m, end_m - edge_m, height_m, edge_m)


def pothole(distance_m: npt.ArrayLike, start_m: float, depth_m: float, length_m: float, edge_m: float = 0.0) -> Array:
    """A hole with a flat bottom and edges that slope over ``edge_m`` [m]. ValueError as ``plate``."""
    return plate(distance_m, start_m, -depth_m, length_m, edge_m)


OBSTACLES: dict[str, Callable[..., Array]] = {"bump": speed_bump, "plate": plate, "pothole": pothole, "ramp": ramp,
                                              "step": step}
"""By the names that users call them."""
