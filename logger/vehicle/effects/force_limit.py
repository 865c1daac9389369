"""What pushes a rig has no more force than it has: a coil, a motor or a valve saturates.

The command, or the current, was recorded as a force F; what acts is L tanh((F / L)^n)^(1 / n), which is F while it is
small and no more than L. In its plain form n is 1, as iron saturates; the larger it is, the sharper the limit, down to
the corner of an amplifier that clips.
"""

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import ActuatorEffect, Parameter, Scale, Sought, Values

_SMALLEST, _SATURATED = 1e-9, 20.0
"""Of which tanh is itself, and 1, in double precision."""


class ForceLimit(ActuatorEffect):
    title = "a shaker, coil or motor that saturates"
    parameters = (
        Parameter("limit_n", 500.0, 1.0, 1e7, float("inf"), Scale.RECIPROCAL, (100.0, 500.0, 2500.0),
                  "largest force that acts, of each recorded force"),
        Parameter("sharpness_ratio", 1.0, 0.5, 1000.0, None, Scale.LOG, (4.0,),
                  "exponent: the higher, the sharper the limit", default=1.0),
    )
    source = "K. J. Astrom, L. Rundqwist, Proc. American Control Conference (1989) 1693: actuators that saturate"
    signature = "the motion grows less than in proportion to the force, at all frequencies"
    shown_by = "push it weakly and strongly with the same motion"
    sought = Sought.ON_RIGS
    refinements = ("sharpness_ratio",)

    def force(self, p: Values, rate_hz: float, force_n: Array) -> Array:
        share = np.minimum(np.abs(force_n / p.limit_n), _SATURATED ** (1 / p.sharpness_ratio))
        power = np.maximum(share ** p.sharpness_ratio, _SMALLEST)  # of small forces it is 0 in double precision
        return np.asarray(p.limit_n * np.copysign(share * (np.tanh(power) / power) ** (1 / p.sharpness_ratio), force_n))


EFFECT = ForceLimit()
