"""What a road can be: one place that judges whether numbers are those of a road in the unit that they claim.

Nothing that was measured is refused for being rough. The roughest road that has a name is class H of ISO 8608, whose
upper limit is an IRI of some 390 m/km, far beyond any car; a smooth road of 0.5 m/km in millimetres has 500. Between
what anybody has driven on (the scale of the World Bank's Technical Paper 46 ends at 24 m/km; 100 is said to be doubtful
here) and that limit a profile is taken, with a word. Hills and slopes do not count: the IRI of an even slope is 0.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.roads.iri import COARSEST_SPACING_M, START_M, iri
from logger.roads.iso8608 import CLASS_GD_N0_CM3, iri_from_gd_n0
from logger.units import FOOT_M, INCH_PER_MILE_M_PER_KM, KMH_MPS, KNOT_MPS, MILE_M, MPH_MPS

Array = npt.NDArray[np.float64]

UNITS_M = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "in": FOOT_M / 12, "ft": FOOT_M, "mi": MILE_M}
"""Units of lengths, by the ending of a column's name."""
DOUBTFUL_M_PER_KM = 100.0
"""No road that a car can drive on is as rough, and no limit that is looked for is half as high."""
ROUGHEST_M_PER_KM = iri_from_gd_n0(2 * CLASS_GD_N0_CM3["H"])
"""Upper limit of class H: twice its geometric mean."""
HIGHEST_LIMIT_M_PER_KM = DOUBTFUL_M_PER_KM / 2
_ROADS_M_PER_KM = (0.4, 24.0)
"""From a new motorway to the end of the scale of the World Bank's Technical Paper 46."""
_FINEST_M = 1e-3
"""No profiler samples more densely; 0.3 m apart are 0.0003 km."""
_STEEPEST = 1.0
"""Mean slope, where there is no IRI, as samples are too far apart: a road as steep all along is none."""

_SAME_WAY = 0.05
"""Of a way by speeds and one by distances: a knot and a mile an hour are 15 % apart."""


def unit_doubt(iri_m_per_km: float) -> str:
    """What is to be said of a profile with this IRI that is rougher than any road; else nothing."""
    return "" if iri_m_per_km <= DOUBTFUL_M_PER_KM else (
        f"Elevation in {_likely(iri_m_per_km)[0]}? An IRI of {iri_m_per_km:.4g} m/km is more than any road has"
        f"{_in_others(iri_m_per_km)}; expected elevation_m in metres.")


def doubts_of(iri_m_per_km: float) -> dict[str, list[dict[str, str]]]:
    """The same for a program, to be added to its object: ``doubts``; or nothing."""
    return {"doubts": [{"what": "unit", "words": words}]} if (words := unit_doubt(iri_m_per_km)) else {}


def doubt_of(elevation_m: Array, spacing_m: float) -> str:
    """``unit_doubt`` of a profile (n,) [m]; nothing where it has no IRI."""
    return unit_doubt(iri(elevation_m, spacing_m)) if _has_iri(elevation_m, spacing_m) else ""


def _has_iri(elevation_m: Array, spacing_m: float) -> bool:
    return spacing_m <= COARSEST_SPACING_M and (len(elevation_m) - 1) * spacing_m >= START_M


def unit_complaint(elevation_m: Array, spacing_m: float) -> str:
    """What is wrong with a profile (n,) [m] that cannot be one in metres ("expected ..., found ..."); else nothing."""
    if spacing_m < _FINEST_M:
        others = " or ".join(f"{spacing_m * UNITS_M[unit]:.3g} m in {unit}" for unit in ("km", "mi"))
        return (f"expected distances in m, found samples {spacing_m:.3g} m apart, finer than any profiler takes them "
                f"(they are {others}): name the column by its unit, as distance_km or distance_mi")
    if _has_iri(elevation_m, spacing_m):
        found = iri(elevation_m, spacing_m)
        if found <= ROUGHEST_M_PER_KM:
            return ""
        unit = _likely(found)[0]
        return (f"expected elevations in m. Elevation in {unit}? By its IRI of {found:.4g} m/km, more than any road "
                f"has{_in_others(found)}, the profile seems to be in {unit}: name the column by its unit, as "
                f"elevation_{unit}, or write metres")
    slope = float(np.abs(np.diff(elevation_m)).mean()) / spacing_m
    return "" if slope <= _STEEPEST else (
        f"expected elevations in m, found a mean slope of {100 * slope:.4g} %, more than any road has. Elevation in "
        "mm? Name the column by its unit, as elevation_mm, or write metres")


def spacing_hint(spacing_m: float) -> str:
    """The unit that distances so far apart have if they are a profiler's; nothing where none fits."""
    likely = [unit for unit in ("mm", "cm", "in", "ft")
              if spacing_m > COARSEST_SPACING_M >= spacing_m * UNITS_M[unit] >= _FINEST_M]
    return f" (in {' or '.join(likely)}? Name the column by its unit, as distance_{likely[0]})" if likely else ""


def likely_unit(by_speed_m: float, by_distance_m: float) -> str:
    """The unit of a speed or a distance that comes nearest to how far a way by the speeds is off that by the distances,
    and how far it would be."""
    off = by_speed_m / by_distance_m if by_speed_m > 0 and by_distance_m > 0 else 1 / KMH_MPS
    factors = {"km/h": 1 / KMH_MPS, "mph": 1 / MPH_MPS, "knots": 1 / KNOT_MPS,
               **{f"distances in {unit}": size for unit, size in UNITS_M.items() if unit != "m"}}
    near = {unit: factor for unit, factor in factors.items() if abs(np.log(off / factor)) < _SAME_WAY}
    unit, factor = next(iter(near.items()), ("km/h", factors["km/h"]))
    return f"{unit} would give {factor:.3g}"


def limit_hint(limit_m_per_km: float) -> str:
    """What an IRI from which on a road is to be called rough may mean where no road has it; else nothing."""
    return "" if not HIGHEST_LIMIT_M_PER_KM < limit_m_per_km < np.inf else (
        f", which roads seldom reach; {limit_m_per_km:g} in/mi are "
        f"{limit_m_per_km * INCH_PER_MILE_M_PER_KM:.4g} m/km")


def _likely(iri_m_per_km: float) -> list[str]:
    """The units in which elevations with this IRI would be those of a road; millimetres where there is none."""
    low, high = _ROADS_M_PER_KM
    return [unit for unit in ("mm", "cm", "in") if low <= iri_m_per_km * UNITS_M[unit] <= high] or ["mm"]


def _in_others(iri_m_per_km: float) -> str:
    return f" ({', '.join(f'{iri_m_per_km * UNITS_M[unit]:.3g} in {unit}' for unit in _likely(iri_m_per_km))})"
