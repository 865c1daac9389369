"""Oil through an orifice, and air, resist by the square of the rate: beside c v a damper has d v |v|."""

import numpy as np

from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Sought, Values
from logger.vehicle.laws import CornerLaws


class OrificeDamping(ForceEffect):
    title = "dampers whose force grows with the square of the rate: an orifice, or air"
    parameters = (
        Parameter("quadratic_damping_n_s2_per_m2", 2000.0, 0.0, 2e4, 0.0, Scale.LINEAR, (500.0, 4000.0),
                  "force over the square of the suspension's rate"),
        AXLE,
    )
    source = "J. C. Dixon, The Shock Absorber Handbook (2007), chapter 5: flow through an orifice"
    signature = "the damping grows with the motion: strong motions die away faster than weak ones"
    shown_by = "move it weakly and strongly at the same frequency"
    sought = Sought.ON_RIGS
    sought_last = True

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return laws.with_damper(lambda rate_mps: p.quadratic_damping_n_s2_per_m2 * rate_mps * np.abs(rate_mps))


EFFECT = OrificeDamping()
