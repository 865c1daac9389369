"""The International Roughness Index: its reference car, of a profile, by wavelength and place by place.

Here too is judged whether numbers are those of a road in the unit that they claim. Nothing that was measured is refused
for being rough. The roughest road that has a name is class H of ISO 8608, whose upper limit is an IRI of some 390 m/km,
far beyond any car; a smooth road of 0.5 m/km in millimetres has 500. Between what anybody has driven on (the scale of
the World Bank's Technical Paper 46 ends at 24 m/km; 100 is said to be doubtful here) and that limit a profile is taken,
with a word. Hills and slopes do not count: the IRI of an even slope is 0.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor

import numpy as np
import numpy.typing as npt

from logger.arrays import Array
from logger.bounds import EVEN_SAMPLES
from logger.dsp.filters import BlockFilter
from logger.roads.iso8608 import CLASS_GD_N0_CM3, iri_from_gd_n0
from logger.units import FOOT_M, INCH_PER_MILE_M_PER_KM, KMH_MPS, KNOT_MPS, MILE_M, MPH_MPS
from logger.vehicle.linear_car import frequency_response
from logger.vehicle.models import GOLDEN_CAR, quarter_car
from logger.vehicle.structure import suspension_travel

STANDARD_SPEED_MPS = 80 * KMH_MPS
START_M = 11.0
TIRE_BASE_M = 0.25
COARSEST_SPACING_M = 0.3


def check_spacing(spacing_m: float) -> None:
    """ValueError for samples of a profile that lie farther apart than the standards allow [m]."""
    if not 0 < spacing_m <= COARSEST_SPACING_M * (1 + 1e-9):
        raise ValueError(f"expected samples at most {COARSEST_SPACING_M:g} m apart, found {spacing_m:g} m")


def golden_car_sections(spacing_m: float) -> Array:
    """Second-order sections, (2, 6) rows b0, b1, b2, 1, a1, a2, from road slope to suspension slope [m/m to m/m].

    One sample per step of ``spacing_m`` [m] at 80 km/h; the output belongs to the end of the step. Steady slope in,
    nothing out. ValueError unless the spacing is above 0 and at most 300 mm.
    """
    check_spacing(spacing_m)
    poles = np.linalg.eigvals(quarter_car(GOLDEN_CAR).state_space()[0])
    upper = poles[poles.imag > 0]
    stiffness_per_mass = GOLDEN_CAR.front.tire_stiffness_n_per_m / GOLDEN_CAR.front.unsprung_mass_kg
    denominators, numerators = [], []
    for pole in upper:
        others = poles[poles != pole]
        residue = -stiffness_per_mass * pole / np.prod(pole - others)
        step = np.exp(pole * spacing_m / STANDARD_SPEED_MPS)
        denominators.append([1.0, -2 * step.real, abs(step) ** 2])
        numerators.append([2 * (residue * step).real, -2 * abs(step) ** 2 * residue.real])
    summed = np.convolve(numerators[0], denominators[1]) + np.convolve(numerators[1], denominators[0])
    return np.array([[1.0, -1.0, 0.0, *denominators[0]], [*summed[:3], *denominators[1]]])


def slope_gain(wave_number_cpm: npt.ArrayLike, tire_base_m: float = TIRE_BASE_M) -> Array:
    """Amplitude of the suspension's slope z_s' - z_u' per amplitude of the road's slope, for a sinusoidal road.

    The IRI is no average of heights. It passes waves from about 1.2 to 30 m and is deaf to much shorter and longer
    ones; its gain peaks near 0.065 cycles per metre, where the body bounces, and near 0.42, where the wheel hops (the
    dissertation has these two the wrong way round).

    wave_number_cpm    (n,) [cycles per metre]; tire_base_m [m] of the moving average, 0 for a tire that touches in
    a point. Fig 2.13; the Golden Car at 80 km/h as a continuous system, so for a finely sampled profile.
    """
    wave_number = np.asarray(wave_number_cpm, dtype=float)
    car = quarter_car(GOLDEN_CAR)
    travel = frequency_response(car, [suspension_travel(car, 0)], wave_number * STANDARD_SPEED_MPS)[..., 0, 0]
    return np.abs(travel * np.sinc(wave_number * tire_base_m))


PER_KM = 1000.0


def rectified_slope(elevation_m: npt.ArrayLike, spacing_m: float) -> Array:
    """Rectified slope |z_s' - z_u'| of the Golden Car, one value per step of the profile [m/m].

    elevation_m    (n,) elevations at uniform spacing [m]
    spacing_m      [m], at most 0.3 m

    Problem: the IRI drives a quarter car at 80 km/h over a profile, step by step and exactly: a straight line between
    samples is a constant slope over a step. Solution: driven by the road's slope, the suspension's slope z_s' - z_u' is
    -(kt / mu) s^2 / D(s), D the characteristic polynomial with two pairs of complex poles p. Its response to a slope
    that is held over a step has a closed form,

        H(z) = (1 - 1/z) sum over p of r q / (1 - q / z),   q = exp(p dx / V),   r = -(kt / mu) p / product of (p -
          others),

    the value at the end of a step coming with the slope of that step. The residues r sum to zero, which leaves a
    numerator of second order beside the factor 1 - 1/z: two second-order sections, exact for the profile as it is
    sampled. That factor also makes a straight grade exactly smooth, which the printed coefficients of World Bank
    Technical Paper 46 do not. At rest on a constant slope is the start that ASTM E1926 asks for (states: slope, slope,
    0, 0).

    Value i is that at the end of the step from sample i to i + 1; the tire's average takes the slope to the elevation
    250 mm ahead. There are n - k of them, k being the samples of the tire's base (1 from about 167 mm of spacing on).
    ValueError if the profile is shorter than 11 m, too coarse or not finite.
    """
    car = BlockFilter(golden_car_sections(spacing_m))
    elevation = np.asarray(elevation_m, dtype=float)
    length_m = (elevation.size - 1) * spacing_m
    if length_m < START_M * (1 - 1e-9):
        raise ValueError(f"expected a profile of at least {START_M:g} m, found {max(length_m, 0):.4g} m")
    if elevation.ndim != 1 or not np.isfinite(elevation).all():
        raise ValueError("expected a row of finite elevations")
    base, start = (max(1, int(length / spacing_m + 0.5)) for length in (TIRE_BASE_M, START_M))
    car.reset((elevation[start] - elevation[0]) / (start * spacing_m))
    return np.abs(car.process((elevation[base:] - elevation[:-base]) / (base * spacing_m)))


def iri(elevation_m: npt.ArrayLike, spacing_m: float) -> float:
    """IRI of a whole profile [m/km]. Arguments and errors as in ``rectified_slope``.

    The IRI is the mean rectified slope between body and wheel of the Golden Car at 80 km/h (Eq 2.8 of Blum 2015). A
    program that integrates it with ordinary steps gets another number; the standard says how: the profile is a straight
    line between samples, so each step of the car is taken exactly (ASTM E1926; Sayers, "On the calculation of
    International Roughness Index from longitudinal road profile", TRR 1501, 1995; World Bank Technical Paper 46).

    What is meant here, where sources differ:

    - The 250 mm tire average is the slope from a sample to the one 250 mm ahead of it (Sayers). Eq 2.7 of the
      dissertation prints the sum around the other way. As in Sayers' program the base is the whole number of samples
      nearest to 250 mm, so from about 167 mm of spacing on it is a single step, which is no average.
    - The car starts with the mean slope of the first 11 m (ASTM), not of 0.5 s.
    - The sum runs over end points of the steps; the last is the one whose tire base still lies on the profile. A window
      that cuts through a step takes its share of it.
    - With two wheel tracks, MRI is the mean of the tracks' IRI and HRI the IRI of the tracks' mean (the half car, which
      does not feel roll). HRI is never above MRI.
    """
    return float(PER_KM * rectified_slope(elevation_m, spacing_m).mean())


def window_iri(slope: Array, spacing_m: float, edges_m: npt.ArrayLike) -> Array:
    """IRI between neighbouring edges [m/km].

    slope      what ``rectified_slope`` gave for the whole profile, so that no window starts the car from rest
    edges_m    (w + 1,) increasing distances from the profile's first sample [m]; returns (w,)

    ValueError if an edge lies outside the profile, or edges do not increase.
    """
    steps = [_steps(edge, spacing_m) for edge in np.asarray(edges_m, dtype=float)]
    if (np.diff(steps) <= 0).any() or steps[0] < 0 or steps[-1] > len(slope):
        raise ValueError(f"window edges must increase within 0 ... {len(slope) * spacing_m:g} m")
    return np.array([PER_KM * _mean_between(slope, *pair) for pair in pairwise(steps)])


@dataclass(frozen=True)
class IriWindow:
    """IRI [m/km] of one stretch, distances from the profile's first sample [m]. ``partial``: cut short by the end."""

    distance_start_m: float
    distance_end_m: float
    iri_m_per_km: float
    partial: bool


def _steps(distance_m: float, spacing_m: float) -> float:
    """Distance in steps; a whole number where rounding alone keeps it from being one."""
    steps = float(distance_m / spacing_m)
    nearest = float(np.rint(steps))
    return nearest if abs(steps - nearest) < EVEN_SAMPLES else steps


def _mean_between(slope: Array, start: float, stop: float) -> float:
    """Mean of the steps from ``start`` to ``stop``, which may lie within a step."""
    first, last = floor(start), ceil(stop)
    part = slope[first:last]
    total = part.sum() - (start - first) * part[0] - (last - stop) * part[-1]
    return float(total / (stop - start))


@dataclass(frozen=True, eq=False)
class ProfileIri:
    """IRI [m/km] by name, each (1 + w,): of the whole profile, then of its windows.

    Of one track ``iri_m_per_km``; of two that of the left one, ``iri_right_m_per_km``, and of both together
    ``mri_m_per_km`` and ``hri_m_per_km``. The windows' distances are from the first sample on.
    """

    windows: tuple[IriWindow, ...]
    columns: dict[str, Array]

    def row(self, number: int) -> dict[str, float]:
        """One value of each name: 0 is the whole, 1 the first window."""
        return {name: float(column[number]) for name, column in self.columns.items()}


def profile_iri(elevation_m: Array, elevation_right_m: Array | None, spacing_m: float, window_m: float) -> ProfileIri:
    """IRI of each track (n,), and MRI and HRI of two. ValueError as in ``logger.roads.iri``."""
    left, windows = _track(elevation_m, spacing_m, window_m)
    columns = {"iri_m_per_km": left}
    if elevation_right_m is not None:
        right, _ = _track(elevation_right_m, spacing_m, window_m)
        half_car, _ = _track((elevation_m + elevation_right_m) / 2, spacing_m, window_m)
        columns |= {"iri_right_m_per_km": right, "mri_m_per_km": (left + right) / 2, "hri_m_per_km": half_car}
    return ProfileIri(tuple(windows), columns)


def continuous_iri(elevation_m: Array, elevation_right_m: Array | None, spacing_m: float, base_m: float
                   ) -> tuple[Array, Array]:
    """The moving IRI over a base length, of two tracks their mean (AASHTO R 54: 25 ft): middles of the bases (k,) from
    the first sample on [m], and values (k,) [m/km]. A profile that is shorter has one base, all of it."""
    slopes = [rectified_slope(track, spacing_m) for track in (elevation_m, elevation_right_m) if track is not None]
    slope: Array = np.asarray(np.mean(slopes, axis=0))
    length = min(max(round(base_m / spacing_m), 1), len(slope))
    sums = np.concatenate([[0.0], np.cumsum(slope)])
    values: Array = PER_KM * (sums[length:] - sums[:-length]) / length
    return np.asarray(spacing_m * (np.arange(len(values)) + length / 2)), values


def _track(elevation_m: Array, spacing_m: float, window_m: float) -> tuple[Array, list[IriWindow]]:
    slope = rectified_slope(elevation_m, spacing_m)
    windows = windows_of(slope, spacing_m, window_m)
    return np.array([PER_KM * slope.mean(), *(window.iri_m_per_km for window in windows)]), windows


def windows_of(slope: Array, spacing_m: float, window_m: float) -> list[IriWindow]:
    """What ``rectified_slope`` gave in windows of one length, the last cut short by the end of the profile. ValueError
    unless a window holds at least one step."""
    if not spacing_m <= window_m < float("inf"):
        raise ValueError(f"expected a finite window of at least the {spacing_m:g} m between samples, found "
                         f"{window_m:g} m")
    windows: list[IriWindow] = []
    while (start := _steps(begin_m := len(windows) * window_m, spacing_m)) < len(slope):
        end_m = (len(windows) + 1) * window_m
        if partial := (stop := _steps(end_m, spacing_m)) > len(slope):
            stop, end_m = len(slope), len(slope) * spacing_m
        windows.append(IriWindow(begin_m, end_m, PER_KM * _mean_between(slope, start, stop), partial))
    return windows


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

    AASHTO R 54 (Accepting Pavement Ride Quality) slides a base of 25 ft over a profile; an area begins where the
    sliding value rises above the limit and ends where it falls below again. A profile has a value at each sample. A log
    has one number for each window of 25 ft, taken as even inside: the mean over a base that lies across two windows is
    then their mean by length, so that between the windows' middles the sliding value is a straight line. It can reach
    no higher than the worst window: of a bump that lies on the limit of two windows each shows a part only, at the
    least half.

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


UNITS_M = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "in": FOOT_M / 12, "ft": FOOT_M, "mi": MILE_M}
"""Units of lengths, by the ending of a column's name."""
DOUBTFUL_M_PER_KM = 100.0
"""No road that a car can drive on is as rough, and no limit that is looked for is half as high."""
ROUGHEST_M_PER_KM = iri_from_gd_n0(2 * CLASS_GD_N0_CM3["H"])  # Upper limit of class H: twice its geometric mean
_WORDS = {"in": "inches", "ft": "feet"}
HIGHEST_LIMIT_M_PER_KM = 0.5 * DOUBTFUL_M_PER_KM
_FINEST_M = 1e-3  # No profiler samples more densely; 0.3 m apart are 0.0003 km


