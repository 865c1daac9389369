"""A spring with play in its seat, in a bushing or in a joint: within a gap either way from rest it answers nothing.

F = k (x - g) beyond a gap g in extension, k (x + g) in compression, 0 between: what the linear spring would have
answered within the gap, k times the travel clipped to it, is taken away. The damper beside it has no play; for that
of dampers see the laws that ``learn`` tries. A spring that a car's weight presses into its seat has none.
"""

import numpy as np

from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Sought, Values
from logger.vehicle.laws import CornerLaws
from logger.vehicle.vehicle import Vehicle


class Play(ForceEffect):
    title = "play of the springs: in a seat, a bushing or a joint"
    parameters = (
        Parameter("half_gap_m", 0.0005, 0.0, 0.02, 0.0, Scale.LINEAR, (0.0002, 0.0008, 0.003),
                  "travel from the middle in each direction, within which the spring exerts no force"),
        AXLE,
    )
    source = "M. Nordin, P.-O. Gutman, Automatica 38 (2002) 1633: mechanical systems with backlash, dead zone"
    signature = "small motions meet no spring, and resonances rise in frequency with the motion"
    shown_by = "move it by little more than the gap, and by many times that"
    sought = Sought.ON_RIGS

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        axles = [one for one in (vehicle.front, vehicle.rear) if one is not None]
        return None if any(one.suspension_stiffness_n_per_m for one in axles) else "it needs a spring"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        gap_m, stiffness = p.half_gap_m, laws.stiffness_n_per_m
        if gap_m * stiffness == 0:
            return laws
        return laws.with_spring(lambda travel_m: -stiffness * np.clip(travel_m, -gap_m, gap_m))


EFFECT = Play()
