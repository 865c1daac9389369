"""What the IRI hears: its response to each wavelength of the road (Fig 2.13 of Blum 2015).

The IRI is no average of heights. It passes waves from about 1.2 to 30 m and is deaf to much shorter and longer ones;
its gain peaks near 0.065 cycles per metre, where the body bounces, and near 0.42, where the wheel hops (the
dissertation has these two the wrong way round).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.roads.golden_car import STANDARD_SPEED_MPS, TIRE_BASE_M
from logger.vehicle.frequency_response import frequency_response
from logger.vehicle.quarter_car import GOLDEN_CAR, structure
from logger.vehicle.structure import suspension_travel

Array = npt.NDArray[np.float64]


def slope_gain(wave_number_cpm: npt.ArrayLike, tire_base_m: float = TIRE_BASE_M) -> Array:
    """Amplitude of the suspension's slope z_s' - z_u' per amplitude of the road's slope, for a sinusoidal road.

    wave_number_cpm    (n,) [cycles per metre]; tire_base_m [m] of the moving average, 0 for a tire that touches in
    a point. Fig 2.13; the Golden Car at 80 km/h as a continuous system, so for a finely sampled profile.
    """
    wave_number = np.asarray(wave_number_cpm, dtype=float)
    car = structure(GOLDEN_CAR)
    travel = frequency_response(car, [suspension_travel(car, 0)], wave_number * STANDARD_SPEED_MPS)[..., 0, 0]
    return np.abs(travel * np.sinc(wave_number * tire_base_m))


def sinusoid_iri(amplitude_m: npt.ArrayLike, wave_number_cpm: npt.ArrayLike) -> Array:
    """IRI [m/km] of an endless sinusoidal road of this amplitude [m] and wave number [cycles per metre].

    The mean of a rectified sine is 2 / pi of its amplitude, and the road's slope has 2 pi n times that of its height.
    """
    wave_number = np.asarray(wave_number_cpm, dtype=float)
    return 4000.0 * wave_number * np.asarray(amplitude_m, dtype=float) * slope_gain(wave_number)
