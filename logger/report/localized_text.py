"""Areas of localized roughness, for a person and for a program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from logger.report.display_units import UNITS, DisplayUnits
from logger.report.quantities import known
from logger.roads.iri import Area


def area_lines(found: Sequence[Area], limit_m_per_km: float, units: DisplayUnits = UNITS["si"]) -> Iterator[str]:
    """A table, or a sentence where there is none."""
    (place, place_m), (iri, scale), decimals = units.place, units.iri, units.iri_decimals
    limit = f"{limit_m_per_km / scale:.{decimals}f}" if scale != 1 else f"{limit_m_per_km:g}"
    if not found:
        yield f"Localized roughness: nowhere is the IRI over 25 ft above {limit} {iri}."
        return
    yield f"Localized roughness: where the IRI over 25 ft, which slides along, is above {limit} {iri}"
    yield f"{'from ' + place:>10} {'to ' + place:>10} {'length ' + place:>9} {'worst ' + iri:>14} {'at ' + place:>10}"
    for one in found:
        error = known(one.worst_std_m_per_km)
        worst = (f"{one.worst_m_per_km / scale:.{decimals}f}"
                 + ("" if error is None else f" ± {error / scale:.{decimals}f}"))
        start, end, length, at = (f"{value / place_m:.{units.place_decimals}f}" for value in (
            one.start_m, one.end_m, one.end_m - one.start_m, one.worst_at_m))
        yield f"{start:>10} {end:>10} {length:>9} {worst:>14} {at:>10}"


def area_values(one: Area) -> dict[str, float | None]:
    """By the names of their columns; None where nothing is known."""
    return {"distance_start_m": one.start_m, "distance_end_m": one.end_m, "worst_m_per_km": one.worst_m_per_km,
            "worst_std_m_per_km": known(one.worst_std_m_per_km), "worst_at_m": one.worst_at_m}
