"""What pushes a rig has no more force than it has: a coil, a motor or a valve saturates.

The command, or the current, was recorded as a force F; what acts is L tanh(F / L), which is F while it is small and no
more than L.
"""

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import ActuatorEffect, Parameter, Scale, Sought, Values


class ForceLimit(ActuatorEffect):
    title = "a shaker, coil or motor that saturates"
    parameters = (
        Parameter("limit_n", 500.0, 1.0, 1e7, float("inf"), Scale.RECIPROCAL, (100.0, 500.0, 2500.0),
                  "largest force that acts, of each recorded force"),
    )
    source = "K. J. Astrom, L. Rundqwist, Proc. American Control Conference (1989) 1693: actuators that saturate"
    signature = "strong pushes move it less, in proportion, than weak ones, at all frequencies"
    shown_by = "push it weakly and strongly with the same motion"
    sought = Sought.ON_RIGS

    def force(self, p: Values, rate_hz: float, force_n: Array) -> Array:
        return np.asarray(p.limit_n * np.tanh(force_n / p.limit_n))


EFFECT = ForceLimit()
