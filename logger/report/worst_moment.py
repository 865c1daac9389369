"""Where a model is worst: the part of a run that a page shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from logger.lab.compare import Standing
from logger.runs import short_names

_AROUND_S = 1.5


@dataclass(frozen=True)
class Moment:
    """The samples ``part`` of those that count in a run, by its number, and where that is in words."""

    run: int
    part: slice
    words: str


def worst_moment(standing: Standing) -> Moment:
    """Around the largest residual in the worst place; on rigs, which stand where they are, of all."""
    residuals, worst = standing.residuals, standing.where.worst_places(1)
    names = short_names(residuals.runs)
    if worst:
        index = next(i for i, run in enumerate(residuals.runs) if run.name == worst[0].name)
        run = residuals.runs[index]
        at_m = run.distance_m[run.first:]
        inside = np.flatnonzero((at_m >= worst[0].low) & (at_m < worst[0].high))
    else:
        index = int(np.argmax([np.abs(one).max() for one in residuals.residual]))
        run = residuals.runs[index]
        inside = np.arange(len(residuals.residual[index]))
    middle = int(inside[np.abs(residuals.residual[index][inside]).argmax()])
    where = f"{at_m[middle]:.0f} m" if worst else f"{(run.first + middle) / residuals.rate_hz:.1f} s"
    reach = round(_AROUND_S * residuals.rate_hz)
    return Moment(index, slice(max(0, middle - reach), middle + reach), f"{names[run.name]}, around {where}")
