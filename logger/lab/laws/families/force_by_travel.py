"""A force in the suspensions by their travel: a spring that is no straight line.

A power of the travel, or a smooth curve through points, which may differ in compression and extension (stops).
"""

from __future__ import annotations

from logger.lab.laws.curves import TRAVEL, CurveFamily
from logger.lab.laws.draft import LawContext

_SHARE = 0.3  # of the spring's own force


class ForceByTravel(CurveFamily):
    title = "a force by the travel of the suspensions"
    related_effects = ("progressive_spring", "bump_stop")
    shown_by = "drive a rough road, or over obstacles, so that the suspension travels far"
    motion = TRAVEL
    force = "spring force"
    source = "J. Reimpell, H. Stoll, J. W. Betzler, The Automotive Chassis (2001), chapter 5: springs, stops"
    signature = "large motions meet another spring than small ones"
    ends = ((0, "in deep compression"), (-1, "in extension"))

    def usual_force_n(self, context: LawContext, usual: float) -> float:
        return _SHARE * context.vehicle.front.suspension_stiffness_n_per_m * usual


FAMILY = ForceByTravel()
