"""Measures along a route: where on a line with kilometre posts the windows of a drive lie, and in which direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from logger.roads.road_matching import USUAL, Receiver, match
from logger.roads.road_network import Array, Ints, RoadNetwork, Trace, on_sphere

ALONG, AGAINST = 1, -1
_SHORTEST_M = 1.0  # between posts


@dataclass(frozen=True, eq=False)
class OnRoute:
    """Windows (n,): direction ALONG or AGAINST growing measures, 0 where they lie on another road; measure of the
    middle [m], NaN there."""

    direction: Ints
    measure_m: Array


def measures(lat_deg: Array, lon_deg: Array, begin_m: float | None, end_m: float | None, posts: Array | None = None,
             post_m: Array | None = None) -> Array:
    """Measures (n,) of the corners of a line [m].

    begin_m, end_m    at its ends; with neither its own length from 0 on
    posts             (p, 2) latitudes and longitudes of kilometre posts, with measures (p,): between them they hold,
                      and beyond the outer ones the line's own length goes on from them

    ValueError where the line has no length, or posts do not follow each other along the line by growing measures.
    """
    corners = on_sphere(lat_deg, lon_deg)
    length_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    if not length_m[-1] > 0:
        raise ValueError("expected a line with a length")
    if posts is None or post_m is None or not len(post_m):
        first = begin_m if begin_m is not None else 0.0 if end_m is None else end_m - length_m[-1]
        last = end_m if end_m is not None else first + length_m[-1]
        return np.asarray(first + (last - first) * length_m / length_m[-1])
    at_m = _abreast(corners, length_m, on_sphere(posts[:, 0], posts[:, 1]))
    order = np.argsort(at_m)
    at_m, known_m = at_m[order], post_m[order]
    if (np.diff(at_m) < _SHORTEST_M).any() or (np.diff(known_m) <= 0).any():
        raise ValueError("expected kilometre posts that follow each other along the line by growing numbers")
    measured = np.interp(length_m, at_m, known_m)
    return measured + np.minimum(length_m - at_m[0], 0.0) + np.maximum(length_m - at_m[-1], 0.0)


def _abreast(corners: Array, length_m: Array, points: Array) -> Array:
    """How far along a line (n, 3) points (p, 3) lie [m]: the foot on the nearest of its parts."""
    start, step = corners[:-1], np.diff(corners, axis=0)
    square = np.maximum(np.einsum("ij,ij->i", step, step), 1e-12)
    found = np.empty(len(points))
    for number, point in enumerate(points):
        share = np.clip(np.einsum("ij,ij->i", point - start, step) / square, 0.0, 1.0)
        off = np.linalg.norm(start + share[:, None] * step - point, axis=1)
        part = int(np.argmin(off))
        found[number] = length_m[part] + share[part] * np.sqrt(square[part])
    return found


def route_network(lat_deg: Array, lon_deg: Array, measure_m: Array) -> RoadNetwork:
    """A line with measures of its corners as two ways: 0 along it, 1 against it by measures below 0."""
    network = RoadNetwork()
    network.add_line(lat_deg, lon_deg, measure_m)
    network.add_line(lat_deg[::-1], lon_deg[::-1], -measure_m[::-1])
    return network


def on_route(network: RoadNetwork, trace: Trace, receiver: Receiver = USUAL) -> OnRoute:
    """Lay a drive on a route's two ways."""
    found, _ = match(network, trace, receiver)
    direction = np.where(found.way < 0, 0, np.where(found.way == 0, ALONG, AGAINST))
    return OnRoute(direction, direction * found.along_m)
