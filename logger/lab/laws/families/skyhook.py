"""Dampers that resist how fast the body moves against the ground, not against the wheel: as if hooked to the sky.

The force between body and wheel is C z', with z' the speed of the body's end of the suspension (D. Karnopp, M. J.
Crosby and R. A. Harwood, Journal of Engineering for Industry 96, 1974). An active one gives it always. A semi-active
one can only resist its own rate v: it gives the smaller of C |z'| and B |v| where both have one sign, and else nothing.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

ACTIVE, SEMI_ACTIVE = "active", "semi-active"
_ACTIVE = """
def hooked(p, seen):
    return p.sky_n_s_per_m * seen.body_mps
"""
_SEMI_ACTIVE = """
def hooked(p, seen):
    resists = np.minimum(p.sky_n_s_per_m * np.abs(seen.body_mps), p.firmest_n_s_per_m * np.abs(seen.rate_mps))
    return np.where(seen.body_mps * seen.rate_mps > 0.0, np.sign(seen.rate_mps) * resists, 0.0)
"""
_TRIED, _MOST = (0.3, 1.0), 30.0  # of the damper's own damping


class Skyhook(Family):
    title = "dampers that resist the body's velocity against the ground (skyhook)"
    related_effects = ("damper_asymmetry", "damper_blow_off")
    source = "D. Karnopp, M. J. Crosby and R. A. Harwood, Journal of Engineering for Industry 96 (1974)"
    signature = "the body bounces less, and the wheels hop no less"
    shown_by = "drive a road with long waves, on which the body bounces, and a short rough one, on which the wheels hop"

    def drafts(self, context: LawContext) -> list[Draft]:
        if context.vehicle.is_part:  # which has no body
            return []
        own = context.vehicle.front.suspension_damping_n_s_per_m
        tried, most = tuple(rounded(share * own) for share in _TRIED), rounded(_MOST * own)
        sky = Parameter("sky_n_s_per_m", tried[0], 0.0, most, 0.0, Scale.LINEAR, tried,
                        "force per velocity of the body's end of the suspension")
        firmest = Parameter("firmest_n_s_per_m", tried[1], rounded(0.01 * own), most, None, Scale.LOG, tried,
                            "largest force over the suspension's rate")
        return [self.draft(parameters, handed_on("hooked"), functions, title=f"{variant} {self.title}", variant=variant)
                for variant, parameters, functions in ((ACTIVE, (sky,), _ACTIVE),
                                                       (SEMI_ACTIVE, (sky, firmest), _SEMI_ACTIVE))]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        said = f"{draft.variant} dampers that resist the body's velocity against the ground, {say('sky_n_s_per_m')}"
        return said if draft.variant == ACTIVE else f"{said}, at most {say('firmest_n_s_per_m')} times their rate"


FAMILY = Skyhook()
