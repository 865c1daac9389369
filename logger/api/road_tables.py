"""What is shown of a public record of roads: the car beside the profiler, road by road, and what the best could reach.

A factor, where one is fitted, is fitted on the other roads and judged on this one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.chart_data import Curves, Line
from logger.roads.agreement import Agreement, agreement, factor_to
from logger.studies.study import Cell, Column, Table

Array = npt.NDArray[np.float64]

REPEAT_R2 = {10.0: (0.60, 0.82), 100.0: (0.91, 0.97)}
"""R2 between passes of one profiler over 26 km, the lowest and the highest of three pairs that are laid together in two
ways: ``ridelog study lira-map`` on peacefulotter/LiRA-Map (MIT)."""
COLUMNS = (
    Column("road"), Column("compared"), Column("windows", ".0f"), Column("R2", ".3f"), Column("R2 of log IRI", ".3f"),
    Column("MAE [m/km]", ".3f"), Column("bias", "+.1%"), Column("within 1 std. error (68%)", ".0%"),
    Column("within 2 (95%)", ".0%"))
REPEAT_COLUMNS = (*COLUMNS[:7], Column("correlation squared", ".3f"), Column("r.m.s. difference [m/km]", ".3f"),
                  Column("moved by [m]", "+.0f"))


@dataclass(frozen=True, eq=False)
class Compared:
    """Windows (n,) of one length on one road: estimates, their standard errors, the reference, and where along."""

    road: str
    window_m: float
    at_m: Array
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    reference_m_per_km: Array
    what: str = "car"


def compared_table(parts: list[Compared], window_m: float) -> Table:
    """A row for each road, as it is and multiplied by the other roads' factor; then all roads together."""
    chosen = [one for one in parts if one.window_m == window_m]
    rows = []
    for one in chosen:
        rows.append(_row(one.road, one.what, agreement(one.iri_m_per_km, one.iri_std_m_per_km, one.reference_m_per_km)))
        others = [other for other in chosen if other.road != one.road and other.what == one.what]
        if others:
            factor = factor_to(*(np.concatenate([getattr(other, name) for other in others])
                                 for name in ("iri_m_per_km", "reference_m_per_km")))
            rows.append(_row(one.road, f"{one.what}, times {factor:.3g} by the other roads", agreement(
                factor * one.iri_m_per_km, factor * one.iri_std_m_per_km, one.reference_m_per_km)))
    return Table(f"Windows of {window_m:g} m", COLUMNS, tuple(rows))


def repeat_row(road: str, what: str, mine: Array, theirs: Array, moved_m: float = 0.0) -> tuple[Cell, ...]:
    """A profiler beside itself or another, over windows (n,): a row of ``REPEAT_COLUMNS``."""
    found = _row(road, what, agreement(mine, None, theirs))
    known = np.isfinite(mine) & np.isfinite(theirs)
    if found[3] is None:
        return (*found[:7], None, None, moved_m)
    squared = float(np.corrcoef(mine[known], theirs[known])[0, 1] ** 2)
    return (*found[:7], squared, float(np.sqrt(np.mean((mine - theirs)[known] ** 2))), moved_m)


def _row(road: str, what: str, found: Agreement | None) -> tuple[Cell, ...]:
    if found is None:
        return (road, what, 0.0, None, None, None, None, None, None)
    numbers = (found.r2, found.r2_log, found.mae_m_per_km, found.bias, found.within_one, found.within_two)
    return (road, what, float(found.windows), *(one if np.isfinite(one) else None for one in numbers))


def along(part: Compared) -> Curves:
    """The road as the profiler and as the car have it; of several passes over a place, their mean."""
    at_m, passes = np.unique(np.round(part.at_m, 1), return_inverse=True)
    lines = []
    for name, values in (("profiler", part.reference_m_per_km), ("car", part.iri_m_per_km)):
        known = np.isfinite(values)
        count = np.bincount(passes[known], minlength=len(at_m))
        mean = np.bincount(passes[known], values[known], len(at_m)) / np.maximum(count, 1)
        lines.append(Line(name, at_m[count > 0], mean[count > 0], dots=name == "profiler"))
    return Curves(f"{part.road}: IRI over {part.window_m:g} m", "along the road [m]", "IRI [m/km]", tuple(lines))


def verdict_of(parts: list[Compared], refused: list[str], repeat: str) -> str:
    """How well all roads together agree, in sentences."""
    words = []
    for window_m in sorted({one.window_m for one in parts}):
        chosen = [one for one in parts if one.window_m == window_m and one.what == "car"]
        found = agreement(*(np.concatenate([getattr(one, name) for one in chosen]) for name in (
            "iri_m_per_km", "iri_std_m_per_km", "reference_m_per_km")))
        if found is not None:
            words.append(f"All roads, {window_m:g} m: R2 {found.r2:.2f}, off by {found.mae_m_per_km:.2f} m/km on the "
                         f"mean, bias {found.bias:+.0%}, {found.within_two:.0%} within two standard errors.")
    if not words:
        words.append("Too few windows lie on the profiled roads for a figure.")
    words.append(repeat)
    if refused:
        words.append(f"Left out: {len(refused)}, the first {refused[0]}".rstrip(".") + ".")
    return " ".join(words)
