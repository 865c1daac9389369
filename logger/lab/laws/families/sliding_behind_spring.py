"""A part alone on its bench: what slides in it does so behind a spring, which may have play, by a power of the force.

All carry the force F: the spring is stretched by s = F / k beyond the play, half of which lies on either side of where
the record began, and what slides goes at the rate (F / F0)^n, which is Norton's creep. n = 1 is a damper behind rubber
(Maxwell), a large n friction that gives before it slides, or a fluid that yields; between them are valves that open. F0
is what the force comes to where the part is moved at one usual rate. It acts beside the part's own spring and damper.
(What differs by direction is ``damper_as_a_whole``.)
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def force(p, seen):  # the memory is the stretch of spring and play over the yield travel
    z, gap = seen.memory[0], p.play_m / p.yield_travel_m
    return p.sliding_force_n * (z - np.minimum(np.maximum(z, -gap), gap))


def rates(p, seen):
    z, gap = seen.memory[0], p.play_m / p.yield_travel_m
    pulls = z - np.minimum(np.maximum(z, -gap), gap)
    slides_mps = p.sliding_rate_m_per_s * np.sign(pulls) * np.abs(pulls) ** p.power_ratio
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
        front, travel_m, rate_mps = vehicle.front, context.reach("travel_m", 0.9), context.reach("rate_mps", 0.9)
        size_n = rounded(0.3 * (front.suspension_stiffness_n_per_m * travel_m
                                + front.suspension_damping_n_s_per_m * rate_mps))
        if not vehicle.is_part or size_n * travel_m == 0:
            return []
        lengths_m = tuple(rounded(one * travel_m) for one in (0.02, 0.2))

        def play(*trials: float) -> Parameter:
            return Parameter("play_m", trials[0], 0.0, travel_m, None, Scale.LINEAR, trials,
                             "of that spring, either way", default=0.0, step=0.01 * travel_m, given=trials == (0.0,))

        parameters = (
            Parameter("sliding_force_n", size_n, 0.0, 1e4 * size_n, 0.0, Scale.LINEAR, (size_n,),
                      f"as it slides at {rate_mps:g} m/s"),
            Parameter("yield_travel_m", lengths_m[0], 1e-4 * lengths_m[0], 10 * travel_m, None, Scale.LOG, lengths_m,
                      "over which the spring reaches that force"),
            Parameter("power_ratio", 1.5, 0.3, 40.0, None, Scale.LOG, (1.5, 6.0),
                      "exponent of the force in the rate of sliding; at its high end it is friction", may_end=True),
            Parameter("sliding_rate_m_per_s", rate_mps, rate_mps, rate_mps, None, Scale.LOG, (rate_mps,),
                      "at which the sliding part has its force", default=rate_mps))
        return [self.draft((*parameters, one), handed_on(states=1), _FUNCTIONS, at="loop", variant=variant, title=title)
                for variant, title, one in (("", "a part slides behind a spring", play(0.0)), (
                    "play", "a part slides behind a spring with play", play(0.3 * travel_m, 0.03 * travel_m)))]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"sliding behind a spring, {say('sliding_force_n')} over {say('yield_travel_m', 1000.0, 'mm')} at the "
                f"power {say('power_ratio')}"
                + f", with play of {say('play_m', 1000.0, 'mm')} either way" * bool(draft.variant))


FAMILY = SlidingBehindSpring()
