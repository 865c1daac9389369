"""A spring whose rubber creeps: a spring and a damper in series, parallel to the suspension's own (Maxwell's
branch)."""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
REACH_M = {reach_m!r}  # the memory is how far it has crept, over this


def force(p, seen):
    return p.stiffness_n_per_m * (seen.travel_m - REACH_M * seen.memory[0])


def rates(p, seen):
    return ((seen.travel_m / REACH_M - seen.memory[0]) / p.creep_time_s,)
"""


class SpringWithMemory(Family):
    title = "a spring with memory: rubber that creeps"
    related_effects = ("top_mount_compliance", "hysteresis")
    source = ("J. C. Maxwell, Phil. Trans. R. Soc. 157 (1867) 49; for rubber: M. Berg, Vehicle System Dynamics 30 "
              "(1998) 197")
    signature = "the suspension is stiffer for quick motions than for slow ones"
    shown_by = "drive the same road slowly and fast: quick motions meet a stiffer spring than slow ones"

    def drafts(self, context: LawContext) -> list[Draft]:
        stiffness = rounded(0.5 * context.vehicle.front.suspension_stiffness_n_per_m)
        parameters = (
            Parameter("stiffness_n_per_m", stiffness, 0.0, 100 * stiffness, 0.0, Scale.LINEAR, (stiffness,),
                      "of the rubber when it has no time to creep"),
            Parameter("creep_time_s", 0.1, 0.005, 5.0, None, Scale.LOG, (0.02, 0.07, 0.25),
                      "in which its force falls to 37 %"))
        functions = _FUNCTIONS.format(reach_m=context.reach("travel_m", 0.9))
        return [self.draft(parameters, handed_on(states=1), functions, at="loop",
                           title="rubber parallel to the springs that creeps")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"a spring with memory, {say('stiffness_n_per_m', 0.001, 'N/mm')} that creeps within "
                f"{say('creep_time_s', 1000.0, 'ms')}")


FAMILY = SpringWithMemory()
