"""A spring with play in its seat, in a bushing or in a joint: within a gap either way from rest it answers nothing.

F = k (x - g) beyond a gap g in extension, k (x + g) in compression, 0 between: what the linear spring would have
answered within the gap, k times the travel clipped to it, is taken away. A damper beside it has no play, unless a bolt
holds both: then there is no force within the gap, and beyond it none that pulls back,

    F = max(k (x - g) + c x', 0) + min(k (x + g) + c x', 0)

which leaves out how the spring gives way to the damper within the gap, in c / k. A spring that a car's weight presses
into its seat has no play.
"""

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Sought, Values
from logger.vehicle.laws import CornerLaws


class Play(ForceEffect):
    title = "play of the springs: in a seat, a bushing or a joint"
    parameters = (
        Parameter("half_gap_m", 0.0005, 0.0, 0.02, 0.0, Scale.LINEAR, (0.0002, 0.0008, 0.003),
                  "travel from the middle in each direction, within which the spring exerts no force"),
        Parameter("damper_plays", 0.0, 0.0, 1.0, None, Scale.LINEAR, (0.0, 1.0),
                  "whether one joint holds spring and damper (1), or the spring alone (0)", choices=(0.0, 1.0),
                  default=0.0),
        AXLE,
    )
    source = "M. Nordin, P.-O. Gutman, Automatica 38 (2002) 1633: mechanical systems with backlash, dead zone"
    signature = "small motions meet no spring, and resonances rise in frequency with the motion"
    shown_by = "move it by little more than the gap, and by many times that"
    sought = Sought.ON_RIGS
    needs_spring = True

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        gap_m, stiffness = p.half_gap_m, laws.stiffness_n_per_m
        if gap_m * stiffness == 0:
            return laws
        if not p.damper_plays:
            return laws.with_spring(lambda travel_m: -stiffness * np.clip(travel_m, -gap_m, gap_m))
        damping, gap_n = laws.damping_n_s_per_m, stiffness * gap_m

        def loose(travel_m: Array, rate_mps: Array) -> Array:
            tight = stiffness * travel_m + damping * rate_mps
            return np.asarray(-np.clip(tight, -gap_n, gap_n))

        return laws.with_force(loose)


EFFECT = Play()
