"""A part alone on its bench: what slides in it does so behind a spring, by a power of the force.

Both carry the force F: the spring is stretched by s = F / k, and what slides goes at the rate
(F / F0)^n, which is Norton's creep. n = 1 is a damper behind rubber (Maxwell), a large n friction that gives before it
slides, or a fluid that yields; between them are valves that open. F0 is what the force comes to where the part is moved
at one usual rate. It acts beside the part's own spring and damper. (What differs by direction, or has
play, is ``damper_as_a_whole``.)
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def force(p, seen):  # the memory is the force over that of sliding, and the spring's stretch over the yield travel
    return p.sliding_force_n * seen.memory[0]


def rates(p, seen):
    z = seen.memory[0]
    slides_mps = p.sliding_rate_m_per_s * np.sign(z) * np.abs(z) ** p.power_ratio
    return ((seen.rate_mps - slides_mps) / p.yield_travel_m,)
"""


class SlidingBehindSpring(Family):
    title = "friction in series with a spring, in a part on a bench"
    related_effects = ("hysteresis", "maxwell_element", "top_mount_compliance", "dry_friction")
    source = ("F. H. Norton, The Creep of Steel at High Temperatures (1929); P. Perzyna, Advances in Applied Mechanics "
              "9 (1966) 243")
    signature = "small motions meet a spring, larger ones a force that hardly grows"
    shown_by = "move the part by small and by large amounts, slowly and fast"

    def drafts(self, context: LawContext) -> list[Draft]:
        vehicle = context.vehicle
        if not vehicle.is_part:
            return []
        front, travel_m, rate_mps = vehicle.front, context.reach("travel_m", 0.9), context.reach("rate_mps", 0.9)
        size_n = rounded(0.3 * (front.suspension_stiffness_n_per_m * travel_m
                                + front.suspension_damping_n_s_per_m * rate_mps))
        lengths_m = tuple(rounded(one * travel_m) for one in (0.02, 0.2))
        parameters = (
            Parameter("sliding_force_n", size_n, 0.0, 1e4 * size_n, 0.0, Scale.LINEAR, (size_n,),
                      f"as it slides at {rate_mps:g} m/s"),
            Parameter("yield_travel_m", lengths_m[0], 1e-4 * lengths_m[0], 10 * travel_m, None, Scale.LOG, lengths_m,
                      "over which the spring reaches that force"),
            Parameter("power_ratio", 1.5, 0.3, 40.0, None, Scale.LOG, (1.5, 6.0),
                      "exponent of the force in the rate of sliding"),
            Parameter("sliding_rate_m_per_s", rate_mps, rate_mps, rate_mps, None, Scale.LOG, (rate_mps,),
                      "at which the sliding part has its force", default=rate_mps))
        return [self.draft(parameters, handed_on(states=1), _FUNCTIONS, at="loop",
                           title="a part slides behind a spring")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"sliding behind a spring, {say('sliding_force_n')} over {say('yield_travel_m', 1000.0, 'mm')} at the "
                f"power {say('power_ratio')}")


FAMILY = SlidingBehindSpring()
