"""Units in which a table is printed for a person: SI, or those of road agencies in the US."""

from __future__ import annotations

from dataclasses import dataclass

from logger.units import FOOT_M, INCH_PER_MILE_M_PER_KM, KMH_MPS, MILE_M, MPH_MPS


@dataclass(frozen=True)
class DisplayUnits:
    """Name and SI value of each unit, and decimals that are printed.

    length    of sections and where they lie
    place     of what is shorter than a section
    way       of a whole drive
    """

    length: tuple[str, float]
    length_decimals: int
    place: tuple[str, float]
    place_decimals: int
    iri: tuple[str, float]
    iri_decimals: int
    speed: tuple[str, float]
    way: tuple[str, float]


UNITS = {
    "si": DisplayUnits(("m", 1.0), 1, ("m", 1.0), 2, ("m/km", 1.0), 2, ("km/h", KMH_MPS), ("km", 1000.0)),
    "us": DisplayUnits(("mi", MILE_M), 3, ("ft", FOOT_M), 1, ("in/mi", INCH_PER_MILE_M_PER_KM), 0, ("mph", MPH_MPS),
                       ("mi", MILE_M)),
}
