"""The models of a car by the names that vehicle files call them."""

from __future__ import annotations

from logger.vehicle import full_car, half_car, quarter_car
from logger.vehicle.structure import Structure
from logger.vehicle.vehicle import Vehicle

MODELS = {"quarter_car": quarter_car.structure, "half_car": half_car.structure, "full_car": full_car.structure}


def structure_of(vehicle: Vehicle) -> Structure:
    """The matrices of a vehicle by the model it names. ValueError if it lacks what its model needs."""
    return MODELS[vehicle.model](vehicle)
