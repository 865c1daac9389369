"""The figures of a dataset as relational expressions, written once in Ibis for any engine it knows.

Three groupings. ``passes_by_car``: of each piece of road and car the number of passes and the sums of their IRI and
time. ``passes_by_session``: means by session, of a part of the roads, from which the biases of cars follow.
``roads``: the sums of each piece of road over all cars, each car's readings divided by its gain. What follows from the
sums is arithmetic over as many rows as there are pieces of road.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import ibis.expr.types as ir

YEAR_US = 365.25 * 86400e6
"""A Julian year."""
_PRIME = 1_000_003


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


def cars(by_car: ir.Table) -> ir.Table:
    """Passes and roads of each car."""
    return by_car.group_by("car").aggregate(passes=by_car.passes.sum(), roads=by_car.count())


def passes_by_session(rows: ir.Table, since_us: int | None, until_us: int | None, zero_us: int, one_in: int
                      ) -> ir.Table:
    """Means over passes by road, car and session, of one road in so many: by the remainder of the key, first by a
    prime, as the last bits of a key are a direction."""
    passes = _passes(rows, since_us, until_us)
    if one_in > 1:
        passes = passes.filter((passes.road % _PRIME) % one_in == 0)
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
