"""Where drives went: on ways found by place and direction, learned from drives or given, or along one line.

Problem. Windows of drives have to be laid over each other, or along a line with kilometre posts, anywhere on the Earth
and with no map at hand. Solution. A way is a chain of points in the order in which it is driven, each with its measure
along the way. Points lie on the sphere in three coordinates, so that no meridian and no pole is special. What is driven
where no way lies becomes a way; what is driven again moves it sideways towards the mean of all who passed.

Which way each window of a drive lies on is decided by the whole drive. Problem. The error of a receiver is some metres
and changes over minutes, so that a window alone does not distinguish a street from the next one 15 m aside, and neither
do a hundred windows in a row: they all err alike. Solution. The error against the network is a state: two components, a
first-order Gauss-Markov process each. Every chain of ways that a drive may have followed carries its own estimate of it
(a Kalman filter of the distances aside), and the most likely chain is kept (Viterbi; Newson & Krumm, "Hidden Markov map
matching through noise and sparseness", ACM GIS 2009, with the error that they take for white). A jump to the parallel
street asks for a jump of the error, which is not likely within seconds; a street that is not known yet is one more
hypothesis. Each turn shows the component that the street before hid, so places along a way, smoothed from both ends
(Rauch, Tung & Striebel 1965), are better than the fixes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import erfc, exp, inf, log, pi, sqrt
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from logger.arrays import Array, Bools, Indices, Rows
from logger.geodesy import EARTH_RADIUS_M

SEARCH_M = 25.0
"""How far aside a way is looked for: beyond four standard deviations of the difference of two good fixes. No receiver
with a fix is farther off among houses, but for moments; a parallel street is."""
MOST_TURN_DEG = 50.0  # Of a window against a way: more is a crossing, or the other direction
_MOST_CANDIDATES = 64
_ORIGIN = -1
_STEP_M = 10.0  # between points of a given line


@dataclass(frozen=True, eq=False)
class Trace(Rows):
    """Windows of one drive that have a place, in order (n,).

    lat_deg, lon_deg    of their middles [degrees]
    distance_m          travelled distance there [m]
    t_s                 time there, from any origin [s]
    """

    lat_deg: Array
    lon_deg: Array
    distance_m: Array
    t_s: Array


@dataclass(frozen=True, eq=False)
class Candidates:
    """Ways that m windows may lie on, sorted by window; one place for each time that a way comes by.

    window, point    (m,) numbers of the window and of the network's nearest point
    east_m, north_m  (m,) of the window as seen from that point
    """

    window: Indices
    point: Indices
    east_m: Array
    north_m: Array


def on_sphere(lat_deg: Array, lon_deg: Array) -> Array:
    """Places (n,) as points (n, 3) of the sphere [m]."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    return EARTH_RADIUS_M * np.column_stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])


