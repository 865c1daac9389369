"""A force in the suspensions by their rate: a damper that is no straight line.

A power of the rate (two numbers), F = f sign(v) |v / v0|^n; or a smooth curve through points, which may differ in bump
and rebound.
"""

from __future__ import annotations

from logger.lab.laws.curves import free_curve, power_curve
from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, Look, Say
from logger.vehicle.effect import Chosen

_MEANING = ("oil that is pressed through holes resists with the square of its speed, valves with less than its first "
            "power (J. C. Dixon, The Shock Absorber Handbook, 2007, chapter 6)")


class ForceByRate(Family):
    name = "force_by_rate"
    title = "a force by the rate of the suspensions"
    akin = ("damper_blow_off", "damper_asymmetry", "dry_friction")
    shown_by = "drive the same road slowly and fast, or a smooth and a rough one"

    def drafts(self, look: Look) -> list[Draft]:
        common = {
            "family": self.name, "at": "rate", "source": _MEANING, "shown_by": self.shown_by,
            "signature": "the damping changes as the road gets rougher",
        }
        usual_mps, reach_mps = look.reach("rate_mps", 0.95), look.reach("rate_mps", 0.9995)
        size_n = look.vehicle.front.suspension_damping_n_s_per_m * usual_mps
        return [
            power_curve("mps", usual_mps, 2 * reach_mps, size_n, (0.4, 2.0, 3.0), (0.1, 5.0), **common),
            free_curve("mps", [look.reach("rate_mps", share) for share in (0.5, 0.9, 0.995)], size_n, **common),
        ]

    def words(self, draft: Draft, found: Chosen, say: Say) -> str:
        if draft.variant == "power":
            return (f"a damper force that grows with the rate to the power {say('power_ratio')}, "
                    f"{say('force_n')} at {draft.reference:g} m/s")
        return f"a damper force that follows a free curve of the rate, {say(draft.parameters[-1].name)} at the fastest"


FAMILY = ForceByRate()
