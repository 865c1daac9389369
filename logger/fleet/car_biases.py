"""Which car reads how much too high, from the roads that cars share.

A pass of car j over road i at time t reads IRI m_i g_j exp(growth t) (1 + e): errors of an IRI go with it. With a
logarithmic link and a variance that goes with the square of the mean this is a generalised linear model of the gamma
family (P. McCullagh and J. A. Nelder, Generalized Linear Models, 1989, chapter 8). Its estimating equations are
linear in the readings, so means over passes are all it needs, and noise does not bias them, as it does means of
logarithms. Its information matrix does not change from step to step: Fisher scoring solves with one matrix, from
which the roads, a diagonal block, are eliminated. What is left has as many rows as there are cars.

The mean of all cars' ln g is zero: what all cars share cannot be distinguished from the roads. Cars that share no road
with others, directly or through others, make groups of their own, each with its own zero; a car alone has no bias that
could be known. Growth is one rate for all roads: without it a car of the second year would be charged with a year's
decay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.intp]

_STEPS = 50
_CLOSE = 1e-9
_LEAST_INFORMATION = 1e-6
"""Of the variance of times that cars and roads leave, per pass [years2]: a third of a day squared."""


@dataclass(frozen=True, eq=False)
class CarBiases:
    """Gains of cars (j,).

    gain             what a car reads of a road, over what the mean car of its group reads; 1 where not known
    log_std          standard error of its logarithm; where the gain is not known, the spread of the other cars' gains
    group            cars that can be compared share a number; the largest group is 0
    known            the gain follows from roads shared with other cars
    growth_per_year  of the mean road's IRI, as a fraction; NaN: the passes do not show it
    pass_std         relative standard deviation of a pass; NaN: no road has two passes of different cars
    """

    gain: Array
    log_std: Array
    group: Codes
    known: npt.NDArray[np.bool_]
    growth_per_year: float
    pass_std: float


def car_biases(road: Codes, car: Codes, cars: int, passes: Array, iri: Array, years: Array,
               growth_of: Array | None = None) -> CarBiases:
    """The biases of so many cars from sums (n,) by road and car.

    road, car    codes from 0, each pair once
    passes       their number
    iri, years   sums of their IRI [m/km] and of their times [years]
    growth_of    each road's own, by its code, as a fraction a year; None: one for all, to be estimated
    """
    from scipy.sparse import coo_matrix

    roads = int(road.max()) + 1
    mean, time = iri / passes, years / passes
    counts = coo_matrix((passes, (road, car)), shape=(roads, cars)).tocsr()
    by_road, by_car = np.bincount(road, passes, roads), np.bincount(car, passes, cars)
    shared = counts.multiply(1.0 / by_road[:, None]).tocsr()
    information = np.diag(by_car) - np.asarray((counts.T @ shared).todense())
    group = _groups(information)
    own_time = np.bincount(road, passes * time, roads) / by_road
    centred = time - own_time[road]
    with_time = np.bincount(car, passes * centred, cars)
    of_time = float((passes * centred**2).sum())
    gauge = _gauge(group)
    inverse = np.linalg.inv(information + gauge) - _gauge_inverse(group)
    left = of_time - float(with_time @ inverse @ with_time)
    is_timed = growth_of is None and left > _LEAST_INFORMATION * passes.sum()
    own = 1.0 if growth_of is None else 1.0 + growth_of[road] * centred

    log_gain, growth = np.zeros(cars), 0.0
    level = np.zeros(roads)
    residual = np.zeros(len(mean))
    for _ in range(_STEPS):
        expected = np.exp(log_gain[car] + growth * centred) * own
        level = np.bincount(road, passes * mean / expected, roads) / by_road
        residual = mean / (level[road] * expected) - 1.0
        of_cars = np.bincount(car, passes * residual, cars)
        step = 0.0
        if is_timed:
            step = (float((passes * centred * residual).sum()) - float(with_time @ inverse @ of_cars)) / left
        change = inverse @ (of_cars - with_time * step)
        log_gain += change
        growth += step
        if max(np.abs(change).max(), abs(step)) < _CLOSE:
            break
    size = np.bincount(group)[group]
    known = size > 1
    freedom = len(mean) - roads - int(known.sum()) + len(np.unique(group[known])) - is_timed
    variance = float((passes * residual**2).sum()) / freedom if freedom > 0 else np.nan
    spread = inverse if not is_timed else inverse + np.outer(inverse @ with_time, inverse @ with_time) / left
    log_std = np.sqrt(np.maximum(np.diag(spread), 0.0) * variance)
    between = float(np.std(log_gain[known], ddof=1)) if known.sum() > 1 else 0.0
    return CarBiases(np.where(known, np.exp(log_gain), 1.0), np.where(known, log_std, between), group, known,
                     growth if is_timed else np.nan, float(np.sqrt(variance)))


def shared_by_session(car: Codes, passes: Array, residual: Array, square: Array) -> float:
    """Variance of what all passes of a session share: temperature, load and tires of that day. By analysis of
    variance of a random effect (S. R. Searle, G. Casella, C. E. McCulloch, Variance Components, 1992, section 3.6),
    from sums of relative residuals of each session (n,) of a car; 0 where nothing shows it."""
    sessions, cars, total = len(car), len(np.unique(car)), passes.sum()
    if sessions <= cars or total <= sessions:
        return 0.0
    within = (square - residual**2 / passes).sum() / (total - sessions)
    of_car = np.bincount(car, passes)
    mean = np.bincount(car, residual) / np.maximum(of_car, 1.0)
    between = (passes * (residual / passes - mean[car]) ** 2).sum() / (sessions - cars)
    size = (total - (np.bincount(car, passes**2) / np.maximum(of_car, 1.0)).sum()) / (sessions - cars)
    return float(max(between - within, 0.0) / size)


def with_sessions(biases: CarBiases, car: Codes, passes: Array, variance: float) -> CarBiases:
    """Biases whose errors hold what passes of a session share, by the design effect 1 + (k - 1) rho of clusters of size
    k (L. Kish, Survey Sampling, 1965, section 5.4). ``car``, ``passes``: of each session (n,)."""
    if not biases.pass_std > 0:
        return biases
    cars, rho = len(biases.gain), min(variance / biases.pass_std**2, 1.0)
    size = np.bincount(car, passes**2, cars) / np.maximum(np.bincount(car, passes, cars), 1.0)
    effect = np.where(biases.known, 1.0 + np.maximum(size - 1.0, 0.0) * rho, 1.0)
    return replace(biases, log_std=biases.log_std * np.sqrt(effect))


def _groups(information: Array) -> Codes:
    """Cars that share roads, the largest group first."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(csr_matrix(information < 0), directed=False)
    rank = np.empty(count, dtype=np.intp)
    rank[np.argsort(-np.bincount(label), kind="stable")] = np.arange(count)
    return np.asarray(rank[label], dtype=np.intp)


def _gauge(group: Codes) -> Array:
    """What makes the information of a group regular: that the mean of its logarithms is zero."""
    return (group[:, None] == group[None, :]).astype(np.float64)


def _gauge_inverse(group: Codes) -> Array:
    size = np.bincount(group)[group].astype(np.float64)
    return _gauge(group) / (size[:, None] * size[None, :])
