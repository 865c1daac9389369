"""What kind of road a wheel track is: its spectrum's line, its exact IRI, and the IRI that such a line lets expect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.roads.elevation_spectrum import Roughness, classify
from logger.roads.gd_iri import Expected, iri_of_road
from logger.roads.iri import iri

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TrackClass:
    """One wheel track: its spectrum's line, its IRI [m/km], and the IRI that roads with such a line have."""

    roughness: Roughness
    iri_m_per_km: float
    expected: Expected


def track_class(elevation_m: Array, spacing_m: float, widest_step_m: float | None = None) -> TrackClass:
    """Classify a track (n,). Arguments and ValueError as in ``logger.roads.elevation_spectrum.classify``."""
    roughness = classify(elevation_m, spacing_m, widest_step_m)
    expected = iri_of_road(roughness.gd_n0_cm3, (len(elevation_m) - 1) * spacing_m, roughness.waviness)
    return TrackClass(roughness, iri(elevation_m, spacing_m), expected)
