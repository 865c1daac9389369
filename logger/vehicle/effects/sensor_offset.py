"""A sensor ahead of the centre of gravity, or behind it, rises and falls with the pitch of the body.

Its acceleration is z'' + x theta'', nose up positive, with x ahead of the centre of gravity.
"""

from dataclasses import replace

from logger.vehicle.effect import Parameter, Scale, Values, VehicleEffect
from logger.vehicle.vehicle import Vehicle


class SensorOffset(VehicleEffect):
    title = "the sensor sits ahead of the centre of gravity, or behind it, and feels pitch"
    parameters = (
        Parameter("offset_m", 0.3, -3.0, 3.0, 0.0, Scale.LINEAR, (-0.3, 0.3),
                  "from the centre of gravity, ahead positive, behind negative"),
    )
    needs_wheel = True
    source = "rigid-body kinematics; the sensitivities of 4.4 of Blum 2015 are for a sensor at the centre of gravity"
    signature = "the record contains pitch: more motion where front and rear move against each other"
    shown_by = "drive one bump at two speeds: the peaks of front and rear axle are out of proportion"
    stage = 2

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        return "a quarter car does not pitch" if vehicle.rear is None else None

    def vehicle(self, p: Values, vehicle: Vehicle) -> Vehicle:
        return replace(vehicle, sensor=replace(vehicle.sensor, ahead_m=p.offset_m))


EFFECT = SensorOffset()
