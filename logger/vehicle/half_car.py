"""The half car: one side of the body on a front and a rear wheel (Eq 4.12 to 4.35 of Blum 2015).

The matrices are M, C and K of Eq 4.12. The dissertation's Eq 4.23 to 4.25 carry wrong signs in the pitch row;
here everything follows from M, C and K (its Appendix A.2), which do not.
"""

from __future__ import annotations

import numpy as np

from logger.vehicle.structure import Structure
from logger.vehicle.vehicle import Vehicle


def structure(vehicle: Vehicle) -> Structure:
    """Matrices of a half car; degrees of freedom: body, pitch (nose up), front wheel, rear wheel.

    ValueError if the vehicle has no rear axle or no pitch inertia.
    """
    front, rear = vehicle.front, vehicle.rear
    if rear is None or vehicle.pitch_inertia_kg_m2 is None:
        raise ValueError(f"{vehicle.name}: a half car needs a rear axle and a pitch inertia")
    l1, l2 = front.cg_distance_m, rear.cg_distance_m
    # Each row maps the coordinates to the compression of one suspension: body end (Eq 4.15, 4.16) minus wheel.
    travel = np.array([[1.0, l1, -1.0, 0.0], [1.0, -l2, 0.0, -1.0]])
    springs = np.diag([front.suspension_stiffness_n_per_m, rear.suspension_stiffness_n_per_m])
    dampers = np.diag([front.suspension_damping_n_s_per_m, rear.suspension_damping_n_s_per_m])
    tires = np.array([front.tire_stiffness_n_per_m, rear.tire_stiffness_n_per_m])
    road = np.vstack([np.zeros((2, 2)), np.diag(tires)])
    return Structure(
        mass=np.diag([
            vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2, front.unsprung_mass_kg, rear.unsprung_mass_kg,
        ]),
        damping=travel.T @ dampers @ travel,
        stiffness=travel.T @ springs @ travel + np.diag([0.0, 0.0, *tires]),
        road=road,
        behind_m=np.array([0.0, l1 + l2]),
        contact_patch_m=vehicle.contact_patch_m,
    )
