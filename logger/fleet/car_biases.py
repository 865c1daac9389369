"""Which car reads how much too high, from the roads that cars share: their biases, and the least squares behind them.

Least squares with a level and a growth for each road and a bias for each car, the roads eliminated.

Roads are many, and a block each; cars are few. So what is solved has as many rows as there are cars, and one for the
growth that all roads share. A road's own growth beyond that is drawn towards zero by a ridge (a random effect: C. R.
Henderson, Best linear unbiased estimation and prediction, Biometrics 31, 1975).

With X the columns of the cars and of time, R those of the roads, W the weights and B = (R'WR + ridge)^-1 R'WX, the
cars follow from U'v, U = W (X - R B), and A = U'X. Whatever the covariance V of the passes, that of the cars is
A^-1 U'VU A^-1.

A pass of car j over road i at time t reads IRI m_i (1 + growth_i t) g_j (1 + e): errors of an IRI go with it. With a
logarithmic link and a variance that goes with the square of the mean this is a generalised linear model of the gamma
family (P. McCullagh and J. A. Nelder, Generalized Linear Models, 1989, chapter 8). Its estimating equations are
linear in the readings, so noise does not bias them, as it does means of logarithms. Fisher scoring solves with one
matrix, from which the roads are eliminated.

Two passes of one session are not two drives: they share load, tires and temperature. So e has a part of the session and
one of the pass, and roads grow at rates of their own. A pass weighs the less, the more passes its session has; the
variances of the three follow from as many quadratic forms of the residuals, whose expectations are taken with all that
was fitted in place (Henderson's moments: S. R. Searle, G. Casella, C. E. McCulloch, Variance Components, 1992, chapter
5), the traces by random signs (M. F. Hutchinson, Communications in Statistics 19, 1990). So no degree of freedom is
counted that the cars and roads have used up.

How far one drive is off another is shown by drives that repeat a road: as many as sessions differ by beyond what cars,
roads and the common growth take up. A car that has driven once has its bias and its drive's error in one number. With
fewer than ``LEAST_REPEATS`` the scatter of drives is not known, and so is no bias, no error of a mean and no change.

The mean of all cars' ln g is zero: what all cars share cannot be distinguished from the roads. Cars that share no
road with others, directly or through others, make groups of their own, each with its own zero; a car alone has no bias
that could be known. Without the growth a car of the second year would be charged with a year's decay.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from logger.arrays import AT_ONCE, Array, Bools, Indices

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

    road: Indices
    session: Indices
    car_of_session: Indices
    count: Array
    iri: Array
    years: Array

    @property
    def car(self) -> Indices:
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
        for start in range(0, len(chosen), AT_ONCE):
            block = slice(start, start + AT_ONCE)
            some, car = chosen[block], passes.car_of_session[chosen[block]]
            sums = level[block] @ to_level + slope[block] @ to_slope
            sums = -np.asarray(sums if isinstance(sums, np.ndarray) else sums.todense())
            sums[np.arange(len(some)), car] += own[some]
            sums[:, -1] += timed[some]
            out += sums.T @ sums
            of_chosen[:-1] += np.bincount(car, own[some] ** 2, self.cars)
        of_all = np.append(np.bincount(passes.car_of_session, own**2, self.cars), 0.0)
        return (out - np.diag(of_chosen)) * (sessions / len(chosen)) + np.diag(of_all)


def _sparse(road: Indices, car: Indices, values: Array, last: Array, roads: int, cars: int) -> Any:
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
    # Share of entries that are not zero beyond which products of dense blocks are quicker than sparse ones
    # (measured).
    dense = 0.03
    return bool(matrix.nnz >= dense * matrix.shape[0] * matrix.shape[1])


def _product(one: Any, other: Any) -> Array:
    """one' other, both sparse and (r, c + 1)."""
    if not _is_dense(one):
        return np.asarray((one.T @ other).todense())
    out = np.zeros((one.shape[1], other.shape[1]))
    for start in range(0, one.shape[0], AT_ONCE):
        out += one[start : start + AT_ONCE].toarray().T @ other[start : start + AT_ONCE].toarray()
    return out


