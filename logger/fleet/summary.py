"""The figures of a dataset (roads, sections, cells or routes, and the cars that measured them) as relational
expressions, written once in Ibis for any engine it knows; and mean and change of each road, with their errors.

Three groupings. ``passes_by_car``: of each piece of road and car the number of passes and the sums of their IRI and
time. ``passes_by_session``: means by session, of a part of the roads, from which the biases of cars follow.
``roads``: the sums of each piece of road over all cars, each car's readings divided by its gain. What follows from the
sums is arithmetic over as many rows as there are pieces of road.

Few passes show little of their own scatter. Their variance is drawn towards that of all roads by as much as the roads'
variances agree (G. K. Smyth, Linear models and empirical Bayes methods, 2004, sections 3 and 6.2: a scaled inverse
chi-square prior whose two numbers follow from mean and variance of the logarithms). Changes are significant where the
share of false ones among them stays below a limit (Y. Benjamini and Y. Hochberg, 1995).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Bools, Indices, Whole
from logger.bounds import FALSE_SHARE
from logger.fleet.car_biases import CarBiases, RoadPasses, car_biases
from logger.fleet.dataset import Engine
from logger.fleet.road_map import ON_MAP, SEGMENT_M, RoadPieces, block_of, cell_keys, section_of
from logger.roads.repeated_drives import false_discovery, two_sided
from logger.roads.sections import FAIR_TO_IN_PER_MI
from logger.units import DAY_US, INCH_PER_MILE_M_PER_KM, MILE_M

if TYPE_CHECKING:
    import ibis.expr.types as ir


YEAR_US = 365.25 * DAY_US  # A Julian year


def passes_by_car(rows: ir.Table, since_us: int | None, until_us: int | None, zero_us: int) -> ir.Table:
    """Sums of passes by road and car, of a time [us since 1970, half-open]; years count from ``zero_us``."""
    passes = _passes(rows, since_us, until_us)
    passes = passes.mutate(
        years=(passes.utc_us - zero_us).cast("float64") / YEAR_US, iri=passes.pass_iri_m_per_km,
        heading_rad=passes.heading_deg.cast("float64").radians(), square=passes.pass_a_w_mps2 * passes.pass_a_w_mps2)
    return passes.group_by(["road", "car"]).aggregate(
        passes=passes.count(), windows=passes.pass_windows.sum(),
        years=passes.years.sum(), years_square=(passes.years * passes.years).sum(),
        iri=passes.iri.sum(), iri_years=(passes.iri * passes.years).sum(), iri_square=(passes.iri * passes.iri).sum(),
        felt=passes.square.count(), a_w_square=passes.square.sum(), speed=passes.speed_mps.cast("float64").sum(),
        lat=passes.lat_deg.sum(), lon=passes.lon_deg.sum(), north=passes.heading_rad.cos().sum(),
        east=passes.heading_rad.sin().sum(), last_us=passes.utc_us.max())


def _passes(rows: ir.Table, since_us: int | None, until_us: int | None) -> ir.Table:
    # Errors go with the IRI: one that is not above zero is none.
    passes = rows.filter(rows.pass_iri_m_per_km > 0)
    if since_us is not None:
        passes = passes.filter(passes.utc_us >= since_us)
    return passes if until_us is None else passes.filter(passes.utc_us < until_us)


def passes_by_session(rows: ir.Table, since_us: int | None, until_us: int | None, zero_us: int, one_in: int
                      ) -> ir.Table:
    """Means over passes by road, car and session, of one road in so many: by the remainder of the key, first by a
    prime, as the last bits of a key are a direction."""
    prime = 1_000_003
    passes = _passes(rows, since_us, until_us)
    if one_in > 1:
        passes = passes.filter((passes.road % prime) % one_in == 0)
    passes = passes.mutate(years=(passes.utc_us - zero_us).cast("float64") / YEAR_US)
    return passes.group_by(["road", "car", "session"]).aggregate(
        passes=passes.count(), iri=passes.pass_iri_m_per_km.mean(), years=passes.years.mean())


def roads(by_car: ir.Table, gains: ir.Table) -> ir.Table:
    """Sums by road over all cars; ``gains`` has each car's gain and the variance of its logarithm."""
    joined = by_car.join(gains, "car")
    passes = joined.passes.cast("float64")

    def total(column: Any) -> Any:
        return column.sum()

    plain = ("years", "years_square", "felt", "a_w_square", "speed", "lat", "lon", "north", "east", "windows")
    return joined.group_by("road").aggregate(
        passes=total(joined.passes), cars=joined.car.count(), last_us=joined.last_us.max(),
        iri=total(joined.iri / joined.gain), iri_years=total(joined.iri_years / joined.gain),
        iri_square=total(joined.iri_square / (joined.gain * joined.gain)),
        bias_square=total(passes * passes * joined.log_variance), **{name: total(joined[name]) for name in plain})


