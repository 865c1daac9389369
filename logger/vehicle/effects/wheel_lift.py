"""A tire pushes and cannot pull: where the road falls away faster than the wheel follows, contact is lost.

The tire's whole force, its static load included, is never below 0. The static loads follow from the weights.
"""

from dataclasses import replace

from logger.vehicle.effect import ForceEffect, Values
from logger.vehicle.laws import CornerLaws


class WheelLift(ForceEffect):
    title = "a tire cannot pull: contact is lost when its force reaches zero"
    needs_wheel = True
    source = "M. Mitschke, H. Wallentowitz, Dynamik der Kraftfahrzeuge (2014), chapter on wheel loads"
    signature = "after hard edges the wheel lands late, and the body falls freely until then"
    shown_by = "drive over a sharp bump or a rough road so fast that a wheel leaves the ground"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return replace(laws, tire_pulls=False)


EFFECT = WheelLift()