def _groups(information: Array) -> Indices:
    """Cars that share roads, the largest group first."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(csr_matrix(information < 0), directed=False)
    rank = np.empty(count, dtype=np.intp)
    rank[np.argsort(-np.bincount(label), kind="stable")] = np.arange(count)
    return np.asarray(rank[label], dtype=np.intp)


@dataclass(frozen=True, eq=False)
class CarBiases:
    """Gains of cars (j,).

    gain             what a car reads of a road, over what the mean car of its group reads; 1 where not known
    log_std          standard error of its logarithm; where the gain is not known, the spread of the other cars' gains
    group            cars that can be compared share a number; the largest group is 0
    known            the gain follows from roads shared with other cars
    growth_per_year  of the mean road's IRI, as a fraction; NaN: the passes do not show it
    pass_std         relative standard deviation of a pass; NaN: too few drives repeat a road
    session_std      of it, what all passes of a session share; NaN likewise
    repeats          drives over roads that the same car has driven before, as far as they show how drives scatter
    needed           so many of them; one of those that are there goes into the growth, where they lie apart in time
    """

    gain: Array
    log_std: Array
    group: Indices
    known: Bools
    growth_per_year: float
    pass_std: float
    session_std: float
    repeats: int
    needed: int


@dataclass(frozen=True)
class Variances:
    """Relative variances: a pass's own, what the passes of a session share, and of roads' growth [1/years2]."""

    of_pass: float
    of_session: float
    of_growth: float

    @property
    def ridge(self) -> float:
        """What draws a road's own growth to zero, in passes times years squared."""
        return (self.of_pass + self.of_session) / self.of_growth if self.of_growth > 0 else np.inf

    def weights(self, passes: RoadPasses) -> Array:
        """Of passes (n,), over the inverse of a pass's own variance: a session of k passes weighs
        k / (1 + k of_session / of_pass)."""
        if not self.of_pass + self.of_session > 0:
            return passes.count
        share = self.of_session / (self.of_pass + self.of_session)
        return passes.count / (1.0 - share + share * passes.of_session)[passes.session]


def car_biases(passes: RoadPasses, cars: int) -> CarBiases:
    """The biases of so many cars."""
    rounds = 2  # Of weights and variances; a third changes no error by 1 % (measured at 10^6 rows).
    # Of which a standard deviation is known within a factor of two, up or down, with 90 % certainty: the square root
    # of 6 over the 5 % quantile of chi-square with 6 degrees of freedom is 1.92; with 5 degrees it would be 2.09.
    least_repeats = 6
    variances = Variances(0.0, 0.0, 0.0)
    design = Elimination(passes, cars, variances.weights(passes), variances.ridge)
    repeats, needed = _repeats(passes, cars), least_repeats + design.is_timed
    if repeats < needed:
        return CarBiases(np.ones(cars), np.zeros(cars), design.group, np.zeros(cars, dtype=np.bool_), np.nan, np.nan,
                         np.nan, repeats, needed)
    for _ in range(rounds):
        design = Elimination(passes, cars, variances.weights(passes), variances.ridge)
        _, residual = _fitted(design)
        variances = _variances(design, residual)
    design = Elimination(passes, cars, variances.weights(passes), variances.ridge)
    effects, _ = _fitted(design)
    spread = design.covariance(variances.of_pass, variances.of_session, variances.of_growth)
    log_std = np.sqrt(np.maximum(np.diag(spread)[:-1], 0.0))
    log_gain, group = effects[:-1], design.group
    known = np.bincount(group)[group] > 1
    between = float(np.std(log_gain[known], ddof=1)) if known.sum() > 1 else 0.0
    return CarBiases(np.where(known, np.exp(log_gain), 1.0), np.where(known, log_std, between), group, known,
                     float(effects[-1]) if design.is_timed else np.nan,
                     float(np.sqrt(variances.of_pass + variances.of_session)), float(np.sqrt(variances.of_session)),
                     repeats, needed)