def history(rows: ir.Table, gains: ir.Table, since_us: int | None, until_us: int | None) -> ir.Table:
    """Passes by road and quarter of a year: number, mean IRI with the cars' gains taken out."""
    passes = _passes(rows, since_us, until_us).join(gains, "car")
    passes = passes.mutate(quarter=(passes.utc_us.cast("float64") / (YEAR_US / 4)).floor().cast("int64"))
    return passes.group_by(["road", "quarter"]).aggregate(
        passes=passes.count(), iri=(passes.pass_iri_m_per_km / passes.gain).sum())



@dataclass(frozen=True, eq=False)
class Sums:
    """Of the passes over each of n roads: number; sums of times [years], IRI [m/km] and products; and what the cars'
    gains add to the variance of the sum, over the square of the IRI."""

    passes: Array
    years: Array
    years_square: Array
    iri: Array
    iri_years: Array
    iri_square: Array
    bias_square: Array


@dataclass(frozen=True, eq=False)
class RoadFigures:
    """Of n roads; NaN: not known.

    iri_m_per_km, iri_std_m_per_km            mean of the passes, and its standard error with that of the cars' biases
    trend_m_per_km_per_year, trend_std_...    change, from three passes on
    p_value                                   of no change, two-sided
    """

    iri_m_per_km: Array
    iri_std_m_per_km: Array
    trend_m_per_km_per_year: Array
    trend_std_m_per_km_per_year: Array
    p_value: Array


def road_figures(sums: Sums, pass_std: float) -> RoadFigures:
    """Figures of n roads. ``pass_std``: relative standard deviation of a pass, for where no road shows it; NaN: drives
    are too few to show how far they scatter, so no error and no change is known."""
    from scipy.stats import t

    count = sums.passes
    mean = sums.iri / count
    if not np.isfinite(pass_std):
        return RoadFigures(mean, *(np.full(len(mean), np.nan) for _ in range(4)))
    spread_years = np.maximum(sums.years_square - sums.years**2 / count, 0.0)
    product = sums.iri_years - sums.iri * sums.years / count
    has_trend = (count >= 3) & (spread_years > 1e-9 * count)
    trend = np.divide(product, spread_years, out=np.zeros(len(mean)), where=has_trend)
    rest = np.maximum(sums.iri_square - sums.iri**2 / count - trend * product, 0.0)
    freedom = count - 1 - has_trend
    variance = np.divide(rest, freedom * mean**2, out=np.zeros(len(mean)), where=freedom > 0)
    prior_freedom, prior = _prior(variance, freedom, pass_std**2)
    if np.isinf(prior_freedom):
        moderated = np.full(len(mean), prior)
    else:
        moderated = (prior_freedom * prior + freedom * variance) / (prior_freedom + freedom)
    iri_std = mean * np.sqrt(moderated / count + sums.bias_square / count**2)
    trend_std = np.sqrt(np.divide(moderated * mean**2, spread_years, out=np.full(len(mean), np.nan), where=has_trend))
    trend = np.where(has_trend, trend, np.nan)
    p_value = 2.0 * t.sf(np.abs(trend) / trend_std, np.minimum(prior_freedom + freedom, 1e9))
    return RoadFigures(mean, iri_std, trend, trend_std, p_value)


def significant(p_value: Array, false_share: float) -> Bools:
    """Which of n tests are significant, with a share of false ones among them of at most so much; NaN is none."""
    known = np.isfinite(p_value)
    out = np.zeros(len(p_value), dtype=np.bool_)
    out[known] = false_discovery(p_value[known]) <= false_share
    return out


