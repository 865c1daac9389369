"""A drive along a measured line: the line, the motion, and how it is laid on the line."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from logger.arrays import Array, Indices, Whole
from logger.dsp.repeated_samples import stretches_of
from logger.estimation.receiver_delay import FREEDOM
from logger.geodesy import east_and_north_m
from logger.lab.likelihood.lag import SLOWEST_MPS, lags, offset_by_correlation_m
from logger.profiles.track import Track
from logger.roads.road_matching import SEARCH_M
from logger.runs import RECEIVER_ERROR_LASTS_S, Run

_APART_M = 15.0
"""By so much the place on the line and the way that was driven may differ from fix to fix on one pass."""
_LEAST_FIXES = 5
_MORE, _LESS, _PLACE_M = 0.05, 0.7, 20.0
"""Places that were measured well lie no farther apart than the way between them, but for errors, and, where few of
them are given, nearer by the bends; a third is more than bends take."""
_SPACING_M = 1.0


@dataclass(frozen=True, eq=False)
class MeasuredLine:
    """Places (m,) along a line: distances, growing [m], east and north of the first one [m].

    Problem: a profile has distances, a receiver positions; a drive begins before the line, ends behind it, may leave it
    and come back, or go the other way. Solution: each position is laid on the nearest piece of the line. Where that
    place moves along as far as the car does, position after position, the car was on it; such stretches are the passes.
    """

    distance_m: Array
    east_m: Array
    north_m: Array
    lat_deg: float
    lon_deg: float

    @staticmethod
    def of(distance_m: Array, lat_deg: Array, lon_deg: Array) -> "MeasuredLine":
        """By geographic coordinates (m,) [degrees]. ValueError for fewer than two places, distances that do not grow,
        and places that cannot be so far apart on the ground, or lie much nearer together."""
        if len(distance_m) < 2:
            raise ValueError("expected two positions or more")
        if not (np.diff(distance_m) > 0).all():
            raise ValueError("expected distances that increase from position to position")
        east_m, north_m = east_and_north_m(lat_deg, lon_deg, float(lat_deg[0]), float(lon_deg[0]))
        apart_m, ahead_m = np.hypot(np.diff(east_m), np.diff(north_m)), np.diff(distance_m)
        if (far := apart_m > (1 + _MORE) * ahead_m + _PLACE_M).any():
            at = int(np.argmax(far))
            raise ValueError(f"expected positions no farther apart than their distances, found {apart_m[at]:.0f} m "
                             f"between those at {distance_m[at]:g} and {distance_m[at + 1]:g} m")
        if apart_m.sum() < _LESS * ahead_m.sum() - _PLACE_M:
            raise ValueError(f"expected positions {ahead_m.sum():.0f} m apart in all, to match the distances, found "
                             f"{apart_m.sum():.0f} m")
        return MeasuredLine(distance_m, east_m, north_m, float(lat_deg[0]), float(lon_deg[0]))

    def passed(self, lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
        """The distance of the place nearest to positions (k,), and how far aside they are, both (k,) [m]."""
        from scipy.spatial import cKDTree

        east_m, north_m = east_and_north_m(lat_deg, lon_deg, self.lat_deg, self.lon_deg)
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
    """The passes of a drive, by fixes (k,): how far the car had come, the nearest place of the line, how far aside. By
    places with their signs turned, those of a drive from the line's end to its beginning."""
    offset_m = along_m - driven_m
    on = aside_m <= SEARCH_M
    together = on[1:] & on[:-1] & (np.abs(np.diff(offset_m)) <= _APART_M)
    found = []
    for first, last in zip(*stretches_of(together), strict=True):
        moved = np.ptp(driven_m[first : last + 1])
        if last - first + 1 >= _LEAST_FIXES and moved > 2 * _APART_M and np.ptp(offset_m[first : last + 1]) < moved / 2:
            found.append(Pass(int(first), int(last) + 1, float(np.median(offset_m[first : last + 1]))))
    return found


