"""Roughness as a process along the road, learned on the way: how rough each place is.

Problem. A road has holes and joints of a metre, patches of ten and sections of a hundred and more, and its level may
change in a step. One level for a block of 20 s leaks a rough section into the smooth one behind it; a variance that
each point learns by itself sees little where the readings say little.

Solution. The white innovations v of the road have at each point the variance d = exp(L) w. The level L is a Gaussian
process along the road, a sum of one for each of ``LENGTHS_M`` whose correlation exp(-distance / length) allows for
steps. The scale w of some ``_REACH_M`` about a point is heavy-tailed: as if ``common`` more points said that it is 1
(an inverse gamma distribution), so that a pothole is a large w and raises no level.

From an estimate of v, made with d, and the share r of it that the readings resolve, the slope of the log evidence in
log d is (v^2 / d - r) / 2 (MacKay 1992), and its expected curvature r^2 / 2, mean over all waves: it is that of a sum
of squares v^2 - (r - r^2) d with r^2 degrees of freedom. With w integrated over, that of L is that of a Student t. A
Newton step per round finds the most probable L (Laplace's approximation); w follows from it as (common + v^2 / exp(L))
/ (common + r), sums over neighbours. Readings tell the mean variance of places that they do not resolve, for they feel
many at once: L is its logarithm there, half the variance of log w above the mean logarithm. Of places that they resolve
L is that of the mean precision, as much below. What was found of cells that no block shows any more is carried by a
Kalman filter, for such processes are Markov's. Their variances are learned by scoring in the evidence.
"""

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from logger.arrays import ROUNDING, Array, Bools
from logger.estimation.road_spectrum import COMMON_DEVIATIONS
from logger.estimation.scored_variances import FORGOTTEN, LARGEST_STEP, ScoredVariances
from logger.estimation.time_grid import neighbours

LENGTHS_M = np.array([10.0, 100.0, 10_000.0])
_COMMON_VARIANCES = np.array([0.05, 0.15])  # of the log variance, before a road is known; the last is that of levels
_VARIANCE_LOG_STD = 1.5  # by how much roads differ in that
_SMOOTHEST, _ROUGHEST = -12.0, 8.0  # L of roads that have an IRI of 0.006 and 140 m/km
_CELL_M = 8.0
_MOST_CELLS = 256  # at once: 2 km, and blocks of 20 s are shorter. A place that jumps must cost no memory
_REACH_M = 1.0
_COMMON = 4.0  # points, before the scatter is known, and never fewer
_MOST_COMMON = 100.0  # w keeps within 14 %, which costs nothing
_LEAST_OF_MEAN = 0.1  # a place that shows less says nothing of the scatter
_TAKEN_OVER = 0.6  # of a new scale, so that it does not overshoot
_TABLE_STEP = 0.5
# Towards the most probable level, where bounds follow it late: until they do, the curvature is the expected one, and
# more than twice the step that it allows runs in circles.
_WAY, _MOST_OF_CURVATURE = 0.75, 1.5


@dataclass(frozen=True)
class _Level:
    """L of cells from number ``first`` on (c,), what readings say of it, ``shown``, with ``information`` about it.

    Of the cells from ``edge`` on: ``prior`` (e, e) is the covariance of L before them. ``state`` (k,) and
    ``state_covariance`` (k, k) are what cells before the edge say of the processes there.
    """

    first: int
    log_level: Array
    shown: Array
    information: Array
    edge: int
    prior: Array
    state: Array
    state_covariance: Array

    @cached_property
    def _root(self) -> Array:
        return np.sqrt(self.information[self.edge - self.first:])

    @cached_property
    def _narrowed(self) -> Array:
        return np.eye(len(self.prior)) + self._root[:, None] * self.prior * self._root

    @cached_property
    def spread(self) -> Array:
        """The inverse (e, e) of the covariance of what is shown."""
        return self._root[:, None] * np.linalg.inv(self._narrowed) * self._root

    def pull(self, mean: Array) -> Array:
        """``spread`` times what is shown less ``mean`` (e,): times ``prior`` it is by how much L rises."""
        off = self._root * (self.shown[self.edge - self.first:] - mean)
        return self._root * np.linalg.solve(self._narrowed, off)

    def cells(self, first: int, count: int) -> tuple[Array, Array, Array]:
        """L, what is shown, and information of other cells: beyond those that are known L goes on as there."""
        at = first + np.arange(count) - self.first
        near = np.clip(at, 0, len(self.log_level) - 1)
        known = at == near
        return self.log_level[near], self.shown[near] * known, self.information[near] * known