def _prior(variance: Array, freedom: Array, otherwise: float) -> tuple[float, float]:
    """Degrees of freedom and value of the prior variance (Smyth 2004, section 6.2)."""
    from scipy.special import digamma, polygamma

    known = (freedom > 0) & (variance > 0)
    if known.sum() < 3:
        return np.inf, otherwise
    half = freedom[known] / 2
    level = np.log(variance[known]) - digamma(half) + np.log(half)
    excess = level.var(ddof=1) - float(polygamma(1, half).mean())
    if excess <= 0:
        return np.inf, float(np.exp(level.mean()))
    prior_half = _inverse_trigamma(excess)
    return 2 * prior_half, float(np.exp(level.mean() + digamma(prior_half) - np.log(prior_half)))


def _inverse_trigamma(value: float) -> float:
    """Where trigamma has a value above 0, by Newton's method for 1 / trigamma, which is convex (Smyth 2004,
    appendix)."""
    from scipy.special import polygamma

    if value > 1e7:
        return float(value**-0.5)
    if value < 1e-6:
        return 1.0 / value
    at = 0.5 + 1.0 / value
    for _ in range(50):
        trigamma = float(polygamma(1, at))
        step = trigamma * (1.0 - trigamma / value) / float(polygamma(2, at))
        at += step
        if -step / at < 1e-8:
            break
    return at


Keys = Whole

POOR_M_PER_KM = FAIR_TO_IN_PER_MI * INCH_PER_MILE_M_PER_KM
SECTION_M = MILE_M / 10
MOST_PASSES = 1_000_000
"""From which biases are estimated, some 300 MB; of more those of a part of the roads are taken. What the passes of a
session share then limits a bias, not the number of roads."""
_ZERO_US = 1_577_836_800_000_000  # 2020-01-01: years count from here, so that their squares keep their digits


@dataclass(frozen=True, eq=False)
class RoadTable(RoadFigures):
    """Figures of n segments, sections, cells or routes; NaN: not known.

    key                       of a segment or a section; for others the number of the cell or route
    lat_deg, lon_deg          mean place of the passes; ``heading_deg`` their mean direction, NaN where there are many
    length_m                  of road with figures
    cars, passes              of a group of segments the least and the mean number on its segments
    mean_years                mean time of the passes, from 2020-01-01 on
    a_w_mps2, speed_mps       r.m.s. over the passes, and mean
    last_us                   of the last pass [us since 1970]
    worse                     the change is significant and upwards
    visit                     words that say why to go there; empty: no reason
    """

    by: str
    key: Keys
    lat_deg: Array
    lon_deg: Array
    heading_deg: Array
    length_m: Array
    cars: Keys
    passes: Array
    mean_years: Array
    a_w_mps2: Array
    speed_mps: Array
    last_us: Keys
    worse: Bools
    visit: npt.NDArray[np.str_]

    @property
    def changes_known(self) -> bool:
        """Whether the passes show a change, or that there is none, anywhere."""
        return bool(np.isfinite(self.trend_std_m_per_km_per_year).any())


@dataclass(frozen=True, eq=False)
class FleetFigures:
    """What a summary holds.

    roads         figures by what was asked for
    cars          numbers (j,), in order, and ``names``; ``car_passes`` their passes; ``biases`` in the same order
    shared        by all passes of a session: the share of a pass's variance
    windows       in all passes
    withheld      segments that fewer cars have driven than may be published
    """

    roads: RoadTable
    cars: Keys
    names: tuple[str, ...]
    car_passes: Array
    biases: CarBiases
    shared: float
    windows: int
    withheld: int


def summarise(engine: Engine, by: str, since_us: int | None, until_us: int | None, least_cars: int,
              pieces: RoadPieces | None, name_of: Callable[[int], str]) -> FleetFigures | None:
    """Figures of a time [us since 1970, half-open]; None where no pass lies in it.

    by        segment, section, cell or route
    pieces    of the map that keys were made with, if one was
    name_of   a car, by its number
    """
    by_car = passes_by_car(engine.rows, since_us, until_us, _ZERO_US)
    with engine.kept(by_car) as kept:
        of_cars = engine.arrays(kept.group_by("car").aggregate(passes=kept.passes.sum(), roads=kept.count()))
        order = np.argsort(of_cars["car"])
        cars, car_passes = of_cars["car"][order], of_cars["passes"][order].astype(np.float64)
        if not len(cars):
            return None
        sample = _sample(engine, since_us, until_us, int(of_cars["passes"].sum()))
        biases = car_biases(as_passes(sample, cars), len(cars))
        of_roads = engine.arrays(roads(kept, gains_table(cars, biases)))
    shared = biases.session_std**2 / biases.pass_std**2 if biases.pass_std > 0 else 0.0
    published = of_roads["cars"] >= least_cars
    windows = int(of_roads["windows"].sum())
    order = np.flatnonzero(published)[np.argsort(of_roads["road"][published])]
    segments = _segments({name: values[order] for name, values in of_roads.items()}, biases.pass_std, pieces)
    return FleetFigures(grouped(segments, by, pieces, shared), cars, tuple(map(name_of, cars.tolist())), car_passes,
                        biases, shared, windows, int((~published).sum()))


