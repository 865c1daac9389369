"""A flat spot of a tire, or a bump on it: once in each turn the tire pushes less, for a short way.

It is the tire's stiffness times how deep the spot is, over its length a raised cosine, which has all multiples of the
wheel's turns at once (P. W. A. Zegelaar, The Dynamic Response of Tyres to Brake Torque Variations and Road
Unevennesses, Delft, 1998: short unevennesses as their basic shape). Where the wheel stood as a recording began nobody
knows: the spot has one place along the way in all runs, where their ways go on, or in each run its own.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on, rounded
from logger.lab.laws.repeating import ALL_ALIKE, BEGINS, EACH, best_lags_m, comb_frequency, each_run, in_run, of_run
from logger.vehicle.effect import AXLE, Chosen, Parameter, Scale, chosen

_FUNCTIONS = """
def dip(p, seen):
    place_m = {place}
    turn_m = 2 * np.pi * p.turn_radius_m
    away_m = (seen.distance_m - place_m + 0.5 * turn_m) % turn_m - 0.5 * turn_m
    inside = np.abs(away_m) < 0.5 * p.length_m
    return inside * 0.5 * p.force_n * (1.0 + np.cos(2 * np.pi * away_m / p.length_m))
"""
_RADII_M = (0.25, 0.45)  # of the tires of cars and vans, less than twice apart, so that no multiple is taken for a turn
_LENGTH_M = 0.2  # that of a contact patch
_SHARE = 0.01  # of what its stiffness answers to its length: tried


class FlatSpot(Family):
    title = "a flat spot on a tire"
    source = ("P. W. A. Zegelaar, The Dynamic Response of Tyres to Brake Torque Variations and Road Unevennesses "
              "(Delft, 1998)")
    signature = "short blows, once in each turn of a wheel, whatever the speed"
    shown_by = "drive a smooth road slowly, and look at the tires"
    by_axle = False
    stands_out = True

    def drafts(self, context: LawContext) -> list[Draft]:
        if not context.is_driven:
            return []
        per_m = comb_frequency(context, (1 / (2 * np.pi * _RADII_M[1]), 1 / (2 * np.pi * _RADII_M[0])))
        if per_m is None:
            return []
        radius_m, found = 1 / (2 * np.pi * per_m), []
        for runs in filter(None, (ALL_ALIKE, each_run(context))):
            for axle in context.axles or ("",):
                begun = _draft(context, axle, runs, radius_m, [0.0] * len(runs))
                found.append(_draft(context, axle, runs, radius_m, _places_m(context, begun, len(runs))))
        return found

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        what, sign, how = (("a flat spot on a tire", 1.0, "less") if found.values["force_n"] > 0
                           else ("a bump on a tire", -1.0, "more"))
        force = say("force_n", sign, "N").replace("± -", "± ")
        begins = BEGINS * draft.variant.endswith(EACH)
        return (f"{what}, {say('length_m', 1000.0, 'mm')} long, once in each turn of a wheel of "
                f"{say('turn_radius_m')}, where it pushes {force} {how}{begins}")


def _draft(context: LawContext, axle: str, runs: Sequence[str], radius_m: float, places_m: Sequence[float]) -> Draft:
    car = context.vehicle
    tire = (car.rear if axle == "rear" and car.rear else car.front).tire_stiffness_n_per_m
    usual_n, turn_m = rounded(_SHARE * _LENGTH_M * tire), 2 * np.pi * _RADII_M[1]
    names = [in_run("place", run, "m") for run in runs]
    last = len(runs) - 1
    places = " + ".join(f"p.{name} * (seen.run {'>=' if number == last else '=='} {number})"
                        for number, name in enumerate(names)) if last else f"p.{names[0]}"
    parameters = (
        Parameter("force_n", usual_n, -100 * usual_n, 100 * usual_n, 0.0, Scale.LINEAR, (usual_n,),
                  "drop of the tire's force at the middle of the spot", step=0.1 * usual_n),
        Parameter("length_m", _LENGTH_M, 0.03, 0.8, None, Scale.LOG, (_LENGTH_M,), "of the spot, along the tread"),
        Parameter("turn_radius_m", radius_m, *_RADII_M, None, Scale.LOG, (radius_m,),
                  "of a wheel that turns once per blow", step=1e-5),
        *(Parameter(name, place_m, -turn_m, turn_m, None, Scale.LINEAR, (place_m,),
                    f"along the road, where the spot touches the ground{of_run(run)}", step=0.005)
          for name, place_m, run in zip(names, places_m, runs, strict=True)))
    at = float(["", "front", "rear"].index(axle))
    return FAMILY.draft((*parameters, replace(AXLE, start=at, trials=(at,), default=at, choices=(at,))),
                        handed_on("dip", "WHEEL_AND_GROUND"), _FUNCTIONS.format(place=places),
                        variant="_".join(filter(None, ("spot", axle))) + EACH * (last > 0),
                        words=("needs_road = True",))


def _places_m(context: LawContext, begun: Draft, count: int) -> list[float]:
    """Where the spot of a draft has to be [m], in all runs or in each of so many: what it does at place 0 lags the
    residual by that."""
    state, posterior = context.state, context.posterior
    one = chosen(begun.effect, {each.name: each.start for each in begun.parameters})
    there = posterior.predict((*state.effects, one), state.logs, state.record)
    return best_lags_m(context, there, 2 * np.pi * one.values["turn_radius_m"], apart=count > 1)


FAMILY = FlatSpot()
