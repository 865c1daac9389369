"""Families of laws that are curves of one motion: a power of what moves, or a smooth curve through points.

A power has two numbers, F = f sign(x) |x / x0|^n, and holds what physics books have: the square of a damper's rate, the
cube of a spring's travel. The curve is free. Its smoothness is its prior: it goes through few points, at rest and where
the runs' motions lie, monotone between them (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5, 1984), and
each of them counts. Beyond the motions of the runs curves stay what they are there: nothing is known of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded, through_points
from logger.vehicle.effect import Chosen, Parameter, Scale

_POINTS = {"curve": (0.5, 0.9, 0.995), "long_curve": (0.5, 0.9, 0.99, 0.999)}
"""Shares of the time within which a motion stays: where free curves have their points. A spring that stiffens at the
ends of its travel does most where it hardly ever is."""


@dataclass(frozen=True)
class LawMotion:
    """A motion that a force may depend on.

    at         its short name, as drafts have it
    name       in words
    measure    what ``LawContext.reach`` calls it
    unit       in which it is measured
    shown      the same in words: factor and unit
    method     of ``Laws`` that takes such a force, with what is handed on to it
    """

    at: str
    name: str
    measure: str
    unit: str
    shown: tuple[float, str]
    method: str

    def words(self, size: float) -> str:
        """A size of the motion in words: "12 mm"."""
        factor, unit = self.shown
        return f"{factor * size:g} {unit}"


RATE = LawMotion("rate", "rate", "rate_mps", "m/s", (1.0, "m/s"), "with_damper(lambda rate_mps: force_n(p, rate_mps))")
TRAVEL = LawMotion("travel", "travel", "travel_m", "m", (1000.0, "mm"),
                   "with_spring(lambda travel_m: force_n(p, travel_m))")
DEFLECTION = LawMotion("deflection", "tire's deflection", "deflection_m", "m", (1000.0, "mm"),
                       "with_tire(lambda deflection_m: force_n(p, deflection_m))")


class CurveFamily(Family):
    """A force that is a curve of one motion.

    motion               that it depends on
    force                what it is in words: "damper force"
    answers              number of an axle that gives such a force where it is multiplied with the motion
    tried                share of that force that the search begins with
    usual_share          of the time that the motion stays within where the force is what its number says
    reach_share          of the time; beyond twice what this gives, the force stays as it is there
    powers               to be tried; ``power_ends``: what they may be
    ends                 points of a free curve that a sentence names, by their place among them, and where they are in
                         words
    """

    motion: LawMotion
    force: str
    answers: str
    tried: float = 0.3
    usual_share: float = 0.98
    reach_share: float = 0.9999
    powers: tuple[float, ...] = (2.0, 3.0)
    power_ends: tuple[float, float] = (0.3, 8.0)
    ends: tuple[tuple[int, str], ...]
    straight_at = 1.0

    def drafts(self, context: LawContext) -> list[Draft]:
        def reach(share: float) -> float:
            return context.reach(self.motion.measure, share)

        usual = reach(self.usual_share)
        size_n = self.tried * getattr(context.vehicle.front, self.answers) * usual
        return [self._power(usual, 2 * reach(self.reach_share), size_n),
                *(self.free(variant, [reach(share) for share in shares], size_n)
                  for variant, shares in _POINTS.items())]

    def is_straight(self, draft: Draft, found: Chosen, sigma: float) -> bool:
        if draft.variant == "power":
            return super().is_straight(draft, found, sigma)
        force_n, error_n = (np.array([some.get(one, np.inf) for one in draft.strengths])
                            for some in (found.values, found.standard_errors))
        # The line through rest from which no point is off by more, if there is one.
        places = np.array(draft.places)
        slopes = np.sort(np.divide([force_n - sigma * error_n, force_n + sigma * error_n], places), axis=0)
        return bool(slopes[0].max() < slopes[1].min())

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        motion = self.motion.at
        if draft.variant == "power":
            return (f"a {self.force} that grows with the {motion} to the power {say('power_ratio')}, {say('force_n')} "
                    f"at {self.motion.words(draft.reference)}")
        ends = " and ".join(f"{say(draft.strengths[place])} {where}" for place, where in self.ends)
        return f"a {self.force} that follows a free curve of the {motion}, {ends}"

    def _power(self, reference: float, reach: float, size_n: float) -> Draft:
        """A force that grows with a power of the motion, symmetric, constant beyond ``reach``."""
        functions = f"""
def force_n(p, at):
    size = np.minimum(np.abs(at), {rounded(reach)!r}) / {reference!r}
    return p.force_n * np.sign(at) * size**p.power_ratio
"""
        parameters = (_strength("force_n", size_n, f"at {reference:g} {self.motion.unit}"),
                      Parameter("power_ratio", self.powers[0], *self.power_ends, None, Scale.LOG, self.powers,
                                "exponent"))
        return self._draft("power", "grows with a power of", parameters, functions, reference, ())

    def free(self, variant: str, knots: Sequence[float], size_n: float) -> Draft:
        """A force that follows a smooth curve through points on either side of rest."""
        places = sorted({sign * rounded(one) for one in knots if one for sign in (-1, 1)})  # beside rest, which is one
        names = {one: f"force_{number}_n" for number, one in enumerate(places, 1)}
        parameters = tuple(_strength(name, size_n, f"at {one:g} {self.motion.unit}", (0.1,))
                           for one, name in names.items())
        return self._draft(variant, "follows a curve of", parameters, through_points("force_n", names), places[-1],
                           tuple(places))

    def _draft(self, variant: str, does: str, parameters: tuple[Parameter, ...], functions: str, reference: float,
               places: tuple[float, ...]) -> Draft:
        return self.draft(parameters, f"def laws(self, p, laws):\n    return laws.{self.motion.method}", functions,
                          title=f"a force that {does} the {self.motion.name}", variant=variant, at=self.motion.at,
                          reference=reference, places=places)


def _strength(name: str, size_n: float, meaning: str, trials: Sequence[float] = (0.1, -0.1)) -> Parameter:
    size_n = rounded(size_n)
    return Parameter(name, trials[0] * size_n, -100 * size_n, 100 * size_n, 0.0, Scale.LINEAR,
                     tuple(one * size_n for one in trials), meaning, step=0.02 * size_n)
