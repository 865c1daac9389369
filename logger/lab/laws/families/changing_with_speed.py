"""Dampers, springs or tires that change with the driving speed: adaptive dampers that grow firm, air springs that
stiffen as they are lowered, tires that spin.

A damping or a stiffness k that was taken for fixed is k + d (v / v0 - 1) at the speed v, with v0 the mean speed of the
runs. Beyond the speeds that these had it stays what it was at their ends, for nothing is known there. Adaptive dampers:
S. M. Savaresi et al., Semi-Active Suspension Control Design for Vehicles (2010), chapter 2; a tire that spins: H. B.
Pacejka, Tire and Vehicle Dynamics (2012), chapter 9.
"""

from __future__ import annotations

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def changed(p, seen):
    speed_mps = np.minimum(np.maximum(seen.speed_mps, {slowest!r}), {fastest!r})
    return p.changed_{unit} * (speed_mps / {mean!r} - 1.0) * seen.{motion}
"""
_METHOD = """def laws(self, p, laws):
    return laws.with_law(Between.{between}, changed, p)
"""
_TRIED = 0.2  # of the damping or stiffness, at twice the mean speed
_MOST_LOST = 0.9  # of it, at either end of the speeds
_OF = {
    "dampers": ("suspension_damping_n_s_per_m", "n_s_per_m", "rate_mps", "BODY_AND_WHEEL", "damping"),
    "springs": ("suspension_stiffness_n_per_m", "n_per_m", "travel_m", "BODY_AND_WHEEL", "stiffness"),
    "tires": ("tire_stiffness_n_per_m", "n_per_m", "deflection_m", "WHEEL_AND_GROUND", "stiffness"),
}


class ChangingWithSpeed(Family):
    name = "changing_with_speed"
    title = "a damping or a stiffness that changes with the driving speed"
    shown_by = "drive one road slowly and fast"

    def drafts(self, context: LawContext) -> list[Draft]:
        if not context.is_driven:
            return []
        speed_mps = np.concatenate([run.speed_mps[run.first:] for run in context.runs])
        ends_and_mean = speed_mps.min(), speed_mps.mean(), speed_mps.max()
        slowest, mean, fastest = (rounded(float(one), 3) for one in ends_and_mean)
        if not slowest < mean < fastest:
            return []
        axles = [one for one in (context.vehicle.front, context.vehicle.rear) if one is not None]
        return [self._draft(of, min(getattr(axle, _OF[of][0]) for axle in axles), (slowest, mean, fastest))
                for of in _OF]

    def _draft(self, of: str, softer: float, speeds_mps: tuple[float, float, float]) -> Draft:
        """Of what the softer axle has: no axle may be left without it at any speed."""
        _, unit, motion, between, what = _OF[of]
        slowest, mean, fastest = speeds_mps
        size = rounded(_TRIED * softer)
        low, high = -_MOST_LOST * softer / (fastest / mean - 1), _MOST_LOST * softer / (1 - slowest / mean)
        return Draft(
            family=self.name, kind="ForceEffect", title=f"{of} whose {what} changes with the driving speed",
            parameters=(Parameter(f"changed_{unit}", size, rounded(low), rounded(high), 0.0, Scale.LINEAR,
                                  (size, -size), f"by which the {what} of the {of} is larger at {2 * mean:g} m/s "
                                  f"than at {mean:g} m/s", step=rounded(0.1 * size)),),
            source="S. M. Savaresi et al., Semi-Active Suspension Control Design for Vehicles (2010), chapter 2"
            if of == "dampers" else "H. B. Pacejka, Tire and Vehicle Dynamics (2012), chapter 9",
            signature="runs at different speeds ask for different numbers of one car", shown_by=self.shown_by,
            method=_METHOD.format(between=between), variant=of,
            functions=_FUNCTIONS.format(slowest=slowest, mean=mean, fastest=fastest, unit=unit, motion=motion),
            imports=("from logger.vehicle.laws import Between",), words=("needs_road = True",))

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return f"{draft.title}, by {say(draft.strengths[0])} from the mean speed to twice that"


FAMILY = ChangingWithSpeed()
