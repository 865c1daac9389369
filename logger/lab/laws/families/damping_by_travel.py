"""A damping that goes with the travel: F = f |x / x0|^n v / v0.

Of a rig such a damping may also follow a smooth curve of the travel, which multiplies the force of the damper with all
that is known of it: fluid that goes past the piston through grooves or tubes has its way only where these are, and a
magnet brakes only what is in its field.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded, through_points
from logger.vehicle.effect import Chosen, Parameter, Scale


class DampingByTravel(Family):
    title = "damping that depends on suspension travel"
    related_effects = ("damper_blow_off", "damper_asymmetry", "progressive_spring")
    source = "J. C. Dixon, The Shock Absorber Handbook (2007), chapter 3: position-dependent damping"
    signature = "the damping is larger at one travel than at another"
    shown_by = "drive a rough road slowly, so that the suspension travels far at different rates"
    straight_at = 0.0
    points = 3, 5  # on either side of rest, which is one

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
        power = self.draft(parameters, "def laws(self, p, laws):\n"
                           "    return laws.with_force(lambda travel_m, rate_mps: force_n(p, travel_m, rate_mps))",
                           functions, at="loop", reference=travel_m)
        curves = () if context.is_driven else self.points
        return [power, *(self._curve(count, context.reach("travel_m", 0.995)) for count in curves)]

    def _curve(self, count: int, reach_m: float) -> Draft:
        """A damping that follows a curve through so many points on either side of rest."""
        places = sorted(sign * rounded(reach_m * one / count) for sign in (-1, 1) for one in range(1, count + 1))
        names = {one: f"more_{number}_ratio" for number, one in enumerate(places, 1)}
        parameters = tuple(Parameter(
            name, trial := rounded(abs(one) / places[-1]), -1.0, 100.0, 0.0, Scale.LINEAR, (trial,),
            f"damping at {1000 * one:g} mm over that at rest, less 1", step=0.02) for one, name in names.items())
        return self.draft(parameters, "def laws(self, p, laws):\n    return laws.with_force("
                          "lambda travel_m, rate_mps: more(p, travel_m) * laws.damper(rate_mps))",
                          through_points("more", names), variant=f"curve through {len(places) + 1} points", at="loop",
                          reference=places[-1], places=tuple(places))

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        if draft.places:
            ends = (f"{say(draft.strengths[end])} of that at {1000 * draft.places[end]:g} mm" for end in (0, -1))
            return f"damping that follows a curve of the travel; from rest it changes by {' and '.join(ends)}"
        return (f"damping that grows with the travel to the power {say('power_ratio')}: "
                f"{say('force_n')} at {draft.parameters[0].meaning.removeprefix('at ')}")


FAMILY = DampingByTravel()
