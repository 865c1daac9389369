"""A measured line on the ground: which place of it a car passed, by the positions of a receiver.

Problem: a profile has distances, a receiver positions; a drive begins before the line, ends behind it, may leave it and
come back, or go the other way. Solution: each position is laid on the nearest piece of the line. Where that place moves
along as far as the car does, position after position, the car was on it; such stretches are the passes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.dsp.repeated_samples import stretches_of
from logger.geodesy import EARTH_RADIUS_M

Array = npt.NDArray[np.float64]

ASIDE_M = 25.0
"""No receiver with a fix is farther off among houses, but for moments; a parallel street is."""
_APART_M = 15.0
"""By so much the place on the line and the way that was driven may differ from fix to fix on one pass."""
_LEAST_FIXES = 5
_MORE, _LESS, _PLACE_M = 0.05, 0.7, 20.0
"""Places that were measured well lie no farther apart than the way between them, but for errors, and, where few of
them are given, nearer by the bends; a third is more than bends take."""
_SPACING_M = 1.0


@dataclass(frozen=True, eq=False)
class MeasuredLine:
    """Places (m,) along a line: distances, growing [m], east and north of the first one [m]."""

    distance_m: Array
    east_m: Array
    north_m: Array
    lat_deg: float
    lon_deg: float

    @staticmethod
    def of(distance_m: Array, lat_deg: Array, lon_deg: Array) -> MeasuredLine:
        """By geographic coordinates (m,) [degrees]. ValueError for fewer than two places, distances that do not grow,
        and places that cannot be so far apart on the ground, or lie much nearer together."""
        if len(distance_m) < 2:
            raise ValueError("expected two places or more")
        if not (np.diff(distance_m) > 0).all():
            raise ValueError("expected distances that grow from place to place")
        east_m, north_m = _flat(lat_deg, lon_deg, float(lat_deg[0]), float(lon_deg[0]))
        apart_m, ahead_m = np.hypot(np.diff(east_m), np.diff(north_m)), np.diff(distance_m)
        if (far := apart_m > (1 + _MORE) * ahead_m + _PLACE_M).any():
            at = int(np.argmax(far))
            raise ValueError(f"expected places no farther apart than their distances, found {apart_m[at]:.0f} m "
                             f"between those at {distance_m[at]:g} and {distance_m[at + 1]:g} m")
        if apart_m.sum() < _LESS * ahead_m.sum() - _PLACE_M:
            raise ValueError(f"expected places {ahead_m.sum():.0f} m apart all in all, as the distances are, found "
                             f"{apart_m.sum():.0f} m")
        return MeasuredLine(distance_m, east_m, north_m, float(lat_deg[0]), float(lon_deg[0]))

    def passed(self, lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
        """The distance of the place nearest to positions (k,), and how far aside they are, both (k,) [m]."""
        from scipy.spatial import cKDTree

        east_m, north_m = _flat(lat_deg, lon_deg, self.lat_deg, self.lon_deg)
        length_m = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(self.east_m), np.diff(self.north_m)))])
        dense_m = np.linspace(0.0, length_m[-1], max(2, round(length_m[-1] / _SPACING_M)))
        spots = np.stack([np.interp(dense_m, length_m, one) for one in (self.east_m, self.north_m)], axis=1)
        aside_m, nearest = cKDTree(spots).query(np.stack([east_m, north_m], axis=1))
        along_m = dense_m[nearest]
        ahead = np.gradient(spots, dense_m, axis=0)[nearest]
        off = np.stack([east_m, north_m], axis=1) - spots[nearest]
        inside = (nearest > 0) & (nearest < len(dense_m) - 1)
        along_m = along_m + np.where(inside, (off * ahead).sum(axis=1), 0.0)
        return np.interp(along_m, length_m, self.distance_m), np.asarray(aside_m)


@dataclass(frozen=True)
class Pass:
    """A stretch of fixes, from ``first`` up to ``last``, on which a car followed the line; ``offset_m`` is the line's
    distance minus the car's [m]."""

    first: int
    last: int
    offset_m: float


def passes(driven_m: Array, along_m: Array, aside_m: Array) -> list[Pass]:
    """The passes of a drive, by fixes (k,): how far the car had come, the nearest place of the line, how far aside."""
    offset_m = along_m - driven_m
    on = aside_m <= ASIDE_M
    together = on[1:] & on[:-1] & (np.abs(np.diff(offset_m)) <= _APART_M)
    found = []
    for first, last in zip(*stretches_of(together), strict=True):
        moved = np.ptp(driven_m[first : last + 1])
        if last - first + 1 >= _LEAST_FIXES and moved > 2 * _APART_M and np.ptp(offset_m[first : last + 1]) < moved / 2:
            found.append(Pass(int(first), int(last) + 1, float(np.median(offset_m[first : last + 1]))))
    return found


def goes_back(driven_m: Array, along_m: Array, aside_m: Array) -> bool:
    """Whether a drive followed the line from its end to its beginning."""
    return bool(passes(driven_m, -along_m, aside_m))


def _flat(lat_deg: Array, lon_deg: Array, lat0_deg: float, lon0_deg: float) -> tuple[Array, Array]:
    """How far east and north of a near place others (k,) lie [m]."""
    east_deg = (lon_deg - lon0_deg + 180.0) % 360.0 - 180.0
    return (EARTH_RADIUS_M * np.radians(east_deg) * np.cos(np.radians(lat0_deg)),
            EARTH_RADIUS_M * np.radians(lat_deg - lat0_deg))
