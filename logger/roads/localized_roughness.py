"""Areas of localized roughness: where the IRI over a base length that slides along the road is above a limit.

AASHTO R 54 (Accepting Pavement Ride Quality) slides a base of 25 ft over a profile; an area begins where the sliding
value rises above the limit and ends where it falls below again. A profile has a value at each sample. A log has one
number for each window of 25 ft, taken as even inside: the mean over a base that lies across two windows is then their
mean by length, so that between the windows' middles the sliding value is a straight line. It can reach no higher than
the worst window: of a bump that lies on the limit of two windows each shows a part only, at the least half.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Area:
    """A stretch above the limit.

    start_m, end_m    where the middle of the base is when the sliding value passes the limit
    worst_m_per_km    highest sliding value, at ``worst_at_m``, with its standard error (NaN: none is known)
    """

    start_m: float
    end_m: float
    worst_m_per_km: float
    worst_std_m_per_km: float
    worst_at_m: float


def areas(middle_m: Array, iri_m_per_km: Array, limit_m_per_km: float, iri_std_m_per_km: Array | None = None,
          gap_m: float = np.inf) -> list[Area]:
    """Areas of a sliding IRI, given at the middles of its bases (n,), growing; between them a straight line.

    NaN ends an area where the value before it stands, and so does a step of more than ``gap_m``.
    """
    found: list[Area] = []
    std = np.full(len(middle_m), np.nan) if iri_std_m_per_km is None else iri_std_m_per_km
    above = np.nan_to_num(iri_m_per_km) > limit_m_per_km
    joins = np.isfinite(iri_m_per_km[1:]) & np.isfinite(iri_m_per_km[:-1]) & (np.diff(middle_m) <= gap_m)
    breaks = np.flatnonzero((above[1:] != above[:-1]) | ~joins) + 1
    for first, end in zip([0, *breaks.tolist()], [*breaks.tolist(), len(above)], strict=True):
        if end == first or not above[first]:
            continue
        worst = first + int(np.argmax(iri_m_per_km[first:end]))

        def passes(inside: int, outside: int) -> float:
            """Where the line from one to the other meets the limit; the one inside where it does not reach it."""
            if not (0 <= outside < len(above) and joins[min(inside, outside)]):
                return float(middle_m[inside])
            share = (iri_m_per_km[inside] - limit_m_per_km) / (iri_m_per_km[inside] - iri_m_per_km[outside])
            return float(middle_m[inside] + share * (middle_m[outside] - middle_m[inside]))

        found.append(Area(passes(first, first - 1), passes(end - 1, end), float(iri_m_per_km[worst]),
                          float(std[worst]), float(middle_m[worst])))
    return found
