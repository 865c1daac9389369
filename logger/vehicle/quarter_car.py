"""The quarter car: a body on one wheel (Eq 4.3 to 4.9 of Blum 2015)."""

from __future__ import annotations

from logger.vehicle.structure import Corner, Structure, assemble
from logger.vehicle.vehicle import Axle, Vehicle

# The reference car of the IRI (ASTM E1926; Sayers 1995; Table 4.1), all values per kilogram of sprung mass.
GOLDEN_CAR = Vehicle("golden-car", "quarter_car", 1.0, None, Axle(0.0, 0.15, 63.3, 6.0, 653.0), None, 0.25)


def structure(vehicle: Vehicle) -> Structure:
    """Matrices of a quarter car; degrees of freedom: body, wheel."""
    return assemble([vehicle.sprung_mass_kg], [Corner(vehicle.front, 0.0, 0.0)], vehicle.contact_patch_m)
