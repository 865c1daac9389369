"""Beyond a knee velocity the valves of a damper open, and its force grows more slowly: a digressive damper.

Up to the knee the force is that of the damper without it; beyond, what it would grow by is multiplied by the ratio.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Values
from logger.vehicle.laws import CornerLaws


class DamperBlowOff(ForceEffect):
    title = "digressive dampers: beyond a knee velocity the slope falls"
    parameters = (
        Parameter("knee_velocity_m_per_s", 0.15, 0.005, 2.0, None, Scale.LOG, (0.05, 0.12, 0.25, 0.5),
                  "suspension rate above which the slope is smaller"),
        Parameter("slope_ratio", 0.4, 0.0, 1.0, 1.0, Scale.LINEAR, (0.4,),
                  "slope beyond the knee over that before it"),
        AXLE,
    )
    source = "J. C. Dixon, The Shock Absorber Handbook (2007), chapter 6: digressive characteristics"
    signature = "the damping falls as the road gets rougher: strong motions ring longer than in the model"
    shown_by = "drive the same road slowly and fast, or a smooth and a rough one: the damping must differ"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        damper, knee = laws.damper, p.knee_velocity_m_per_s

        def digressive(rate_mps: Array) -> Array:
            inner = np.clip(rate_mps, -knee, knee)
            return damper(inner) + p.slope_ratio * (damper(rate_mps) - damper(inner))

        return replace(laws, damper=digressive)


EFFECT = DamperBlowOff()