def unit_doubt(iri_m_per_km: float) -> str:
    """What is to be said of a profile with this IRI that is rougher than any road; else nothing."""
    return "" if iri_m_per_km <= DOUBTFUL_M_PER_KM else (
        f"Elevation in {_word(_likely(iri_m_per_km)[0])}? An IRI of {iri_m_per_km:.4g} m/km is more than any road has"
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
    # Mean slope, where there is no IRI, as samples are too far apart: a road as steep all along is none.
    steepest = 1.0
    if spacing_m < _FINEST_M:
        others = " or ".join(f"{spacing_m * UNITS_M[unit]:.3g} m in {unit}" for unit in ("km", "mi"))
        return (f"expected distances in m, found samples {spacing_m:.3g} m apart, finer than any profiler takes them "
                f"(they are {others}): name the column by its unit, as distance_km or distance_mi")
    if _has_iri(elevation_m, spacing_m):
        found = iri(elevation_m, spacing_m)
        if found <= ROUGHEST_M_PER_KM:
            return ""
        unit = _likely(found)[0]
        return (f"expected elevations in m. Elevation in {_word(unit)}? By its IRI of {found:.4g} m/km, more than any "
                f"road has{_in_others(found)}, the profile seems to be in {_word(unit)}: name the column by its unit, "
                f"as elevation_{unit}, or write metres")
    slope = float(np.abs(np.diff(elevation_m)).mean()) / spacing_m
    return "" if slope <= steepest else (
        f"expected elevations in m, found a mean slope of {100 * slope:.4g} %, more than any road has. Elevation in "
        "mm? Name the column by its unit, as elevation_mm, or write metres")


def spacing_hint(spacing_m: float) -> str:
    """The unit that distances so far apart have if they are a profiler's; nothing where none fits."""
    likely = [unit for unit in ("mm", "cm", "in", "ft")
              if spacing_m > COARSEST_SPACING_M >= spacing_m * UNITS_M[unit] >= _FINEST_M]
    words = " or ".join(map(_word, likely))
    return f" (in {words}? Name the column by its unit, as distance_{likely[0]})" if likely else ""


def likely_unit(by_speed_m: float, by_distance_m: float) -> str:
    """The unit of a speed or a distance that comes nearest to how far a way by the speeds is off that by the distances,
    and how far it would be."""
    same_way = 0.05  # Of a way by speeds and one by distances: a knot and a mile an hour are 15 % apart.
    off = by_speed_m / by_distance_m if by_speed_m > 0 and by_distance_m > 0 else 1 / KMH_MPS
    factors = {"km/h": 1 / KMH_MPS, "mph": 1 / MPH_MPS, "knots": 1 / KNOT_MPS,
               **{f"distances in {unit}": size for unit, size in UNITS_M.items() if unit != "m"}}
    near = {unit: factor for unit, factor in factors.items() if abs(np.log(off / factor)) < same_way}
    unit, factor = next(iter(near.items()), ("km/h", factors["km/h"]))
    return f"{unit} would give {factor:.3g}"


def limit_hint(limit_m_per_km: float) -> str:
    """What an IRI from which on a road is to be called rough may mean where no road has it; else nothing."""
    return "" if not HIGHEST_LIMIT_M_PER_KM < limit_m_per_km < np.inf else (
        f", which few roads reach; {limit_m_per_km:g} in/mi are {limit_m_per_km * INCH_PER_MILE_M_PER_KM:.4g} m/km")


def _likely(iri_m_per_km: float) -> list[str]:
    """The units in which elevations with this IRI would be those of a road; millimetres where there is none."""
    roads_m_per_km = (0.4, 24.0)  # From a new motorway to the end of the scale of the World Bank's Technical Paper 46.
    low, high = roads_m_per_km
    return [unit for unit in ("mm", "cm", "in") if low <= iri_m_per_km * UNITS_M[unit] <= high] or ["mm"]


def _word(unit: str) -> str:
    return _WORDS.get(unit, unit)


def _in_others(iri_m_per_km: float) -> str:
    return f" ({', '.join(f'{iri_m_per_km * UNITS_M[unit]:.3g} in {_word(unit)}' for unit in _likely(iri_m_per_km))})"