@dataclass(frozen=True)
class ResolvedShares:
    """What the readings resolve of a road's variance: shares (n,) of each of its ``points``, means over the waves, with
    their degrees of ``freedom`` (n,), the means of their squares; and (k,) of each of its ``waves``, means over the
    points that were seen."""

    points: Array
    freedom: Array
    waves: Array

    def at_most(self, freedom: float, seen: Array) -> "ResolvedShares":
        """Where all that was ``seen`` (n,) takes no more degrees of freedom of the readings: a hole rings on in these,
        which makes them more than it has."""
        return replace(self, points=self.points * min(freedom / float(seen @ self.points), 1.0))


class RoadLevels:
    """Log variance of innovations by number of the point on an endless grid of ``spacing_m``, over that of a common
    road, for a spectrum of any level.

    ``curvature`` is that of the evidence with the level over the expected one, where bounds move with the level
    (``level_response``); None: they do not. ``moved`` is the root mean square change of L by the last step.
    """

    def __init__(self, spacing_m: float) -> None:
        self._reach = _REACH_M / spacing_m
        self._cell = round(_CELL_M / spacing_m)
        self._cell_m = self._cell * spacing_m
        self._first = 0
        self._log_scale, self._scale_error, self._excess = np.empty(0), np.empty(0), np.empty(0)
        self._level: _Level | None = None
        self._scored = ScoredVariances(_COMMON_VARIANCES, _VARIANCE_LOG_STD)
        self.curvature: float | None = None
        self.moved = 0.0
        self._held: Array | None = None
        self._common = _COMMON
        self._scattered, self._heard = 0.0, 0.0  # sum of weight x scatter, and of the weights

    @property
    def variances(self) -> Array:
        """Of L, what each process of ``LENGTHS_M`` makes of it, as learned."""
        return np.append(self._scored.values, COMMON_DEVIATIONS[0] ** 2)

    def held_at(self, log_variance: Array) -> "RoadLevels":
        """The same road with this log variance (n,), point by point of one block, which stays."""
        held = copy(self)
        held._held = log_variance
        return held

    def solved_with(self, first: int, count: int) -> Array:
        """Log variance (count,) with which points ``first`` ... ``first + count - 1`` are to be solved: their
        precision's mean."""
        if self._held is not None:
            return self._held
        return self._levels(first, count) + self._kept(self._log_scale, first, count)

    def at(self, first: int, count: int) -> Array:
        """Mean log variance (count,) of the same points; beyond what is known the level goes on as there."""
        if self._held is not None:
            return self._held
        return self.solved_with(first, count) + self._kept(self._excess, first, count)

    def log_std(self, first: int, count: int) -> float:
        """Standard error of the log variance of these points: of the mean level, and of a scale."""
        if self._level is None:
            return 0.0
        at = (first + np.arange(count)) // self._cell - self._level.edge
        weight = np.bincount(np.clip(at, 0, len(self._level.prior) - 1)) / count
        alike = weight @ self._level.prior[:len(weight)]
        of_level = float(alike[:len(weight)] @ weight - alike @ self._level.spread @ alike)
        error = of_level + float(self._kept(self._scale_error, first, count).mean())
        return float(np.sqrt(max(error, 0.0)))

    def _kept(self, row: Array, first: int, count: int) -> Array:
        """Part of a row by points as they were learned; 0 elsewhere."""
        found, ahead = np.zeros(count), first - self._first
        here = slice(max(-ahead, 0), max(min(len(row) - ahead, count), 0))
        found[here] = row[max(ahead, 0): max(min(len(row), ahead + count), 0)]
        return found

    def _levels(self, first: int, count: int) -> Array:
        if self._level is None:
            return np.zeros(count)
        at = (first + np.arange(count)) // self._cell
        return self._level.cells(int(at[0]), int(at[-1] - at[0]) + 1)[0][at - at[0]]

    def learn(self, first: int, innovations: Array, log_before: Array, shares: ResolvedShares, seen: Array,
              learns: bool = False) -> None:
        """Take what a solved block says.

        innovations    (n,) v at its points; n is even
        log_before     (n,) the log variance that it was solved with
        shares         of it that the readings resolve
        seen           (n,) 1 where the road was read, else 0
        learns         the variances and the scatter as well: once per block
        """
        if self._held is not None or not seen.any():
            return
        count = len(innovations)
        squares = innovations**2
        rows = np.stack([squares, shares.points, squares - (shares.points - shares.freedom) * np.exp(log_before),
                         shares.freedom, np.ones(count)]) * seen
        about = neighbours(count, self._reach)
        power, weight, squares, freedom, near = np.fft.irfft(np.fft.rfft(rows) * about, count)
        power, weight, freedom = (np.maximum(row, 0.0) for row in (power, weight, freedom))
        self._learn_level(first, squares, freedom, weight, seen / float(about[0]), learns)
        level = self._levels(first, count)
        power = power * np.exp(-level)
        if learns:
            self._learn_scatter(power, weight, shares.waves, seen > 0)
        fresh = np.log((self._common + power) / (self._common + weight))
        fresh = _TAKEN_OVER * fresh + (1 - _TAKEN_OVER) * (log_before - level)
        self._first, self._log_scale = first, np.where(near > ROUNDING, fresh, 0.0)
        self._scale_error = 2 / (self._common + weight)
        self._excess = 0.5 * self._scale_error * (weight - self._common) / (weight + self._common)

    def _learn_level(self, first: int, squares: Array, freedom: Array, weight: Array, each: Array, learns: bool
                     ) -> None:
        """One step for L of the cells that are seen and those behind them; of points, ``each`` (n,) counts as a part of
        a neighbourhood."""
        cells = (first + np.arange(len(squares))) // self._cell
        begin, edge, end = int(cells[0]), int(cells[np.flatnonzero(each)[0]]), int(cells[-1]) + 1
        old = self._level
        if old is None:
            nothing = np.zeros(1)
            state = np.zeros(len(LENGTHS_M))
            old = _Level(edge, nothing, nothing, nothing, edge, np.zeros((1, 1)), state, np.diag(self.variances))
        edge = max(edge, old.edge, end - _MOST_CELLS)
        state, state_covariance = self._carried(old, edge)
        now, total = old.cells(edge, end - edge)[0], end - edge
        at, chosen = cells[cells >= edge] - edge, cells >= edge
        alike = _processes(total, self._cell_m)
        since = alike[:, 0]
        mean = state @ since
        prior = np.tensordot(self.variances, alike, 1) + since.T @ (state_covariance - np.diag(self.variances)) @ since

        # A hole that lies elsewhere than it was thought to says nothing of the level, however large it was thought: at
        # least what is found of a road of this level whose innovations are nothing.
        relative = np.maximum(squares[chosen] * np.exp(-now[at]), np.minimum(freedom - weight, 0.0)[chosen])
        freedom, half = freedom[chosen], 0.5 * self._common * each[chosen]
        slope = np.bincount(at, half * (relative - freedom) / (self._common + np.maximum(relative, 0.0)), total)
        bend = np.maximum(np.bincount(at, half * freedom / (self._common + freedom), total), ROUNDING)
        if self.curvature is not None:
            bend = np.maximum(self.curvature * bend, ROUNDING)
        level, shown, information = (np.concatenate(pair) for pair in zip(
            old.cells(begin, edge - begin), (now, now + slope / bend, bend), strict=True))
        self._level = _Level(begin, level, shown, information, edge, prior, state, state_covariance)
        pull = self._level.pull(mean)
        way = 1.0 if self.curvature is None else min(_WAY, _MOST_OF_CURVATURE * self.curvature)
        step = np.clip(way * (mean + prior @ pull - now), -LARGEST_STEP, LARGEST_STEP)
        level[edge - begin:] = np.clip(now + step, _SMOOTHEST, _ROUGHEST)
        self.moved = float(np.sqrt(np.mean(step**2)))
        if learns:
            self._learn_variances(alike[:-1], pull, self._level.spread)

    def _carried(self, old: _Level, edge: int) -> tuple[Array, Array]:
        """State and its covariance by a Kalman filter over the cells between the old edge and this one."""
        state, covariance = old.state, old.state_covariance
        decay = np.exp(-self._cell_m / LENGTHS_M)
        new = np.diag(self.variances * (1 - decay**2))
        _, shown, information = old.cells(old.edge, edge - old.edge)
        for value, precision in zip(shown.tolist(), information.tolist(), strict=True):
            column = covariance.sum(axis=1)
            gain = column * (precision / (1 + precision * column.sum()))
            state = decay * (state + gain * (value - state.sum()))
            covariance = decay[:, None] * (covariance - np.outer(gain, column)) * decay + new
        return state, covariance

    def _learn_variances(self, alike: Array, pull: Array, spread: Array) -> None:
        """One scoring step in the evidence of what was shown, N(mean, inverse of ``spread``)."""
        parts = self._scored.values[:, None, None] * alike
        products = parts @ spread
        slope = 0.5 * (parts @ pull @ pull - np.trace(products, axis1=1, axis2=2))
        curvature = 0.5 * (products * products.transpose(0, 2, 1)).sum(axis=(1, 2))
        self._scored.learn(slope, curvature)

    def _learn_scatter(self, power: Array, weight: Array, resolved: Array, inside: Bools) -> None:
        """By how much the local means of a block scatter more than chance makes them: their variance less that of a
        weighted sum of squares of what has the correlation that the shares (k,) of its waves give it (Isserlis)."""
        count = len(power)
        near = neighbours(count, self._reach)
        correlation = np.fft.irfft(resolved, count)
        if correlation[0] <= 0 or not power.any():
            return
        chance = 2 * float(np.fft.irfft(near**2, count) @ correlation**2) / (correlation[0] * near[0]) ** 2
        mean = float(weight[inside].mean())
        relative = power[inside] / np.maximum(weight[inside], _LEAST_OF_MEAN * mean)
        found = float(np.var(relative) / np.mean(relative) ** 2) - chance
        usual = 2 / _COMMON
        self._scattered += mean * min(max(found, -usual), usual) - FORGOTTEN * self._scattered
        self._heard += mean - FORGOTTEN * self._heard
        scatter = (self._scattered + _COMMON * usual) / (self._heard + _COMMON)
        self._common = 2 / max(scatter, 2 / _MOST_COMMON)


