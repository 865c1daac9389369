"""Dampers that change as a run goes on: oil that warms up grows thin.

The force of a damper by its rate is c v (1 - s (1 - exp(-t / T))): a share s is lost in the end, most of it in the time
T (J. C. Dixon, The Shock Absorber Handbook, 2007, section 6.7, on fade).
"""

from __future__ import annotations

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def fading(p, seen):
    return -p.lost_n_s_per_m * (1.0 - np.exp(-np.maximum(seen.time_s, 0.0) / p.time_s)) * seen.rate_mps
"""
_METHOD = """def laws(self, p, laws):
    own = SimpleNamespace(lost_n_s_per_m=p.lost_ratio * laws.damping_n_s_per_m, time_s=p.time_s)
    return laws.with_law(Between.BODY_AND_WHEEL, fading, own)
"""


class FadingDamping(Family):
    title = "damping that changes during a run"
    source = "J. C. Dixon, The Shock Absorber Handbook, 2007, section 6.7"
    signature = "the body and the wheels ring longer, or more briefly, later in a run"
    shown_by = "drive one rough road for half an hour from cold, recorded as one run"

    def drafts(self, context: LawContext) -> list[Draft]:
        lasts_s = max(run.count / run.rate_hz for run in context.runs)
        trials = tuple(rounded(share * lasts_s) for share in (0.1, 0.3, 1.0))
        lost = Parameter("lost_ratio", 0.2, -2.0, 0.95, 0.0, Scale.LINEAR, (0.2, -0.2), "share of the damping that is "
                         "finally lost", step=0.02)
        time = Parameter("time_s", trials[1], rounded(0.01 * lasts_s), rounded(10 * lasts_s), None, Scale.LOG, trials,
                         "time constant of the loss")
        return [self.draft((lost, time), _METHOD, _FUNCTIONS, variant="settling")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return f"damping that falls by a share of {say('lost_ratio')} during a run, within about {say('time_s')}"


FAMILY = FadingDamping()
