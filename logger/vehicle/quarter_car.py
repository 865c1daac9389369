"""The quarter car: a body on one wheel (Eq 4.3 to 4.9 of Blum 2015)."""

from __future__ import annotations

import numpy as np

from logger.vehicle.structure import Structure
from logger.vehicle.vehicle import Axle, Vehicle

# The reference car of the IRI (ASTM E1926; Sayers 1995; Table 4.1), all values per kilogram of sprung mass.
GOLDEN_CAR = Vehicle("golden-car", "quarter_car", 1.0, None, Axle(0.0, 0.15, 63.3, 6.0, 653.0), None, 0.25)


def structure(vehicle: Vehicle) -> Structure:
    """Matrices of a quarter car; degrees of freedom: body, wheel."""
    k = vehicle.front.suspension_stiffness_n_per_m
    c = vehicle.front.suspension_damping_n_s_per_m
    kt = vehicle.front.tire_stiffness_n_per_m
    return Structure(
        mass=np.diag([vehicle.sprung_mass_kg, vehicle.front.unsprung_mass_kg]),
        damping=np.array([[c, -c], [-c, c]]),
        stiffness=np.array([[k, -k], [-k, k + kt]]),
        road=np.array([[0.0], [kt]]),
        behind_m=np.zeros(1),
        contact_patch_m=vehicle.contact_patch_m,
    )
