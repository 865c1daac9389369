"""More on the springs than the model says: luggage, fuel, people on firm seats. It lies at the centre of gravity.

In a half car it is the load of one side, as all its masses are: half of what the car carries.
"""

from __future__ import annotations

from logger.vehicle.effect import Parameter, Scale, Values, VehicleEffect
from logger.vehicle.vehicle import Vehicle, with_load


class Payload(VehicleEffect):
    title = "more sprung mass than the model says"
    parameters = (
        Parameter("mass_kg", 80.0, 0.0, 5000.0, 0.0, Scale.LINEAR, (10.0, 60.0, 200.0),
                  "beyond the model's sprung mass; in a half car on one side"),
    )
    source = "Newton's second law; 4.4 of Blum 2015 finds the sprung mass from a bump"
    signature = "the body bounces more slowly and shakes less above its bounce, on every road alike"
    shown_by = "drive a road with long waves, or weigh the car"
    needs_body = True

    def vehicle(self, p: Values, vehicle: Vehicle) -> Vehicle:
        return with_load(vehicle, p.mass_kg)


EFFECT = Payload()