NEAREST_FIXES_S = 0.02
"""Fixes nearer to each other than that are one: no receiver sends 50 a second."""
_WILD = 5.0  # deviations of a speed: noise alone is never so far off, and braking is not taken for it
_ROUNDS = 3
_LEAST_NOISE_MPS = 0.005  # of a speed that is written in thousandths of a knot
_RATIOS = np.logspace(-2.0, 5.0, 15)
"""Of the walk of the acceleration over the square of a speed's noise [1/s3]: from a ship to a braking car."""
_FINER = np.logspace(-0.5, 0.5, 7)
_SLIP_S = 0.05
"""The way differs from the integral of the speed by a random walk as well, of so much of a speed's noise after a
second: next to nothing, but without it the equations of ten fixes a second cannot be solved in double precision."""
_UNKNOWN = (1e4, 1e4, 500.0)  # deviations of the first distance [m], speed [m/s] and acceleration [m/s2]
_DRAWS = 24
_ENOUGH_FIXES = 1500  # for what all of a drive has in common


@dataclass(frozen=True, eq=False)
class Observations:
    """Speeds or places at instants (k,), each with its standard deviation: [m/s] or [m]."""

    time_s: Array
    value: Array
    deviation: Array


@dataclass(frozen=True, eq=False)
class TrackMotion:
    """The most likely motion at the times of the fixes (k,); between them it is a polynomial of the fifth order.

    state       (k, 3) distance [m], speed [m/s] and acceleration [m/s2]
    walk        variance by which the acceleration wanders in a second [m2/s5]
    noise_mps   standard deviation of a speed
    """

    time_s: Array
    state: Array
    walk: float
    noise_mps: float

    def distance_m(self, time_s: Array) -> Array:
        """Where the car was (n,), never going back."""
        return np.asarray(np.maximum.accumulate(self._curve(time_s, 0)))

    def speed_mps(self, time_s: Array) -> Array:
        """How fast it was (n,), 0 at least."""
        return np.maximum(self._curve(time_s, 1), 0.0)

    def _curve(self, time_s: Array, order: int) -> Array:
        """The distance, or its first derivative (n,), by Hermite's quintics through the states."""
        first = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, len(self.time_s) - 2)
        step = self.time_s[first + 1] - self.time_s[first]
        u = (time_s - self.time_s[first]) / step
        scale = np.stack([np.ones_like(step), step, step**2], axis=1)
        begin, end = (self.state[one] * scale for one in (first, first + 1))
        c = [begin[:, 0], begin[:, 1], 0.5 * begin[:, 2]]
        ahead, faster, harder = end[:, 0] - sum(c), end[:, 1] - c[1] - 2 * c[2], end[:, 2] - 2 * c[2]
        c += [10 * ahead - 4 * faster + 0.5 * harder, -15 * ahead + 7 * faster - harder,
              6 * ahead - 3 * faster + 0.5 * harder]
        if order == 0:
            return np.asarray(c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * (c[4] + u * c[5])))))
        return np.asarray((c[1] + u * (2 * c[2] + u * (3 * c[3] + u * (4 * c[4] + u * 5 * c[5])))) / step)


def motion_of(speeds: Observations, places: Observations | None = None, like: TrackMotion | None = None) -> TrackMotion:
    """The motion by two fixes or more, in order of time and ``NEAREST_FIXES_S`` apart.

    Problem: a receiver gives the speed once or ten times a second, with noise, now and then wildly wrong; a model needs
    the distance a hundred times a second, to some centimetres. Solution: the speed of a car changes smoothly. Its
    acceleration is taken for a random walk; the most likely motion given all fixes together (the smoother of A. Rauch,
    F. Tung and C. Striebel, AIAA Journal 3, 1965) is the solution of one banded system. How much the acceleration
    wanders, and how large the errors of the fixes are, is chosen by evidence; wild ones count less. Places along a line
    that are known from elsewhere enter as further observations, with errors by Student's t. Errors come from drawing
    the motion that all could be (G. Papandreou and A. Yuille, NIPS 2010).

    speeds    with no deviations of their own (ones) but where these differ: they are scaled by evidence
    places    along the way [m]; None: the way begins at 0
    like      another motion of the same fixes, whose walk and noise are taken; None: they are found

    ValueError for fewer than two fixes.
    """
    if len(speeds.time_s) < 2:
        raise ValueError("expected two fixes or more")
    places = places or Observations(*(np.array([one]) for one in (speeds.time_s[0], 0.0, 0.001)))
    walk, noise = (like.walk, like.noise_mps) if like else _strengths(speeds)
    return _fitted(speeds, places, walk, noise)


