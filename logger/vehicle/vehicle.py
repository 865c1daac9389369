"""What a car is to the models: masses, springs and dampers, as numbers and nothing else."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Axle:
    """One end of the car, for one side of it (one wheel, one spring, one damper).

    cg_distance_m                    from the centre of gravity to the axle, along the car, positive [m]
    unsprung_mass_kg                 wheel, hub and what moves with them [kg]
    suspension_stiffness_n_per_m     [N/m]
    suspension_damping_n_s_per_m     [N s/m]
    tire_stiffness_n_per_m           [N/m]
    """

    cg_distance_m: float
    unsprung_mass_kg: float
    suspension_stiffness_n_per_m: float
    suspension_damping_n_s_per_m: float
    tire_stiffness_n_per_m: float


@dataclass(frozen=True)
class Vehicle:
    """A car as the model named ``model`` sees it (Tables 4.1 and 4.2 of Blum 2015 are two of them).

    A half car carries the sprung mass of one side on two axles. A quarter car carries it on ``front`` alone and
    has neither pitch inertia nor a rear axle: both are None.

    sprung_mass_kg         [kg]
    pitch_inertia_kg_m2    about the centre of gravity [kg m2]
    contact_patch_m        length over which a tire averages the road [m]
    """

    name: str
    model: str
    sprung_mass_kg: float
    pitch_inertia_kg_m2: float | None
    front: Axle
    rear: Axle | None
    contact_patch_m: float
