"""Many drives laid over each other, one after the other: a network of ways that grows with what nobody drove before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from logger.roads.road_matching import GAP_M, NO_WAY, USUAL, Matched, Receiver, match
from logger.roads.road_network import MOST_TURN_DEG, SEARCH_M, RoadNetwork, Trace, directions, on_sphere

_APART_M = 100.0  # from which distance on a drive that comes back drives again
_Error = tuple[float, float, float, float, float]


def lay(network: RoadNetwork, traces: Sequence[Trace], receiver: Receiver = USUAL) -> list[Matched]:
    """Lay drives over each other, one after the other: where no way is known a drive makes one, and ``network`` grows.

    A drive that passes a place again is laid over itself.
    """
    found = []
    for founder, trace in enumerate(traces, start=network.traces):
        parts: list[Matched] = []
        state: _Error | None = None
        for start, end in _laps(trace):
            lap = trace.part(start, end)
            matched, state = match(network, lap, receiver, state)
            parts.append(_learned(network, lap, matched, founder))
        found.append(_joined(parts))
        network.traces = founder + 1
    return found


def _learned(network: RoadNetwork, lap: Trace, matched: Matched, founder: int) -> Matched:
    """What was matched moves its ways; what was not becomes ways of its own."""
    on = np.flatnonzero(matched.way >= 0)
    network.move(matched.point[on], matched.aside_m[on])
    way, along_m, point = matched.way.copy(), matched.along_m.copy(), matched.point.copy()
    off = matched.way == NO_WAY
    breaks = np.flatnonzero((off[1:] != off[:-1]) | (np.diff(lap.distance_m) > GAP_M)) + 1
    for start, end in zip([0, *breaks], [*breaks, len(off)], strict=True):
        if end > start and off[start]:
            way[start:end], along_m[start:end], point[start:end] = network.add(lap, start, end, founder)
    return Matched(way, along_m, point, np.where(off, 0.0, matched.aside_m))


def _laps(trace: Trace) -> list[tuple[int, int]]:
    """Parts of a trace of which none comes back to where it has been, in its direction."""
    from scipy.spatial import cKDTree

    points = on_sphere(trace.lat_deg, trace.lon_deg)
    heading = directions(points, trace.distance_m)
    pairs = cKDTree(points).query_pairs(SEARCH_M, output_type="ndarray") if len(points) else np.zeros((0, 2), np.intp)
    early, late = pairs.min(axis=1), pairs.max(axis=1)
    alike = np.einsum("ij,ij->i", heading[early], heading[late]) > np.cos(np.radians(MOST_TURN_DEG))
    again = alike & (trace.distance_m[late] - trace.distance_m[early] > _APART_M)
    last = np.full(len(points), -1)
    np.maximum.at(last, late[again], early[again])
    cuts = [0]
    for window in np.flatnonzero(last >= 0).tolist():
        if last[window] >= cuts[-1]:
            cuts.append(window)
    return [(start, end) for start, end in zip(cuts, [*cuts[1:], len(points)], strict=True) if end > start]


def _joined(parts: Sequence[Matched]) -> Matched:
    return Matched(*(np.concatenate([getattr(one, name) for one in parts] or [np.zeros(0)])
                     for name in ("way", "along_m", "point", "aside_m")))
