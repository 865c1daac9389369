"""Springs or tires that change as a run goes on: air that warms up in a tire makes it stiffer, rubber softer.

A stiffness k that was taken for fixed is k + d (1 - exp(-t / T)): it changes by d in the end, most of it in the time T.
A tire's stiffness grows with its pressure (J. Y. Wong, Theory of Ground Vehicles, 2008, chapter 1), and that with the
temperature.
"""

from __future__ import annotations

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def changed(p, seen):
    return p.changed_n_per_m * (1.0 - np.exp(-np.maximum(seen.time_s, 0.0) / p.time_s)) * seen.{motion}
"""
_METHOD = """def laws(self, p, laws):
    own = SimpleNamespace(changed_n_per_m=p.changed_n_per_m, time_s=p.time_s)
    return laws.with_law(Between.{between}, changed, own)
"""
_OF = {"springs": ("travel_m", "BODY_AND_WHEEL", "the body bounces"),
       "tires": ("deflection_m", "WHEEL_AND_GROUND", "the wheels hop")}


class ChangingStiffness(Family):
    title = "a stiffness that changes during a run"
    source = "a tire's stiffness by its pressure: J. Y. Wong, Theory of Ground Vehicles (2008), chapter 1"
    shown_by = "drive one rough road for half an hour from cold, recorded as one run"

    def drafts(self, context: LawContext) -> list[Draft]:
        axles = [one for one in (context.vehicle.front, context.vehicle.rear) if one is not None]
        lasts_s = max(run.count / run.rate_hz for run in context.runs)
        # The softer axle's: no axle may be left without a stiffness.
        return [_draft(of, min(stiffness), lasts_s) for of, stiffness in (
            ("springs", [one.suspension_stiffness_n_per_m for one in axles]),
            ("tires", [one.tire_stiffness_n_per_m for one in axles]))]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"{draft.variant} whose stiffness changes by {say('changed_n_per_m', 0.001, 'N/mm')} during a run, "
                f"within about {say('time_s')}")


def _draft(of: str, stiffness_n_per_m: float, lasts_s: float) -> Draft:
    motion, between, what = _OF[of]
    times = tuple(rounded(share * lasts_s) for share in (0.1, 0.3, 1.0))
    size, lost, most = (rounded(share * stiffness_n_per_m) for share in (0.1, 0.9, 3.0))
    parameters = (
        Parameter("changed_n_per_m", size, -lost, most, 0.0, Scale.LINEAR, (size, -size),
                  f"final change of the stiffness of the {of}", step=rounded(0.1 * size)),
        Parameter("time_s", times[1], rounded(0.01 * lasts_s), rounded(10 * lasts_s), None, Scale.LOG, times,
                  "time constant of the change"))
    return FAMILY.draft(parameters, _METHOD.format(between=between), _FUNCTIONS.format(motion=motion), variant=of,
                        title=f"{of} whose stiffness changes during a run",
                        signature=f"{what} faster, or slower, later in a run")


FAMILY = ChangingStiffness()
