"""What a car is to the models: masses, springs, dampers and places, as numbers and nothing else."""

from dataclasses import dataclass, replace

GENERIC = "generic"
"""The vehicle that stands for a car that nobody has measured: the mean of published cars, with their spread."""


@dataclass(frozen=True)
class Axle:
    """One end of the car, for one side of it (one wheel, one spring, one damper).

    cg_distance_m                    from the centre of gravity to the axle, along the car, positive [m]
    unsprung_mass_kg                 wheel, hub and what moves with them [kg]
    suspension_stiffness_n_per_m     [N/m]
    suspension_damping_n_s_per_m     [N s/m]
    tire_stiffness_n_per_m           [N/m]
    anti_roll_stiffness_n_m_per_rad  moment of the axle's anti-roll bar per roll of the body against the axle [N m/rad];
                                     only a full car feels it
    """

    cg_distance_m: float
    unsprung_mass_kg: float
    suspension_stiffness_n_per_m: float
    suspension_damping_n_s_per_m: float
    tire_stiffness_n_per_m: float
    anti_roll_stiffness_n_m_per_rad: float = 0.0


@dataclass(frozen=True)
class SensorPlace:
    """Where on the body the accelerometer sits, from the centre of gravity: forward and to the left positive [m]."""

    ahead_m: float = 0.0
    left_m: float = 0.0


AT_CENTRE_OF_GRAVITY = SensorPlace()


OWN_NAMES = {"single_mass": {
    "mass_kg": "sprung_mass_kg", "stiffness_n_per_m": "front.suspension_stiffness_n_per_m",
    "damping_n_s_per_m": "front.suspension_damping_n_s_per_m"}}
OWN_NAMES["component"] = {**OWN_NAMES["single_mass"], "preload_n": "preload_n"}
"""What models that are no cars call their numbers, and where these stand in a ``Vehicle``."""


@dataclass(frozen=True)
class Vehicle:
    """A car as the model named ``model`` sees it (Tables 4.1 and 4.2 of Blum 2015 are two of them).

    A half car carries the sprung mass of one side on two axles. A quarter car carries it on ``front`` alone and
    has neither pitch inertia nor a rear axle: both are None. A full car has the sprung mass and the inertias of the
    whole car; its axles are still those of one side, so each stands for two equal wheels. Only a full car has a roll
    inertia and a track width. A single mass on a spring and a damper is the sprung mass with the suspension of
    ``front``, and has nothing else: no wheel, no tire. So has a component, a part alone on its bench that moves it and
    measures its force; its mass is of what moves.

    sprung_mass_kg         [kg]
    pitch_inertia_kg_m2    of the sprung mass, about its centre of gravity [kg m2]
    contact_patch_m        length over which a tire averages the road [m]
    roll_inertia_kg_m2     of the sprung mass, about its centre of gravity [kg m2]
    track_width_m          from the left wheels to the right ones [m]
    preload_n              what a component pulls back with at its rest [N]
    """

    name: str
    model: str
    sprung_mass_kg: float
    pitch_inertia_kg_m2: float | None
    front: Axle
    rear: Axle | None
    contact_patch_m: float
    roll_inertia_kg_m2: float | None = None
    track_width_m: float | None = None
    sensor: SensorPlace = AT_CENTRE_OF_GRAVITY
    preload_n: float = 0.0

    @property
    def is_part(self) -> bool:
        """Whether it is a part alone, whose motion its bench gives."""
        return self.model == "component"


def with_load(vehicle: Vehicle, extra_sprung_mass_kg: float) -> Vehicle:
    """The same car with more (or, negative, less) mass at its centre of gravity, such as people; inertias stay.

    For a half car this is the load on one side [kg].
    """
    return replace(vehicle, sprung_mass_kg=vehicle.sprung_mass_kg + extra_sprung_mass_kg)
