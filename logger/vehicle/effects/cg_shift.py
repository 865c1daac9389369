"""The centre of gravity sits ahead of where the model puts it, or behind.

The axles stay where they are, and so does the sensor, so that all of them come to lie farther back from it. A shift
beyond an axle is applied as well, so that a fit may pass there; ``check_on`` refuses it where somebody asks for it.
"""

from dataclasses import replace

from logger.vehicle.effect import Parameter, Scale, Values, VehicleEffect
from logger.vehicle.vehicle import Vehicle


class CgShift(VehicleEffect):
    title = "the centre of gravity lies ahead of the model's, or behind it"
    parameters = (
        Parameter("shift_m", 0.15, -1.0, 1.0, 0.0, Scale.LINEAR, (-0.15, -0.03, 0.03, 0.15),
                  "ahead positive, behind negative", step=1e-3),
    )
    needs_wheel = True
    source = "rigid-body mechanics (Eq 4.12 of Blum 2015 with other distances)"
    signature = "one axle shows more strongly in the record than in the model, the other one less"
    shown_by = "drive one bump at two speeds, or weigh the axles"

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        return "a quarter car has one axle" if vehicle.rear is None else None

    def vehicle(self, p: Values, vehicle: Vehicle) -> Vehicle:
        front, rear = vehicle.front, vehicle.rear
        assert rear is not None
        return replace(
            vehicle,
            front=replace(front, cg_distance_m=front.cg_distance_m - p.shift_m),
            rear=replace(rear, cg_distance_m=rear.cg_distance_m + p.shift_m),
            sensor=replace(vehicle.sensor, ahead_m=vehicle.sensor.ahead_m - p.shift_m),
        )


EFFECT = CgShift()