def _repeats(passes: RoadPasses, cars: int) -> int:
    """By how much sessions and roads have more degrees of freedom than cars and roads: the rank of their columns is
    their number less that of the parts that hang together."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    roads = int(passes.road.max()) + 1

    def rank(of: Indices, count: int) -> int:
        size = roads + count
        edges = csr_matrix((np.ones(len(of)), (passes.road, roads + of)), shape=(size, size))
        return size - int(connected_components(edges, directed=False)[0])

    return rank(passes.session, len(passes.car_of_session)) - rank(passes.car, cars)


def _fitted(design: Elimination) -> tuple[Array, Array]:
    """The effects (c + 1,), and what they and the roads' levels leave of each pass (n,), relative."""
    least_grown = 0.1  # Of its level: where a road's growth is drawn too far, it stays above zero.
    road, iri, weight = design.passes.road, design.passes.iri, design.weight
    total = design.by_road(weight)
    effects, growth = np.zeros(design.cars + 1), np.zeros(design.roads)
    residual = np.zeros(len(iri))
    most_steps, close = 50, 1e-9
    for _ in range(most_steps):
        grown = 1.0 + (effects[-1] + growth[road]) * design.time
        expected = np.exp(effects[design.car]) * np.maximum(grown, least_grown)
        level = design.by_road(weight * iri / expected) / total
        residual = iri / (level[road] * expected) - 1.0 + growth[road] * design.time
        working = residual + design.of_effects(effects)
        found = design.effects(working)
        change = float(np.abs(found - effects).max())
        effects = found
        growth = design.slopes(working - design.of_effects(effects))
        if change < close:
            break
    return effects, residual


def _variances(design: Elimination, residual: Array) -> Variances:
    """The three variances whose expected quadratic forms are those of the residuals; none is below zero."""
    from scipy.optimize import nnls

    # Random signs for a trace: a few of a large data set, many of a small one, so that its error stays below 1 %.
    probed, least_freedom = 500_000, 1e-6
    passes = design.passes
    sessions = len(passes.car_of_session)
    random = np.random.default_rng(1)
    probes = int(np.clip(probed // len(passes.count), 4, 100))

    def expected(of: int) -> Array:
        def once() -> Array:
            sign = random.choice([-1.0, 1.0], size=(len(passes.count), sessions, design.roads)[of])
            drawn = (lambda: sign / np.sqrt(passes.count), lambda: sign[passes.session],
                     lambda: sign[passes.road] * design.time)[of]()
            return _quadratic(design, drawn - design.of_effects(design.effects(drawn)))
        return np.mean([once() for _ in range(probes)], axis=0)

    found, forms = _quadratic(design, residual), np.stack([expected(of) for of in range(3)], axis=1)
    # What is left of a form after cars and roads: nothing where, say, no road has been driven at three times.
    whole = np.array([len(passes.count), sessions, float(passes.count @ design.time**2)])
    shown = np.diag(forms) > least_freedom * whole
    scale = 1.0 / np.where(shown, forms.max(axis=1), 1.0)
    solved = np.zeros(3)
    solved[shown] = nnls((forms * scale[:, None])[np.ix_(shown, shown)], (found * scale)[shown])[0]
    return Variances(*(float(one) for one in solved))


def _quadratic(design: Elimination, values: Array) -> Array:
    """Quadratic forms of what cars leave (n,): of passes, of sums by session, and of roads' growth."""
    passes = design.passes
    rest = design.off_roads(values)
    of_session = np.bincount(passes.session, passes.count * rest, len(passes.car_of_session))
    of_time = design.by_road(passes.count * design.time**2)
    slope = design.by_road(passes.count * design.time * design.off_levels(values))
    return np.array([passes.count @ rest**2, (of_session**2 / passes.of_session).sum(),
                     np.divide(slope**2, of_time, out=np.zeros(design.roads), where=of_time > 0).sum()])
