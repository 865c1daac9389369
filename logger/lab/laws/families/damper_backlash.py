"""Play in the mount of the dampers: within a gap the damper does not answer.

The gap's state z goes from -1 to 1, and moves with the suspension until it is taken up on either side: Bouc's law with
a sharp yield. As long as it moves, the damper does not: what the linear damper would have answered, c z' g, is taken
away, g the gap either way.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
SHARP = 12.0  # exponent: the gap is taken up within its last tenth


def force(p, seen):
    z = seen.memory[0]
    held = 0.5 * np.minimum(np.abs(z), 1.0) ** SHARP * (1.0 + np.sign(seen.rate_mps * z))
    return -p.damping_n_s_per_m * seen.rate_mps * (1.0 - held)


def rates(p, seen):
    z = seen.memory[0]
    held = 0.5 * np.abs(z) ** SHARP * (1.0 + np.sign(seen.rate_mps * z))
    return (seen.rate_mps / p.gap_m * (1.0 - held),)
"""
_METHOD = """
def laws(self, p, laws):
    if p.gap_m == 0:
        return laws
    p = SimpleNamespace(gap_m=p.gap_m, damping_n_s_per_m=laws.damping_n_s_per_m)
    return laws.with_law(Between.BODY_AND_WHEEL, force, p, rates, memory=(0.0,))
"""


class DamperBacklash(Family):
    title = "play in the mounts of the dampers"
    related_effects = ("top_mount_compliance",)
    source = "M. Nordin, P.-O. Gutman, Automatica 38 (2002) 1633: mechanical systems with backlash"
    signature = "small motions are hardly damped, larger ones with a delay"
    shown_by = "drive a smooth road, so that the suspension moves by little more than the play"

    def drafts(self, context: LawContext) -> list[Draft]:
        gap = Parameter("gap_m", 0.001, 0.0, 0.05, 0.0, Scale.LINEAR, (0.0003, 0.001, 0.003),
                        "in each direction, within which the damper exerts no force")
        return [self.draft((gap,), _METHOD, _FUNCTIONS, at="loop")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return f"play in the dampers' mounts, {say('gap_m', 1000.0, 'mm')} either way"


FAMILY = DamperBacklash()
