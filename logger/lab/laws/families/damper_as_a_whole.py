"""A damper alone on its bench as a whole: all that dampers do at once, fitted together.

Valves give a smooth curve of the rate, which oil, gas in it and the rubber of an eye put behind a spring, and more or
less of it where oil passes them by; seals rub beside that, and yield first; gas that is compressed makes a spring bent.
Each alone explains little of such a damper, and those that are found one after the other stand for what is not yet
there.
"""

import numpy as np

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded, through_points
from logger.vehicle.effect import Chosen, Parameter, Scale

_SHARES = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""Of the highest rate, where the curve has its points, each at twice the rate of the one before: a knee may be at any,
as valves open, and fluids yield, at low ones."""
_PLACES = 9
"""Of the travel, from one end of it to the other."""
_METHOD = """
def laws(self, p, laws):
    behind = replace(laws, mount_n_per_m=1 / (1 / laws.mount_n_per_m + 1 / p.oil_n_per_m), mount_play_m=p.play_m)
    bent = behind.with_damper(lambda rate_mps: valves_n(p, rate_mps, -laws.damping_n_s_per_m))
    bent = bent.with_spring(lambda travel_m: gas_n(p, travel_m))
    there = bent.with_force(lambda travel_m, rate_mps: more_ratio(p, travel_m) * bent.damper(rate_mps))
    return there.with_law(Between.BODY_AND_WHEEL, rubs, p, rates, memory=(0.0,))
"""
_FUNCTIONS = """

def gas_n(p, travel_m):
    at = travel_m / {travel_m!r}
    return p.gas_square_n * at**2 + p.gas_cube_n * at**3


def rubs(p, seen):  # the memory is the force of the seals over that with which they slide
    return p.seals_n * seen.memory[0]


def rates(p, seen):
    z = seen.memory[0]
    held = np.abs(z) ** p.seals_sharpness_ratio * (0.5 + 0.5 * np.sign(seen.rate_mps * z))
    return (seen.rate_mps / p.seals_travel_m * (1.0 - held),)
"""


class DamperAsAWhole(Family):
    title = "a damper as a whole: valves behind a spring, seals that rub, gas"
    related_effects = ("hysteresis", "damper_blow_off", "dry_friction")
    source = ("J. C. Dixon, The Shock Absorber Handbook (2007), chapters 5 to 7: valves, oil, friction and gas; "
              "R. Bouc (1967) and Y.-K. Wen (1976)")
    signature = "loops of force over travel and over rate that no curve of one of these explains"
    shown_by = "move the part by small and by large amounts, slowly and fast"
    by_axle = False
    holds = ("damper_blow_off", "damper_asymmetry", "orifice_damping", "top_mount_compliance", "dry_friction",
             "progressive_spring")

    def drafts(self, context: LawContext) -> list[Draft]:
        front = context.vehicle.front
        top_mps, travel_m = context.reach("rate_mps", 0.995), context.reach("travel_m", 0.9)
        size_n = rounded(front.suspension_damping_n_s_per_m * context.reach("rate_mps", 0.95))
        if not context.vehicle.is_part or size_n * travel_m == 0:
            return []
        places = tuple(sorted(rounded(sign * share * top_mps) for share in _SHARES for sign in (-1, 1)))
        names = {at: f"valves_{number}_n" for number, at in enumerate(places[:-1], 1)}
        springs = tuple(rounded(size_n / (share * travel_m)) for share in (0.02, 0.2))
        rigid = 100 * springs[0]
        span_m = np.concatenate([one.travel_m[run.first:].ravel() for run, one in zip(
            context.runs, context.responses, strict=True)])
        low_m, high_m = np.quantile(span_m, (0.005, 0.995))
        ends_m = np.linspace(low_m, high_m, _PLACES)
        digits = 1 - int(np.floor(np.log10(ends_m[1] - ends_m[0])))  # of a part far from its rest they lie close
        more = {round(float(at), digits): f"more_{number}_ratio" for number, at in enumerate(
            [at for at in ends_m if abs(at) > 0.5 * (ends_m[1] - ends_m[0])], 1)}
        way_m = rounded(0.02 * travel_m)

        def force(name: str, share: float, meaning: str) -> Parameter:
            # A little below 0 lies nothing that is physical: where there is none of it, its number is about 0.
            start_n = float(share * size_n)
            return Parameter(name, start_n, -100 * size_n, 100 * size_n, 0.0, Scale.LINEAR, (start_n,), meaning,
                             step=0.02 * size_n)

        return [self.draft(
            (*(force(name, np.sign(at) * 0.1, f"of the valves at {at:g} m/s, beside the linear damper")
               for at, name in names.items()),
             Parameter("oil_n_per_m", springs[0], springs[-1] / 100, rigid, None, Scale.LOG, springs,
                       "in series with the valves", default=rigid, may_end=True),
             force("seals_n", 0.2, "with which the seals slide"),
             Parameter("seals_travel_m", way_m, way_m / 1000, 100 * way_m, None, Scale.LOG, (way_m, 10 * way_m),
                       "over which their first stiffness would reach that force", may_end=True),
             Parameter("seals_sharpness_ratio", 1.0, 0.2, 10.0, None, Scale.LOG, (1.0,), "of the yield", may_end=True),
             Parameter("play_m", 0.1 * way_m, 0.0, travel_m, None, Scale.LINEAR, (0.1 * way_m,),
                       "in series with the valves, either way", step=0.02 * way_m, may_end=True),
             *(Parameter(name, 0.05, -1.0, 100.0, 0.0, Scale.LINEAR, (0.05,),
                         f"of the valves' force at {1000 * at:g} mm over that at rest, less 1", step=0.02)
               for at, name in more.items()),
             force("gas_square_n", 0.05, f"of the gas at {1000 * travel_m:g} mm, by the square of the travel"),
             force("gas_cube_n", 0.05, f"of the gas at {1000 * travel_m:g} mm, by the cube of the travel")),
            _METHOD, through_points("valves_n", names, zeros=(0.0, places[-1]), more="least")
            + through_points("more_ratio", more, "FAR") + _FUNCTIONS.format(travel_m=travel_m), at="rate",
            reference=places[0], places=places[:-1])]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"a damper whose force follows a curve of the rate, {say('valves_1_n')} beside the linear "
                f"damper at {draft.reference:g} m/s, behind a spring of {say('oil_n_per_m', 0.001, 'N/mm')} with play "
                f"of {say('play_m', 1000.0, 'mm')} either way; seals that rub with {say('seals_n')} after "
                f"{say('seals_travel_m', 1000.0, 'mm')}; valves that resist {say('more_1_ratio')} times more at the "
                f"end of the travel than at rest; and a spring with {say('gas_square_n')} by the square and "
                f"{say('gas_cube_n')} by the cube of the travel")


FAMILY = DamperAsAWhole()