def place_std_m(motion: TrackMotion, speeds: Observations, places: Observations) -> Array:
    """Standard error of the distance at the times of the fixes (k,) [m]."""
    rng = np.random.default_rng(0)
    system = _System(speeds.time_s, motion.walk, motion.noise_mps)
    speeds = replace(speeds, deviation=speeds.deviation * motion.noise_mps)
    rows = [(1, speeds), (0, places)]
    drawn = [system.drawn(rows, rng) for _ in range(_DRAWS)]
    return np.asarray(np.sqrt(np.mean([one[:, 0] ** 2 for one in drawn], axis=0)))


def speed_scale(motion: TrackMotion, speeds: Observations, places: Observations) -> tuple[float, float]:
    """The speeds of fixes (k,) over those of a motion that follows known places, between the first and the last of
    these, and the standard error of that."""
    inside = (speeds.time_s >= places.time_s.min()) & (speeds.time_s <= places.time_s.max())
    driven_mps, value_mps = motion.speed_mps(speeds.time_s)[inside], speeds.value[inside]
    weights = _without_wild((value_mps - driven_mps) / motion.noise_mps)
    size = float(weights @ driven_mps**2)
    return float((weights * driven_mps) @ value_mps) / size, motion.noise_mps / float(np.sqrt(size))


