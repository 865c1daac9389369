"""A damping that goes with the travel: F = f |x / x0|^n v / v0."""

from __future__ import annotations

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale


class DampingByTravel(Family):
    title = "damping that depends on suspension travel"
    related_effects = ("damper_blow_off", "damper_asymmetry", "progressive_spring")
    source = "J. C. Dixon, The Shock Absorber Handbook (2007), chapter 3: position-dependent damping"
    signature = "the damping is larger far from rest than near it"
    shown_by = "drive a rough road slowly, so that the suspension travels far at different rates"
    straight_at = 0.0

    def drafts(self, context: LawContext) -> list[Draft]:
        travel_m, rate_mps = context.reach("travel_m", 0.95), context.reach("rate_mps", 0.95)
        size_n = rounded(0.3 * context.vehicle.front.suspension_damping_n_s_per_m * rate_mps)
        functions = f"""
def force_n(p, travel_m, rate_mps):
    way = np.minimum(np.abs(travel_m), {rounded(2 * context.reach('travel_m', 0.9999))!r}) / {travel_m!r}
    return p.force_n * way**p.power_ratio * rate_mps / {rate_mps!r}
"""
        parameters = (
            Parameter("force_n", size_n, 0.0, 100 * size_n, 0.0, Scale.LINEAR, (size_n,),
                      f"at {1000 * travel_m:g} mm and {rate_mps:g} m/s"),
            Parameter("power_ratio", 1.0, 0.3, 6.0, None, Scale.LOG, (1.0, 2.0), "exponent of the travel"))
        return [self.draft(parameters, "def laws(self, p, laws):\n"
                           "    return laws.with_force(lambda travel_m, rate_mps: force_n(p, travel_m, rate_mps))",
                           functions, at="loop", reference=travel_m)]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"damping that grows with the travel to the power {say('power_ratio')}: "
                f"{say('force_n')} at {draft.parameters[0].meaning.removeprefix('at ')}")


FAMILY = DampingByTravel()
