"""What a physical effect is made of, for one of your own (``docs/own-effect.md``):

    >>> from ridelog.effects import ForceEffect, Parameter, Scale

``ridelog.effects()`` still lists the effects that there are.
"""

import sys
from types import ModuleType

from logger.vehicle.effect import (
    AXLE,
    ActuatorEffect,
    BodyEffect,
    DriveEffect,
    Effect,
    ForceEffect,
    Parameter,
    RecordEffect,
    Recording,
    RoadEffect,
    Scale,
    SensorEffect,
    Sought,
    VehicleEffect,
)
from logger.vehicle.laws import Between, CornerLaws
from logger.vehicle.structure import Structure, hung
from logger.vehicle.vehicle import Vehicle

__all__ = [
    "AXLE",
    "ActuatorEffect",
    "Between",
    "BodyEffect",
    "CornerLaws",
    "DriveEffect",
    "Effect",
    "ForceEffect",
    "Parameter",
    "RecordEffect",
    "Recording",
    "RoadEffect",
    "Scale",
    "SensorEffect",
    "Sought",
    "Structure",
    "Vehicle",
    "VehicleEffect",
    "hung",
]


class _ListsEffects(ModuleType):
    """Python keeps this module as ``ridelog.effects``, where the function of that name would be."""

    def __call__(self) -> object:
        from logger.api.inputs import effects

        return effects()


sys.modules[__name__].__class__ = _ListsEffects
