"""The figures of a dataset: roads, sections, cells or routes, and the cars that measured them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.fleet.car_biases import CarBiases, car_biases
from logger.fleet.engine import Engine
from logger.fleet.expressions import cars as car_sums
from logger.fleet.expressions import passes_by_car, passes_by_session, roads
from logger.fleet.road_cells import ON_MAP, SEGMENT_M, block_of, cell_keys, section_of
from logger.fleet.road_elimination import RoadPasses
from logger.fleet.road_figures import RoadFigures, Sums, road_figures, significant
from logger.fleet.road_map import RoadPieces
from logger.roads.sections import FAIR_TO_IN_PER_MI
from logger.units import INCH_PER_MILE_M_PER_KM, MILE_M

Array = npt.NDArray[np.float64]
Keys = npt.NDArray[np.int64]

FALSE_SHARE = 0.05
"""Of false ones among the changes that are called significant."""
_POWER = 0.8
_CERTAIN = 1.645
"""Standard errors from a mean to where it lies with 95 % certainty on one side."""
POOR_M_PER_KM = FAIR_TO_IN_PER_MI * INCH_PER_MILE_M_PER_KM
UNCOMFORTABLE_MPS2 = 0.8
"""ISO 2631-1, C.2.3."""
SECTION_M = MILE_M / 10
MOST_PASSES = 1_000_000
"""From which biases are estimated, some 300 MB; of more those of a part of the roads are taken. What the passes of a
session share then limits a bias, not the number of roads."""
_ZERO_US = 1_577_836_800_000_000
"""2020-01-01: years count from here, so that their squares keep their digits."""


@dataclass(frozen=True, eq=False)
class RoadTable:
    """Figures of n segments, sections, cells or routes; NaN: not known.

    key                       of a segment or a section; for others the number of the cell or route
    lat_deg, lon_deg          mean place of the passes; ``heading_deg`` their mean direction, NaN where there are many
    length_m                  of road with figures
    cars, passes              of a group of segments the least and the mean number on its segments
    mean_years                mean time of the passes, from 2020-01-01 on
    iri_m_per_km, ...         as in ``road_figures``
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
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    trend_m_per_km_per_year: Array
    trend_std_m_per_km_per_year: Array
    p_value: Array
    a_w_mps2: Array
    speed_mps: Array
    last_us: Keys
    worse: npt.NDArray[np.bool_]
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
        of_cars = engine.arrays(car_sums(kept))
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
                        biases, shared, windows,
                        int((~published).sum()))


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
    needed = float(norm.isf(at_p / 2) + norm.ppf(_POWER))
    return needed * float(np.median(roads.trend_std_m_per_km_per_year[known]))


def piece_of(key: Keys) -> npt.NDArray[np.intp]:
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
                          _normal_p(trend, trend_std))
    north = mean("heading_deg", lambda one: np.cos(np.radians(one)))
    east = mean("heading_deg", lambda one: np.sin(np.radians(one)))
    heading_deg = np.where(np.hypot(north, east) > 0.5, np.degrees(np.arctan2(east, north)) % 360.0, np.nan)
    return _table(by, key, mean("lat_deg"), mean("lon_deg"), heading_deg, total(np.ones(len(code))),
                  extreme("cars", np.minimum), mean("passes"), mean("mean_years"), figures,
                  np.sqrt(mean("a_w_mps2", np.square)), mean("speed_mps"), extreme("last_us", np.maximum))


def _normal_p(trend: Array, trend_std: Array) -> Array:
    from scipy.stats import norm

    return np.asarray(2.0 * norm.sf(np.abs(trend) / trend_std))


def _table(by: str, key: Keys, lat_deg: Array, lon_deg: Array, heading_deg: Array, length_m: Array, cars: Keys,
           passes: Array, mean_years: Array, figures: RoadFigures, a_w_mps2: Array, speed_mps: Array, last_us: Keys
           ) -> RoadTable:
    worse = significant(figures.p_value, FALSE_SHARE) & (figures.trend_m_per_km_per_year > 0)
    rough = figures.iri_m_per_km - _CERTAIN * figures.iri_std_m_per_km > POOR_M_PER_KM
    hard = a_w_mps2 >= UNCOMFORTABLE_MPS2
    words = np.array(["|".join(word for word, holds in zip(("rough", "worse", "uncomfortable"), three, strict=True)
                               if holds) for three in zip(rough, worse, hard, strict=True)], dtype=np.str_)
    return RoadTable(by, key, lat_deg, lon_deg, heading_deg, length_m, cars.astype(np.int64), passes,
                     mean_years, figures.iri_m_per_km, figures.iri_std_m_per_km, figures.trend_m_per_km_per_year,
                     figures.trend_std_m_per_km_per_year, figures.p_value, a_w_mps2, speed_mps,
                     last_us.astype(np.int64), worse, words)
