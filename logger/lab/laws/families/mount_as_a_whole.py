"""A mount alone on its bench as a whole: rubber, foam, leaves or rope, with all that they do at once.

Its spring is bent; rubber creeps, not in one time but in all, so that its stiffness goes with a power of the frequency
and its damping hardly does; and what rubs in it, filler, strands or cells, gives before it slides, some of it early and
some late, and presses more to one side than to the other. Creep is the sum of branches of Maxwell whose times are a
fourth of each other; friction that of three elements of Bouc and Wen, whose travels and forces are the same number of
times each other's.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_TIMES_S = (0.4, 0.1, 0.025, 0.00625)
"""In which creep ends, from 0.4 to 25 Hz, at which benches move mounts. Of times that are a fourth of each other the
loss follows a power of the frequency within 0.3 %, of a tenth within 5 % (computed for a ladder without ends)."""
_METHOD = """
def laws(self, p, laws):
    damped = laws.with_damper(lambda rate_mps: p.damper_n * rate_mps / {rate_mps!r})
    bent = damped.with_spring(lambda travel_m: bent_n(p, travel_m))
    creeping = bent.with_law(Between.BODY_AND_WHEEL, creeps, p, creep_rates, memory=(0.0, 0.0, 0.0, 0.0))
    return creeping.with_law(Between.BODY_AND_WHEEL, rubs, p, rub_rates, memory=(0.0, 0.0, 0.0))
"""
_FUNCTIONS = """
def bent_n(p, travel_m):
    at = travel_m / p.usual_travel_m
    return p.spring_square_n * at**2 + p.spring_cube_n * at**3


def creeps(p, seen):  # the memory is the stretch of each branch's spring over the usual travel
    a, b, c, d = seen.memory
    share = 4**p.creep_power
    stretch_m = p.usual_travel_m * (a + share * (b + share * (c + share * d)))
    return p.creep_n_per_m * stretch_m / (1 + share + share**2 + share**3)


def creep_rates(p, seen):
    a, b, c, d = seen.memory
    rate = seen.rate_mps / p.usual_travel_m
    return ({creep_rates})


def rubs(p, seen):  # the memory is the force of each element over that with which it slides
    early, middle, late = seen.memory
    share, more = p.late_force_ratio, 1 + p.load_ratio * seen.travel_m / p.usual_travel_m
    return p.friction_n * np.maximum(more, 0.0) * (early + share * (middle + share * late)) / (1 + share + share**2)


def rub_rates(p, seen):
    early, middle, late = seen.memory
    rate, more = seen.rate_mps / p.friction_travel_m, p.late_travel_ratio
    first, then, last = [1 - np.abs(z) ** p.sharpness_ratio * (0.5 + 0.5 * np.sign(rate * z))
                         for z in (early, middle, late)]
    return (rate * first, rate / more * then, rate / more**2 * last)
"""


class MountAsAWhole(Family):
    title = "a mount as a whole: a bent spring, rubber that creeps, friction that gives"
    related_effects = ("hysteresis", "maxwell_element", "progressive_spring")
    source = ("M. Berg, Vehicle System Dynamics 30 (1998) 197: spring, creep and friction of rubber; R. L. Bagley and "
              "P. J. Torvik, AIAA Journal 21 (1983) 741: powers of the frequency; W. D. Iwan, J. Appl. Mech. 33 (1966) "
              "893: friction that yields bit by bit")
    signature = "stiffer for quick motions than for slow ones, and for small ones than for large ones"
    shown_by = "move the part by small and by large amounts, slowly and fast"
    by_axle = False
    holds = ("progressive_spring", "hysteresis", "maxwell_element", "dry_friction")

    def drafts(self, context: LawContext) -> list[Draft]:
        front = context.vehicle.front
        travel_m, rate_mps = context.reach("travel_m", 0.9), context.reach("rate_mps", 0.9)
        size_n = rounded(front.suspension_stiffness_n_per_m * travel_m
                         + front.suspension_damping_n_s_per_m * rate_mps)
        if not context.vehicle.is_part or size_n * travel_m == 0:
            return []
        spring, way_m = rounded(size_n / travel_m), rounded(0.05 * travel_m)

        def beside(name: str, meaning: str) -> Parameter:
            return Parameter(name, 0.02 * size_n, -100 * size_n, 100 * size_n, 0.0, Scale.LINEAR, (0.02 * size_n,),
                             meaning, step=0.02 * size_n)

        def losing(name: str, share: float, size: float, meaning: str) -> Parameter:
            # Below 0 it would make energy: two that oppose each other would stand for what is not yet there.
            return Parameter(name, share * size, 0.0, 100 * size, 0.0, Scale.LINEAR, (share * size,), meaning,
                             step=0.02 * size, may_end=True)

        return [self.draft(
            (*(beside(f"spring_{power}_n", f"of the spring at {1000 * travel_m:g} mm, by the {power} of the travel")
               for power in ("square", "cube")),
             beside("damper_n", f"of a damper at {rate_mps:g} m/s, beside the linear one"),
             losing("creep_n_per_m", 0.5, spring, "of all that creeps, before it does"),
             Parameter("creep_power", 0.3, -2.0, 3.0, None, Scale.LINEAR, (0.3,),
                       "of the frequency, with which the stiffness of what creeps grows", step=0.05, may_end=True),
             losing("friction_n", 0.2, size_n, "with which all that rubs slides"),
             Parameter("friction_travel_m", way_m, way_m / 1000, 100 * way_m, None, Scale.LOG, (way_m,),
                       "over which the first stiffness of what slides first would reach its force", may_end=True),
             Parameter("sharpness_ratio", 1.0, 0.2, 10.0, None, Scale.LOG, (1.0,), "of the yield", may_end=True),
             Parameter("late_travel_ratio", 3.0, 1.0, 20.0, None, Scale.LOG, (3.0,),
                       "of such travels, of what slides next to what slides first, and of what slides last to that",
                       may_end=True),
             Parameter("late_force_ratio", 1.0, 0.02, 50.0, None, Scale.LOG, (1.0,), "of their forces", may_end=True),
             Parameter("load_ratio", 0.05, -5.0, 5.0, None, Scale.LINEAR, (0.05,),
                       f"of the friction at {1000 * travel_m:g} mm over that at rest, less 1", step=0.02),
             Parameter("usual_travel_m", travel_m, travel_m, travel_m, None, Scale.LOG, (travel_m,),
                       "at which these have their sizes", default=travel_m)),
            _METHOD.format(rate_mps=rate_mps), _FUNCTIONS.format(creep_rates=", ".join(
                f"rate - {name} / {time_s!r}" for name, time_s in zip("abcd", _TIMES_S, strict=True))),
            at="loop")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"a mount that is {say('creep_n_per_m', 0.001, 'N/mm')} stiffer where it is moved quickly than slowly, "
                f"by the power {say('creep_power')} of the frequency; {say('friction_n')} of friction that gives, the "
                f"first of it after {say('friction_travel_m', 1000.0, 'mm')}, and is {say('load_ratio')} times more at "
                f"the end of the travel than at rest; and a spring with {say('spring_square_n')} by the square and "
                f"{say('spring_cube_n')} by the cube of the travel, beside {say('damper_n')} of a damper")



FAMILY = MountAsAWhole()
