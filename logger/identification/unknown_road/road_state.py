"""Numbers of a car, a road and the drives over it: their names, how they are asked for, and the road's spectrum.

The prior of a road is that of ISO 8608, Gd(n0) (n / n0)^-w, flat below the longest waves. Its level is counted at a
pivot where a car is shaken, so that level and waviness can be separated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from logger.estimation.road_spectrum import FLATTENED_BELOW_CPM, PIVOT_CPM
from logger.roads.iso8608 import CM3_M3, REFERENCE_N0_CPM, STANDARD_WAVINESS
from logger.vehicle.named_parameters import Free

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

GD_N0, WAVINESS, NOISE, OFFSET, SCALE = "gd_n0_cm3", "waviness", "noise_mps2", "place_offset_m", "distance_scale"
HUNDREDTH = 0.01
"""A scale of distances moves by hundredths."""


class ResponseCar(Protocol):
    """A car as far as it is known here."""

    @property
    def parameters(self) -> Sequence[Free]: ...

    @property
    def behind_m(self) -> Array:
        """(x,) how far behind the front one each axle stands [m]."""

    @property
    def contact_patch_m(self) -> float: ...

    def responses(self, values: Array, f_hz: Array) -> tuple[Complex, Complex]:
        """Readings per elevation under each axle (x, f) with these values (p,), and their derivatives (p, x, f)."""


@dataclass(frozen=True)
class Options:
    """How to fit.

    waviness         of every road, or where it starts
    free_waviness    find it, one for each road
    place_off_m      how far the places of two drives over one road may be off; 0: they are exact
    scale_off        how far their distances may be off beyond that, as a share; 0: they are exact
    probes           simulated drives that slopes are compared with on the way
    last_probes      and at the end, where what they have in common is an error of the estimate
    seed             of them
    most_steps       of Fisher's
    solved           what is left of a set of equations when it counts as solved, of what it began with
    fisher_probes    simulated drives that the information is a mean over
    refuse           raise NotIdentifiable; otherwise ``RoadFit.verdict`` says it
    """

    waviness: float = STANDARD_WAVINESS
    free_waviness: bool = False
    place_off_m: float = 3.0
    probes: int = 10
    seed: int = 1
    most_steps: int = 30
    solved: float = 3e-4
    fisher_probes: int = 2
    refuse: bool = True
    scale_off: float = 0.0
    last_probes: int = 40


@dataclass(frozen=True, eq=False)
class RoadState:
    """Numbers of a car and a road in plain units; the level is the logarithm of Gd at the pivot, in units of 1 cm3 at
    n0, and the scales those of the drives' distances, 1 if none are given."""

    values: Array
    level: float
    waviness: float
    offsets_m: Array
    noise_mps2: float
    scales: Array | None = None


def displacement_psd_m3(level: float, waviness: float, wave_number_cpm: Array) -> Array:
    """Spectrum (k,) [m3] of a road whose level is given as in ``RoadState``; nothing at the first wave number, 0."""
    psd = np.exp(level) * CM3_M3 * (np.maximum(wave_number_cpm, FLATTENED_BELOW_CPM) / PIVOT_CPM) ** -waviness
    psd[0] = 0.0
    return np.asarray(psd)


def by_waviness(wave_number_cpm: Array) -> Array:
    """Derivative (k,) of the logarithm of the spectrum by the waviness."""
    return np.asarray(-np.log(np.maximum(wave_number_cpm, FLATTENED_BELOW_CPM) / PIVOT_CPM))


def at_n0(waviness: float) -> float:
    """Gd at n0 over Gd at the pivot."""
    return float((REFERENCE_N0_CPM / PIVOT_CPM) ** -waviness)
