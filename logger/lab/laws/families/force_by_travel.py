"""A force in the suspensions by their travel: a spring that is no straight line.

A power of the travel, or a smooth curve through points, which may differ in compression and extension (stops).
"""

from logger.lab.laws.curves import TRAVEL, CurveFamily


class ForceByTravel(CurveFamily):
    title = "a force that depends on suspension travel"
    related_effects = ("progressive_spring", "bump_stop")
    shown_by = "drive a rough road, or over obstacles, so that the suspension travels far"
    motion = TRAVEL
    force = "spring force"
    answers = "suspension_stiffness_n_per_m"
    source = "J. Reimpell, H. Stoll, J. W. Betzler, The Automotive Chassis (2001), chapter 5: springs, stops"
    signature = "the spring is different at large and at small travel"
    ends = ((0, "in deep compression"), (-1, "in extension"))


FAMILY = ForceByTravel()
