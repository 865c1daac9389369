"""Dampers that fade as they grow hot: oil gets thin by the power that it takes up, and cools again.

The viscosity of oil falls with its temperature by an exponential (O. Reynolds, Phil. Trans. Royal Society 177, 1886,
157), the temperature rises with the energy that the damper takes up, and falls off in time. With h, how much the
logarithm of the damping has lost, the force of the linear damper is exp(-h) c v, and h' = a exp(-h) c v^2 - h / T.
"""

from __future__ import annotations

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, FormatNumber, LawContext
from logger.lab.laws.families.friction_with_memory import BETWEEN
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def force(p, seen):
    return (np.exp(-seen.memory[0]) - 1.0) * p.damping_n_s_per_m * seen.rate_mps


def rates(p, seen):
    taken_up_w = np.exp(-seen.memory[0]) * p.damping_n_s_per_m * seen.rate_mps**2
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
                Parameter("lost_per_j", 1e-4, 0.0, 0.05, 0.0, Scale.LINEAR, (3e-5, 3e-4, 3e-3),
                          "what the logarithm of a damper's force loses by what it takes up"),
                Parameter("cooling_time_s", 30.0, 3.0, 600.0, None, Scale.LOG, (15.0, 100.0),
                          "in which what was lost comes back to 37 %")),
            source="J. C. Dixon, The Shock Absorber Handbook (2007), chapter 8: damping falls as the oil grows hot",
            signature="the damping falls while a rough road is driven",
            functions=_FUNCTIONS, method=_METHOD, imports=(*BETWEEN, "from types import SimpleNamespace"))]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"dampers that fade as they grow hot, by exp(-h): h grows by {say('lost_per_j', 1000.0, '')} for each "
                f"kJ that one takes up, and falls back within {say('cooling_time_s')}")


FAMILY = DamperHeat()
