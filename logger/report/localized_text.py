"""Areas of localized roughness, for a person and for a program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from logger.report.quantities import known
from logger.roads.localized_roughness import Area


def area_lines(found: Sequence[Area], limit_m_per_km: float) -> Iterator[str]:
    """A table, or a sentence where there is none."""
    if not found:
        yield f"Localized roughness: nowhere is the IRI over 25 ft above {limit_m_per_km:g} m/km."
        return
    yield f"Localized roughness: where the IRI over 25 ft, which slides along, is above {limit_m_per_km:g} m/km"
    yield f"{'from m':>10} {'to m':>10} {'length m':>9} {'worst m/km':>14} {'at m':>10}"
    for one in found:
        error = known(one.worst_std_m_per_km)
        worst = f"{one.worst_m_per_km:.2f}" + ("" if error is None else f" ± {error:.2f}")
        yield (f"{one.start_m:10.2f} {one.end_m:10.2f} {one.end_m - one.start_m:9.2f} {worst:>14} "
               f"{one.worst_at_m:10.2f}")


def area_values(one: Area) -> dict[str, float | None]:
    """By the names of their columns; None where nothing is known."""
    return {"distance_start_m": one.start_m, "distance_end_m": one.end_m, "worst_m_per_km": one.worst_m_per_km,
            "worst_std_m_per_km": known(one.worst_std_m_per_km), "worst_at_m": one.worst_at_m}