def resolved_shares(strength: Array, gain: Array, seen: Array) -> ResolvedShares:
    """Of points (n,) of relative variance exp(strength) that were ``seen`` (n,) 1 or 0, with the ``gain`` (k,) of each
    wave, information over prior, where that variance is 1."""
    place = (strength - strength.min()) / _TABLE_STEP
    low = place.astype(np.int64)
    above = (place - low) * seen
    counts = np.bincount(low, seen - above, int(low.max()) + 2) + np.bincount(low + 1, above, int(low.max()) + 2)
    table = strength.min() + _TABLE_STEP * np.arange(len(counts))
    share = np.exp(table)[:, None] * gain
    share /= 1 + share
    points, freedom = (
        np.exp(np.interp(strength, table, np.log(np.maximum(each.sum(axis=1) * (2 / len(strength)), 1e-300))))
        for each in (share, share**2))
    return ResolvedShares(points, freedom, counts @ share / max(float(seen.sum()), 1.0))


@lru_cache(maxsize=16)
def _processes(count: int, cell_m: float) -> Array:
    """Covariances (lengths, count, count) over cells of processes of variance 1; kept, for there are few counts."""
    lag_m = cell_m * np.abs(np.arange(count)[:, None] - np.arange(count))
    return np.exp(-lag_m / LENGTHS_M[:, None, None])