def _line(lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
    """Corners of a line (n, 3) on the sphere and its length up to each (n,) [m]. ValueError where it has none."""
    corners = on_sphere(lat_deg, lon_deg)
    length_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    if not length_m[-1] > 0:
        raise ValueError("expected a line with a length")
    return corners, length_m


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
    way: Indices = field(default_factory=lambda: np.zeros(0, np.intp))
    along_m: Array = field(default_factory=lambda: np.zeros(0))
    founder: Indices = field(default_factory=lambda: np.zeros(0, np.intp))
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

    def move(self, point: Indices, aside_m: Array) -> None:
        """Lay points into the mean of those who passed: new passes lay so far to the left of them (m,) [m]."""
        left = np.cross(self.point[point] / EARTH_RADIUS_M, self.heading[point])
        sums, count = np.zeros_like(self.point), np.zeros(len(self.point))
        np.add.at(sums, point, aside_m[:, None] * left)
        np.add.at(count, point, 1.0)
        self.point = self.point + sums / (self.passes + count)[:, None]
        self.passes = self.passes + count
        self._tree = None

    def add(self, trace: Trace, start: int, end: int, founder: int) -> tuple[int, Array, Indices]:
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
        corners, length_m = _line(lat_deg, lon_deg)
        kept = np.concatenate([[True], np.diff(length_m) > 0])
        measure_m = length_m if measure_m is None else measure_m
        corners, length_m, measure_m = corners[kept], length_m[kept], measure_m[kept]
        if not (np.diff(measure_m) > 0).all():
            raise ValueError("expected measures that increase along the line")
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


NO_WAY = -1
DOUBTFUL = -2
_STREETS_M = 10.0  # no two streets of one direction lie nearer to each other
_NEW_SHARE = 0.3  # how likely a street is one that is not known yet, where one is known within reach
_KNOWN = log(1 - _NEW_SHARE)
_UNKNOWN = log(_NEW_SHARE / (2 * (SEARCH_M - _STREETS_M)))  # anywhere within reach, but not there
_CHANGE = log(0.1)  # to leave a street that goes on beside
_WORST = 25.0  # how much less likely than the best a chain may be and still be followed
GAP_M = 50.0  # between windows: what lay beside before says nothing after
_STREET_M, _STRAIGHT = 5.0, 0.9  # aside, and cosine: so near the next way continues the one before


# A receiver in the open has a slow error of 2 to 3 m to the east and as much to the north (data sheets: 2.5 m CEP,
# which is 2.1 m in each component), between houses 4 m; after the time it is another one by 1 - 1/e.
_STD_M, _CORRELATION_S = 3.0, 120.0
_SPREAD_M2 = 2 * _STD_M**2  # variance of the difference of two such errors
_ASIDE_M = 2.0  # what windows scatter aside beyond that: lanes, the car in its lane, fast errors


@dataclass(frozen=True, eq=False)
class Matched(Rows):
    """Where the windows of a trace lie (n,).

    way        number of the way, NO_WAY: on none, DOUBTFUL: on one of several, and none is to be believed
    along_m    measure there of the window's middle [m]; NaN: on none
    point      nearest point of the network, -1: none
    aside_m    how far left of that point the fix lay [m]
    """

    way: Indices
    along_m: Array
    point: Indices
    aside_m: Array


_State = tuple[float, float, float, float, float]
"""Error to the east and north [m], and its covariance (ee, en, nn) [m2]."""
_UNKNOWN_ERROR: _State = (0.0, 0.0, _SPREAD_M2, 0.0, _SPREAD_M2)


class _Chain(NamedTuple):
    """What a drive may have followed up to a window.

    score            logarithm of the likelihood
    candidate        that it lies on or beside, NO_WAY: none is near
    known            it lies on that; else on a street that nobody knows, beside it
    reference        the last point that it lay on, or NO_WAY
    error            of the receiver against that
    beside_m         how far left of the candidate an unknown street lies, with its variance
    parent           number of the chain of the window before that it goes on
    rivals           numbers of others that came to the same, and how much less likely they are
    """

    score: float
    candidate: int
    known: bool
    reference: int
    error: _State
    beside_m: tuple[float, float]
    parent: int
    rivals: tuple[tuple[int, float], ...] = ()


def match(network: RoadNetwork, trace: Trace, start: _State = _UNKNOWN_ERROR) -> tuple[Matched, _State]:
    """Lay a trace on the ways of a network, or on none where none is likely.

    start    error to the east and north at the beginning and its covariance (ee, en, nn), as this function gives it for
             the end
    """
    sure = 0.8  # as of places to visit: a street that is less likely than this is not to be believed
    count = len(trace.t_s)
    found = network.candidates(trace)
    if not len(found.window):
        return _nowhere(count), _UNKNOWN_ERROR
    path, states, belief = _best_chain(network, trace, start, found)
    on = path >= 0
    point = np.where(on, found.point[np.maximum(path, 0)], NO_WAY)
    smooth = _smoothed(trace, states)
    u_east, u_north = network.plane_heading()
    rel_e, rel_n = found.east_m[np.maximum(path, 0)], found.north_m[np.maximum(path, 0)]
    at = np.maximum(point, 0)
    along = (rel_e - smooth[:, 0]) * u_east[at] + (rel_n - smooth[:, 1]) * u_north[at]
    end_e, end_n, end_ee, end_en, end_nn = states[-1].tolist()
    way = np.where(on, network.way[at], NO_WAY)
    aside_m = rel_n * u_east[at] - rel_e * u_north[at]
    doubtful = on & _too_far(way, aside_m) | (belief < sure)
    on &= ~doubtful
    way[doubtful], point = DOUBTFUL, np.where(on, point, NO_WAY)
    return Matched(way, np.where(on, network.along_m[at] + along, np.nan), point,
                   np.where(on, aside_m, np.nan)), (end_e, end_n, end_ee, end_en, end_nn)


def _too_far(way: Indices, aside_m: Array) -> Bools:
    """Windows of stretches on one way that lie further aside on the mean than the difference of two errors should."""
    believed = 2.0  # standard deviations that a stretch may lie aside of its way
    stretch = np.cumsum(np.diff(way, prepend=way[:1]) != 0)
    mean_m = np.bincount(stretch, np.nan_to_num(aside_m)) / np.bincount(stretch)
    return np.asarray(np.abs(mean_m[stretch]) > believed * 2**0.5 * _STD_M)


def _nowhere(count: int) -> Matched:
    none = np.full(count, NO_WAY, np.intp)
    return Matched(none, np.full(count, np.nan), none, np.full(count, np.nan))


def _best_chain(network: RoadNetwork, trace: Trace, start: _State, found: Candidates) -> tuple[Indices, Array, Array]:
    """Candidate of each window (n,), NO_WAY for none, the filtered errors (n, 5) along that chain, and how likely each
    window is to lie on its street (n,)."""
    count = len(trace.t_s)
    most_chains = 16
    lists = _Lists.of(network, found, count)
    chains = [_Chain(0.0, NO_WAY, False, NO_WAY, start, (0.0, 0.0), -1)]
    steps_s, steps_m = np.diff(trace.t_s, prepend=trace.t_s[:1]), np.diff(trace.distance_m, prepend=0.0)
    history: list[list[_Chain]] = []
    before = range(0)
    for window, (step_s, step_m) in enumerate(zip(steps_s.tolist(), steps_m.tolist(), strict=True)):
        here = range(lists.begins[window], lists.begins[window + 1])
        if step_m > GAP_M:
            before = range(0)
            chains = [chain._replace(candidate=NO_WAY, known=False) for chain in chains]
        ahead = [(number, chain._replace(error=_drifted(chain.error, step_s)))
                 for number, chain in enumerate(chains)]
        # Variance that the difference of two errors gains in this time [m2].
        drift = _SPREAD_M2 * (1 - exp(-2 * max(step_s, 0.0) / _CORRELATION_S))
        new = [found for one in here for found in _distinct(
            [_on(lists, chain, one, number, here, before) for number, chain in ahead])]
        new += [found for one in here for found in _distinct(
            [_beside(lists, chain, one, number, here, before, drift) for number, chain in ahead])]
        if not here:
            new = [chain._replace(candidate=NO_WAY, known=False, parent=number, rivals=()) for number, chain in ahead]
        best = max(chain.score for chain in new)
        likely = (chain for chain in new if chain.score > best - _WORST)
        chains = sorted(likely, key=attrgetter("score"), reverse=True)[:most_chains]
        history.append(chains)
        before = here
    path, states = _traced_back(history)
    return path, states, _belief(history, lists)


def _distinct(chains: Sequence[_Chain]) -> list[_Chain]:
    """Of chains that came to one street: the best, and those that say another error, as what comes next may speak for
    them (multiple hypotheses; Reid, "An algorithm for tracking multiple targets", IEEE Trans. Automatic Control 24,
    1979). One that is left out is a rival of the one that it is like."""
    most_each = 3  # of them to one street, by different errors of the receiver
    ranked = sorted(chains, key=attrgetter("score"), reverse=True)
    kept: list[_Chain] = []
    rivals: list[list[tuple[int, float]]] = []
    for chain in ranked:
        if chain.score < ranked[0].score - _WORST:
            break
        like = next((number for number, other in enumerate(kept) if _alike(chain.error, other.error)), None)
        if like is None and len(kept) < most_each:
            kept.append(chain)
            rivals.append([])
        else:
            rivals[like or 0].append((chain.parent, kept[like or 0].score - chain.score))
    return [chain._replace(rivals=tuple(found)) for chain, found in zip(kept, rivals, strict=True)]


def _alike(one: _State, other: _State) -> bool:
    """Whether two errors are the same but for a standard deviation of the second."""
    east, north = one[0] - other[0], one[1] - other[1]
    _, _, ee, en, nn = other
    return east * east * nn - 2 * east * north * en + north * north * ee < ee * nn - en * en


def _belief(history: Sequence[Sequence[_Chain]], lists: _Lists) -> Array:
    """How likely it is (n,) that a window lies on the street of the best chain, beside the best chain over each other
    street: what speaks against a choice often comes later (a Viterbi algorithm with soft decisions; Hagenauer & Hoeher,
    IEEE Globecom 1989). Each chain's total is that of the best way on from it."""
    found = np.ones(len(history))
    totals, best = [chain.score for chain in history[-1]], 0
    for window in range(len(history) - 1, -1, -1):
        chains, mine = history[window], history[window][best]
        weights = [exp(max(total - totals[best], -_WORST)) for total in totals]
        same = sum(weight for weight, chain in zip(weights, chains, strict=True) if lists.agree(chain, mine))
        found[window] = same / sum(weights)
        if window:
            before = [-inf] * len(history[window - 1])
            for total, chain in zip(totals, chains, strict=True):
                for parent, less in ((chain.parent, 0.0), *chain.rivals):
                    before[parent] = max(before[parent], total - less)
            totals, best = before, mine.parent
    return found


def _on(lists: _Lists, chain: _Chain, one: int, parent: int, here: range, before: range) -> _Chain:
    """A chain that goes on, or begins, on a known street."""
    score, last, known, reference, (error_e, error_n, ee, en, nn), *_ = chain
    point = lists.point[one]
    if not (known and lists.same(last, one)):
        # A street begins: to go over to the one beside is less likely than to turn into it.
        score += _CHANGE if lists.goes_on(here, last) or lists.goes_on(before, one) else _KNOWN
    if reference != NO_WAY and lists.way_of[reference] != lists.way[one] and (
            lists.founder[reference] != lists.founder[point]):
        # The error was against a way as wrong as its drives were; what it says of the receiver's own holds on.
        passes = lists.passes[reference]
        keeps = passes / (passes + 1)
        own = _STD_M**2 * (1 / (passes + 1) + 1 / lists.passes[point])
        error_e, error_n = keeps * error_e, keeps * error_n
        ee, en, nn = keeps * keeps * ee + own, keeps * keeps * en, keeps * keeps * nn + own
    left_e, left_n = lists.left_e[one], lists.left_n[one]
    gain_e, gain_n = ee * left_e + en * left_n, en * left_e + nn * left_n
    variance = gain_e * left_e + gain_n * left_n + _ASIDE_M**2
    off = lists.aside_m[one] - error_e * left_e - error_n * left_n
    score -= 0.5 * (off * off / variance + log(2 * pi * variance))
    gain_e, gain_n = gain_e / variance, gain_n / variance
    error = (error_e + gain_e * off, error_n + gain_n * off, ee - gain_e * gain_e * variance,
             en - gain_e * gain_n * variance, nn - gain_n * gain_n * variance)
    return _Chain(score, one, True, point, error, (0.0, 0.0), parent)


def _beside(lists: _Lists, chain: _Chain, one: int, parent: int, here: range, before: range, drift: float
            ) -> _Chain:
    """A chain that goes on, or begins, on an unknown street beside a known one: so far aside as it was, or anywhere."""
    score, last, known, reference, error, beside, *_ = chain
    fast, aside_m = _ASIDE_M**2, lists.aside_m[one]
    begins = known or last == NO_WAY
    if begins:
        score += _CHANGE if known and lists.goes_on(here, last) else 0.0
        beside = (0.0, 0.0)
    elif not lists.same(last, one) or lists.way[last] != lists.way[one]:
        was = next((other for other in before if lists.same(other, one)), NO_WAY)
        apart = 0.0 if was == NO_WAY or lists.way[was] == lists.way[one] else _STD_M**2
        beside = (0.0, 0.0) if was == NO_WAY else (lists.aside_m[was], fast + apart)
    score += min((_clear_of(lists, other, error, fast) for other in here
                  if begins or not lists.goes_on(before, other)), default=0.0)
    if beside[1] == 0.0:
        return _Chain(score + _UNKNOWN, one, False, reference, error, (aside_m, fast), parent)
    ahead = beside[1] + drift
    variance, off = ahead + fast, aside_m - beside[0]
    score -= 0.5 * (off * off / variance + log(2 * pi * variance))
    gain = ahead / variance
    return _Chain(score, one, False, reference, error, (beside[0] + gain * off, (1 - gain) * ahead), parent)


def _clear_of(lists: _Lists, one: int, error: _State, fast: float) -> float:
    """How likely it is that an unknown street keeps its distance from a known one, where this fix lies."""
    least = 1e-6  # a likelihood that anything has: the model may be wrong
    error_e, error_n, ee, en, nn = error
    left_e, left_n = lists.left_e[one], lists.left_n[one]
    spread = 2 * (ee * left_e**2 + 2 * en * left_e * left_n + nn * left_n**2 + fast)
    aside_m = abs(lists.aside_m[one] - error_e * left_e - error_n * left_n)
    reach = sqrt(spread)
    return log(0.5 * (erfc((_STREETS_M - aside_m) / reach) + erfc((_STREETS_M + aside_m) / reach)) + least)


def _drifted(state: _State, step_s: float) -> _State:
    keeps = exp(-max(step_s, 0.0) / _CORRELATION_S)
    error_e, error_n, ee, en, nn = state
    square = keeps * keeps
    new = (1 - square) * _SPREAD_M2
    return keeps * error_e, keeps * error_n, square * ee + new, square * en, square * nn + new


def _traced_back(history: Sequence[Sequence[_Chain]]) -> tuple[Indices, Array]:
    path, states, number = np.full(len(history), NO_WAY, np.intp), np.zeros((len(history), 5)), 0
    for window in range(len(history) - 1, -1, -1):
        chain = history[window][number]
        if chain.known:
            path[window] = chain.candidate
        states[window], number = chain.error, chain.parent
    return path, states


def _smoothed(trace: Trace, states: Array) -> Array:
    """Errors to the east and north (n, 2) as the whole drive gives them."""
    keeps = np.exp(-np.diff(trace.t_s).clip(0.0) / _CORRELATION_S)
    covariance = states[:, [2, 3, 3, 4]].reshape(-1, 2, 2)
    drifted = keeps[:, None, None]**2 * covariance[:-1] + (
        (1 - keeps**2) * _SPREAD_M2)[:, None, None] * np.eye(2)
    gain = np.einsum("nij,njk->nik", keeps[:, None, None] * covariance[:-1], np.linalg.inv(drifted))
    offset = states[:-1, :2] - np.einsum("nij,nj->ni", gain, keeps[:, None] * states[:-1, :2])
    found = np.array(states[:, :2])
    for window in range(len(found) - 2, -1, -1):
        found[window] = offset[window] + gain[window] @ found[window + 1]
    return found


@dataclass(frozen=True, eq=False)
class _Lists:
    """Candidates as lists, which a loop reads faster than arrays; ``begins`` of those of each window."""

    begins: list[int]
    way: list[int]
    point: list[int]
    along_m: list[float]
    aside_m: list[float]
    left_e: list[float]
    left_n: list[float]
    way_of: Indices
    founder: Indices
    passes: Array

    def goes_on(self, among: range, one: int) -> bool:
        """Whether a candidate's street is among those of a neighbouring window too, perhaps as another way."""
        return one != NO_WAY and any(self.same(one, other) for other in among)

    def agree(self, one: _Chain, other: _Chain) -> bool:
        """Whether two chains lie on one street, or both on an unknown one."""
        if one.known != other.known or not one.known:
            return one.known == other.known
        return one.candidate == other.candidate or self.same(one.candidate, other.candidate)

    def same(self, one: int, other: int) -> bool:
        """Whether candidates of neighbouring windows are of one street: the same way, or one that continues it."""
        if self.way[one] == self.way[other] and abs(self.along_m[one] - self.along_m[other]) > 2 * SEARCH_M:
            return False
        if self.left_e[one] * self.left_e[other] + self.left_n[one] * self.left_n[other] < _STRAIGHT:
            return self.way[one] == self.way[other]
        return abs(self.aside_m[one] - self.aside_m[other]) < _STREET_M

    @classmethod
    def of(cls, network: RoadNetwork, found: Candidates, count: int) -> _Lists:
        u_east, u_north = network.plane_heading()
        e, n = u_east[found.point], u_north[found.point]
        return cls(np.searchsorted(found.window, np.arange(count + 1)).tolist(), network.way[found.point].tolist(),
                   found.point.tolist(), (network.along_m[found.point] + found.east_m * e + found.north_m * n).tolist(),
                   (found.north_m * e - found.east_m * n).tolist(), (-n).tolist(), e.tolist(), network.way,
                   network.founder, network.passes)


def lay(network: RoadNetwork, traces: Sequence[Trace]) -> list[Matched]:
    """Lay drives over each other, one after the other: where no way is known a drive makes one, and ``network`` grows.

    A drive that passes a place again is laid over itself.
    """
    found = []
    for founder, trace in enumerate(traces, start=network.traces):
        parts: list[Matched] = []
        state = _UNKNOWN_ERROR
        for start, end in _laps(trace):
            lap = trace.of(slice(start, end))
            matched, state = match(network, lap, state)
            parts.append(_learned(network, lap, matched, founder))
        found.append(Matched.joined(parts or [_nowhere(0)]))
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
    apart_m = 100.0  # from which distance on a drive that comes back drives again
    from scipy.spatial import cKDTree

    points = on_sphere(trace.lat_deg, trace.lon_deg)
    heading = directions(points, trace.distance_m)
    pairs = cKDTree(points).query_pairs(SEARCH_M, output_type="ndarray") if len(points) else np.zeros((0, 2), np.intp)
    early, late = pairs.min(axis=1), pairs.max(axis=1)
    alike = np.einsum("ij,ij->i", heading[early], heading[late]) > np.cos(np.radians(MOST_TURN_DEG))
    again = alike & (trace.distance_m[late] - trace.distance_m[early] > apart_m)
    last = np.full(len(points), -1)
    np.maximum.at(last, late[again], early[again])
    cuts = [0]
    for window in np.flatnonzero(last >= 0).tolist():
        if last[window] >= cuts[-1]:
            cuts.append(window)
    return [(start, end) for start, end in zip(cuts, [*cuts[1:], len(points)], strict=True) if end > start]


ALONG, AGAINST = 1, -1


@dataclass(frozen=True, eq=False)
class OnRoute:
    """Windows (n,): direction ALONG or AGAINST growing measures, 0 where they lie on another road; measure of the
    middle [m], NaN there."""

    direction: Indices
    measure_m: Array


def measures(lat_deg: Array, lon_deg: Array, begin_m: float | None, end_m: float | None, posts: Array | None = None,
             post_m: Array | None = None) -> Array:
    """Measures (n,) of the corners of a line [m].

    begin_m, end_m    at its ends; with neither its own length from 0 on
    posts             (p, 2) latitudes and longitudes of kilometre posts, with measures (p,): between them they hold,
                      and beyond the outer ones the line's own length goes on from them

    ValueError where the line has no length, or posts do not follow each other along the line by growing measures.
    """
    shortest_m = 1.0  # between posts
    corners, length_m = _line(lat_deg, lon_deg)
    if posts is None or post_m is None or not len(post_m):
        first = begin_m if begin_m is not None else 0.0 if end_m is None else end_m - length_m[-1]
        last = end_m if end_m is not None else first + length_m[-1]
        return np.asarray(first + (last - first) * length_m / length_m[-1])
    at_m = _abreast(corners, length_m, on_sphere(posts[:, 0], posts[:, 1]))
    order = np.argsort(at_m)
    at_m, known_m = at_m[order], post_m[order]
    if (np.diff(at_m) < shortest_m).any() or (np.diff(known_m) <= 0).any():
        raise ValueError("expected kilometre posts with increasing numbers along the line")
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


def on_route(network: RoadNetwork, trace: Trace) -> OnRoute:
    """Lay a drive on a route's two ways."""
    found, _ = match(network, trace)
    direction = np.where(found.way < 0, 0, np.where(found.way == 0, ALONG, AGAINST))
    return OnRoute(direction, direction * found.along_m)
