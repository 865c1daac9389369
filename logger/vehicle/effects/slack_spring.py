"""A string, a cable or a mount that nothing holds down: it pulls, or carries, one way only.

Spring and damper together give up no more than the load L that they carry at rest: beyond the force on the body is
min(k x + c x', L), with x the extension from rest. A mass that hangs on a string falls freely while it is slack, one
that stands on a spring hops.
"""

import numpy as np

from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Sought, Values
from logger.vehicle.laws import CornerLaws


class SlackSpring(ForceEffect):
    title = "a string or a spring that goes slack"
    parameters = (
        Parameter("slack_extension_m", 0.02, 1e-4, 1.0, float("inf"), Scale.RECIPROCAL, (0.005, 0.02, 0.06),
                  "extension from rest at which it is slack: its load at rest over its stiffness"),
        AXLE,
    )
    source = "A. C. Lazer, P. J. McKenna, SIAM Review 32 (1990) 537: a string that resists only being stretched"
    signature = "strong motions swing farther to one side, and more slowly than weak ones"
    shown_by = "move it by more than its load stretches it"
    sought = Sought.ON_RIGS
    needs_spring = True

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        slack_m, stiffness, damping = p.slack_extension_m, laws.stiffness_n_per_m, laws.damping_n_s_per_m
        return laws.with_force(lambda travel_m, rate_mps: -np.maximum(
            stiffness * (travel_m - slack_m) + damping * rate_mps, 0.0))


EFFECT = SlackSpring()
