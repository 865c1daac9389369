"""A force in the suspensions by their rate: a damper that is no straight line.

A power of the rate, or a smooth curve through points, which may differ in bump and rebound. Of a part alone on its
bench such a curve is tried behind a spring as well: rubber at the damper's end, or oil that is compressed before the
valves let it through.
"""

from collections.abc import Callable
from dataclasses import replace

from logger.lab.laws.curves import RATE, CurveFamily
from logger.lab.laws.draft import Draft, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_BEHIND_SPRING = """
def laws(self, p, laws):
    behind = replace(laws, mount_n_per_m=1 / (1 / laws.mount_n_per_m + 1 / p.spring_n_per_m))
    return behind.with_damper(lambda rate_mps: force_n(p, rate_mps))
"""
_BEHIND = "curve behind spring"


class ForceByRate(CurveFamily):
    title = "a force that depends on suspension rate"
    related_effects = ("damper_blow_off", "damper_asymmetry", "dry_friction")
    shown_by = "drive the same road slowly and fast, or a smooth and a rough one"
    motion = RATE
    force = "damper force"
    answers, tried = "suspension_damping_n_s_per_m", 1.0
    source = ("the resistance of orifices grows with the square of the oil's speed, that of valves less than in "
              "proportion (J. C. Dixon, The Shock Absorber Handbook, 2007, chapter 6)")
    signature = "the damping changes as the road gets rougher"
    usual_share, reach_share = 0.95, 0.9995
    powers, power_ends = (0.4, 2.0, 3.0), (0.1, 5.0)
    ends = ((-1, "at the fastest"),)

    def more_drafts(self, context: LawContext, reach: Callable[[float], float], size_n: float) -> list[Draft]:
        if not context.vehicle.is_part or size_n == 0:
            return []
        springs = tuple(rounded(size_n / (share * context.reach("travel_m", 0.9))) for share in (0.02, 0.2))
        spring = Parameter("spring_n_per_m", springs[0], springs[-1] / 100, springs[0] * 100, None, Scale.LOG, springs,
                           "stiffness of the spring in series with the damper")
        plain = self.free(_BEHIND, [reach(share) for share in (0.5, 0.9, 0.995)], size_n)
        return [replace(plain, parameters=(*plain.parameters, spring), method=_BEHIND_SPRING,
                        title=f"{plain.title}, behind a spring")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        plain = super().words(draft, found, say)
        if draft.variant != _BEHIND:
            return plain
        return f"{plain}, behind a spring of {say('spring_n_per_m', 0.001, 'N/mm')}"


FAMILY = ForceByRate()
