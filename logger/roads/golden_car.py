"""The IRI's reference car as a filter that runs along a road, in blocks of any size.

Problem: the IRI drives a quarter car at 80 km/h over a profile, step by step and exactly (a straight line between
samples is a constant slope over a step), and a stream must give the same numbers as the whole profile at once.

Solution: driven by the road's slope, the suspension's slope z_s' - z_u' is -(kt / mu) s^2 / D(s), D the characteristic
polynomial with two pairs of complex poles p. Its response to a slope that is held over a step has a closed form,

    H(z) = (1 - 1/z) sum over p of r q / (1 - q / z),   q = exp(p dx / V),   r = -(kt / mu) p / product of (p - others),

the value at the end of a step coming with the slope of that step. The residues r sum to zero, which leaves a
numerator of second order beside the factor 1 - 1/z: two second-order sections, exact for the profile as it is sampled.
That factor also makes a straight grade exactly smooth, which the printed coefficients of World Bank Technical Paper 46
do not. At rest on a constant slope is the start that ASTM E1926 asks for (states: slope, slope, 0, 0).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from logger.dsp.fixed_point import FixedFilter
from logger.dsp.sections import BlockFilter
from logger.units import KMH_MPS
from logger.vehicle.quarter_car import GOLDEN_CAR, structure

Array = npt.NDArray[np.float64]

STANDARD_SPEED_MPS = 80 * KMH_MPS
START_M = 11.0
TIRE_BASE_M = 0.25
COARSEST_SPACING_M = 0.3


def sections(spacing_m: float) -> Array:
    """Second-order sections, (2, 6) rows b0, b1, b2, 1, a1, a2, from road slope to suspension slope [m/m to m/m].

    One sample per step of ``spacing_m`` [m] at 80 km/h; the output belongs to the end of the step. Steady slope in,
    nothing out. ValueError unless the spacing is above 0 and at most 300 mm.
    """
    if not 0 < spacing_m <= COARSEST_SPACING_M * (1 + 1e-9):
        raise ValueError(f"expected samples at most {COARSEST_SPACING_M:g} m apart, found {spacing_m:g} m")
    poles = np.linalg.eigvals(structure(GOLDEN_CAR).state_space()[0])
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


class GoldenCarFilter:
    """Elevations in, rectified slopes |z_s' - z_u'| out; any split of a profile gives the same bits.

    spacing_m      distance between elevations [m], above 0 and at most 300 mm (else ValueError)
    make_filter    what runs the sections: floating point, or the integers of ``logger.dsp.fixed_point``

    Value i belongs to the end of the step from elevation i to i + 1. The tire's average takes the slope to the
    elevation 250 mm ahead, so values come that much later; the first ones come once 11 m are known.
    """

    def __init__(
        self, spacing_m: float, make_filter: Callable[[Array], BlockFilter | FixedFilter] = BlockFilter
    ) -> None:
        self._filter = make_filter(sections(spacing_m))
        self._spacing_m = spacing_m
        self._base = max(1, int(TIRE_BASE_M / spacing_m + 0.5))
        self._start = int(START_M / spacing_m + 0.5)
        self._started = False
        self._known = np.empty(0)

    def push(self, elevation_m: npt.ArrayLike) -> Array:
        """The rectified slopes [m/m] that the next elevations (n,) [m] make known. ValueError if one is not finite."""
        fresh = np.asarray(elevation_m, dtype=float)
        if fresh.ndim != 1 or not np.isfinite(fresh).all():
            raise ValueError("expected a row of finite elevations")
        known = np.concatenate([self._known, fresh])
        if not self._started:
            if len(known) <= self._start:
                self._known = known
                return np.empty(0)
            self._filter.reset((known[self._start] - known[0]) / (self._start * self._spacing_m))
            self._started = True
        self._known = known[-self._base:]
        slope = (known[self._base:] - known[:-self._base]) / (self._base * self._spacing_m)
        return np.abs(self._filter.process(slope))
