"""Which car reads how much too high, from the roads that cars share.

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

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.fleet.road_elimination import Codes, Elimination, RoadPasses

Array = npt.NDArray[np.float64]

_STEPS = 50
_CLOSE = 1e-9
_LEAST_GROWN = 0.1
"""Of its level: where a road's growth is drawn too far, it stays above zero."""
_ROUNDS = 2
"""Of weights and variances; a third changes no error by 1 % (measured at 10^6 rows)."""
_PROBED = 500_000
"""Random signs for a trace: a few of a large data set, many of a small one, so that its error stays below 1 %."""
_LEAST_FREEDOM = 1e-6
LEAST_REPEATS = 6
"""Of which a standard deviation is known within a factor of two, up or down, with 90 % certainty: the square root of 6
over the 5 % quantile of chi-square with 6 degrees of freedom is 1.92; with 5 degrees it would be 2.09."""


@dataclass(frozen=True, eq=False)
class CarBiases:
    """Gains of cars (j,).

    gain             what a car reads of a road, over what the mean car of its group reads; 1 where not known
    log_std          standard error of its logarithm; where the gain is not known, the spread of the other cars' gains
    group            cars that can be compared share a number; the largest group is 0
    known            the gain follows from roads shared with other cars
    growth_per_year  of the mean road's IRI, as a fraction; NaN: the passes do not show it
    growth_std       of roads' own growth about that, as a fraction a year
    pass_std         relative standard deviation of a pass; NaN: too few drives repeat a road
    session_std      of it, what all passes of a session share; NaN likewise
    repeats          drives over roads that the same car has driven before, as far as they show how drives scatter
    needed           so many of them; one of those that are there goes into the growth, where they lie apart in time
    """

    gain: Array
    log_std: Array
    group: Codes
    known: npt.NDArray[np.bool_]
    growth_per_year: float
    growth_std: float
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
    variances = Variances(0.0, 0.0, 0.0)
    design = Elimination(passes, cars, variances.weights(passes), variances.ridge)
    repeats, needed = _repeats(passes, cars), LEAST_REPEATS + design.is_timed
    if repeats < needed:
        return CarBiases(np.ones(cars), np.zeros(cars), design.group, np.zeros(cars, dtype=np.bool_), np.nan, np.nan,
                         np.nan, np.nan, repeats, needed)
    for _ in range(_ROUNDS):
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
                     float(effects[-1]) if design.is_timed else np.nan, float(np.sqrt(variances.of_growth)),
                     float(np.sqrt(variances.of_pass + variances.of_session)), float(np.sqrt(variances.of_session)),
                     repeats, needed)


def _repeats(passes: RoadPasses, cars: int) -> int:
    """By how much sessions and roads have more degrees of freedom than cars and roads: the rank of their columns is
    their number less that of the parts that hang together."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    roads = int(passes.road.max()) + 1

    def rank(of: Codes, count: int) -> int:
        size = roads + count
        edges = csr_matrix((np.ones(len(of)), (passes.road, roads + of)), shape=(size, size))
        return size - int(connected_components(edges, directed=False)[0])

    return rank(passes.session, len(passes.car_of_session)) - rank(passes.car, cars)


def _fitted(design: Elimination) -> tuple[Array, Array]:
    """The effects (c + 1,), and what they and the roads' levels leave of each pass (n,), relative."""
    road, iri, weight = design.passes.road, design.passes.iri, design.weight
    total = design.by_road(weight)
    effects, growth = np.zeros(design.cars + 1), np.zeros(design.roads)
    residual = np.zeros(len(iri))
    for _ in range(_STEPS):
        grown = 1.0 + (effects[-1] + growth[road]) * design.time
        expected = np.exp(effects[design.car]) * np.maximum(grown, _LEAST_GROWN)
        level = design.by_road(weight * iri / expected) / total
        residual = iri / (level[road] * expected) - 1.0 + growth[road] * design.time
        working = residual + design.of_effects(effects)
        found = design.effects(working)
        change = float(np.abs(found - effects).max())
        effects = found
        growth = design.slopes(working - design.of_effects(effects))
        if change < _CLOSE:
            break
    return effects, residual


def _variances(design: Elimination, residual: Array) -> Variances:
    """The three variances whose expected quadratic forms are those of the residuals; none is below zero."""
    from scipy.optimize import nnls

    passes = design.passes
    sessions = len(passes.car_of_session)
    random = np.random.default_rng(1)
    probes = int(np.clip(_PROBED // len(passes.count), 4, 100))

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
    shown = np.diag(forms) > _LEAST_FREEDOM * whole
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
