"""A force in the suspensions by their travel: a spring that is no straight line.

A power of the travel (two numbers), F = f sign(x) |x / x0|^n; or a smooth curve through points, which may differ in
compression and extension (stops).
"""

from __future__ import annotations

from logger.lab.laws.curves import free_curve, power_curve
from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, Look, Say
from logger.vehicle.effect import Chosen

_SHARE = 0.3  # of the spring's own force


class ForceByTravel(Family):
    name = "force_by_travel"
    title = "a force by the travel of the suspensions"
    akin = ("progressive_spring", "bump_stop")
    shown_by = "drive a rough road, or over obstacles, so that the suspension travels far"

    def drafts(self, look: Look) -> list[Draft]:
        common = {
            "family": self.name, "at": "travel", "shown_by": self.shown_by,
            "source": "J. Reimpell, H. Stoll, J. W. Betzler, The Automotive Chassis (2001), chapter 5: springs, stops",
            "signature": "large motions meet another spring than small ones",
        }
        usual_m, reach_m = look.reach("travel_m", 0.98), look.reach("travel_m", 0.9999)
        size_n = _SHARE * look.vehicle.front.suspension_stiffness_n_per_m * usual_m
        return [
            power_curve("m", usual_m, 2 * reach_m, size_n, (2.0, 3.0), (0.3, 8.0), **common),
            free_curve("m", [look.reach("travel_m", share) for share in (0.5, 0.9, 0.995)], size_n, **common),
        ]

    def words(self, draft: Draft, found: Chosen, say: Say) -> str:
        if draft.variant == "power":
            return (f"a spring force that grows with the travel to the power {say('power_ratio')}, {say('force_n')} at "
                    f"{1000 * draft.reference:g} mm")
        first, last = draft.parameters[0].name, draft.parameters[-1].name
        return (f"a spring force that follows a free curve of the travel, {say(first)} in deep compression and "
                f"{say(last)} in extension")


FAMILY = ForceByTravel()
