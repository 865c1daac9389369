"""A stop that ends the suspensions' extension, with a damping of its own: rubber, or a cushion of oil in the damper.

Beyond a clearance it answers with k (x - d) + c x', and lets go where that would pull: spring and damper in contact
(K. H. Hunt and F. R. E. Crossley, J. Applied Mechanics 42, 1975, 440). Its damping is given by the time c / k.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def force(p, seen):
    beyond_m = seen.travel_m - p.clearance_m
    return (beyond_m > 0.0) * np.maximum(p.stiffness_n_per_m * (beyond_m + p.damping_time_s * seen.rate_mps), 0.0)
"""


class ExtensionStop(Family):
    title = "a stop at the end of the suspension's travel in extension"
    related_effects = ("bump_stop", "progressive_spring")
    source = "K. H. Hunt and F. R. E. Crossley, J. Applied Mechanics 42 (1975) 440: contact with damping"
    signature = "large motions are cut short in extension"
    shown_by = "drive over a crest or a wide hole fast enough for the wheels to hang"

    def drafts(self, context: LawContext) -> list[Draft]:
        stiffness = rounded(3.0 * context.vehicle.front.suspension_stiffness_n_per_m)
        clear_m = tuple(sorted({context.reach("travel_m", share) for share in (0.8, 0.93, 0.98)}))  # of the time
        parameters = (
            Parameter("stiffness_n_per_m", stiffness, 0.0, 100 * stiffness, 0.0, Scale.LINEAR, (stiffness,),
                      "of the stop"),
            Parameter("clearance_m", clear_m[len(clear_m) // 2], rounded(0.05 * clear_m[0]),
                      context.reach("travel_m", 1.0), None, Scale.LOG, clear_m, "extension from rest at which the "
                                                                                "stop is met"),
            Parameter("damping_time_s", 0.01, 0.0, 1.0, None, Scale.LINEAR, (0.01,), "its damping over its stiffness",
                      step=0.001))
        return [self.draft(parameters, handed_on(), _FUNCTIONS, title="a stop in extension", at="loop")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"a stop in extension of {say('stiffness_n_per_m', 0.001, 'N/mm')} beyond "
                f"{say('clearance_m', 1000.0, 'mm')}, its damping {say('damping_time_s', 1000.0, 'ms')} times that")


FAMILY = ExtensionStop()
