"""Ways on the ground as chains of points with a heading: found by place and direction, learned from drives, or given.

Problem. Windows of drives have to be laid over each other, or along a line with kilometre posts, anywhere on the Earth
and with no map at hand. Solution. A way is a chain of points in the order in which it is driven, each with its measure
along the way. Points lie on the sphere in three coordinates, so that no meridian and no pole is special. What is driven
where no way lies becomes a way; what is driven again moves it sideways towards the mean of all who passed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.geodesy import EARTH_RADIUS_M

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.intp]

SEARCH_M = 25.0
"""How far aside a way is looked for: beyond four standard deviations of the difference of two good fixes."""
MOST_TURN_DEG = 50.0
"""Of a window against a way: more is a crossing, or the other direction."""
_MOST_CANDIDATES = 64
_ORIGIN = -1
_STEP_M = 10.0  # between points of a given line


@dataclass(frozen=True, eq=False)
class Trace:
    """Windows of one drive that have a place, in order (n,).

    lat_deg, lon_deg    of their middles [degrees]
    distance_m          travelled distance there [m]
    t_s                 time there, from any origin [s]
    """

    lat_deg: Array
    lon_deg: Array
    distance_m: Array
    t_s: Array

    def part(self, start: int, end: int) -> Trace:
        """Windows from one to before another."""
        return Trace(self.lat_deg[start:end], self.lon_deg[start:end], self.distance_m[start:end],
                     self.t_s[start:end])


@dataclass(frozen=True, eq=False)
class Candidates:
    """Ways that m windows may lie on, sorted by window; one place for each time that a way comes by.

    window, point    (m,) numbers of the window and of the network's nearest point
    east_m, north_m  (m,) of the window as seen from that point
    """

    window: Ints
    point: Ints
    east_m: Array
    north_m: Array


def on_sphere(lat_deg: Array, lon_deg: Array) -> Array:
    """Places (n,) as points (n, 3) of the sphere [m]."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    return EARTH_RADIUS_M * np.column_stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])


def east_and_north(points: Array) -> tuple[Array, Array]:
    """Unit vectors to the east and to the north at points (n, 3), each (n, 3)."""
    length = np.hypot(points[:, 0], points[:, 1])
    east = np.column_stack([-points[:, 1], points[:, 0], np.zeros(len(points))]) / np.maximum(length, 1e-9)[:, None]
    return east, np.cross(points / EARTH_RADIUS_M, east)


def directions(points: Array, distance_m: Array) -> Array:
    """Unit vectors of travel (n, 3) at points (n, 3): from the neighbour before to that after. NaN where windows do
    not follow each other, or stand on one place."""
    gap = np.linalg.norm(np.diff(points, axis=0), axis=1)
    way_m = np.abs(np.diff(distance_m))
    follows = (gap < 3 * way_m + 1.0) & (gap > 0)
    before, after = np.arange(len(points)), np.arange(len(points))
    after[:-1][follows] += 1
    before[1:][follows] -= 1
    step = points[after] - points[before]
    length = np.linalg.norm(step, axis=1)
    return np.divide(step, length[:, None], out=np.full(step.shape, np.nan), where=length[:, None] > 0)


