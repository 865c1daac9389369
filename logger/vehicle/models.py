"""The models of a car by the names that vehicle files call them.

The quarter car is a body on one wheel (Eq 4.3 to 4.9 of Blum 2015); the half car one side of the body on a front and a
rear wheel (Eq 4.12 to 4.35). The dissertation's Eq 4.23 to 4.25 carry wrong signs in the pitch row; here everything
follows from M, C and K of Eq 4.12 (its Appendix A.2), which do not.

A half car sees one track and knows nothing of the other, but the two tracks of a road differ and tilt the car. The full
car adds roll: the half car's equations with a second side, and an anti-roll bar on each axle, which resists only what
the two suspensions of the axle do against each other. With x the extension of a suspension and b the track width, the
axle rolls against the body by (x_left - x_right) / b, and the bar stores 1/2 k ((x_left - x_right) / b)^2.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from logger.vehicle.structure import Corner, Structure, assemble, mass_on_base
from logger.vehicle.vehicle import Axle, Vehicle

# The reference car of the IRI (ASTM E1926; Sayers 1995; Table 4.1), all values per kilogram of sprung mass.
GOLDEN_CAR = Vehicle("golden-car", "quarter_car", 1.0, None, Axle(0.0, 0.15, 63.3, 6.0, 653.0), None, 0.25)


def quarter_car(vehicle: Vehicle) -> Structure:
    """Matrices of a quarter car; degrees of freedom: body, wheel."""
    return assemble([vehicle.sprung_mass_kg], [Corner(vehicle.front, 0.0, 0.0)], vehicle.contact_patch_m)


def half_car(vehicle: Vehicle) -> Structure:
    """Matrices of a half car; degrees of freedom: body, pitch (nose up), front wheel, rear wheel.

    ValueError if the vehicle has no rear axle or no pitch inertia.
    """
    front, rear = vehicle.front, vehicle.rear
    if rear is None or vehicle.pitch_inertia_kg_m2 is None:
        raise ValueError(f"{vehicle.name}: a half car needs a rear axle and a pitch inertia")
    corners = [Corner(front, front.cg_distance_m, 0.0), Corner(rear, -rear.cg_distance_m, 0.0)]
    return assemble([vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2], corners, vehicle.contact_patch_m)


def full_car(vehicle: Vehicle) -> Structure:
    """Matrices of a full car.

    Degrees of freedom: body, pitch (nose up), roll (left side up), wheels front left, front right, rear left, rear
    right. ValueError if the vehicle has no rear axle, inertia of pitch or roll, or track width.
    """
    front, rear, track_m = vehicle.front, vehicle.rear, vehicle.track_width_m
    if rear is None or track_m is None or vehicle.pitch_inertia_kg_m2 is None or vehicle.roll_inertia_kg_m2 is None:
        raise ValueError(f"{vehicle.name}: a full car needs a rear axle, pitch and roll inertias and a track width")
    ends = ((front, front.cg_distance_m), (rear, -rear.cg_distance_m))
    independent = assemble(
        [vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2, vehicle.roll_inertia_kg_m2],
        [Corner(axle, ahead_m, side * track_m / 2) for axle, ahead_m in ends for side in (1, -1)],
        vehicle.contact_patch_m,
    )
    axle_roll = (independent.travel[[0, 2]] - independent.travel[[1, 3]]) / track_m
    bars = np.diag([front.anti_roll_stiffness_n_m_per_rad, rear.anti_roll_stiffness_n_m_per_rad])
    return replace(independent, stiffness=independent.stiffness + axle_roll.T @ bars @ axle_roll)


def single_mass(vehicle: Vehicle) -> Structure:
    """Matrices of a mass on a spring and a damper on a base; one degree of freedom, its place over the base."""
    front = vehicle.front
    return mass_on_base(vehicle.sprung_mass_kg, front.suspension_stiffness_n_per_m, front.suspension_damping_n_s_per_m)


def component(vehicle: Vehicle) -> Structure:
    """Matrices of a part alone on its bench, which moves it."""
    return replace(single_mass(vehicle), held=True, springs=np.zeros(1))  # nothing rests on it


MODELS = {"single_mass": single_mass, "component": component, "quarter_car": quarter_car, "half_car": half_car,
          "full_car": full_car}


@lru_cache(maxsize=16)  # effects of laws and sensors leave it as it is
def structure_of(vehicle: Vehicle) -> Structure:
    """The matrices of a vehicle by the model it names. ValueError if it lacks what its model needs."""
    return MODELS[vehicle.model](vehicle)
