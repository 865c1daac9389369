"""A tire averages the road over its contact patch, and the patch is not as long as the model says.

What lies under the patch is averaged evenly, so that waves as short as the patch vanish.
"""

from dataclasses import replace

from logger.vehicle.effect import Parameter, Scale, Values, VehicleEffect
from logger.vehicle.vehicle import Vehicle


class TireEnveloping(VehicleEffect):
    title = "a contact length other than the model's"
    parameters = (
        Parameter("contact_patch_m", 0.25, 0.0, 1.0, None, Scale.LINEAR, (0.03, 0.08, 0.14, 0.2, 0.28, 0.36, 0.5),
                  "over which a tire averages the road"),
    )
    needs_wheel = True
    source = "M. W. Sayers, S. M. Karamihas, The Little Book of Profiling (1998): a moving average of 0.25 m"
    signature = "at low speed, short waves are weaker or stronger than in the model; at high speed nothing changes"
    shown_by = "drive a rough road slowly, at 4 to 8 m/s"

    replaces = ("contact_patch_m",)
    needs_road = True

    def vehicle(self, p: Values, vehicle: Vehicle) -> Vehicle:
        return replace(vehicle, contact_patch_m=p.contact_patch_m)


EFFECT = TireEnveloping()
