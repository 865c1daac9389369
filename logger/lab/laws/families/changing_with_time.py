"""Springs, tires or dampers that change as a run goes on: air that warms up in a tire makes it stiffer, rubber softer,
and oil grows thin.

The force of the model is multiplied by 1 + s (1 - exp(-t / T)): it changes by the share s, most of it in the time T.
A tire's stiffness grows with its pressure (J. Y. Wong, Theory of Ground Vehicles, 2008, chapter 1), and that with the
temperature; dampers fade (J. C. Dixon, The Shock Absorber Handbook, 2007, section 6.7).
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def changed(p, seen):
    return p.changed * (1.0 - np.exp(-np.maximum(seen.time_s, 0.0) / p.time_s)) * seen.{motion}
"""
_METHOD = """def laws(self, p, laws):
    own = SimpleNamespace(changed=p.changed_ratio * {of}, time_s=p.time_s)
    return laws.with_law(Between.{between}, changed, own)
"""


class ChangingWithTime(Family):
    title = "damping or stiffness that changes during a run"
    source = ("J. Y. Wong, Theory of Ground Vehicles (2008), chapter 1; J. C. Dixon, The Shock Absorber Handbook "
              "(2007), section 6.7")
    shown_by = "drive one rough road for half an hour from cold, recorded as one run"

    def drafts(self, context: LawContext) -> list[Draft]:
        axles = [one for one in (context.vehicle.front, context.vehicle.rear) if one is not None]
        lasts_s = max(run.count / run.rate_hz for run in context.runs)
        # The softer axle's: no axle may be left without a stiffness.
        spring, tire = (rounded(min(getattr(one, f"{of}_stiffness_n_per_m") for one in axles), digits=4)
                        for of in ("suspension", "tire"))
        return [_draft(what, motion, of, between, lasts_s) for what, motion, of, between in (
            ("dampers", "rate_mps", "laws.damping_n_s_per_m", "BODY_AND_WHEEL"),
            ("springs", "travel_m", repr(spring), "BODY_AND_WHEEL"),
            ("tires", "deflection_m", repr(tire), "WHEEL_AND_GROUND")) if of != repr(0.0)]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"{draft.variant} that change by {say('changed_ratio', 100.0, '%')} during a run, within about "
                f"{say('time_s')}")


def _draft(what: str, motion: str, of: str, between: str, lasts_s: float) -> Draft:
    times = tuple(rounded(share * lasts_s) for share in (0.1, 0.3, 1.0))
    parameters = (
        Parameter("changed_ratio", 0.1, -0.95, 3.0, 0.0, Scale.LINEAR, (0.2, -0.2), f"final change of the {what}, as a "
                  f"share of {'their damping' if of.startswith('laws.') else of + ' N/m'}", step=0.02),
        Parameter("time_s", times[1], rounded(0.01 * lasts_s), rounded(10 * lasts_s), None, Scale.LOG, times,
                  "time constant of the change"))
    return FAMILY.draft(parameters, _METHOD.format(of=of, between=between), _FUNCTIONS.format(motion=motion),
                        variant=what, title=f"{what} that change during a run",
                        signature="the body and the wheels bounce faster or slower, or ring longer, later in a run")


FAMILY = ChangingWithTime()
