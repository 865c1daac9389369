"""A force of the tires by their deflection: a tire that is no straight spring.

A power of the deflection (two numbers), or a smooth curve through points, which may differ where the tire is pressed
and where it is let go.
"""

from __future__ import annotations

from logger.lab.laws.curves import free_curve, power_curve
from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, Look, Say
from logger.vehicle.effect import Chosen

_SHARE = 0.3  # of the tire's own force


class TireForce(Family):
    name = "tire_force"
    title = "a force by the deflection of the tires"
    akin = ("bump_stop", "progressive_spring", "wheel_lift")
    shown_by = "drive a rough road, or over obstacles, fast, so that the tires are pressed far"

    def drafts(self, look: Look) -> list[Draft]:
        common = {
            "family": self.name, "at": "deflection", "shown_by": self.shown_by,
            "source": "H. B. Pacejka, Tire and Vehicle Dynamics (2012), chapter 9: stiffness grows with the load",
            "signature": "wheels hop at another frequency where the road is rough",
        }
        usual_m, reach_m = look.reach("deflection_m", 0.98), look.reach("deflection_m", 0.9999)
        size_n = _SHARE * look.vehicle.front.tire_stiffness_n_per_m * usual_m
        return [
            power_curve("m", usual_m, 2 * reach_m, size_n, (2.0, 3.0), (0.3, 8.0), **common),
            free_curve("m", [look.reach("deflection_m", share) for share in (0.5, 0.9, 0.995)], size_n, **common),
        ]

    def words(self, draft: Draft, found: Chosen, say: Say) -> str:
        if draft.variant == "power":
            return (f"a tire force that grows with the deflection to the power {say('power_ratio')}, {say('force_n')} "
                    f"at {1000 * draft.reference:g} mm")
        first, last = draft.parameters[0].name, draft.parameters[-1].name
        return (f"a tire force that follows a free curve of the deflection, {say(first)} where it is pressed most and "
                f"{say(last)} where it is let go")


FAMILY = TireForce()