def _sample(engine: Engine, since_us: int | None, until_us: int | None, passes: int) -> Mapping[str, npt.NDArray[Any]]:
    """Passes by session of a part of the roads, at most some ``MOST_PASSES``.

    Of few roads the part by remainders may be far smaller than meant, or empty: then of twice as many roads. A few
    roads that hold most of the passes may so bring more than ``MOST_PASSES``."""
    one_in = -(-passes // MOST_PASSES)
    while True:
        sample = engine.arrays(passes_by_session(engine.rows, since_us, until_us, _ZERO_US, one_in))
        if one_in == 1 or 4 * int(sample["passes"].sum()) >= MOST_PASSES:
            return sample
        one_in = -(-one_in // 2)


def as_passes(sample: Mapping[str, npt.NDArray[Any]], cars: Keys) -> RoadPasses:
    """Passes by road, car and session; in a fixed order, so that sums do not depend on the engine."""
    order = np.lexsort((sample["road"], sample["session"], sample["car"]))
    road, car, session, count, iri, years = (sample[name][order] for name in (
        "road", "car", "session", "passes", "iri", "years"))
    new = np.append(True, (np.diff(car) != 0) | (np.diff(session) != 0))[: len(car)]
    return RoadPasses(np.unique(road, return_inverse=True)[1], np.cumsum(new) - 1, np.searchsorted(cars, car[new]),
                  count.astype(np.float64), iri, years)


def gains_table(cars: Keys, biases: CarBiases) -> Any:
    """Gains as a table for the expressions."""
    import ibis
    import pyarrow

    return ibis.memtable(pyarrow.table({"car": cars, "gain": biases.gain, "log_variance": biases.log_std**2}))


def _segments(sums: Mapping[str, npt.NDArray[Any]], pass_std: float, pieces: RoadPieces | None) -> RoadTable:
    passes = sums["passes"].astype(np.float64)
    figures = road_figures(Sums(passes, *(sums[name] for name in (
        "years", "years_square", "iri", "iri_years", "iri_square", "bias_square"))), pass_std)
    length_m = np.full(len(passes), SEGMENT_M)
    on_map = (sums["road"] & ON_MAP) != 0
    if pieces is not None:
        length_m[on_map] = pieces.length_m[piece_of(sums["road"][on_map])]
    a_w = np.sqrt(np.divide(sums["a_w_square"], sums["felt"], out=np.full(len(passes), np.nan),
                            where=sums["felt"] > 0).astype(np.float64))
    heading_deg = np.degrees(np.arctan2(sums["east"], sums["north"])) % 360.0
    return _table("segment", sums["road"], sums["lat"] / passes, sums["lon"] / passes, heading_deg, length_m,
                  sums["cars"], passes, sums["years"] / passes, figures, a_w, sums["speed"] / passes, sums["last_us"])


def change_found(roads: RoadTable) -> float:
    """The change a year [m/km] that half of the roads would show as significant with the usual power of 80 % (J. Cohen,
    Statistical Power Analysis, 1988, section 2.4); NaN: no road has a change."""
    from scipy.stats import norm

    known = np.isfinite(roads.trend_std_m_per_km_per_year) & (roads.trend_std_m_per_km_per_year > 0)
    if not known.any():
        return np.nan
    called = significant(roads.p_value, FALSE_SHARE)
    at_p = float(roads.p_value[called].max()) if called.any() else FALSE_SHARE / int(known.sum())
    power = 0.8
    needed = float(norm.isf(at_p / 2) + norm.ppf(power))
    return needed * float(np.median(roads.trend_std_m_per_km_per_year[known]))


def piece_of(key: Keys) -> Indices:
    """The pieces of a map that keys (n,) of it mean."""
    return ((key & ~ON_MAP) >> 1).astype(np.intp)


def group_keys(segments: RoadTable, by: str, pieces: RoadPieces | None) -> Keys:
    """The section, cell or route that each segment belongs to; -1: to no route."""
    key = segments.key
    on_map = (key & ON_MAP) != 0
    if by == "cell":
        return block_of(cell_keys(segments.lat_deg, segments.lon_deg, np.zeros(len(key))))
    out = np.where(on_map, -1, -1 if by == "route" else section_of(key))
    if pieces is not None:
        piece, forward = piece_of(key[on_map]), key[on_map] & 1
        route = 2 * pieces.road[piece].astype(np.int64) + forward
        along = np.floor(pieces.start_m[piece] / SECTION_M + 1e-9).astype(np.int64)
        out[on_map] = route if by == "route" else ON_MAP | (route << 24) | along
    return out


def grouped(segments: RoadTable, by: str, pieces: RoadPieces | None, shared: float) -> RoadTable:
    """Segments as they are, or put together: means by length. Of the variance of a segment's error so much is
    ``shared`` with the others, as if the same sessions had driven all of them; the rest is its own."""
    if by == "segment":
        return segments
    group = group_keys(segments, by, pieces)
    inside = group >= 0
    key, code = np.unique(group[inside], return_inverse=True)
    length_m = segments.length_m[inside]

    def total(values: Array, weight: Array = length_m) -> Array:
        return np.asarray(np.bincount(code, np.nan_to_num(values) * weight, len(key)))

    def mean(name: str, change: Callable[[Array], Array] = np.asarray) -> Array:
        values = change(getattr(segments, name)[inside])
        over = total(np.isfinite(values).astype(np.float64))
        return np.divide(total(values), over, out=np.full(len(key), np.nan), where=over > 0)

    def error_of_mean(name: str) -> Array:
        values = getattr(segments, name)[inside]
        over = total(np.isfinite(values).astype(np.float64))
        of_sum = np.sqrt((1.0 - shared) * total(values**2, length_m**2) + shared * total(values) ** 2)
        return np.divide(of_sum, over, out=np.full(len(key), np.nan), where=over > 0)

    def extreme(name: str, of: Any) -> Keys:
        out = np.full(len(key), segments.last_us.max() if of is np.minimum else 0, dtype=np.int64)
        of.at(out, code, getattr(segments, name)[inside])
        return out

    trend, trend_std = mean("trend_m_per_km_per_year"), error_of_mean("trend_std_m_per_km_per_year")
    figures = RoadFigures(mean("iri_m_per_km"), error_of_mean("iri_std_m_per_km"), trend, trend_std,
                          two_sided(trend / trend_std))
    north = mean("heading_deg", lambda one: np.cos(np.radians(one)))
    east = mean("heading_deg", lambda one: np.sin(np.radians(one)))
    heading_deg = np.where(np.hypot(north, east) > 0.5, np.degrees(np.arctan2(east, north)) % 360.0, np.nan)
    return _table(by, key, mean("lat_deg"), mean("lon_deg"), heading_deg, total(np.ones(len(code))),
                  extreme("cars", np.minimum), mean("passes"), mean("mean_years"), figures,
                  np.sqrt(mean("a_w_mps2", np.square)), mean("speed_mps"), extreme("last_us", np.maximum))


def _table(by: str, key: Keys, lat_deg: Array, lon_deg: Array, heading_deg: Array, length_m: Array, cars: Keys,
           passes: Array, mean_years: Array, figures: RoadFigures, a_w_mps2: Array, speed_mps: Array, last_us: Keys
           ) -> RoadTable:
    certain = 1.645  # Standard errors from a mean to where it lies with 95 % certainty on one side.
    uncomfortable_mps2 = 0.8  # ISO 2631-1, C.2.3.
    worse = significant(figures.p_value, FALSE_SHARE) & (figures.trend_m_per_km_per_year > 0)
    rough = figures.iri_m_per_km - certain * figures.iri_std_m_per_km > POOR_M_PER_KM
    hard = a_w_mps2 >= uncomfortable_mps2
    words = np.array(["|".join(word for word, holds in zip(("rough", "worse", "uncomfortable"), three, strict=True)
                               if holds) for three in zip(rough, worse, hard, strict=True)], dtype=np.str_)
    return RoadTable(**vars(figures), by=by, key=key, lat_deg=lat_deg, lon_deg=lon_deg, heading_deg=heading_deg,
                     length_m=length_m, cars=cars.astype(np.int64), passes=passes, mean_years=mean_years,
                     a_w_mps2=a_w_mps2, speed_mps=speed_mps, last_us=last_us.astype(np.int64), worse=worse, visit=words)
