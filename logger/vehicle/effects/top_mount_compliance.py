"""A damper is held by rubber: quick motions press the rubber and never reach the damper.

The mount, a spring, stands in series with the damper: both carry the force F, and the suspension's rate is that of the
damper plus F' / k.
"""

from dataclasses import replace

from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Values
from logger.vehicle.laws import CornerLaws


class TopMountCompliance(ForceEffect):
    title = "a rubber mount in series with the damper"
    parameters = (
        Parameter("mount_stiffness_n_per_m", 2e5, 5e3, 1e8, float("inf"), Scale.RECIPROCAL, (6e4, 3e5, 1.5e6),
                  "of the mount"),
        AXLE,
    )
    source = "J. C. Maxwell's series of spring and damper; J. C. Dixon, The Shock Absorber Handbook (2007), chapter 1"
    signature = "the dampers seem weaker at wheel hop than at body bounce, and hop is at a slightly higher frequency"
    shown_by = "drive a rough road at several speeds, so that bounce and hop are both excited"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return replace(laws, mount_n_per_m=1 / (1 / laws.mount_n_per_m + 1 / p.mount_stiffness_n_per_m))


EFFECT = TopMountCompliance()
