"""The half car: one side of the body on a front and a rear wheel (Eq 4.12 to 4.35 of Blum 2015).

The matrices are M, C and K of Eq 4.12. The dissertation's Eq 4.23 to 4.25 carry wrong signs in the pitch row;
here everything follows from M, C and K (its Appendix A.2), which do not.
"""

from __future__ import annotations

from logger.vehicle.structure import Corner, Structure, assemble
from logger.vehicle.vehicle import Vehicle


def structure(vehicle: Vehicle) -> Structure:
    """Matrices of a half car; degrees of freedom: body, pitch (nose up), front wheel, rear wheel.

    ValueError if the vehicle has no rear axle or no pitch inertia.
    """
    front, rear = vehicle.front, vehicle.rear
    if rear is None or vehicle.pitch_inertia_kg_m2 is None:
        raise ValueError(f"{vehicle.name}: a half car needs a rear axle and a pitch inertia")
    corners = [Corner(front, front.cg_distance_m, 0.0), Corner(rear, -rear.cg_distance_m, 0.0)]
    return assemble([vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2], corners, vehicle.contact_patch_m)
