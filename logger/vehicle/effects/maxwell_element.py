"""Rubber creeps: beside the suspension's own spring and damper there is a spring and a damper in series (a branch of
Maxwell).

Both carry the force k z, with z the spring's stretch: z' = x' - z / T. Motions quicker than T meet the spring, slower
ones a damper of k T.

A search tries it on rigs, whose mounts are of rubber: without it a mount in series and a mass on a spring stand for it
together. Of a car it is tried when all others leave something unexplained.
"""

from typing import Any

from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Sought, Values
from logger.vehicle.laws import Between, CornerLaws, Seen


def force(p: Any, seen: Seen) -> Any:
    """In the suspension [N]."""
    return p.maxwell_stiffness_n_per_m * seen.memory[0]


def rates(p: Any, seen: Seen) -> tuple[Any]:
    """How fast the stretch grows [m/s]."""
    return (seen.rate_mps - seen.memory[0] / p.relaxation_time_s,)


class MaxwellElement(ForceEffect):
    title = "Maxwell element: rubber that creeps"
    parameters = (
        Parameter("maxwell_stiffness_n_per_m", 1e4, 0.0, 1e6, 0.0, Scale.LINEAR, (1e4,),
                  "of its spring, beside the suspension's own"),
        Parameter("relaxation_time_s", 0.1, 0.005, 5.0, None, Scale.LOG, (0.02, 0.07, 0.25),
                  "in which its force falls to 37 %"),
        AXLE,
    )
    source = ("J. C. Maxwell, Phil. Trans. R. Soc. 157 (1867) 49; for rubber: M. Berg, Vehicle System Dynamics 30 "
              "(1998) 197")
    signature = "the suspension is stiffer for quick motions than for slow ones"
    shown_by = "move it slowly and quickly: quick motions meet a stiffer spring than slow ones"
    sought = Sought.ON_RIGS
    sought_last = True

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        if p.maxwell_stiffness_n_per_m == 0:
            return laws
        return laws.with_law(Between.BODY_AND_WHEEL, force, p, rates, memory=(0.0,))


EFFECT = MaxwellElement()