@dataclass(eq=False)
class RoadNetwork:
    """Points of all ways (k,), and what they were made of.

    point       (k, 3) on the sphere [m]
    heading     (k, 3) unit vectors of travel
    way         (k,) number of the way, growing
    along_m     (k,) measure along it [m]
    founder     (k,) which trace made it, from 0; passes (k,) how many went into its place
    ways        how many there are, and ``traces`` how many they were learned from
    """

    point: Array = field(default_factory=lambda: np.zeros((0, 3)))
    heading: Array = field(default_factory=lambda: np.zeros((0, 3)))
    way: Ints = field(default_factory=lambda: np.zeros(0, np.intp))
    along_m: Array = field(default_factory=lambda: np.zeros(0))
    founder: Ints = field(default_factory=lambda: np.zeros(0, np.intp))
    passes: Array = field(default_factory=lambda: np.zeros(0))
    ways: int = 0
    traces: int = 0
    _tree: Any = None

    def candidates(self, trace: Trace) -> Candidates:
        """Which ways the windows of a trace may lie on."""
        points = on_sphere(trace.lat_deg, trace.lon_deg)
        heading = directions(points, trace.distance_m)
        if not len(self.point) or not len(points):
            none = np.zeros(0, np.intp)
            return Candidates(none, none, np.zeros(0), np.zeros(0))
        from scipy.spatial import cKDTree

        if self._tree is None:
            self._tree = cKDTree(self.point)
        most = min(_MOST_CANDIDATES, len(self.point))
        _, near = self._tree.query(points, most, distance_upper_bound=SEARCH_M)
        near = near.reshape(len(points), most)
        window, _ = np.nonzero(near < len(self.point))
        point = near[near < len(self.point)]
        cosine = np.einsum("ij,ij->i", heading[window], self.heading[point])
        same_way = cosine > np.cos(np.radians(MOST_TURN_DEG))
        window, point = window[same_way], point[same_way]
        apart = points[window] - self.point[point]
        along = np.einsum("ij,ij->i", apart, self.heading[point])
        # Of each way, and of each time that it comes by, the point that lies abreast of the window.
        at_m = self.along_m[point] + along
        order = np.lexsort((at_m, self.way[point], window))
        window, point, along, at_m = window[order], point[order], np.abs(along[order]), at_m[order]
        begins = np.ones(len(order), bool)
        begins[1:] = (np.diff(window) != 0) | (np.diff(self.way[point]) != 0) | (np.diff(at_m) > SEARCH_M)
        visit = np.cumsum(begins)
        order = np.lexsort((along, visit))
        first = order[np.diff(visit[order], prepend=0) > 0]
        first = first[along[first] <= _STEP_M]
        window, point = window[first], point[first]
        east, north = east_and_north(self.point[point])
        apart = points[window] - self.point[point]
        return Candidates(window, point, np.einsum("ij,ij->i", apart, east), np.einsum("ij,ij->i", apart, north))

    def plane_heading(self) -> tuple[Array, Array]:
        """East and north parts of the points' headings (k,)."""
        east, north = east_and_north(self.point)
        return np.einsum("ij,ij->i", self.heading, east), np.einsum("ij,ij->i", self.heading, north)

    def move(self, point: Ints, aside_m: Array) -> None:
        """Lay points into the mean of those who passed: new passes lay so far to the left of them (m,) [m]."""
        left = np.cross(self.point[point] / EARTH_RADIUS_M, self.heading[point])
        sums, count = np.zeros_like(self.point), np.zeros(len(self.point))
        np.add.at(sums, point, aside_m[:, None] * left)
        np.add.at(count, point, 1.0)
        self.point = self.point + sums / (self.passes + count)[:, None]
        self.passes = self.passes + count
        self._tree = None

    def add(self, trace: Trace, start: int, end: int, founder: int) -> tuple[int, Array, Ints]:
        """A new way of windows of a trace from one to before another, which follow each other: its number, their
        measures along it (m,), the first half a window in, and their points (m,), -1 for one without a direction."""
        points = on_sphere(trace.lat_deg, trace.lon_deg)
        heading = directions(points, trace.distance_m)[start:end]
        known = np.isfinite(heading[:, 0])
        distance_m = trace.distance_m[start:end]
        half_m = (distance_m[1] - distance_m[0]) / 2 if end - start > 1 else 0.0
        number, along_m = self.ways, distance_m - distance_m[0] + half_m
        point = np.where(known, len(self.point) + np.cumsum(known) - 1, -1)
        self._append(points[start:end][known], heading[known], number, along_m[known], founder)
        return number, along_m, point

    def add_line(self, lat_deg: Array, lon_deg: Array, measure_m: Array | None = None) -> int:
        """A given line as a way, with its measures at the corners, or from 0 at its beginning; gives its number.
        ValueError for a line without length, or measures that do not grow."""
        corners = on_sphere(lat_deg, lon_deg)
        length_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
        if not length_m[-1] > 0:
            raise ValueError("expected a line with a length")
        kept = np.concatenate([[True], np.diff(length_m) > 0])
        measure_m = length_m if measure_m is None else measure_m
        corners, length_m, measure_m = corners[kept], length_m[kept], measure_m[kept]
        if not (np.diff(measure_m) > 0).all():
            raise ValueError("expected measures that grow along the line")
        at_m = np.unique(np.concatenate([np.arange(0.0, length_m[-1], _STEP_M), length_m]))
        points = np.column_stack([np.interp(at_m, length_m, corners[:, axis]) for axis in range(3)])
        middle_m = (at_m[1:] + at_m[:-1]) / 2
        step = np.diff(points, axis=0)
        self._append((points[1:] + points[:-1]) / 2, step / np.linalg.norm(step, axis=1)[:, None], number := self.ways,
                     np.interp(middle_m, length_m, measure_m), _ORIGIN)
        return number

    def _append(self, point: Array, heading: Array, way: int, along_m: Array, founder: int) -> None:
        count = len(point)
        self.point, self.heading = np.concatenate([self.point, point]), np.concatenate([self.heading, heading])
        self.way = np.concatenate([self.way, np.full(count, way, np.intp)])
        self.along_m = np.concatenate([self.along_m, along_m])
        self.founder = np.concatenate([self.founder, np.full(count, founder, np.intp)])
        self.passes = np.concatenate([self.passes, np.ones(count)])
        self.ways = way + 1
        self._tree = None
