"""The two tracks of a road differ, and a whole car rides on both.

The half car becomes a full one: twice its masses on four wheels, the left ones on ``elevation_m`` and the right ones on
``elevation_right_m``, with the roll of the body between them.
"""

from dataclasses import replace

from logger.vehicle.effect import Parameter, Scale, Values, VehicleEffect
from logger.vehicle.vehicle import Vehicle


class Roll(VehicleEffect):
    title = "left and right tracks differ: a full car"
    parameters = (
        Parameter("track_width_m", 1.5, 0.5, 3.0, None, Scale.LOG, (1.5,), "from left to right wheels"),
        Parameter("roll_inertia_kg_m2", 500.0, 20.0, 20000.0, None, Scale.LOG, (500.0,),
                  "of the whole body, about its length"),
    )
    needs_wheel = True
    source = "the full car of the models; 4.1 of Blum 2015 leaves it out"
    signature = "much of the motion does not follow the left track, most of all on short waves"
    shown_by = "measure both tracks, and drive with the sensor off the centre line as well"
    needs_road = True
    stage = 9

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        if vehicle.model != "half_car":
            return f"a {vehicle.model.replace('_', ' ')} cannot become a full car; it needs a half car"
        return None if two_tracks else "the profile has one track; it needs elevation_right_m"

    def vehicle(self, p: Values, vehicle: Vehicle) -> Vehicle:
        assert vehicle.pitch_inertia_kg_m2 is not None
        return replace(
            vehicle,
            model="full_car",
            sprung_mass_kg=2 * vehicle.sprung_mass_kg,
            pitch_inertia_kg_m2=2 * vehicle.pitch_inertia_kg_m2,
            roll_inertia_kg_m2=p.roll_inertia_kg_m2,
            track_width_m=p.track_width_m,
        )


EFFECT = Roll()
