"""Dampers that fade as they grow hot: oil gets thin by the power that it takes up, and cools again.

The lost share s of a damper grows with the energy that the linear damper takes up, and falls off in time:
s' = a c v^2 - s / T; the force of the linear damper is (1 - s) c v.
"""

from __future__ import annotations

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, FormatNumber, LawContext
from logger.lab.laws.families.friction_with_memory import BETWEEN
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
LEAST = 0.05  # of a damper's force stays however hot it is


def force(p, seen):
    return -np.minimum(seen.memory[0], 1.0 - LEAST) * p.damping_n_s_per_m * seen.rate_mps


def rates(p, seen):
    taken_up_w = p.damping_n_s_per_m * seen.rate_mps**2
    return (p.lost_per_j * taken_up_w - seen.memory[0] / p.cooling_time_s,)
"""
_METHOD = """
def laws(self, p, laws):
    p = SimpleNamespace(damping_n_s_per_m=laws.damping_n_s_per_m, **vars(p))
    return laws.with_law(Between.BODY_AND_WHEEL, force, p, rates, memory=(0.0,))
"""


class DamperHeat(Family):
    name = "damper_heat"
    title = "dampers that fade as they grow hot"
    related_effects = ("damper_blow_off",)
    shown_by = "drive a rough road for some minutes without a pause, and again after one"

    def drafts(self, context: LawContext) -> list[Draft]:
        return [Draft(
            family=self.name, kind="ForceEffect", title=self.title, shown_by=self.shown_by,
            parameters=(
                Parameter("lost_per_j", 1e-4, 0.0, 0.05, 0.0, Scale.LINEAR, (3e-5, 3e-4),
                          "share of its force that a damper loses by what it takes up"),
                Parameter("cooling_time_s", 30.0, 3.0, 600.0, None, Scale.LOG, (15.0, 100.0),
                          "in which what was lost comes back to 37 %")),
            source="J. C. Dixon, The Shock Absorber Handbook (2007), chapter 8: damping falls as the oil grows hot",
            signature="the damping falls while a rough road is driven",
            functions=_FUNCTIONS, method=_METHOD, imports=(*BETWEEN, "from types import SimpleNamespace"))]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"dampers that fade as they grow hot, {say('lost_per_j', 1e5, '%')} lost for each kJ, back within "
                f"{say('cooling_time_s')}")


FAMILY = DamperHeat()
