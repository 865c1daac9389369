"""Places that somebody should go and see: a single bump, a rough stretch, or a ride that is bad on a smooth road.

Table 6.5 of Blum 2015 lists such places of a drive by the comfort there and the reason found. Here a place is a row of
neighbouring cells of the road, of any length, of which each is as rough, or rides as badly, with so much confidence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.roads.repeated_drives import Means, way_and_cell

Array = npt.NDArray[np.float64]

BUMP, STRETCH, COMFORT = "single bump", "rough stretch", "comfort only"
LEAST_CONFIDENCE = 0.8
"""That a cell's true value lies above the limit: in four of five cases at least."""
UNCOMFORTABLE_MPS2 = 0.5
"""From here on ISO 2631-1 (annex C.2.3) calls a ride fairly uncomfortable."""
BUMP_M = 30.0
"""One obstacle shakes a car for some car's lengths: what is rough no further is one."""


@dataclass(frozen=True)
class PlaceToVisit:
    """A place of cells from one to before another of the means.

    kind                single bump, rough stretch or comfort only
    cells               numbers of its cells, in the order driven
    worst               number of the worst of them
    length_m            of all
    confidence          that its worst cell lies above the limit
    drives              that passed its worst cell
    """

    kind: str
    cells: tuple[int, ...]
    worst: int
    length_m: float
    confidence: float
    drives: int


def places_to_visit(mean: Means, a_w_mps2: Array, a_w_std_mps2: Array, length_m: float, above_m_per_km: float
                    ) -> tuple[PlaceToVisit, ...]:
    """The places of means over cells of a length (k,), those first that are furthest above their limit.

    a_w_mps2, a_w_std_mps2    of the cells; NaN: not known
    above_m_per_km            from which IRI a cell is rough
    """
    rough = _confidence(mean.iri_m_per_km, mean.iri_std_m_per_km, above_m_per_km)
    felt = _confidence(a_w_mps2, a_w_std_mps2, UNCOMFORTABLE_MPS2)
    is_rough = rough >= LEAST_CONFIDENCE
    rows = _rows(mean, is_rough) + _rows(mean, (felt >= LEAST_CONFIDENCE) & ~is_rough)
    found = []
    for row in rows:
        comfort = not is_rough[row[0]]
        excess = a_w_mps2[row] / UNCOMFORTABLE_MPS2 if comfort else mean.iri_m_per_km[row] / above_m_per_km
        worst = int(row[np.argmax(excess)])
        reach_m = len(row) * length_m
        kind = COMFORT if comfort else BUMP if reach_m <= max(BUMP_M, length_m) else STRETCH
        place = PlaceToVisit(kind, tuple(row.tolist()), worst, reach_m, float((felt if comfort else rough)[worst]),
                      int(mean.drives[worst]))
        found.append((-float(excess.max()), worst, place))
    return tuple(place for _, _, place in sorted(found, key=lambda one: one[:2]))


def _confidence(value: Array, std: Array, limit: float) -> Array:
    """That the true value lies above a limit (k,); 0 where nothing is known."""
    from scipy.special import ndtr

    known = np.isfinite(value) & np.isfinite(std)
    z = (np.where(known, value, 0.0) - limit) / np.where(known, np.maximum(std, 1e-9), 1.0)
    return np.where(known, ndtr(z), 0.0)


def _rows(mean: Means, which: npt.NDArray[np.bool_]) -> list[npt.NDArray[np.intp]]:
    """Cells that are chosen, in rows of neighbours on one way."""
    chosen = np.flatnonzero(which)
    if not len(chosen):
        return []
    way, cell = way_and_cell(mean.key[chosen])
    return np.split(chosen, np.flatnonzero((np.diff(way) != 0) | (np.diff(cell) != 1)) + 1)
