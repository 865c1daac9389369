"""Oil through an orifice, and air, resist by the square of the rate: beside c v a damper has d v |v|.

A sail or a paddle on a rig's body drags on still air or water: there v is how fast the body rises against the ground.
"""

from typing import Any

import numpy as np

from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Sought, Values
from logger.vehicle.laws import Between, CornerLaws, Seen


def drag_n(p: Any, seen: Seen) -> Any:
    """Of the body against the ground [N]."""
    return p.body_drag_n_s2_per_m2 * seen.body_mps * np.abs(seen.body_mps)


class OrificeDamping(ForceEffect):
    title = "damping that grows with the square of the rate: an orifice, or air"
    parameters = (
        Parameter("quadratic_damping_n_s2_per_m2", 2000.0, 0.0, 2e4, 0.0, Scale.LINEAR, (500.0, 4000.0),
                  "force over the square of the suspension's rate"),
        Parameter("body_drag_n_s2_per_m2", 10.0, 0.0, 2e4, None, Scale.LINEAR, (10.0,),
                  "on a rig: of a sail on the body, at each suspension, over the square of how fast that rises against "
                  "the ground", default=0.0),
        AXLE,
    )
    refinements = terms = also_by = ("body_drag_n_s2_per_m2",)
    source = "J. C. Dixon, The Shock Absorber Handbook (2007), chapter 5: flow through an orifice"
    signature = "the damping grows with the motion: strong motions die away faster than weak ones"
    shown_by = "move it weakly and strongly at the same frequency"
    sought = Sought.ON_RIGS
    sought_last = True

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        damped = laws.with_damper(lambda rate_mps: p.quadratic_damping_n_s2_per_m2 * rate_mps * np.abs(rate_mps))
        return damped.with_law(Between.BODY_AND_GROUND, drag_n, p) if p.body_drag_n_s2_per_m2 else damped


EFFECT = OrificeDamping()
