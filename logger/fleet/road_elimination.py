"""Least squares with a level and a growth for each road and a bias for each car, the roads eliminated.

Roads are many, and a block each; cars are few. So what is solved has as many rows as there are cars, and one for the
growth that all roads share. A road's own growth beyond that is drawn towards zero by a ridge (a random effect: C. R.
Henderson, Best linear unbiased estimation and prediction, Biometrics 31, 1975).

With X the columns of the cars and of time, R those of the roads, W the weights and B = (R'WR + ridge)^-1 R'WX, the
cars follow from U'v, U = W (X - R B), and A = U'X. Whatever the covariance V of the passes, that of the cars is
A^-1 U'VU A^-1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.intp]

_DENSE = 0.03
"""Share of entries that are not zero beyond which products of dense blocks are quicker than sparse ones (measured)."""
_BLOCK = 4096
_MOST_SESSIONS = 50_000
"""Whose sums are squared in whole; of more, what their roads add to that comes from a part of them, evenly chosen."""
_LEAST_INFORMATION = 1e-6
"""Of the variance of times that cars and roads leave, per pass [years2]: a third of a day squared."""


@dataclass(frozen=True, eq=False)
class RoadPasses:
    """Passes over roads (n,), those of one session over one road together.

    road, session    codes from 0
    car_of_session   (s,) codes from 0
    count            how many
    iri, years       means of their IRI [m/km] and of their times [years]
    """

    road: Codes
    session: Codes
    car_of_session: Codes
    count: Array
    iri: Array
    years: Array

    @property
    def car(self) -> Codes:
        """Of each (n,)."""
        return self.car_of_session[self.session]

    @property
    def of_session(self) -> Array:
        """Passes of each session (s,)."""
        return np.asarray(np.bincount(self.session, self.count, len(self.car_of_session)), np.float64)


class Elimination:
    """Passes with weights (n,), of so many cars. ``ridge``: what draws a road's own growth to zero, in passes times
    years squared; infinity: roads have none."""

    def __init__(self, passes: RoadPasses, cars: int, weight: Array, ridge: float) -> None:
        self.passes, self.cars, self.weight = passes, cars, weight
        self.car, road = passes.car, passes.road
        self.roads = int(road.max()) + 1
        self._total = self.by_road(weight)
        self.time = passes.years - (self.by_road(weight * passes.years) / self._total)[road]
        self._of_time = self.by_road(weight * self.time**2)
        with np.errstate(invalid="ignore"):
            self._with_ridge = self._of_time + ridge * (self._total / self.by_road(passes.count))
        self._level, self._slope = self._sums_of_roads(weight)
        self._to_level = _scaled(self._level, 1.0 / self._total)
        self._to_slope = _scaled(self._slope, self._shrunk(np.ones(self.roads)))
        information = self._squares(weight) - _product(self._level, self._to_level)
        self.group = _groups(information[:cars, :cars])
        information -= _product(self._slope, self._to_slope)
        self.inverse, self.is_timed = self._inverse(information)

    def by_road(self, values: Array) -> Array:
        """Sums of values (n,) by road."""
        return np.asarray(np.bincount(self.passes.road, values, self.roads), np.float64)

    def slopes(self, values: Array) -> Array:
        """The growth of each road that values (n,) show, drawn to zero."""
        return self._shrunk(self.by_road(self.weight * self.time * values))

    def off_levels(self, values: Array) -> Array:
        """Values (n,) without each road's level."""
        return values - (self.by_road(self.weight * values) / self._total)[self.passes.road]

    def off_roads(self, values: Array) -> Array:
        """Values (n,) without each road's level and growth."""
        return self.off_levels(values) - self.slopes(values)[self.passes.road] * self.time

    def effects(self, values: Array) -> Array:
        """The cars and the common growth (c + 1,) that values (n,) show."""
        rest = self.weight * self.off_roads(values)
        return np.asarray(self.inverse @ np.append(np.bincount(self.car, rest, self.cars), self.time @ rest))

    def of_effects(self, effects: Array) -> Array:
        """What cars and the common growth (c + 1,) make of each pass (n,)."""
        return np.asarray(effects[self.car] + effects[-1] * self.time)

    def covariance(self, of_pass: float, of_session: float, of_growth: float) -> Array:
        """Of the effects (c + 1, c + 1), where passes have a variance of their own, sessions one that their passes
        share, and roads one of their growth [1/years2]."""
        kept = np.asarray(1.0 - self._shrunk(self._of_time))
        middle = (of_pass * self._from_passes() + of_session * self._from_sessions()
                  + of_growth * _product(self._slope, _scaled(self._slope, kept**2)))
        return np.asarray(self.inverse @ middle @ self.inverse)

    def _shrunk(self, values: Array) -> Array:
        """Values (r,) over the information on each road's growth; zero where times do not differ."""
        return np.divide(values, self._with_ridge, out=np.zeros(self.roads), where=self._with_ridge > 0)

    def _inverse(self, information: Array) -> tuple[Array, bool]:
        """Of the information, on effects whose mean over each group of cars is zero; and whether growth is known."""
        one = self.group[:, None] == self.group[None, :]
        size = one.sum(axis=1)
        scale = max(float(information[:-1, :-1].trace()) / self.cars, 1e-12)
        regular = information.copy()
        regular[:-1, :-1] += scale * one
        gauge = np.zeros(regular.shape)
        gauge[:-1, :-1] = one / (scale * size[:, None] * size[None, :])
        cars = np.linalg.inv(regular[:-1, :-1])
        remaining = regular[-1, -1] - regular[-1, :-1] @ cars @ regular[:-1, -1]
        is_timed = bool(remaining > _LEAST_INFORMATION * self.weight.sum())
        if is_timed:
            return np.linalg.inv(regular) - gauge, True
        out = -gauge
        out[:-1, :-1] += cars
        return out, False

    def _squares(self, weight: Array) -> Array:
        """X' diag(weight) X."""
        with_time = np.bincount(self.car, weight * self.time, self.cars)
        out = np.diag(np.append(np.bincount(self.car, weight, self.cars), weight @ self.time**2))
        out[-1, :-1] = out[:-1, -1] = with_time
        return np.asarray(out, np.float64)

    def _sums_of_roads(self, weight: Array) -> tuple[Any, Any]:
        """R' diag(weight) X, of levels and of growths, each (r, c + 1) and sparse."""
        timed = weight * self.time
        level, slope = (_sparse(self.passes.road, self.car, one, self.by_road(one * self.time), self.roads, self.cars)
                        for one in (weight, timed))
        return level, slope

    def _from_passes(self) -> Array:
        """U' diag(1 / count) U."""
        weight = self.weight**2 / self.passes.count
        level, slope = self._sums_of_roads(weight)
        total, timed, square = (self.by_road(weight * self.time**power) for power in (0, 1, 2))
        level_rest = level - _scaled(self._to_level, total) - _scaled(self._to_slope, timed)
        slope_rest = slope - _scaled(self._to_level, timed) - _scaled(self._to_slope, square)
        return (self._squares(weight) - _product(level, self._to_level) - _product(slope, self._to_slope)
                - _product(self._to_level, level_rest) - _product(self._to_slope, slope_rest))

    def _from_sessions(self) -> Array:
        """U'ZZ'U, Z the columns of the sessions."""
        from scipy.sparse import csr_matrix

        passes, sessions = self.passes, len(self.passes.car_of_session)
        own = np.bincount(passes.session, self.weight, sessions)
        timed = np.bincount(passes.session, self.weight * self.time, sessions)
        chosen = np.arange(0, sessions, -(-sessions // _MOST_SESSIONS))
        shape = (sessions, self.roads)
        level, slope = (csr_matrix((one, (passes.session, passes.road)), shape=shape)[chosen]
                        for one in (self.weight, self.weight * self.time))
        to_level, to_slope = (one.toarray() if _is_dense(one) else one for one in (self._to_level, self._to_slope))
        out, of_chosen = np.zeros((self.cars + 1, self.cars + 1)), np.zeros(self.cars + 1)
        for start in range(0, len(chosen), _BLOCK):
            block = slice(start, start + _BLOCK)
            some, car = chosen[block], passes.car_of_session[chosen[block]]
            sums = level[block] @ to_level + slope[block] @ to_slope
            sums = -np.asarray(sums if isinstance(sums, np.ndarray) else sums.todense())
            sums[np.arange(len(some)), car] += own[some]
            sums[:, -1] += timed[some]
            out += sums.T @ sums
            of_chosen[:-1] += np.bincount(car, own[some] ** 2, self.cars)
        of_all = np.append(np.bincount(passes.car_of_session, own**2, self.cars), 0.0)
        return (out - np.diag(of_chosen)) * (sessions / len(chosen)) + np.diag(of_all)


def _sparse(road: Codes, car: Codes, values: Array, last: Array, roads: int, cars: int) -> Any:
    """Sums by road and car, and a last column."""
    from scipy.sparse import csr_matrix

    rows, columns = np.append(road, np.arange(roads)), np.append(car, np.full(roads, cars))
    return csr_matrix((np.append(values, last), (rows, columns)), shape=(roads, cars + 1))


def _scaled(matrix: Any, factor: Array) -> Any:
    """Rows times factors."""
    out = matrix.copy()
    out.data *= np.repeat(factor, np.diff(matrix.indptr))
    return out


def _is_dense(matrix: Any) -> bool:
    return bool(matrix.nnz >= _DENSE * matrix.shape[0] * matrix.shape[1])


def _product(one: Any, other: Any) -> Array:
    """one' other, both sparse and (r, c + 1)."""
    if not _is_dense(one):
        return np.asarray((one.T @ other).todense())
    out = np.zeros((one.shape[1], other.shape[1]))
    for start in range(0, one.shape[0], _BLOCK):
        out += one[start : start + _BLOCK].toarray().T @ other[start : start + _BLOCK].toarray()
    return out


def _groups(information: Array) -> Codes:
    """Cars that share roads, the largest group first."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(csr_matrix(information < 0), directed=False)
    rank = np.empty(count, dtype=np.intp)
    rank[np.argsort(-np.bincount(label), kind="stable")] = np.arange(count)
    return np.asarray(rank[label], dtype=np.intp)
