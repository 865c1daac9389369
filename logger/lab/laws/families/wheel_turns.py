"""A force at the wheels that comes round with their turns: imbalance, a flat spot, a tire out of round.

A mass m that turns at a distance r from the axle pulls with m r (v / R)^2, R the tire's radius (J. P. Den Hartog,
Mechanical Vibrations, 1956, section 6.1); a tire that is out of round pushes alike, and its harmonics are as the tire's
radius is divided. Where a wheel stood when the recording began nobody knows: each axle has two strengths.
"""

from __future__ import annotations

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, Look, Say
from logger.lab.laws.repeating import along_the_way
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def turning(p, seen):
    turned = seen.distance_m / p.turn_radius_m
    pull = p.cos_kg_m * np.cos(turned) + p.sin_kg_m * np.sin(turned)
    return pull * (seen.speed_mps / p.turn_radius_m) ** 2
"""
_METHOD = """def laws(self, p, laws):
    cos_kg_m, sin_kg_m = {pick}
    own = SimpleNamespace(cos_kg_m=cos_kg_m, sin_kg_m=sin_kg_m, turn_radius_m=p.turn_radius_m)
    return laws.with_law(Between.WHEEL_AND_GROUND, turning, own)
"""
_USUAL_KG_M = 0.02
"""A hundred grams on a rim of 0.2 m."""
_MOST_KG_M = 2.0
_RADII_M = (0.1, 0.5)


class WheelTurns(Family):
    name = "wheel_turns"
    title = "a force that comes round with the wheels' turns"
    shown_by = "drive a smooth road at two steady speeds"

    def drafts(self, look: Look) -> list[Draft]:
        if not look.is_driven:
            return []
        per_m = along_the_way(look, (1 / (2 * np.pi * _RADII_M[1]), 1 / (2 * np.pi * _RADII_M[0])), speed_power=2)
        if per_m is None:
            return []
        radius_m = 1 / (2 * np.pi * per_m)
        axles = look.axles or ("",)
        strengths = [
            Parameter(_name(axle, part), _USUAL_KG_M, -_MOST_KG_M, _MOST_KG_M, 0.0,
                      Scale.LINEAR, (_USUAL_KG_M,), f"mass times distance from the {axle or 'wheel'} axle, {words}",
                      step=0.1 * _USUAL_KG_M)
            for axle in axles for part, words in (("cos", "down where the way is 0"), ("sin", "a quarter turn later"))]
        radius = Parameter("turn_radius_m", radius_m, *_RADII_M, None, Scale.LOG, (radius_m,),
                           "of a wheel that turns once for each of its pulls", step=1e-5)
        pick = "p.cos_kg_m, p.sin_kg_m" if len(axles) == 1 else (
            "(p.rear_cos_kg_m, p.rear_sin_kg_m) if laws.rear else (p.front_cos_kg_m, p.front_sin_kg_m)")
        return [Draft(
            family=self.name, kind="ForceEffect", title=self.title, parameters=(*strengths, radius),
            source="a mass that turns beside its axle (J. P. Den Hartog, Mechanical Vibrations, 1956, section 6.1)",
            signature="it repeats along the way, whatever the speed, and grows with the square of the speed",
            shown_by=self.shown_by, method=_METHOD.format(pick=pick), functions=_FUNCTIONS, variant="imbalance",
            imports=("from types import SimpleNamespace", "from logger.vehicle.laws import Between"),
            words=("needs_road = True",))]

    def narrower(self, draft: Draft, look: Look) -> list[Draft]:
        return []

    def words(self, draft: Draft, found: Chosen, say: Say) -> str:
        axles = ("front", "rear") if "front_cos_kg_m" in found.values else ("",)
        each = " and ".join(f"{say(_name(axle, 'cos'))} and {say(_name(axle, 'sin'))}{f' at the {axle}' * bool(axle)}"
                            for axle in axles)
        every_m = 2 * np.pi * found.values["turn_radius_m"]
        return (f"a force that comes round once in each {every_m:.2f} m of the way, as a wheel of "
                f"{say('turn_radius_m')} turns, and grows with the square of the speed: out of balance (even "
                f"and odd part) by {each}")


def _name(axle: str, part: str) -> str:
    return "_".join(filter(None, (axle, part, "kg_m")))


FAMILY = WheelTurns()
