"""Words for an IRI: which roads have it (Table 2.3 of Blum 2015) and how they ride (Table 2.4; ASTM E1926).

Table 2.3 gives ranges that overlap on purpose: an old pavement may be as smooth as a new one. So a value has every
kind of road whose range holds it, and none below or above all of them. Table 2.4 writes its descriptions along a
scale from 0 to 12 m/km; here each one holds from the mark it stands at (the first from 0) to that of the next.
"""

from __future__ import annotations

from logger.units import INCH_PER_MILE_M_PER_KM

# Lowest and highest IRI [m/km] and the kind of road.
ROAD_RANGES = (
    (0.25, 1.75, "airport runways and superhighways"),
    (1.50, 3.25, "new pavements"),
    (2.25, 5.75, "older pavements"),
    (3.25, 10.00, "maintained unpaved roads"),
    (4.00, 10.75, "damaged pavements"),
    (8.00, 20.00, "rough unpaved roads"),
)

# From which IRI [m/km], and how a paved road of it rides.
RIDES = (
    (0.0, "comfortable above 120 km/h; no potholes or corrugations to notice"),
    (4.0, "comfortable up to 100-120 km/h; movements felt at 80 km/h, some dips, patches or shallow potholes"),
    (6.0, "comfortable up to 70-90 km/h; strong movements and swaying, frequent dips or patches, some potholes"),
    (8.0, "comfortable up to 50-60 km/h; frequent sharp movements, deep dips and frequent potholes"),
    (10.0, "too rough for 50 km/h; many deep dips and potholes, surface breaking up"),
)

# Where good ends and how far fair reaches: 23 CFR 490.313 (b)(1), of the Interstate and National Highway System.
GOOD_BELOW_IN_PER_MI, FAIR_TO_IN_PER_MI = 95.0, 170.0
FEDERAL_WORDS = ("good", "fair", "poor")


def federal_condition(iri_m_per_km: float) -> str:
    """Good, fair or poor by the IRI of a section of 0.1 mi (23 CFR 490.313: below 95 in/mi, up to 170, above)."""
    in_per_mi = iri_m_per_km / INCH_PER_MILE_M_PER_KM
    if in_per_mi < GOOD_BELOW_IN_PER_MI:
        return "good"
    return "fair" if in_per_mi <= FAIR_TO_IN_PER_MI else "poor"


def road_kinds(iri_m_per_km: float) -> tuple[str, ...]:
    """The kinds of road that usually have this IRI [m/km], smoothest first; none outside every range."""
    return tuple(kind for lowest, highest, kind in ROAD_RANGES if lowest <= iri_m_per_km <= highest)


def ride_words(iri_m_per_km: float) -> str:
    """How a paved road of this IRI [m/km] rides. ValueError for a negative value or NaN."""
    if not iri_m_per_km >= 0:
        raise ValueError(f"an IRI is 0 or more, not {iri_m_per_km}")
    return next(words for lowest, words in reversed(RIDES) if iri_m_per_km >= lowest)
