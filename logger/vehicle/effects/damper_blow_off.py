"""Beyond a knee velocity the valves of a damper open, and its force grows more slowly: a digressive damper.

Up to the knee the force is that of the damper without it; beyond, what it would grow by is multiplied by a ratio. Each
direction has valves of its own: where these differ, the knee in rebound is the square root of a ratio times the knee
velocity and that in bump the knee velocity over that root, and so are the slopes beyond.

As valves open bit by bit, the knee of a damper alone on its bench may be round: at x times its rate the part that does
not go on beyond it is that of x / (1 + x^(1 / w))^w times its rate, with a roundness w; 0 is a corner, 1 a hyperbola.
(In a car such a knee at some mm/s would pass for friction that gives before it slides.)
"""

from dataclasses import replace

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Values
from logger.vehicle.laws import CornerLaws

_CORNER, _STILL = 1e-3, 1e-300
"""A roundness that is none, within a thousandth of the knee's rate; and a rate whose logarithm is finite."""


class DamperBlowOff(ForceEffect):
    title = "digressive dampers: beyond a knee velocity the slope falls"
    parameters: tuple[Parameter, ...] = (
        Parameter("knee_velocity_m_per_s", 0.15, 0.005, 2.0, None, Scale.LOG, (0.05, 0.12, 0.25, 0.5),
                  "suspension rate above which the slope is smaller"),
        Parameter("slope_ratio", 0.4, 0.0, 1.0, 1.0, Scale.LINEAR, (0.4,),
                  "slope beyond the knee over that before it"),
        Parameter("rebound_to_bump_knee_ratio", 1.0, 0.05, 20.0, None, Scale.LOG, (0.6, 1.7),
                  "knee velocity in rebound over that in bump", default=1.0),
        Parameter("rebound_to_bump_slope_ratio", 1.0, 0.05, 20.0, None, Scale.LOG, (1.0,),
                  "slope_ratio in rebound over that in bump", default=1.0),
        AXLE,
    )
    refinements: tuple[str, ...] = ("rebound_to_bump_knee_ratio", "rebound_to_bump_slope_ratio")
    source = "J. C. Dixon, The Shock Absorber Handbook (2007), chapter 6: digressive characteristics"
    signature = "the damping falls as the road gets rougher: strong motions ring longer than in the model"
    shown_by = "drive the same road slowly and fast, or a smooth and a rough one: the damping must differ"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return self._digressive(p, laws, 0.0)

    def _digressive(self, p: Values, laws: CornerLaws, round_by: float) -> CornerLaws:
        damper, knee, slope = laws.damper, p.knee_velocity_m_per_s, p.slope_ratio
        uneven_knee, uneven_slope = (np.sqrt(one) for one in (p.rebound_to_bump_knee_ratio,
                                                              p.rebound_to_bump_slope_ratio))

        def digressive(rate_mps: Array) -> Array:
            inner = np.clip(rate_mps, -knee / uneven_knee, knee * uneven_knee)
            if round_by > _CORNER:
                at = np.where(rate_mps > 0, knee * uneven_knee, knee / uneven_knee)
                over = np.log(np.abs(rate_mps) / at + _STILL)
                inner = rate_mps * np.exp(-round_by * np.logaddexp(0.0, over / round_by))
            beyond = slope * np.where(rate_mps > 0, uneven_slope, 1 / uneven_slope)
            return damper(inner) + beyond * (damper(rate_mps) - damper(inner))

        return replace(laws, damper=digressive)


class _OfPart(DamperBlowOff):
    parameters = (*DamperBlowOff.parameters, Parameter(
        "knee_roundness_ratio", 0.3, 0.0, 3.0, None, Scale.LINEAR, (0.5,),
        "0: the slope falls at once; 1: with the whole rate, as a hyperbola", default=0.0, step=0.01))
    refinements = (*DamperBlowOff.refinements, "knee_roundness_ratio")

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return self._digressive(p, laws, p.knee_roundness_ratio)


EFFECT = DamperBlowOff()
EFFECT.variants = {"component": _OfPart()}
