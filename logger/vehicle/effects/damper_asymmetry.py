"""Dampers resist rebound (extension) more than bump (compression), so that a wheel is not thrown up but held back.

With r the ratio of the two slopes and their mean kept, rebound has 2 r / (1 + r) and bump 2 / (1 + r) of the mean.
"""

from dataclasses import replace

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Values
from logger.vehicle.laws import CornerLaws


class DamperAsymmetry(ForceEffect):
    title = "rebound damping differs from bump damping"
    parameters = (
        Parameter("rebound_to_bump_ratio", 1.5, 0.1, 10.0, 1.0, Scale.LOG, (0.67, 1.5, 3.0),
                  "slope of the damper in extension over that in compression; their mean stays the same"),
        AXLE,
    )
    source = "J. C. Dixon, The Shock Absorber Handbook (2007), chapter 1: ratios of 2 to 3 are usual"
    signature = "the body sits lower while it shakes; upward and downward peaks differ; second harmonics appear"
    shown_by = "drive single bumps and a rough road, so that the suspension moves fast in both directions"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        rebound = 2 * p.rebound_to_bump_ratio / (1 + p.rebound_to_bump_ratio)
        damper = laws.damper

        def uneven(rate_mps: Array) -> Array:
            return damper(rate_mps) * np.where(rate_mps > 0, rebound, 2 - rebound)

        return replace(laws, damper=uneven)


EFFECT = DamperAsymmetry()