def _strengths(speeds: Observations) -> tuple[float, float]:
    """The walk of the acceleration and the noise of the speeds with the most evidence, by the middle of a drive."""
    first = max(0, (len(speeds.time_s) - _ENOUGH_FIXES) // 2)
    middle = slice(first, first + _ENOUGH_FIXES)
    speeds = Observations(speeds.time_s[middle], speeds.value[middle], speeds.deviation[middle])
    start = Observations(speeds.time_s[:1], np.zeros(1), np.full(1, 0.001))
    weights = np.ones(len(speeds.time_s))
    ratios = _RATIOS
    for _ in range(_ROUNDS):
        weighted = replace(speeds, deviation=speeds.deviation / np.sqrt(weights))
        best = -np.inf
        for tried in ratios:
            state, evidence, scale = _System(speeds.time_s, float(tried), 1.0).solved([(1, weighted)], start)
            if evidence > best:
                best, ratio, noise_mps, left = evidence, float(tried), scale, state[:, 1] - speeds.value
        weights = _without_wild(left / speeds.deviation / noise_mps)
        ratios = ratio * _FINER
    noise_mps = max(noise_mps, _LEAST_NOISE_MPS)
    return ratio * noise_mps**2, noise_mps


def _fitted(speeds: Observations, places: Observations, walk: float, noise_mps: float) -> TrackMotion:
    """The motion of given strengths."""
    system = _System(speeds.time_s, walk, noise_mps)
    deviation = speeds.deviation * noise_mps
    weights, seen = np.ones(len(speeds.time_s)), np.ones(len(places.time_s))
    state = np.zeros((len(speeds.time_s), 3))
    for _ in range(_ROUNDS):
        rows = [(1, replace(speeds, deviation=deviation / np.sqrt(weights))),
                (0, replace(places, deviation=places.deviation / np.sqrt(seen)))]
        state = system.solved(rows)[0]
        weights = _without_wild((state[:, 1] - speeds.value) / deviation)
        at = TrackMotion(speeds.time_s, state, walk, noise_mps)
        off = (at._curve(places.time_s, 0) - places.value) / places.deviation
        seen = np.asarray((FREEDOM + 1) / (FREEDOM + off**2))
    return TrackMotion(speeds.time_s, state, walk, noise_mps)


def _without_wild(off: Array) -> Array:
    """Weights (k,) of speeds that are off by so many deviations: less the farther they are beyond ``_WILD``."""
    return np.asarray((_WILD / np.maximum(np.abs(off), _WILD)) ** 2)


class _System:
    """The normal equations of a random walk of the acceleration, (3 k, 3 k), as the bands above and on the diagonal."""

    def __init__(self, time_s: Array, walk: float, noise_mps: float) -> None:
        self._time_s = time_s
        step = np.diff(time_s)
        self._forward = _transitions(step)
        spread = _walked(step) * walk
        spread[:, 0, 0] += (_SLIP_S * noise_mps) ** 2 * step
        self._inverse = np.linalg.inv(spread)
        count = len(time_s)
        blocks = np.zeros((count, 3, 3))
        blocks[0] = np.diag(np.array(_UNKNOWN) ** -2.0)
        turned = self._forward.transpose(0, 2, 1)
        blocks[:-1] += turned @ self._inverse @ self._forward
        blocks[1:] += self._inverse
        self._diagonal, self._beside = blocks, -turned @ self._inverse

    def solved(self, rows: Sequence[tuple[int, Observations]], start: Observations | None = None
               ) -> tuple[Array, float, float]:
        """The states (k, 3), the log of the evidence, and the scale of all deviations with the most of it.

        rows    which of distance 0 and speed 1 was observed, and how
        start   where the way begins, which no scale changes
        """
        from scipy.linalg import cho_solve_banded, cholesky_banded

        blocks, pulls, squares, count, logs = self._observed(rows)
        if start is not None:
            added, pulled, *_ = self._observed([(0, start)])
            blocks, pulls = blocks + added - self._diagonal, pulls + pulled
        root = cholesky_banded(self._bands(blocks))
        state = cho_solve_banded((root, False), pulls.ravel())
        left = max(squares - float(pulls.ravel() @ state), 1e-12)
        variance = left / max(count - 2, 1)  # the first speed and acceleration are known by nothing else
        determinant = -2 * float(np.log(root[-1]).sum()) + float(np.linalg.slogdet(self._inverse)[1].sum())
        evidence = 0.5 * (determinant - logs - count * np.log(variance))
        return state.reshape(-1, 3), evidence, float(np.sqrt(variance))

    def drawn(self, rows: Sequence[tuple[int, Observations]], rng: np.random.Generator) -> Array:
        """How far off the states (k, 3) may be: the answer to noise in place of all that is known."""
        from scipy.linalg import cho_solve_banded, cholesky_banded

        noise = [(order, replace(one, value=one.deviation * rng.standard_normal(len(one.value))))
                 for order, one in rows]
        blocks, pulls, *_ = self._observed(noise)
        roots = np.linalg.cholesky(self._inverse)
        kicks = (roots @ rng.standard_normal((len(roots), 3, 1)))[:, :, 0]
        pulls[1:] += kicks
        pulls[:-1] -= (self._forward.transpose(0, 2, 1) @ kicks[:, :, None])[:, :, 0]
        pulls[0] += rng.standard_normal(3) / np.array(_UNKNOWN)
        root = cholesky_banded(self._bands(blocks))
        return np.asarray(cho_solve_banded((root, False), pulls.ravel())).reshape(-1, 3)

    def _observed(self, rows: Sequence[tuple[int, Observations]]) -> tuple[Array, Array, float, int, float]:
        """Diagonal blocks (k, 3, 3) with what was observed, how it pulls (k, 3), its squares, how much it is, and minus
        the logs of its weights."""
        blocks, pulls = self._diagonal.copy(), np.zeros((len(self._time_s), 3))
        squares, count, logs = 0.0, 0, 0.0
        for order, one in rows:
            knot = self._nearest(one.time_s)
            since = one.time_s - self._time_s[knot]
            seen = np.stack([np.ones_like(since), since, 0.5 * since**2], axis=1)
            if order:
                seen = np.stack([np.zeros_like(since), np.ones_like(since), since], axis=1)
            weight = one.deviation**-2.0
            np.add.at(blocks, knot, weight[:, None, None] * seen[:, :, None] * seen[:, None, :])
            np.add.at(pulls, knot, (weight * one.value)[:, None] * seen)
            squares += float(weight @ one.value**2)
            count += len(since)
            logs -= float(np.log(weight).sum())
        return blocks, pulls, squares, count, logs

    def _nearest(self, time_s: Array) -> Indices:
        after = np.clip(np.searchsorted(self._time_s, time_s), 1, len(self._time_s) - 1)
        earlier = time_s - self._time_s[after - 1] < self._time_s[after] - time_s
        return np.asarray(after - earlier, dtype=np.intp)

    def _bands(self, blocks: Array) -> Array:
        """(6, 3 k): row 5 the diagonal, row 5 - d what lies d above it."""
        count = len(blocks)
        bands = np.zeros((6, 3 * count))
        for i in range(3):
            for j in range(3):
                if j >= i:
                    bands[5 - (j - i), j::3] = blocks[:, i, j]
                bands[5 - (3 + j - i), 3 + j :: 3] = self._beside[:, i, j]
        return bands


def _transitions(step_s: Array) -> Array:
    """(k, 3, 3) of distance, speed and acceleration over steps (k,)."""
    found = np.zeros((len(step_s), 3, 3))
    found[:] = np.eye(3)
    found[:, 0, 1] = found[:, 1, 2] = step_s
    found[:, 0, 2] = 0.5 * step_s**2
    return found


def _walked(step_s: Array) -> Array:
    """Covariances (k, 3, 3) of what a walk of the acceleration of variance 1 a second adds over steps (k,)."""
    powers = step_s[:, None, None] ** np.array([[5, 4, 3], [4, 3, 2], [3, 2, 1]])
    return np.asarray(powers / np.array([[20.0, 8.0, 6.0], [8.0, 3.0, 2.0], [6.0, 2.0, 1.0]]))


GPS_PLACE_M = 3.0
"""Standard error of a receiver's positions."""
_REACH_M = 30.0  # ten deviations of a receiver's place
_RETRIES = 4
_AGREE_M, _FEWEST = 0.2, 4
"""So many windows or more were felt, and half of them lie so near to the motion: those of another road lie anywhere
within 0.3 s, half of them 0.75 m off or more at 5 m/s and above, and no motion that fits the speeds follows them."""
_LEAST_STD_M = 0.01  # of a window: no model of a car is exact


@dataclass(frozen=True, eq=False)
class Registered:
    """A pass on the profile's distance.

    motion         along the profile
    place_std_m    r.m.s. standard error of a place [m]
    by_road        whether the road was recognised; False: places are those of the receiver
    speed_scale    of the receiver's speeds over those on the profile, and its standard error; None: by those speeds
    """

    motion: TrackMotion
    place_std_m: float
    by_road: bool
    speed_scale: tuple[float, float] | None = None


Predict = Callable[[Array], Array]
"""What the sensor of a model records (n,) [m/s2] at these distances (n,) of the front tires [m]."""


def registered(speeds: Observations, places: Observations, time_s: Array, accel_mps2: Array, rate_hz: float,
               track: Track, predict: Predict) -> Registered:
    """Lay a pass on its profile.

    Problem: a receiver's positions are off by metres, a model needs centimetres. Solution: the road itself shows it. A
    model of the car is driven over the profile at the distances that the receiver gives. One shift of the whole pass is
    found where what it should have felt and what it felt are most alike; then the two are compared window by window
    (``lab.likelihood.lag``), and where a window was felt is one more observation for the smoother of the motion.

    speeds, places    of the receiver: of the front tires, the latter by the profile's distance [m]
    time_s            (n,) of the readings, at ``rate_hz``, within the times of the fixes
    accel_mps2        (n,) what was read; 0 where nothing was
    """
    lasting = np.sqrt(max(1.0, RECEIVER_ERROR_LASTS_S * len(places.time_s) / max(np.ptp(places.time_s), 1.0)))
    weak = Observations(places.time_s, places.value, places.deviation * lasting)
    motion = motion_of(speeds, weak)
    by_road = _by_road(motion, speeds, time_s, accel_mps2, rate_hz, track, predict)
    motion, known = by_road or (motion, weak)
    std_m = place_std_m(motion, speeds, known)
    return Registered(motion, float(np.sqrt(np.mean(std_m**2))), by_road is not None,
                      None if by_road is None else speed_scale(motion, speeds, known))


def _by_road(motion: TrackMotion, speeds: Observations, time_s: Array, accel_mps2: Array, rate_hz: float, track: Track,
             predict: Predict) -> tuple[TrackMotion, Observations] | None:
    """The motion on the road as it was felt, and where that was; None where the road was not recognised."""
    distance_m = motion.distance_m(time_s)
    farther_m = offset_by_correlation_m(distance_m, accel_mps2, predict(distance_m), (track.start_m, track.end_m),
                                        _REACH_M)
    if farther_m is None:
        return None
    state = motion.state.copy()
    state[:, 0] += farther_m
    motion = TrackMotion(motion.time_s, state, motion.walk, motion.noise_mps)
    felt = _felt(motion, time_s, accel_mps2, rate_hz, track, predict)
    for _ in range(_RETRIES):
        if len(felt.time_s) < _FEWEST:
            return None
        motion, known = motion_of(speeds, felt, motion), felt
        felt = _felt(motion, time_s, accel_mps2, rate_hz, track, predict)
    off_m = np.interp(known.time_s, time_s, motion.distance_m(time_s)) - known.value
    return (motion, known) if np.median(np.abs(off_m)) < _AGREE_M else None


def _felt(motion: TrackMotion, time_s: Array, accel_mps2: Array, rate_hz: float, track: Track, predict: Predict
          ) -> Observations:
    """Where those windows of the road were felt in which the car did what the profile asks."""
    distance_m, speed_mps = motion.distance_m(time_s), motion.speed_mps(time_s)
    run = Run("", rate_hz, accel_mps2, distance_m, speed_mps, track)
    found = lags([run], [predict(distance_m)])
    at_m = distance_m[0] + found.along_m
    kept = (found.speed_mps > SLOWEST_MPS) & np.isfinite(found.error_s) & (at_m >= track.start_m) & (
        at_m <= track.end_m)
    rising = distance_m + 1e-9 * np.arange(len(distance_m))
    deviation = np.hypot(found.error_s * found.speed_mps, _LEAST_STD_M)
    return Observations(np.interp(at_m, rising, time_s)[kept], (at_m - found.lag_m)[kept], deviation[kept])


_OFF = 0.1
"""Of a step, by which one between two readings of the same piece may differ: times are written in microseconds."""


@dataclass(frozen=True, eq=False)
class RunGrid:
    """Samples (m,) of a run, made of readings (n,).

    Problem: after a hole a recorder's readings go on at instants of their own, up to half a step beside those before
    it; a run, whose times lie on one grid, could not be read again. To interpolate them would smooth what a coarse
    sensor read. Solution: a reading keeps its value and the instant at which it was taken, where the car is looked up,
    and gets the nearest number on the grid that is free.

    time_s     evenly spaced, from the first reading on [s]
    taken_s    the instants that they stand for, growing, within a step of ``time_s`` [s]
    row        number of the reading; -1: none
    """

    time_s: Array
    taken_s: Array
    row: Whole

    def laid(self, values: Array) -> Array:
        """Values of readings (n,) as samples (m,), on straight lines where there was no reading."""
        known = self.row >= 0
        return np.interp(np.arange(len(self.row)), np.flatnonzero(known), values[self.row[known]])


def run_grid(time_s: Array, rate_hz: float) -> RunGrid:
    """Lay readings at growing times (n,) [s], even but for jumps, on a grid; without readings it is empty."""
    if not len(time_s):
        return RunGrid(time_s, time_s, np.empty(0, dtype=np.int64))
    place = (time_s - time_s[0]) * rate_hz
    begins = [0, *(np.flatnonzero(np.abs(np.diff(place) - 1.0) > _OFF) + 1), len(place)]
    number = np.empty(len(place), dtype=np.int64)
    for begin, end in pairwise(begins):
        free = number[begin - 1] + 1 if begin else 0
        number[begin:end] = max(free, round(place[begin])) + np.arange(end - begin)
    row = np.full(number[-1] + 1, -1, dtype=np.int64)
    row[number] = np.arange(len(number))
    count = np.arange(len(row))
    return RunGrid(time_s[0] + count / rate_hz, np.interp(count, number, time_s), row)
