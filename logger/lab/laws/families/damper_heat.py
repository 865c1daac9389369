"""Dampers that fade as they grow hot: oil gets thin by the power that it takes up, and cools again.

The viscosity of oil falls with its temperature by an exponential (O. Reynolds, Phil. Trans. Royal Society 177, 1886,
157), the temperature rises with the energy that the damper takes up, and falls off in time. With h, how much the
logarithm of the damping has lost, the force of the linear damper is exp(-h) c v, and h' = a exp(-h) c v^2 - h / T.
"""

from collections.abc import Mapping

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext
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
    lost_per_j = {lost}
    own = SimpleNamespace(
        damping_n_s_per_m=laws.damping_n_s_per_m, lost_per_j=lost_per_j, cooling_time_s=p.cooling_time_s)
    return laws.with_law(Between.BODY_AND_WHEEL, force, own, rates, memory=(0.0,))
"""


class DamperHeat(Family):
    title = "dampers that fade as they grow hot"
    related_effects = ("damper_blow_off",)
    source = ("O. Reynolds, Phil. Trans. Royal Society 177 (1886) 157: viscosity by temperature; J. C. Dixon, The "
              "Shock Absorber Handbook (2007), chapter 8: damping falls as the oil grows hot")
    signature = "the damping falls in the course of a rough road"
    shown_by = "drive a rough road for some minutes without a pause, and again after one"

    def drafts(self, context: LawContext) -> list[Draft]:
        alike = self._draft("alike", {"lost_per_j": "a damper's force"}, (3e-5, 3e-4, 3e-3), "p.lost_per_j")
        if not context.axles:
            return [alike]
        # Dampers of two sizes grow hot by different energies.
        return [alike, self._draft(
            "by_axle", {f"{axle}_lost_per_j": f"the force of a {axle} damper" for axle in context.axles}, (3e-5,),
            "p.rear_lost_per_j if laws.rear else p.front_lost_per_j")]

    def _draft(self, variant: str, losses: Mapping[str, str], trials: tuple[float, ...], lost: str) -> Draft:
        parameters = (
            *(Parameter(name, 1e-4, 0.0, 0.05, 0.0, Scale.LINEAR, trials,
                        f"fall of the logarithm of {of} per absorbed energy") for name, of in losses.items()),
            Parameter("cooling_time_s", 30.0, 3.0, 600.0, None, Scale.LOG, (15.0, 100.0),
                      "time in which the loss falls to 37 %"))
        return self.draft(parameters, _METHOD.format(lost=lost), _FUNCTIONS, variant=variant,
                          by_axle=variant == "alike")

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        where = {"lost_per_j": "", "front_lost_per_j": " (front)", "rear_lost_per_j": " (rear)"}
        grows = " and ".join(say(name, 1000.0, "") + axle for name, axle in where.items() if name in found.values)
        return (f"dampers that fade as they grow hot, by exp(-h): h grows by {grows} for each absorbed kJ, and decays "
                f"within {say('cooling_time_s')}")


FAMILY = DamperHeat()
