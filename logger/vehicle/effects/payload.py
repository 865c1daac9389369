"""More on the springs than the model says: luggage, fuel, people on firm seats. It lies at the centre of gravity.

In a half car it is the load of one side, as all its masses are: half of what the car carries. Of a part on its bench
it is what hangs between the load cell and the part, and the fluid that it sets in motion: a force in phase with the
acceleration.
"""

from dataclasses import replace

from logger.vehicle.effect import Parameter, Scale, Values, VehicleEffect
from logger.vehicle.vehicle import Vehicle, with_load


class Payload(VehicleEffect):
    title = "more sprung mass than the model says"
    parameters = (
        Parameter("mass_kg", 80.0, 0.0, 5000.0, 0.0, Scale.LINEAR, (10.0, 60.0, 200.0),
                  "beyond the model's sprung mass; in a half car on one side"),
    )
    source = "Newton's second law; 4.4 of Blum 2015 finds the sprung mass from a bump"
    signature = "the body bounces more slowly and shakes less above its bounce frequency, on every road"
    shown_by = "drive a road with long waves, or weigh the car"
    needs_body = True

    def vehicle(self, p: Values, vehicle: Vehicle) -> Vehicle:
        return with_load(vehicle, p.mass_kg)


class _OfPart(Payload):
    title = "a mass that is moved with the part: its fixture, the load cell's own, or fluid"
    # Where a car weighs hundreds of kilograms, the fixture of a bench of the same forces weighs some.
    parameters = (replace(Payload.parameters[0], start=1.0, trials=(0.1, 1.0, 10.0),
                          meaning="of what moves with the part"),)
    signature = "a force in phase with the acceleration, which grows with the square of the frequency"
    shown_by = "move it at higher frequencies, or the fixture alone"
    needs_body = False

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        return "its mass is a parameter of its file" if vehicle.sprung_mass_kg else None


EFFECT = Payload()
EFFECT.variants = {"component": _OfPart()}
